// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/SelectionView.h>

#include <osg/Matrixd>
#include <osg/Plane>

#include <vector>

namespace osgTessLOD {

/// A camera and the viewport that it looks into.
struct ScreenCamera {
    osg::Matrixd localToEye;
    osg::Matrixd projection;
    double width = 0.0; ///< pixels
    double height = 0.0;

    SelectionView view() const { return makeSelectionView(localToEye, projection, width, height); }
    osg::Matrixd localToClip() const { return localToEye * projection; }

    /// Left, right, bottom and top of what is in view, local space.
    std::vector<osg::Plane> sides() const
    {
        const osg::Matrixd m = localToClip();
        std::vector<osg::Plane> planes;
        for (const int axis : {0, 1}) {
            for (const double sign : {-1.0, 1.0}) {
                const auto at = [&](int row) { return m(row, 3) + sign * m(row, axis); };
                planes.emplace_back(at(0), at(1), at(2), at(3));
            }
        }
        return planes;
    }
};

} // namespace osgTessLOD
