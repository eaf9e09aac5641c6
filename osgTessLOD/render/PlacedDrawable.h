// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Matrixd>
#include <osg/ref_ptr>

#include <vector>

namespace osg {
class Node;
}

namespace osgTessLOD {

/// A TessLODDrawable where it is in a scene.
struct PlacedDrawable {
    osg::ref_ptr<TessLODDrawable> drawable;
    osg::Matrixd localToWorld;
};

/// The drawable, under a translation where its asset's frame is not its source's (Lattice::origin). Bounds are computed.
OSGTESSLOD_EXPORT osg::ref_ptr<osg::Node> placeAtOrigin(TessLODDrawable& drawable);

/// The TessLODDrawables of a scene, each as often as there are ways to it, hidden ones too.
OSGTESSLOD_EXPORT std::vector<PlacedDrawable> findTessLODDrawables(osg::Node& scene);

} // namespace osgTessLOD
