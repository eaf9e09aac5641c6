// SPDX-License-Identifier: MIT
// What contracting an edge does to the error.
#include <bake/BumpyMap.h>
#include <bake/SmallTopologies.h>
#include <bake/StripEdges.h>

#include <osgTessLOD/bake/ChartRelayout.h>
#include <osgTessLOD/bake/CollapseCost.h>
#include <osgTessLOD/bake/StripGraph.h>
#include <osgTessLOD/bake/Triangulation.h>

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

/// A strip mesh over a bumpy tetrahedron, its vertices on the charts but for their heights.
struct Bumpy {
    BumpyMap map{tetrahedron(), 0.2, true};
    ChartSet charts;
    StripMesh mesh{map.topology(), 8};

    Bumpy()
    {
        Progress progress;
        charts = makeCharts(map, 32, progress);
        const TessellationPattern pattern(32);
        for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) {
            const StripLattice lattice = mesh.patch(p).lattice;
            for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
                const StripMesh::Site site{p, lattice.point(i)};
                if (!lattice.contains(site.point)) { continue; }
                mesh.place(site, chartPosition(pattern, charts.charts[p], mesh.parameter(site)), mesh.parameter(site));
            }
        }
    }

    /// Difference vectors of a patch at all chart vertices, by trying all triangles, and at all its own.
    std::vector<Vector3d> allDifferences(std::uint32_t p) const
    {
        const StripMesh::Patch& patch = mesh.patch(p);
        const auto points = patternPoints(32);
        std::vector<Vector3d> result;
        for (std::size_t v = 0; v < points.size(); ++v) {
            bool found = false;
            for (std::uint32_t t = 0; t < patch.lattice.triangleIndexCount() && !found; ++t) {
                if (!patch.lattice.hasTriangle(t)) { continue; }
                std::array<ChartPoint, 3> c;
                std::array<Vector3d, 3> x;
                for (std::size_t k = 0; k < 3; ++k) {
                    const std::uint32_t i = patch.lattice.index(patch.lattice.corners(t)[k]);
                    c[k] = patch.parameters[i];
                    x[k] = patch.positions[i];
                }
                const auto area = static_cast<double>(orientation(c[0], c[1], c[2]));
                const auto a = orientation(points[v], c[1], c[2]), b = orientation(c[0], points[v], c[2]);
                const auto d = orientation(c[0], c[1], points[v]);
                if (area <= 0.0 || a < 0 || b < 0 || d < 0) { continue; }
                found = true;
                result.emplace_back(
                    (static_cast<double>(a) * x[0] + static_cast<double>(b) * x[1] + static_cast<double>(d) * x[2]) /
                        area -
                    charts.charts[p].positions[v]);
            }
            EXPECT_TRUE(found);
        }
        const TessellationPattern pattern(32);
        for (std::uint32_t i = 0; i < patch.lattice.indexCount(); ++i) {
            if (!patch.lattice.contains(patch.lattice.point(i))) { continue; }
            result.push_back(patch.positions[i] - chartPosition(pattern, charts.charts[p], patch.parameters[i]));
        }
        return result;
    }
};

std::vector<double> errorsOf(const std::vector<Vector3d>& vectors)
{
    const auto& d = DirectionalErrors::directions();
    std::vector<double> errors(DirectionalErrors::kDirections, 0.0);
    for (std::size_t i = 0; i < errors.size(); ++i) {
        const Vector3d direction(d.x[i], d.y[i], d.z[i]);
        for (const Vector3d& v : vectors) { errors[i] = std::max(errors[i], v.cross(direction).norm()); }
    }
    return errors;
}

