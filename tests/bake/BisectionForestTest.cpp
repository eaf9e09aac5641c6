// SPDX-License-Identifier: MIT
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/bake/BisectionForest.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

/// A control mesh with straight patches, bent by a function of space.
struct BentMesh {
    PatchTopology topology;
    std::vector<Vector3d> corners;
    Vector3d (*bend)(const Vector3d&);

    BisectionForest::Surface surface() const
    {
        return [this](std::uint32_t patch, const Vector3d& b) {
            const auto& c = topology.patches[patch];
            return bend(b[0] * corners[c[0]] + b[1] * corners[c[1]] + b[2] * corners[c[2]]);
        };
    }
};

Vector3d asItIs(const Vector3d& p) { return p; }
Vector3d ontoSphere(const Vector3d& p) { return p.normalized(); }
/// Waves that are much steeper than wide, folds that run back over themselves: lengths hardly shrink at first.
Vector3d folded(const Vector3d& p)
{
    return {p.x() + 0.3 * std::sin(40.0 * p.x()), p.y() + 0.3 * std::sin(37.0 * p.y() + 5.0 * p.x()),
            p.z() + 2.0 * std::sin(25.0 * (p.x() + p.y()))};
}

BentMesh octahedron(Vector3d (*bend)(const Vector3d&))
{
    return {PatchTopology::build(6, {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}),
            {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}, bend};
}

BentMesh square(Vector3d (*bend)(const Vector3d&))
{
    return {PatchTopology::build(4, {{0, 1, 2}, {0, 2, 3}}), {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, bend};
}

std::vector<std::uint32_t> leavesOf(const BisectionForest& forest)
{
    std::vector<std::uint32_t> leaves;
    for (std::uint32_t n = 0; n < forest.nodeCount(); ++n) {
        if (forest.isLeaf(n)) { leaves.push_back(n); }
    }
    return leaves;
}

/// Every leaf's edge is another's, reversed, or lies on an open side. `mostAlike` is how many edges may join the same vertices.
void expectConforming(const BisectionForest& forest, const PatchTopology& topology, int mostAlike = 1)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
    const auto leaves = leavesOf(forest);
    for (const std::uint32_t leaf : leaves) {
        for (std::size_t k = 0; k < 3; ++k) { ++directed[{forest.corners(leaf)[k], forest.corners(leaf)[(k + 1) % 3]}]; }
    }
    for (const auto& [edge, count] : directed) {
        ASSERT_LE(count, mostAlike) << "two leaves on one side of an edge";
        const auto reversed = directed.find({edge.second, edge.first});
        if (reversed != directed.end()) { ASSERT_EQ(reversed->second, count); }
    }
    for (const std::uint32_t leaf : leaves) {
        for (unsigned k = 0; k < 3; ++k) {
            const auto& c = forest.corners(leaf);
            if (directed.count({c[(k + 1) % 3], c[k]}) != 0) { continue; }
            const Vector3d a = forest.toPatch({leaf, Vector3d::Unit(k)}).barycentric;
            const Vector3d b = forest.toPatch({leaf, Vector3d::Unit((k + 1) % 3)}).barycentric;
            bool isOnOpenSide = false;
            for (unsigned side = 0; side < 3; ++side) {
                const auto& edge = topology.edges[topology.patchEdges[forest.patchOf(leaf)][side]];
                isOnOpenSide = isOnOpenSide ||
                               (edge.patches[1] == kNoPatch && a[(side + 2) % 3] == 0.0 && b[(side + 2) % 3] == 0.0);
            }
            ASSERT_TRUE(isOnOpenSide) << "a vertex hangs on leaf " << leaf;
        }
    }
}

/// Leaves' coordinates are dyadic numbers: all of this is exact.
void expectExactCoordinates(const BisectionForest& forest)
{
    for (const std::uint32_t leaf : leavesOf(forest)) {
        for (const Vector3d& b : {Vector3d(0.25, 0.25, 0.5), Vector3d(0.125, 0.75, 0.125), Vector3d(0.5, 0.25, 0.25)}) {
            const FacePoint inPatch = forest.toPatch({leaf, b});
            ASSERT_EQ(inPatch.face, forest.patchOf(leaf));
            const FacePoint back = forest.toLeaf(inPatch);
            ASSERT_EQ(back.face, leaf);
            ASSERT_EQ(back.barycentric, b);
        }
    }
}

void expectVerticesOnSurface(const BisectionForest& forest, const BentMesh& mesh)
{
    const auto surface = mesh.surface();
    for (const std::uint32_t leaf : leavesOf(forest)) {
        for (unsigned k = 0; k < 3; ++k) {
            const FacePoint p = forest.toPatch({leaf, Vector3d::Unit(k)});
            ASSERT_LT((surface(p.face, p.barycentric) - forest.vertices()[forest.corners(leaf)[k]]).norm(), 1e-12);
        }
    }
}

std::vector<FacePoint> randomPoints(std::size_t patches, std::size_t count)
{
    std::mt19937 random(3);
    std::uniform_int_distribution<std::uint32_t> anyPatch(0, static_cast<std::uint32_t>(patches - 1));
    std::vector<FacePoint> points;
    for (std::size_t i = 0; i < count; ++i) { points.push_back({anyPatch(random), randomWeights(random)}); }
    return points;
}

