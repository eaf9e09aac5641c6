// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Vec3d>

namespace osgTessLOD {

/// How levels are selected.
struct SelectionOptions {
    double errorPixels = 1.0; ///< largest error asked for, in pixels of the viewport (> 0)
    bool cullPatches = true;  ///< leave out patches outside the view frustum
    unsigned maxFactor = 64;  ///< coarsest allowed cap: levels of larger factors are never selected
    bool frozen = false;      ///< use `frozenView` instead of the camera's
    /// Viewpoint in the drawable's local space, and pixels per (object unit / distance), of a frozen selection.
    osg::Vec3d frozenEye;
    double frozenPixelScale = 0.0;
};

} // namespace osgTessLOD
