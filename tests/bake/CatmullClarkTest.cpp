// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/CatmullClark.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <initializer_list>
#include <map>
#include <utility>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;

void addFace(PolygonMesh& mesh, std::initializer_list<std::uint32_t> corners)
{
    mesh.corners.insert(mesh.corners.end(), corners);
    mesh.starts.push_back(static_cast<std::uint32_t>(mesh.corners.size()));
}

/// Corners ±1; vertex number = bits of x, y, z.
PolygonMesh cube()
{
    PolygonMesh mesh;
    for (int v = 0; v < 8; ++v) {
        mesh.positions.emplace_back((v & 1) != 0 ? 1 : -1, (v & 2) != 0 ? 1 : -1, (v & 4) != 0 ? 1 : -1);
    }
    addFace(mesh, {0, 2, 3, 1});
    addFace(mesh, {4, 5, 7, 6});
    addFace(mesh, {0, 1, 5, 4});
    addFace(mesh, {2, 6, 7, 3});
    addFace(mesh, {0, 4, 6, 2});
    addFace(mesh, {1, 3, 7, 5});
    return mesh;
}

/// (columns + 1) × (rows + 1) points one apart, all faces with the texture coordinates 0 … 1.
PolygonMesh grid(std::uint32_t columns, std::uint32_t rows)
{
    PolygonMesh mesh;
    for (std::uint32_t j = 0; j <= rows; ++j) {
        for (std::uint32_t i = 0; i <= columns; ++i) { mesh.positions.emplace_back(i, j, 0.0); }
    }
    for (std::uint32_t j = 0; j < rows; ++j) {
        for (std::uint32_t i = 0; i < columns; ++i) {
            const std::uint32_t a = j * (columns + 1) + i;
            addFace(mesh, {a, a + 1, a + columns + 2, a + columns + 1});
            mesh.uvs.insert(mesh.uvs.end(), {{0, 0}, {1, 0}, {1, 1}, {0, 1}});
        }
    }
    return mesh;
}

bool contains(const std::vector<Vector3d>& points, const Vector3d& wanted)
{
    return std::any_of(points.begin(), points.end(), [&](const Vector3d& p) { return (p - wanted).norm() < 1e-14; });
}

TEST(CatmullClark, OneStepOfACubeIsKnown)
{
    const PolygonMesh fine = subdivideCatmullClark(cube());
    ASSERT_EQ(fine.positions.size(), 8U + 12U + 6U);
    ASSERT_EQ(fine.faceCount(), 24U);
    // F̄ = ⅓, R̄ = ⅔, n = 3: (⅓ + 2 · ⅔) / 3 in each coordinate.
    EXPECT_TRUE(fine.positions[7].isApprox(Vector3d::Constant(5.0 / 9.0), 1e-15));
    EXPECT_TRUE(contains(fine.positions, {0.75, 0.75, 0.0}));
    EXPECT_TRUE(contains(fine.positions, {0.0, -0.75, 0.75}));
    EXPECT_TRUE(contains(fine.positions, {0.0, 0.0, -1.0}));
}

TEST(CatmullClark, KeepsOrientation)
{
    PolygonMesh mesh = cube();
    for (int step = 0; step < 2; ++step) { mesh = subdivideCatmullClark(mesh); }
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
    for (std::size_t f = 0; f < mesh.faceCount(); ++f) {
        ASSERT_EQ(mesh.starts[f + 1] - mesh.starts[f], 4U);
        const std::uint32_t* c = mesh.corners.data() + mesh.starts[f];
        for (int k = 0; k < 4; ++k) { ++directed[{c[k], c[(k + 1) % 4]}]; }
        const Vector3d& p = mesh.positions[c[0]];
        const Vector3d normal = (mesh.positions[c[1]] - p).cross(mesh.positions[c[2]] - p);
        EXPECT_GT(normal.dot(p), 0.0) << "face " << f << " looks inside";
    }
    for (const auto& [edge, count] : directed) {
        EXPECT_EQ(count, 1);
        EXPECT_EQ(directed.count({edge.second, edge.first}), 1U);
    }
}

TEST(CatmullClark, BoundariesAreBSplinesOfThemselvesAlone)
{
    PolygonMesh mesh = grid(3, 2);
    const PolygonMesh flat = subdivideCatmullClark(mesh);
    for (const Vector3d& p : flat.positions) { EXPECT_EQ(p.z(), 0.0); }
    // Along a straight boundary of equal steps nothing moves but the corner: ¾ (0, 0) + ⅛ (1, 0) + ⅛ (0, 1).
    EXPECT_EQ(flat.positions[1], Vector3d(1.0, 0.0, 0.0));
    EXPECT_EQ(flat.positions[0], Vector3d(0.125, 0.125, 0.0));

    mesh.positions[5].z() = 1.0; // inside
    const PolygonMesh raised = subdivideCatmullClark(mesh);
    EXPECT_EQ(raised.positions[1], flat.positions[1]);
    EXPECT_NE(raised.positions[5], flat.positions[5]);
}

TEST(CatmullClark, TextureCoordinatesAreLinearInEachFaceAndKeepSeams)
{
    const PolygonMesh fine = subdivideCatmullClark(grid(2, 1)); // both faces have all of 0 … 1: a seam between them
    ASSERT_EQ(fine.uvs.size(), fine.corners.size());
    ASSERT_EQ(fine.faceCount(), 8U);
    const std::vector<Vector2f> first{{0, 0}, {0.5F, 0}, {0.5F, 0.5F}, {0, 0.5F}};
    for (std::size_t face : {0U, 4U}) {
        for (std::size_t k = 0; k < 4; ++k) { EXPECT_EQ(fine.uvs[4 * face + k], first[k]); }
    }
}

TEST(CatmullClark, VerticesOfSeveralFansStay)
{
    PolygonMesh mesh = grid(1, 1);
    mesh.positions.insert(mesh.positions.end(), {{2, 1, 0}, {2, 2, 0}, {1, 2, 0}});
    addFace(mesh, {3, 4, 5, 6}); // meets the first face in vertex 3 only
    mesh.uvs.clear();
    const PolygonMesh fine = subdivideCatmullClark(mesh);
    EXPECT_EQ(fine.positions[3], mesh.positions[3]);
    EXPECT_NE(fine.positions[0], mesh.positions[0]);
}

TEST(CatmullClark, TrianglesBecomeThreeQuadrilaterals)
{
    PolygonMesh mesh;
    mesh.positions = {{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}};
    addFace(mesh, {0, 2, 1});
    addFace(mesh, {0, 1, 3});
    addFace(mesh, {0, 3, 2});
    addFace(mesh, {1, 2, 3});
    const PolygonMesh fine = subdivideCatmullClark(mesh);
    EXPECT_EQ(fine.faceCount(), 12U);
    // F̄ = (1, 1, 1) / 9, as the three faces' middles add up to (1, 1, 1) / 3; R̄ = (1, 1, 1) / 3; n = 3.
    EXPECT_TRUE(fine.positions[0].isApprox(Vector3d::Constant((1.0 / 9.0 + 2.0 / 3.0) / 3.0), 1e-15));
}

} // namespace
} // namespace osgTessLOD::bake
