// SPDX-License-Identifier: MIT
// The tree that intersections leave in a drawable is not stored, but made again when it is needed: nothing is written of it,
// and null is read.
#include <osgTessLOD/render/SurfaceProxy.h>

#include <osgDB/ObjectWrapper>

REGISTER_OBJECT_WRAPPER(osgTessLOD_SurfaceTree, nullptr, osgTessLOD::SurfaceTree, "osgTessLOD::SurfaceTree") {}