TEST(DirectionalErrors, AreTheLargestCrossProducts)
{
    std::mt19937 random(11);
    std::normal_distribution<double> normal;
    std::vector<Vector3d> vectors;
    DirectionalErrors errors;
    for (int i = 0; i < 20; ++i) {
        vectors.emplace_back(normal(random), normal(random), 5.0 * normal(random));
        errors.include(vectors.back().cast<float>());
    }
    const std::vector<double> expected = errorsOf(vectors);
    for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_NEAR(std::sqrt(errors.squared()[i]), expected[i], 1e-5 * expected[i] + 1e-5);
    }
    const double least = *std::min_element(expected.begin(), expected.end());
    EXPECT_NEAR(errors.least(), least * least, 1e-3 * least * least);
    DirectionalErrors more = errors;
    EXPECT_EQ(errors.meanExcess(more), 0.0);
    more.include({0.0F, 40.0F, 0.0F});
    vectors.emplace_back(0.0, 40.0, 0.0);
    const std::vector<double> raised = errorsOf(vectors);
    double mean = 0.0;
    for (std::size_t i = 0; i < raised.size(); ++i) {
        mean += (raised[i] - expected[i]) / static_cast<double>(raised.size());
    }
    EXPECT_NEAR(errors.meanExcess(more), mean, 1e-4 * mean);
    EXPECT_EQ(more.meanExcess(errors), 0.0) << "what is lower does not count";
}

TEST(CollapseCost, KnowsTheDifferencesThroughContractions)
{
    Bumpy bumpy;
    CollapseCost cost(bumpy.mesh, bumpy.charts);
    std::mt19937 random(12);
    for (int round = 0; round < 3; ++round) {
        for (const CornerFan& fan : cornerFans(bumpy.map.topology())) {
            for (std::uint32_t p = 0; p < bumpy.mesh.patchCount(); ++p) {
                cost.relocate(p);
                const std::vector<Vector3d> expected = bumpy.allDifferences(p);
                for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(32); ++v) {
                    ASSERT_LT((cost.difference(p, v) - expected[v]).norm(), 1e-12);
                }
                cost.measure(p);
                const std::vector<double> errors = errorsOf(expected);
                for (std::size_t i = 0; i < errors.size(); ++i) {
                    ASSERT_NEAR(std::sqrt(cost.errors(p).squared()[i]), errors[i], 1e-4 * errors[i]);
                }
            }
            const StripGraph graph(bumpy.mesh, fan);
            std::vector<StripCost> costs(graph.edgeCount());
            for (StripCost& c : costs) { c.error = static_cast<double>(random() % 10); }
            const std::vector<unsigned> strip = graph.optimal(costs);
            std::set<std::uint32_t> broken;
            for (std::size_t layer = 0; layer < strip.size(); ++layer) {
                const auto& line = graph.layers()[layer];
                const StripMesh::Site a{
                    line.patch, bumpy.mesh.patch(line.patch).lattice.point(line.corner, {line.row, strip[layer]})};
                const CollapseStar star = collapseStar(bumpy.mesh, a, line.corner);
                Placement placement = placeVertex(star, PlacementMethod::VolumeUv);
                if (!placement.isValid) { // random strips may be impossible as the chart is laid out
                    placement.position = star.ends[0].position;
                    placement.parameter = star.ends[0].parameter;
                    broken.insert(star.patches.begin(), star.patches.end());
                }
                bumpy.mesh.place(a, placement.position, placement.parameter);
                bumpy.mesh.place({a.patch, a.point + StripLattice::direction(line.corner)}, placement.position,
                                 placement.parameter);
            }
            for (std::size_t c = 0; c < fan.corners.size(); ++c) {
                const auto& [patch, corner] = fan.corners[c];
                const StripLattice before = bumpy.mesh.patch(patch).lattice;
                cost.contracted(patch, before, bumpy.mesh.contract(patch, corner, graph.within(c, strip)));
            }
            broken.erase(kNoPatch);
            for (const std::uint32_t p : broken) {
                relayout(bumpy.mesh, p, TessellationPattern(32), bumpy.charts.charts[p]);
            }
        }
    }
    EXPECT_EQ(bumpy.mesh.patch(0).lattice.factor(), 2U);
    EXPECT_NO_THROW(bumpy.mesh.check());
}