unsigned mostPointsInALeaf(const BisectionForest& forest, const std::vector<FacePoint>& points)
{
    std::vector<unsigned> count(forest.nodeCount(), 0);
    for (const FacePoint& point : points) {
        const FacePoint inLeaf = forest.toLeaf(point);
        EXPECT_TRUE(forest.isLeaf(inLeaf.face));
        EXPECT_EQ(forest.patchOf(inLeaf.face), point.face);
        EXPECT_GE(inLeaf.barycentric.minCoeff(), -1e-12);
        EXPECT_LT((forest.toPatch(inLeaf).barycentric - point.barycentric).norm(), 1e-14);
        ++count[inLeaf.face];
    }
    return *std::max_element(count.begin(), count.end());
}

double longestChord(const BisectionForest& forest)
{
    double longest = 0.0;
    for (const std::uint32_t leaf : leavesOf(forest)) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto& c = forest.corners(leaf);
            longest = std::max(longest, (forest.vertices()[c[k]] - forest.vertices()[c[(k + 1) % 3]]).norm());
        }
    }
    return longest;
}

void expectSound(const BisectionForest& forest, const BentMesh& mesh, int mostAlike = 1)
{
    expectConforming(forest, mesh.topology, mostAlike);
    expectExactCoordinates(forest);
    expectVerticesOnSurface(forest, mesh);
}

TEST(BisectionForest, StaysCoarseWhereNothingExceedsTheLimits)
{
    const BentMesh mesh = octahedron(asItIs);
    const BisectionForest forest(mesh.topology, mesh.surface(), {}, {10.0, 2});
    EXPECT_EQ(forest.nodeCount(), 8U);
    EXPECT_EQ(forest.vertices().size(), 6U);
    expectSound(forest, mesh);
}

TEST(BisectionForest, EdgesOnASphereBecomeShort)
{
    const BentMesh mesh = octahedron(ontoSphere);
    const BisectionForest forest(mesh.topology, mesh.surface(), {}, {0.1, 2});
    expectSound(forest, mesh);
    EXPECT_LE(longestChord(forest), 0.1);
    const std::size_t leaves = leavesOf(forest).size();
    EXPECT_GT(leaves, 4.0 * kPi / 0.0043) << "no triangle with sides up to 0.1 is larger than that";
    EXPECT_LT(leaves, 60000U) << "and no finer than needed by an order of magnitude";
    EXPECT_EQ(forest.vertices().size(), leaves / 2 + 2) << "Euler's formula";
}

TEST(BisectionForest, SeparatesPoints)
{
    for (const BentMesh& mesh : {octahedron(ontoSphere), square(asItIs)}) {
        const auto points = randomPoints(mesh.topology.patches.size(), 5000);
        for (const unsigned most : {1U, 2U, 10U}) {
            const BisectionForest forest(mesh.topology, mesh.surface(), points, {10.0, most});
            expectSound(forest, mesh);
            EXPECT_LE(mostPointsInALeaf(forest, points), most);
        }
    }
}

TEST(BisectionForest, RefinesOnlyWhereItIsNeeded)
{
    // A heap of points in one corner: leaves elsewhere stay large.
    const BentMesh mesh = square(asItIs);
    std::vector<FacePoint> points;
    for (const FacePoint& p : randomPoints(1, 1000)) {
        points.push_back({0, Vector3d::UnitX() * (1.0 - 1e-3) + 1e-3 * p.barycentric});
    }
    const BisectionForest forest(mesh.topology, mesh.surface(), points, {10.0, 1});
    expectSound(forest, mesh);
    EXPECT_LE(mostPointsInALeaf(forest, points), 1U);
    EXPECT_GT(longestChord(forest), 0.7);
}

TEST(BisectionForest, TwoPatchesWithTheSameThreeVertices)
{
    BentMesh mesh{PatchTopology::build(3, {{0, 1, 2}, {0, 2, 1}}), {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, asItIs};
    const auto points = randomPoints(2, 500);
    const BisectionForest forest(mesh.topology, mesh.surface(), points, {0.2, 1});
    // What cuts off a corner joins the same two vertices in both patches.
    expectSound(forest, mesh, 2);
    EXPECT_LE(mostPointsInALeaf(forest, points), 1U);
}

TEST(BisectionForest, EndsOnAFoldedSurface)
{
    for (const BentMesh& mesh : {octahedron(folded), square(folded)}) {
        const auto points = randomPoints(mesh.topology.patches.size(), 500);
        const BisectionForest forest(mesh.topology, mesh.surface(), points, {0.3, 2});
        expectConforming(forest, mesh.topology);
        expectVerticesOnSurface(forest, mesh);
        EXPECT_LE(longestChord(forest), 0.3);
        EXPECT_LE(mostPointsInALeaf(forest, points), 2U);
    }
}

TEST(BisectionForest, EndsWithPointsThatCannotBeSeparated)
{
    const BentMesh mesh = square(asItIs);
    const std::vector<FacePoint> points(10, {1, Vector3d(0.3, 0.3, 0.4)});
    const BisectionForest forest(mesh.topology, mesh.surface(), points, {10.0, 2});
    expectConforming(forest, mesh.topology);
    EXPECT_LT(forest.nodeCount(), 2000U);
}

} // namespace
} // namespace osgTessLOD::bake
