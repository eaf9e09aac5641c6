// SPDX-License-Identifier: MIT
#include <bake/ChartTriangulations.h>

#include <Eigen/Core>

namespace osgTessLOD::bake {
namespace {

TEST(Triangulation, KnowsNeighboursAndEdges)
{
    for (const unsigned factor : {1U, 2U, 4U, 6U, 16U}) {
        const Triangulation t = Triangulation::ofPattern(factor);
        EXPECT_EQ(t.edges().size(), t.vertexCount() + t.triangles().size() - 1) << "Euler";
        std::size_t border = 0;
        for (const Triangulation::Edge& edge : t.edges()) {
            EXPECT_EQ(t.triangles()[edge.triangles[0]][edge.corner], edge.vertices[0]);
            EXPECT_EQ(t.triangles()[edge.triangles[0]][(edge.corner + 1) % 3], edge.vertices[1]);
            EXPECT_EQ(t.neighbour(edge.triangles[0], edge.corner), edge.triangles[1]);
            border += edge.triangles[1] == Triangulation::kNone ? 1 : 0;
        }
        EXPECT_EQ(border, 3 * factor);
        for (std::uint32_t v = 0; v < t.vertexCount(); ++v) {
            for (const std::uint32_t other : t.verticesAround(v)) {
                const auto back = t.verticesAround(other);
                EXPECT_EQ(std::count(back.begin(), back.end(), v), 1);
            }
        }
    }
}

TEST(Triangulation, PatternPointsAreTheLatticePoints)
{
    for (const unsigned factor : {1U, 2U, 6U, 64U, 128U}) {
        const Mesh mesh = pattern(factor);
        for (const Triangle& t : mesh.triangles) {
            EXPECT_GT(orientation(mesh.points[t[0]], mesh.points[t[1]], mesh.points[t[2]]), 0);
        }
        EXPECT_EQ(mesh.points[factor % mesh.points.size()], (ChartPoint{kUnits, 0}));
        for (std::uint32_t k = 0; k <= factor; ++k) {
            const ChartPoint p = mesh.points[factor + k == 3 * factor ? 0 : (factor + k) % mesh.points.size()];
            EXPECT_EQ(p.u + p.v, kUnits) << "second side";
        }
    }
}

TEST(ParameterOverlay, OfOneTriangleAndItselfIsItsCorners)
{
    expectAllPairs(pattern(1), pattern(1));
}

TEST(ParameterOverlay, OfIdenticalPatternsIsTheirVertices)
{
    for (const unsigned factor : {2U, 4U, 8U, 16U, 128U}) {
        const Mesh mesh = pattern(factor);
        const Triangulation topology = mesh.topology();
        const auto samples = overlay({topology, mesh.points}, {topology, mesh.points});
        EXPECT_EQ(samples.size(), mesh.points.size()) << "no spurious crossings";
    }
}

TEST(ParameterOverlay, OfPatternsIsAllPairs)
{
    for (const unsigned level : {1U, 2U, 4U, 8U}) {
        for (const unsigned chart : {1U, 2U, 4U, 8U, 16U}) {
            SCOPED_TRACE(std::to_string(level) + " on " + std::to_string(chart));
            expectAllPairs(pattern(level), pattern(chart));
        }
    }
}

TEST(ParameterOverlay, OfPerturbedPatternsIsAllPairs)
{
    for (unsigned seed = 0; seed < 6; ++seed) {
        SCOPED_TRACE(seed);
        expectAllPairs(perturbed(pattern(4), kUnits / 10, seed), pattern(8));
        expectAllPairs(pattern(8), perturbed(pattern(4), kUnits / 10, seed));
        expectAllPairs(perturbed(pattern(8), kUnits / 30, seed), perturbed(pattern(8), 1, seed + 50));
        expectAllPairs(perturbed(pattern(6), 2, seed), pattern(6));
    }
}

TEST(ParameterOverlay, OfRandomTriangulationsIsAllPairs)
{
    for (unsigned seed = 0; seed < 60; ++seed) {
        SCOPED_TRACE(seed);
        expectAllPairs(randomMesh(12, kUnits / 6, seed), randomMesh(15, kUnits / 6, seed + 1000)); // nearly all aligned
        expectAllPairs(randomMesh(12, kUnits / 24, seed), randomMesh(15, kUnits / 12, seed + 2000));
        expectAllPairs(randomMesh(12, 1, seed), randomMesh(12, 1, seed + 3000));
        expectAllPairs(randomMesh(15, kUnits / 8, seed), pattern(4));
        expectAllPairs(pattern(8), randomMesh(15, kUnits / 8, seed));
    }
}

/// Area of the convex hull of points.
double hullArea(std::vector<Point> points)
{
    std::sort(points.begin(), points.end());
    double area = 0.0;
    for (const bool lower : {true, false}) {
        std::vector<Point> chain;
        for (const Point& p : points) {
            while (chain.size() >= 2) {
                const Point& a = chain[chain.size() - 2];
                const Point& b = chain.back();
                const double turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
                if (lower ? turn > 0.0 : turn < 0.0) { break; }
                chain.pop_back();
            }
            chain.push_back(p);
        }
        for (std::size_t k = 0; k + 1 < chain.size(); ++k) {
            area += (lower ? -0.5 : 0.5) * (chain[k + 1][0] - chain[k][0]) * (chain[k + 1][1] + chain[k][1]);
        }
    }
    return area;
}

double inside(const Mesh& mesh, const Triangle& t, const Point& p)
{
    double least = 1e300;
    for (unsigned k = 0; k < 3; ++k) {
        const ChartPoint a = mesh.points[t[k]];
        const ChartPoint b = mesh.points[t[(k + 1) % 3]];
        const double length = std::hypot(b.u - a.u, b.v - a.v);
        least = std::min(least, ((b.u - a.u) * (p[1] - a.v) - (b.v - a.v) * (p[0] - a.u)) / length);
    }
    return least;
}

TEST(ParameterOverlay, CellsFillTheTriangle)
{
    // The cell of two triangles is the convex hull of the samples in both: were one missing, area would be, too.
    for (unsigned seed = 0; seed < 10; ++seed) {
        const Mesh level = randomMesh(12, kUnits / 24, seed);
        const Mesh chart = perturbed(pattern(8), kUnits / 40, seed);
        const Triangulation levelTopology = level.topology();
        const Triangulation chartTopology = chart.topology();
        const auto samples = overlay({levelTopology, level.points}, {chartTopology, chart.points});
        double total = 0.0;
        for (const Triangle& a : level.triangles) {
            for (const Triangle& b : chart.triangles) {
                std::vector<Point> cell;
                for (const OverlaySample& s : samples) {
                    const Point p = pointOf(level, s.levelTriangle, s.levelWeights);
                    if (inside(level, a, p) > -1e-6 && inside(chart, b, p) > -1e-6) { cell.push_back(p); }
                }
                if (cell.size() >= 3) { total += hullArea(cell); }
            }
        }
        EXPECT_NEAR(total / (0.5 * kUnits * kUnits), 1.0, 1e-8);
    }
}

/// Value at a point of a function given at the vertices.
Eigen::Vector3d valueAt(const Mesh& mesh, const std::vector<Eigen::Vector3d>& values, const Point& p)
{
    for (const Triangle& t : mesh.triangles) {
        if (inside(mesh, t, p) < -1e-9) { continue; }
        const auto part = [&](std::uint32_t b, std::uint32_t c) {
            const ChartPoint s = mesh.points[b];
            const ChartPoint e = mesh.points[c];
            return (e.u - s.u) * (p[1] - s.v) - (e.v - s.v) * (p[0] - s.u);
        };
        const double wa = part(t[1], t[2]);
        const double wb = part(t[2], t[0]);
        const double wc = part(t[0], t[1]);
        return (wa * values[t[0]] + wb * values[t[1]] + wc * values[t[2]]) / (wa + wb + wc);
    }
    ADD_FAILURE() << "no triangle";
    return Eigen::Vector3d::Zero();
}

std::vector<Eigen::Vector3d> randomValues(std::size_t count, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::vector<Eigen::Vector3d> values(count);
    for (auto& v : values) {
        for (Eigen::Index k = 0; k < 3; ++k) { v[k] = normal(random); }
    }
    return values;
}

TEST(ParameterOverlay, NoPointDiffersMoreThanTheSamples)
{
    const Mesh level = perturbed(pattern(4), kUnits / 12, 5);
    const Mesh chart = pattern(8);
    const Triangulation levelTopology = level.topology();
    const Triangulation chartTopology = chart.topology();
    const auto levelValues = randomValues(level.points.size(), 6);
    const auto chartValues = randomValues(chart.points.size(), 7);
    double largest = 0.0;
    for (const OverlaySample& s : overlay({levelTopology, level.points}, {chartTopology, chart.points})) {
        Eigen::Vector3d v = Eigen::Vector3d::Zero();
        for (std::size_t k = 0; k < 3; ++k) {
            v += s.levelWeights[k] * levelValues[level.triangles[s.levelTriangle][k]];
            v -= s.chartWeights[k] * chartValues[chart.triangles[s.chartTriangle][k]];
        }
        largest = std::max(largest, v.norm());
    }
    std::mt19937 random(8);
    std::uniform_real_distribution<double> uniform(0.0, kUnits);
    double found = 0.0;
    for (int trial = 0; trial < 100000; ++trial) {
        Point p{uniform(random), uniform(random)};
        if (p[0] + p[1] > kUnits) { p = {kUnits - p[0], kUnits - p[1]}; }
        found = std::max(found, (valueAt(level, levelValues, p) - valueAt(chart, chartValues, p)).norm());
    }
    EXPECT_LE(found, largest * (1.0 + 1e-12));
    EXPECT_GE(found, 0.9 * largest) << "many points come near the largest";
}

TEST(ParameterOverlay, TakesTrianglesThatAreTurnedOverOrDegenerate)
{
    const Mesh chart = pattern(8);
    const Triangulation chartTopology = chart.topology();
    const std::vector<ChartPoint> points{{0, 0}, {kUnits, 0}, {0, kUnits}, {kUnits / 3, kUnits / 3}, {100, 0}};
    const auto count = [&](const std::vector<Triangle>& triangles) {
        const Triangulation level(static_cast<std::uint32_t>(points.size()), triangles);
        return overlay({level, points}, {chartTopology, chart.points}).size();
    };
    EXPECT_EQ(count({{0, 2, 1}}), chart.points.size()) << "turned over";
    EXPECT_EQ(count({{0, 3, 1}}), count({{0, 1, 3}}));
    EXPECT_EQ(count({{0, 4, 1}}), 3U + 2U * 7U) << "there and back along one side of eight segments";
    // Two triangles over one another are sampled both.
    EXPECT_GT(count({{0, 1, 2}, {0, 3, 1}}), chart.points.size() + 10);
}

TEST(ParameterOverlay, FindsAVertexWhoseEdgesAllLeaveThroughCorners)
{
    // The chart's three spokes from its centre pass through the level's corners: no edges cross.
    const ChartPoint center{kUnits / 3, kUnits / 3};
    const Mesh chart{{{0, 0}, {kUnits, 0}, {0, kUnits}, center}, {{0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
    Mesh level{{}, {{0, 1, 2}}};
    for (unsigned k = 0; k < 3; ++k) {
        level.points.push_back({(chart.points[k].u + center.u) / 2, (chart.points[k].v + center.v) / 2});
    }
    const Triangulation levelTopology = level.topology();
    const Triangulation chartTopology = chart.topology();
    EXPECT_EQ(overlay({levelTopology, level.points}, {chartTopology, chart.points}).size(), 4U);
}

} // namespace
} // namespace osgTessLOD::bake
