// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

struct RawMesh;

/// A mesh of polygons with texture coordinates at the corners of its faces.
struct PolygonMesh {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::uint32_t> starts{0}; ///< face f has the corners starts[f] … starts[f + 1] − 1
    std::vector<std::uint32_t> corners;   ///< vertex of each corner
    std::vector<Eigen::Vector2f> uvs;     ///< of each corner, NaN where it has none; empty: no corner has any

    std::size_t faceCount() const { return starts.size() - 1; }
};

/// The polygons of a file: quadrilaterals are whole again, larger ones stay the triangles that they were cut into. `uvs` as
/// triangles of `raw` have them, or empty. Vertices of equal position become one, faces with two equal corners are left out.
PolygonMesh polygonsOf(const RawMesh& raw, const std::vector<std::array<Eigen::Vector2f, 3>>& uvs);

/// Triangles of a mesh of polygons; quadrilaterals are cut along their shorter diagonal, larger ones into fans.
struct TriangulatedPolygons {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::array<Eigen::Vector2f, 3>> uvs; ///< of the triangles' corners; empty where the polygons' are
};
TriangulatedPolygons triangulate(const PolygonMesh& mesh);

} // namespace osgTessLOD::bake
