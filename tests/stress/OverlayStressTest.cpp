// SPDX-License-Identifier: MIT
// Exact predicates of the parameter triangle where nearly everything is a tie.
#include <bake/ChartTriangulations.h>
#include <stress/RandomSource.h>
#include <stress/Stress.h>

#include <osgTessLOD/bake/DifferenceVectors.h>

namespace osgTessLOD::stress {
namespace {

using namespace bake;

/// Points of one circle about a point of the lattice: multiples of Pythagorean triples.
std::vector<ChartPoint> cocircularPoints(SourceRandom& random)
{
    constexpr int kOffsets[][2] = {{65, 0},  {63, 16}, {60, 25}, {56, 33}, {52, 39},
                                   {39, 52}, {33, 56}, {25, 60}, {16, 63}, {0, 65}};
    const auto scale = static_cast<int>(1 + random.below(100));
    const ChartPoint center{kUnits / 4 + static_cast<int>(random.below(100)),
                            kUnits / 4 + static_cast<int>(random.below(100))};
    std::vector<ChartPoint> points{center};
    for (const auto& o : kOffsets) {
        for (const int su : {-1, 1}) {
            for (const int sv : {-1, 1}) {
                points.push_back({center.u + su * scale * o[0], center.v + sv * scale * o[1]});
            }
        }
    }
    return points;
}

/// Points on one line from end to end of the triangle, and a lattice unit beside it.
std::vector<ChartPoint> nearlyCollinearPoints(SourceRandom& random)
{
    const auto slope = static_cast<int>(random.below(4));
    std::vector<ChartPoint> points;
    for (unsigned k = 0; k < 20; ++k) {
        const auto u = static_cast<int>(random.below(static_cast<std::uint32_t>(kUnits / 8)));
        points.push_back({u, slope * u + static_cast<int>(random.below(3))});
    }
    return points;
}

/// Points of a lattice of a few cells a side, so that most lie on edges and lines of others.
std::vector<ChartPoint> coarsePoints(SourceRandom& random)
{
    const std::uint32_t cells = 2 + random.below(6);
    const int step = kUnits / static_cast<int>(cells);
    std::vector<ChartPoint> points;
    for (unsigned k = 0; k < 20; ++k) {
        points.push_back(
            {step * static_cast<int>(random.below(cells + 1)), step * static_cast<int>(random.below(cells + 1))});
    }
    return points;
}

/// Within a few lattice units of one point, where there is hardly room for triangles.
std::vector<ChartPoint> crowdedPoints(SourceRandom& random)
{
    const ChartPoint center{static_cast<int>(random.below(kUnits / 2)), static_cast<int>(random.below(kUnits / 2))};
    std::vector<ChartPoint> points;
    for (unsigned k = 0; k < 20; ++k) {
        points.push_back({center.u + static_cast<int>(random.below(5)), center.v + static_cast<int>(random.below(5))});
    }
    return points;
}

Mesh degenerateMesh(SourceRandom& random)
{
    using Maker = std::vector<ChartPoint> (*)(SourceRandom&);
    constexpr Maker kMakers[] = {cocircularPoints, nearlyCollinearPoints, coarsePoints, crowdedPoints};
    std::vector<ChartPoint> points = kMakers[random.below(4)](random);
    Mesh mesh = pattern(1U << random.below(2));
    for (std::size_t k = 0; k < std::min<std::size_t>(points.size(), 12); ++k) {
        std::swap(points[k], points[k + random.below(static_cast<std::uint32_t>(points.size() - k))]);
        split(mesh, points[k]);
    }
    return mesh;
}

TEST(OverlayStress, IsAllPairsOfCocircularCollinearAndCrowdedPoints)
{
    for (unsigned k = 0; k < trials(300); ++k) {
        SCOPED_TRACE(k);
        SourceRandom random(k);
        const Mesh level = degenerateMesh(random);
        const Mesh chart = random.chance(0.2) ? level : degenerateMesh(random);
        expectAllPairs(level, chart);
        if (testing::Test::HasFatalFailure()) { return; }
    }
}

TEST(OverlayStress, OrientationsAreExactAtTheLatticesEnds)
{
    // The largest products are near 2³²: what 64 bits are for. The same in 128 bits, and by the cyclic order of corners.
    SourceRandom random(1);
    const auto coordinate = [&] {
        return static_cast<std::int32_t>(random.chance(0.3) ? random.below(2) * kUnits : random.below(kUnits + 1));
    };
    for (unsigned k = 0; k < trials(20000); ++k) {
        const ChartPoint a{coordinate(), coordinate()};
        const ChartPoint b{coordinate(), coordinate()};
        const ChartPoint c{coordinate(), coordinate()};
        __extension__ using Wide = __int128;
        const Wide exact = Wide{b.u - a.u} * (c.v - a.v) - Wide{b.v - a.v} * (c.u - a.u);
        ASSERT_EQ(Wide{orientation(a, b, c)}, exact);
        ASSERT_EQ(orientation(a, b, c), orientation(b, c, a));
        ASSERT_EQ(orientation(a, b, c), -orientation(b, a, c));
    }
}

/// Both surfaces are one linear function of the parameters: whatever the triangulations, nothing differs.
TEST(OverlayStress, LinearFunctionsDoNotDifferOnAnyTriangulation)
{
    Worst worst;
    for (unsigned k = 0; k < trials(300); ++k) {
        SourceRandom random(k);
        const Mesh level = degenerateMesh(random);
        const Mesh chart = degenerateMesh(random);
        const double scale = random.magnitude(1e-12, 1e12);
        const Vector3d alongU = scale * random.direction();
        const Vector3d alongV = scale * random.direction();
        const auto positions = [&](const Mesh& mesh) {
            std::vector<Vector3d> all;
            for (const ChartPoint p : mesh.points) { all.push_back((alongU * p.u + alongV * p.v) / kUnits); }
            return all;
        };
        const Triangulation levelTopology = level.topology();
        const Triangulation chartTopology = chart.topology();
        const DifferenceVectors differences({levelTopology, level.points}, {chartTopology, chart.points});
        const double largest = differences.largest(positions(chart), positions(level)) / scale;
        // Weights are quotients of exact integers: what is left is a few roundings of sums of three.
        ASSERT_LE(largest, 1e-14) << k;
        worst.add(largest);
    }
    report("difference of equal linear functions, parts of their size", worst.value());
}

} // namespace
} // namespace osgTessLOD::stress