TEST(CollapseCost, IsHowMuchTheMeanErrorRises)
{
    Bumpy bumpy;
    CollapseCost cost(bumpy.mesh, bumpy.charts);
    for (std::uint32_t p = 0; p < bumpy.mesh.patchCount(); ++p) {
        cost.relocate(p);
        cost.measure(p);
    }
    std::vector<std::vector<double>> before;
    for (std::uint32_t p = 0; p < bumpy.mesh.patchCount(); ++p) { before.push_back(errorsOf(bumpy.allDifferences(p))); }
    std::size_t edge = 0, free = 0;
    const StripMesh original = bumpy.mesh;
    forEachEdge(original, [&](StripMesh::Site from, unsigned k) {
        if (edge++ % 7 != 0) { return; }
        const CollapseStar star = collapseStar(original, from, k);
        const Placement placement = placeVertex(star, PlacementMethod::VolumeUv);
        ASSERT_TRUE(placement.isValid);
        const double found = cost.evaluate(star, placement);
        bumpy.mesh.place(from, placement.position, placement.parameter);
        bumpy.mesh.place({from.patch, from.point + StripLattice::direction(k)}, placement.position,
                         placement.parameter);
        double expected = 0.0;
        for (const std::uint32_t p : star.patches) {
            if (p == kNoPatch) { continue; }
            const std::vector<double> after = errorsOf(bumpy.allDifferences(p));
            for (std::size_t i = 0; i < after.size(); ++i) {
                expected += std::max(0.0, after[i] - before[p][i]) / static_cast<double>(after.size());
            }
        }
        EXPECT_NEAR(found, expected, 1e-3 * expected + 1e-7);
        free += found == 0.0 ? 1U : 0U;
        EXPECT_GE(found, 0.0);
        bumpy.mesh = original;
    });
    EXPECT_GT(free, 5U);
    EXPECT_LT(free, edge / 7);
}

double sumOfSquares(const Bumpy& bumpy, const StripMesh& mesh, std::uint32_t a, std::uint32_t b)
{
    Bumpy copy = bumpy;
    copy.mesh = mesh;
    double sum = 0.0;
    for (const Vector3d& v : copy.allDifferences(a)) { sum += v.squaredNorm(); }
    if (b == kNoPatch) { return sum; }
    for (const Vector3d& v : copy.allDifferences(b)) { sum += v.squaredNorm(); }
    return sum;
}

TEST(CollapseCost, FittedPositionHasTheLeastSquares)
{
    Bumpy bumpy;
    CollapseCost cost(bumpy.mesh, bumpy.charts);
    for (std::uint32_t p = 0; p < bumpy.mesh.patchCount(); ++p) { cost.relocate(p); }
    const StripLattice& lattice = bumpy.mesh.patch(1).lattice;
    for (const StripLattice::Point point : {StripLattice::Point{3, 4}, lattice.border(1, 3)}) {
        const StripMesh::Site site{1, point};
        const std::uint32_t other = point == lattice.border(1, 3) ? bumpy.mesh.twin(1, 1, 3).patch : kNoPatch;
        const Vector3d best = cost.fittedPosition(site);
        EXPECT_GT((best - bumpy.mesh.position(site)).norm(), 1e-4);
        const auto at = [&](const Vector3d& position) {
            StripMesh moved = bumpy.mesh;
            moved.place(site, position, moved.parameter(site));
            return sumOfSquares(bumpy, moved, 1, other);
        };
        const double least = at(best);
        EXPECT_LT(least, at(bumpy.mesh.position(site)));
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_LT(least, at(best + 0.01 * Vector3d::Unit(axis)));
            EXPECT_LT(least, at(best - 0.01 * Vector3d::Unit(axis)));
        }
    }
}

} // namespace
} // namespace osgTessLOD::bake
