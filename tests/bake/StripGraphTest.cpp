// SPDX-License-Identifier: MIT
// Strips and what contracting them leaves.
#include <bake/SmallTopologies.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/StripGraph.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <set>

namespace osgTessLOD::bake {
namespace {

using Point = StripLattice::Point;
using Triangle = std::array<std::uint32_t, 3>;

/// The same oriented triangle always in the same way.
Triangle canonical(Triangle t)
{
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

std::multiset<Triangle> patternTriangles(unsigned factor)
{
    std::multiset<Triangle> result;
    const TessellationPattern pattern(factor);
    for (const auto& t : pattern.triangles()) { result.insert(canonical(t)); }
    return result;
}

std::multiset<Triangle> latticeTriangles(const StripLattice& lattice)
{
    std::multiset<Triangle> result;
    for (std::uint32_t t = 0; t < lattice.triangleIndexCount(); ++t) {
        if (!lattice.hasTriangle(t)) { continue; }
        const auto c = lattice.corners(t);
        result.insert(
            canonical({lattice.patternVertex(c[0]), lattice.patternVertex(c[1]), lattice.patternVertex(c[2])}));
    }
    return result;
}

std::vector<StripCost> randomCosts(const StripGraph& graph, std::mt19937& random, int largest)
{
    std::vector<StripCost> costs(graph.edgeCount());
    for (StripCost& cost : costs) {
        cost.error = std::uniform_int_distribution<>(0, largest)(random);
        cost.residual = std::uniform_int_distribution<>(0, largest)(random);
    }
    return costs;
}

using Chooser = std::function<std::vector<unsigned>(const StripGraph&)>;

/// Takes all patches from their factor to the next, the fans in random order.
void contractAll(StripMesh& mesh, const Chooser& choose, std::mt19937& random)
{
    std::vector<CornerFan> fans = cornerFans(mesh.topology());
    std::shuffle(fans.begin(), fans.end(), random);
    for (const CornerFan& fan : fans) {
        const StripGraph graph(mesh, fan);
        const std::vector<unsigned> strip = choose(graph);
        ASSERT_TRUE(graph.isStrip(strip));
        for (std::size_t c = 0; c < fan.corners.size(); ++c) {
            mesh.contract(fan.corners[c].patch, fan.corners[c].corner, graph.within(c, strip));
        }
    }
}

/// The triangles of pattern `factor` after its vertices became others, without those that collapsed.
std::multiset<Triangle> contracted(unsigned factor, const std::vector<std::uint32_t>& images)
{
    std::multiset<Triangle> result;
    const TessellationPattern pattern(factor);
    for (const auto& t : pattern.triangles()) {
        const Triangle image{images[t[0]], images[t[1]], images[t[2]]};
        if (image[0] != image[1] && image[1] != image[2] && image[2] != image[0]) { result.insert(canonical(image)); }
    }
    return result;
}

void expectSameBorderImages(const StripMesh& mesh, unsigned factor)
{
    for (const auto& edge : mesh.topology().edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        const auto a = mesh.patternImages(edge.patches[0]), b = mesh.patternImages(edge.patches[1]);
        for (unsigned step = 0; step <= factor; ++step) {
            const std::uint32_t image = a[borderVertex(edge, 0, factor, step)];
            bool found = false;
            for (unsigned t = 0; t <= factor - 2; ++t) {
                if (borderVertex(edge, 0, factor - 2, t) != image) { continue; }
                found = true;
                EXPECT_EQ(b[borderVertex(edge, 1, factor, step)], borderVertex(edge, 1, factor - 2, t));
            }
            EXPECT_TRUE(found) << "border vertex " << step << " left its border";
        }
    }
}

TEST(StripLattice, IsThePatternOfEveryEvenFactor)
{
    for (unsigned factor = 2; factor <= 64; factor += 2) {
        const StripLattice lattice(factor);
        EXPECT_EQ(lattice.factor(), factor);
        EXPECT_EQ(latticeTriangles(lattice), patternTriangles(factor)) << factor;
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            ASSERT_TRUE(lattice.contains(lattice.patternPoint(v)));
            ASSERT_EQ(lattice.patternVertex(lattice.patternPoint(v)), v) << factor;
        }
        for (unsigned side = 0; side < 3; ++side) {
            for (unsigned step = 0; step <= factor; ++step) {
                const std::uint32_t expected = (side * factor + step) % (3 * factor);
                ASSERT_EQ(lattice.patternVertex(lattice.border(side, step)), expected);
            }
        }
    }
}

TEST(StripLattice, PlacesAndBordersAreInverse)
{
    StripLattice lattice(8);
    lattice.contract(1, {1, 2, 3, 4, 4, 3, 2, 2, 1}); // lengths 4, 3, 4
    for (unsigned k = 0; k < 3; ++k) {
        std::set<std::uint32_t> seen;
        for (unsigned row = 0; row < lattice.rows(k); ++row) {
            for (unsigned i = 0; i <= lattice.width(k, row); ++i) {
                const Point p = lattice.point(k, {row, i});
                ASSERT_TRUE(lattice.contains(p));
                seen.insert(lattice.index(p));
                EXPECT_EQ(lattice.place(k, p).row, row);
                EXPECT_EQ(lattice.place(k, p).index, i);
            }
        }
        std::size_t points = 0;
        for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
            points += lattice.contains(lattice.point(i)) ? 1U : 0U;
        }
        EXPECT_EQ(seen.size(), points);
        EXPECT_EQ(points, 3U * 4 * 5 + 1 - 9);
    }
    for (unsigned side = 0; side < 3; ++side) {
        unsigned step = 0;
        for (unsigned t = 1; t < lattice.sideLength(side); ++t) {
            EXPECT_EQ(lattice.sideOf(lattice.border(side, t), step), side);
            EXPECT_EQ(step, t);
        }
        EXPECT_EQ(lattice.sideOf(lattice.corner(side), step), 3U);
        EXPECT_EQ(lattice.border(side, lattice.sideLength(side)), lattice.corner((side + 1) % 3));
    }
}

TEST(StripLattice, TrianglesHaveTheSameIndexFromEveryCornerAndAreAcrossFromEachOther)
{
    const StripLattice lattice(6);
    for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
        const Point p = lattice.point(i);
        for (unsigned turn = 0; turn < 6; ++turn) {
            const Point q = p + StripLattice::kNeighbours[turn], r = p + StripLattice::kNeighbours[(turn + 1) % 6];
            if (!lattice.contains(p) || !lattice.contains(q) || !lattice.contains(r)) { continue; }
            const std::uint32_t t = lattice.triangle(p, turn);
            const auto c = lattice.corners(t);
            const auto at = std::find(c.begin(), c.end(), p) - c.begin();
            ASSERT_LT(at, 3);
            EXPECT_EQ(c[(at + 1) % 3], q);
            EXPECT_EQ(c[(at + 2) % 3], r);
            const std::uint32_t other = lattice.across(t, static_cast<unsigned>(at));
            if (!lattice.hasTriangle(other)) { continue; }
            const auto d = lattice.corners(other);
            const auto back = static_cast<unsigned>(std::find(d.begin(), d.end(), q) - d.begin());
            ASSERT_LT(back, 3U);
            EXPECT_EQ(d[(back + 1) % 3], p);
            EXPECT_EQ(lattice.across(other, back), t);
        }
    }
}

