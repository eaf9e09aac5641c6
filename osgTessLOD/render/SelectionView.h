// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/Matrixd>
#include <osg/Vec3d>

namespace osgTessLOD {

/// A view as selection needs it: how far apart two points of the drawable's local space are on screen at most.
///
/// Perspective: for a point p in view, seen along the unit direction d at the angle φ to the axis, and a point p + v at the
/// depth w (distance along the axis), that is pixelScale · |v × d| / (cos φ · w) pixels. Orthographic: pixelScale · |v × axis|.
/// Both are exact for some v, and hold for projections and model transforms of any kind: see makeSelectionView.
struct SelectionView {
    osg::Vec3d eye;          ///< centre of projection, local space; means nothing where orthographic
    double pixelScale = 0.0; ///< pixels per (object unit / distance); orthographic: per object unit
    bool orthographic = false;
    osg::Vec3d axis{0.0, 0.0,
                    -1.0};    ///< unit, local space, along which depth grows; orthographic: along which one looks
    double leastCosine = 1.0; ///< of the angle between the axis and any direction in view: that of a corner, > 0
    /// Are triangles clockwise on screen, as GL has it, when their normals look towards the eye? Transforms that mirror do that.
    bool mirrored = false;
};

/// The view through `localToEye` and `projection` (as OSG has them: row vectors) into a viewport of so many pixels. Nothing
/// is assumed of either: clip coordinates x, y and w are linear in local space, and that is all that is used, so reversed,
/// infinite, off-centre, turned and mirrored projections and non-uniform scales are as good as others. Views that show
/// nothing (no pixels, singular or not finite) have pixelScale 0.
OSGTESSLOD_EXPORT SelectionView makeSelectionView(const osg::Matrixd& localToEye, const osg::Matrixd& projection,
                                                  double width, double height);

/// The view as it is seen from a space whose points `placement` (affine) takes to the view's: exact where it scales all alike, else
/// of no fewer pixels. For views that are no longer known otherwise: makeSelectionView() is exact always.
OSGTESSLOD_EXPORT SelectionView placedView(const SelectionView& view, const osg::Matrixd& placement);

} // namespace osgTessLOD
