// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PatchTopology.h>

#include <gtest/gtest.h>

#include <stdexcept>

namespace osgTessLOD::bake {
namespace {

using Patches = std::vector<std::array<std::uint32_t, 3>>;
using Vertices = std::array<std::uint32_t, 2>;

/// Every reference between patches and edges, from both ends.
void expectConsistent(const PatchTopology& t)
{
    ASSERT_EQ(t.patchEdges.size(), t.patches.size());
    std::size_t sides = 0;
    for (std::uint32_t p = 0; p < t.patches.size(); ++p) {
        for (std::uint8_t s = 0; s < 3; ++s) {
            const auto& edge = t.edges.at(t.patchEdges[p][s]);
            const std::size_t end = edge.patches[0] == p && edge.sides[0] == s ? 0 : 1;
            EXPECT_EQ(edge.patches[end], p);
            EXPECT_EQ(edge.sides[end], s);
            EXPECT_EQ(edge.vertices[end], t.patches[p][s]) << "patch 0 runs forwards, patch 1 backwards";
            EXPECT_EQ(edge.vertices[1 - end], t.patches[p][(s + 1) % 3]);
        }
    }
    for (const auto& edge : t.edges) { sides += edge.patches[1] == kNoPatch ? 1 : 2; }
    EXPECT_EQ(sides, 3 * t.patches.size());
}

TEST(PatchTopology, OneTriangleHasThreeOpenEdgesInSideOrder)
{
    const PatchTopology t = PatchTopology::build(3, {{2, 0, 1}});
    expectConsistent(t);
    ASSERT_EQ(t.edges.size(), 3U);
    EXPECT_EQ(t.edges[0].vertices, (Vertices{2, 0}));
    EXPECT_EQ(t.edges[1].vertices, (Vertices{0, 1}));
    EXPECT_EQ(t.edges[2].vertices, (Vertices{1, 2}));
    for (const auto& edge : t.edges) { EXPECT_EQ(edge.patches[1], kNoPatch); }
}

TEST(PatchTopology, EdgesAreNumberedByFirstAppearance)
{
    //  3 ── 2
    //  │  ╱ │      the diagonal 2-0 is side 2 of the first patch, side 0 of the second
    //  0 ── 1
    const PatchTopology t = PatchTopology::build(4, {{0, 1, 2}, {0, 2, 3}});
    expectConsistent(t);
    ASSERT_EQ(t.edges.size(), 5U);
    EXPECT_EQ(t.edges[2].vertices, (Vertices{2, 0}));
    EXPECT_EQ(t.edges[2].patches, (Vertices{0, 1}));
    EXPECT_EQ(t.edges[2].sides, (std::array<std::uint8_t, 2>{2, 0}));
    EXPECT_EQ(t.patchEdges[1], (std::array<std::uint32_t, 3>{2, 3, 4}));
}

TEST(PatchTopology, TetrahedronIsClosed)
{
    const PatchTopology t = PatchTopology::build(4, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
    expectConsistent(t);
    EXPECT_EQ(t.edges.size(), 6U);
    for (const auto& edge : t.edges) { EXPECT_NE(edge.patches[1], kNoPatch); }
}

TEST(PatchTopology, TwoPatchesMayShareAllThreeVertices)
{
    const PatchTopology t = PatchTopology::build(3, {{0, 1, 2}, {0, 2, 1}});
    expectConsistent(t);
    ASSERT_EQ(t.edges.size(), 3U);
    EXPECT_EQ(t.edges[0].sides, (std::array<std::uint8_t, 2>{0, 2}));
    EXPECT_EQ(t.edges[1].sides, (std::array<std::uint8_t, 2>{1, 1}));
    EXPECT_EQ(t.edges[2].sides, (std::array<std::uint8_t, 2>{2, 0}));
}

TEST(PatchTopology, RefusesWhatIsNoOrientedManifold)
{
    EXPECT_THROW(PatchTopology::build(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}), std::invalid_argument) << "three patches";
    EXPECT_THROW(PatchTopology::build(4, {{0, 1, 2}, {0, 1, 3}}), std::invalid_argument) << "same direction";
    EXPECT_THROW(PatchTopology::build(3, {{0, 1, 1}}), std::invalid_argument) << "equal corners";
    EXPECT_THROW(PatchTopology::build(3, {{0, 1, 3}}), std::invalid_argument) << "no such vertex";
    EXPECT_EQ(PatchTopology::build(0, {}).edges.size(), 0U);
}

} // namespace
} // namespace osgTessLOD::bake