TEST(CornerFans, GoAroundEveryBaseVertex)
{
    for (const auto& [name, topology] : smallTopologies()) {
        SCOPED_TRACE(name);
        std::size_t corners = 0;
        for (const CornerFan& fan : cornerFans(topology)) {
            corners += fan.corners.size();
            const auto base = [&](const CornerFan::Corner& c) { return topology.patches[c.patch][c.corner]; };
            for (std::size_t c = 0; c + (fan.closed ? 0 : 1) < fan.corners.size(); ++c) {
                const auto& here = fan.corners[c];
                const auto& next = fan.corners[(c + 1) % fan.corners.size()];
                EXPECT_EQ(base(here), base(next));
                EXPECT_EQ(topology.patchEdges[here.patch][(here.corner + 2) % 3],
                          topology.patchEdges[next.patch][next.corner]);
            }
            if (!fan.closed) {
                const auto& first = fan.corners.front();
                EXPECT_EQ(topology.edges[topology.patchEdges[first.patch][first.corner]].patches[1], kNoPatch);
            }
        }
        EXPECT_EQ(corners, 3 * topology.patches.size());
    }
    EXPECT_EQ(cornerFans(PatchTopology::build(5, {{0, 1, 2}, {0, 3, 4}})).size(), 6U) << "two at vertex 0";
    EXPECT_EQ(cornerFans(closedFan(7)).front().closed, true);
}

TEST(StripContraction, LeavesThePatternAtEveryFactorWhateverTheStrips)
{
    for (const auto& [name, topology] : smallTopologies()) {
        SCOPED_TRACE(name);
        std::mt19937 random(static_cast<unsigned>(topology.patches.size()));
        const unsigned finest = topology.patches.size() > 4 ? 16 : 64;
        StripMesh mesh(topology, finest);
        for (unsigned factor = finest; factor > 2; factor -= 2) {
            contractAll(
                mesh, [&](const StripGraph& graph) { return graph.optimal(randomCosts(graph, random, 9)); }, random);
            const auto expected = patternTriangles(factor - 2);
            for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) {
                ASSERT_EQ(mesh.patch(p).lattice.factor(), factor - 2);
                ASSERT_EQ(contracted(factor, mesh.patternImages(p)), expected) << factor;
            }
            expectSameBorderImages(mesh, factor);
            for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) { mesh.mark(p); }
        }
    }
}

