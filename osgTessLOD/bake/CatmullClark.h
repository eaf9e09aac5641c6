// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/PolygonMesh.h>

namespace osgTessLOD::bake {

/// One step of E. Catmull and J. Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes", 1978:
/// every face of n corners becomes n quadrilaterals. Edges that have not exactly two faces are boundaries: cubic B-spline
/// curves, where a vertex with other than two of them stays where it is. Texture coordinates are subdivided linearly within
/// each face, seams kept. Vertices must be welded (equal positions are one vertex).
OSGTESSLOD_EXPORT PolygonMesh subdivideCatmullClark(const PolygonMesh& mesh);

} // namespace osgTessLOD::bake
