// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <array>
#include <vector>

namespace osgTessLOD::bake {

// The surface that a source mesh is, at any of its points.

/// Unit normals of the triangles' corners.
using CornerNormals = std::vector<std::array<Eigen::Vector3f, 3>>;

/// Angle-weighted means of those faces around each corner's vertex that are within the crease angle of the corner's own.
OSGTESSLOD_EXPORT CornerNormals cornerNormals(const SourceMesh& source, double creaseAngleRadians);

Eigen::Vector3d positionAt(const SourceMesh& source, const FacePoint& point);

/// Position, normal and what attributes the mesh has, linear on its triangles.
SurfacePoint surfaceAt(const SourceMesh& source, const CornerNormals& normals, const FacePoint& point);

/// Points spread over a source: its vertices in their order, then its edges' middles and its faces' centroids. Of a boundary
/// edge's middle, whose face runs down the vertices' numbers, the face's other samples must do.
std::vector<FacePoint> samplePoints(const SourceMesh& source);

} // namespace osgTessLOD::bake