TEST(StripContraction, StraightStripsAreTheTessellatorsOwn)
{
    std::mt19937 random(5);
    const PatchTopology topology = tetrahedron();
    StripMesh mesh(topology, 64);
    for (unsigned factor = 64; factor > 2; factor -= 2) {
        contractAll(
            mesh, [](const StripGraph& graph) { return graph.straight(); }, random);
        for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) {
            const auto images = mesh.patternImages(p);
            for (std::uint32_t v = 0; v < images.size(); ++v) {
                ASSERT_EQ(images[v], TessellationPattern::tessellatorParent(factor, v)) << factor << " " << v;
            }
            mesh.mark(p);
        }
    }
}

TEST(StripContraction, ImagesComposeOverSeveralFactors)
{
    std::mt19937 random(6);
    const PatchTopology topology = PatchTopology::build(3, {{0, 1, 2}});
    StripMesh stepwise(topology, 16), atOnce(topology, 16);
    std::vector<std::uint32_t> composed(TessellationPattern::vertexCount(16));
    for (std::uint32_t v = 0; v < composed.size(); ++v) { composed[v] = v; }
    for (unsigned factor = 16; factor > 4; factor -= 2) {
        const auto seed = random();
        for (StripMesh* mesh : {&stepwise, &atOnce}) {
            std::mt19937 same(seed);
            contractAll(
                *mesh, [&](const StripGraph& graph) { return graph.optimal(randomCosts(graph, same, 9)); }, same);
        }
        const auto step = stepwise.patternImages(0);
        for (std::uint32_t& v : composed) { v = step[v]; }
        stepwise.mark(0);
    }
    EXPECT_EQ(atOnce.patternImages(0), composed);
}

/// The least total over all x-strips, by trying them all.
StripCost leastOfAll(const StripGraph& graph, const std::vector<StripCost>& costs)
{
    StripCost least = StripCost::forbidden();
    std::vector<unsigned> strip(graph.layers().size());
    const std::function<void(std::size_t)> extend = [&](std::size_t layer) {
        if (layer == strip.size()) {
            if (graph.isStrip(strip)) { least = std::min(least, graph.total(strip, costs)); }
            return;
        }
        for (int turn = 0; turn < 2; ++turn) {
            const int next = static_cast<int>(strip[layer - 1]) + graph.layers()[layer - 1].shift + turn;
            if (next < 0 || next >= static_cast<int>(graph.layers()[layer].width)) { continue; }
            strip[layer] = static_cast<unsigned>(next);
            extend(layer + 1);
        }
    };
    for (unsigned first = 0; first < graph.layers()[0].width; ++first) {
        strip[0] = first;
        extend(1);
    }
    return least;
}

TEST(StripGraph, OptimumIsTheLeastOfAllStrips)
{
    std::mt19937 random(7);
    const std::vector<PatchTopology> topologies{PatchTopology::build(3, {{0, 1, 2}}),
                                                PatchTopology::build(3, {{0, 1, 2}, {0, 2, 1}}), closedFan(3)};
    for (const PatchTopology& topology : topologies) {
        for (unsigned factor = 4; factor <= (topology.patches.size() == 3 ? 4U : 6U); factor += 2) {
            const StripMesh mesh(topology, factor);
            for (const CornerFan& fan : cornerFans(topology)) {
                const StripGraph graph(mesh, fan);
                for (int trial = 0; trial < 10; ++trial) {
                    auto costs = randomCosts(graph, random, trial < 5 ? 1 : 30); // many ties, and few
                    for (StripCost& cost : costs) {
                        if (trial % 2 == 0 && random() % 5 == 0) { cost = StripCost::forbidden(); }
                    }
                    const StripCost least = leastOfAll(graph, costs);
                    const std::vector<unsigned> strip = graph.optimal(costs);
                    ASSERT_EQ(strip.empty(), least.isForbidden());
                    if (strip.empty()) { continue; }
                    EXPECT_TRUE(graph.isStrip(strip));
                    const StripCost found = graph.total(strip, costs);
                    EXPECT_EQ(found.error, least.error);
                    EXPECT_EQ(found.residual, least.residual);
                }
            }
        }
    }
}

/// The least total over rings from each start edge by a plain search over the whole graph.
StripCost leastByStarts(const StripGraph& graph, const std::vector<StripCost>& costs)
{
    const auto& layers = graph.layers();
    StripCost least = StripCost::forbidden();
    for (unsigned start = 0; start < layers[0].width; ++start) {
        std::vector<StripCost> reached(layers[0].width, StripCost::forbidden());
        reached[start] = costs[start];
        for (std::size_t layer = 1; layer <= layers.size(); ++layer) {
            const bool back = layer == layers.size();
            std::vector<StripCost> next(layers[layer % layers.size()].width, StripCost::forbidden());
            for (unsigned i = 0; i < reached.size(); ++i) {
                for (int turn = 0; turn < 2; ++turn) {
                    const int j = static_cast<int>(i) + layers[layer - 1].shift + turn;
                    if (j < 0 || j >= static_cast<int>(next.size()) || reached[i].isForbidden()) { continue; }
                    const StripCost more = back ? StripCost{} : costs[graph.edge(layer, static_cast<unsigned>(j))];
                    if (reached[i] + more < next[static_cast<unsigned>(j)]) {
                        next[static_cast<unsigned>(j)] = reached[i] + more;
                    }
                }
            }
            reached = next;
        }
        least = std::min(least, reached[start]);
    }
    return least;
}

TEST(StripGraph, OptimalRingsOfLargeFansAreTheLeastToo)
{
    std::mt19937 random(8);
    for (unsigned valence = 3; valence <= 12; ++valence) {
        const PatchTopology topology = closedFan(valence);
        const StripMesh mesh(topology, 20);
        const CornerFan fan = cornerFans(topology).front();
        ASSERT_EQ(fan.corners.size(), valence);
        const StripGraph graph(mesh, fan);
        for (int trial = 0; trial < 6; ++trial) {
            const auto costs = randomCosts(graph, random, trial < 3 ? 1 : 1000);
            const auto strip = graph.optimal(costs);
            ASSERT_TRUE(graph.isStrip(strip));
            const StripCost least = leastByStarts(graph, costs), found = graph.total(strip, costs);
            EXPECT_EQ(found.error, least.error);
            EXPECT_EQ(found.residual, least.residual);
        }
    }
}

TEST(StripGraph, ErrorComesBeforeResidual)
{
    const PatchTopology topology = PatchTopology::build(3, {{0, 1, 2}});
    const StripMesh mesh(topology, 4);
    const StripGraph graph(mesh, cornerFans(topology).front());
    std::vector<StripCost> costs(graph.edgeCount(), StripCost{0.0, 5.0});
    for (std::size_t layer = 0; layer < graph.layers().size(); ++layer) {
        costs[graph.edge(layer, graph.layers()[layer].width - 1)] = {layer == 2 ? 1e-9 : 0.0, 0.0};
    }
    const auto strip = graph.optimal(costs);
    EXPECT_EQ(graph.total(strip, costs).error, 0.0);
    costs[graph.edge(2, graph.layers()[2].width - 1)].error = 0.0;
    EXPECT_EQ(graph.total(graph.optimal(costs), costs).residual, 0.0);
}

TEST(StripMesh, StartsValidAtEveryFactor)
{
    for (const auto& [name, topology] : smallTopologies()) {
        for (const unsigned factor : {2U, 4U, 6U, 10U, 14U, 62U, 64U}) {
            EXPECT_NO_THROW(StripMesh(topology, factor).check()) << name << " " << factor;
        }
    }
}

TEST(StripMesh, PlacesBorderVerticesInBothPatches)
{
    const PatchTopology topology = tetrahedron();
    StripMesh mesh(topology, 8);
    for (unsigned side = 0; side < 3; ++side) {
        const StripMesh::Site vertex{1, mesh.patch(1).lattice.border(side, 3)};
        const std::int32_t along = ChartPoint::kUnits / 8 * 3 + 7;
        mesh.place(vertex, Eigen::Vector3d(1.0, 2.0, 3.0 + side), borderParameter(side, along));
        const StripMesh::Site other = mesh.twin(1, side, 3);
        EXPECT_EQ(mesh.position(other), mesh.position(vertex));
        EXPECT_NO_THROW(mesh.check());
        mesh.placeAlone(other, Eigen::Vector3d(1.0, 2.0, 3.0 + side), mesh.parameter(mesh.twin(1, side, 4)));
        EXPECT_THROW(mesh.check(), std::logic_error);
        mesh.place(vertex, Eigen::Vector3d(1.0, 2.0, 3.0 + side), borderParameter(side, along));
    }
    mesh.placeAlone({0, mesh.patch(0).lattice.patternPoint(30)}, Eigen::Vector3d::Zero(), ChartPoint{0, 0});
    EXPECT_THROW(mesh.check(), std::logic_error) << "a triangle is turned over";
}

} // namespace
} // namespace osgTessLOD::bake
