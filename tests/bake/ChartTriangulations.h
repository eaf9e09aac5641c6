// SPDX-License-Identifier: MIT
// Triangulations of the parameter triangle, and what their overlays are by comparing all with all.
#pragma once

#include <osgTessLOD/bake/ParameterOverlay.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

using Triangle = Triangulation::Triangle;
constexpr std::int32_t kUnits = ChartPoint::kUnits;

struct Mesh {
    std::vector<ChartPoint> points;
    std::vector<Triangle> triangles;
    Triangulation topology() const { return Triangulation(static_cast<std::uint32_t>(points.size()), triangles); }
};

inline Mesh pattern(unsigned factor)
{
    return {patternPoints(factor), Triangulation::ofPattern(factor).triangles()};
}

/// Moves the vertices about, those on the border along it, as long as all triangles stay positive.
inline Mesh perturbed(Mesh mesh, std::int32_t most, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_int_distribution<std::int32_t> step(-most, most);
    const Triangulation topology = mesh.topology();
    for (std::uint32_t v = 3; v < mesh.points.size(); ++v) {
        const ChartPoint before = mesh.points[v];
        const bool corner = (before.u == 0 || before.u == kUnits) && (before.v == 0 || before.v == kUnits);
        if (corner) { continue; }
        ChartPoint moved{before.u + step(random), before.v + step(random)};
        if (before.u == 0) { moved.u = 0; }
        if (before.v == 0) { moved.v = 0; }
        if (before.u + before.v == kUnits) { moved.v = kUnits - moved.u; }
        mesh.points[v] = moved;
        for (const std::uint32_t t : topology.trianglesAround(v)) {
            const auto& [a, b, c] = mesh.triangles[t];
            if (orientation(mesh.points[a], mesh.points[b], mesh.points[c]) <= 0) { mesh.points[v] = before; }
        }
    }
    return mesh;
}

/// Splits triangles and edges at a point. False if it is not in the parameter triangle, or a vertex already.
inline bool split(Mesh& mesh, ChartPoint p)
{
    if (!p.isInside() || std::count(mesh.points.begin(), mesh.points.end(), p) > 0) { return false; }
    mesh.points.push_back(p);
    const auto vertex = static_cast<std::uint32_t>(mesh.points.size() - 1);
    std::vector<Triangle> triangles;
    for (const Triangle& t : mesh.triangles) {
        const auto at = [&](unsigned k) { return orientation(mesh.points[t[k]], mesh.points[t[(k + 1) % 3]], p); };
        if (at(0) < 0 || at(1) < 0 || at(2) < 0) {
            triangles.push_back(t);
            continue;
        }
        for (unsigned k = 0; k < 3; ++k) {
            if (at(k) > 0) { triangles.push_back({t[k], t[(k + 1) % 3], vertex}); }
        }
    }
    mesh.triangles = triangles;
    return true;
}

/// Split at random points of a lattice as coarse as `step`, so that much is aligned.
inline Mesh randomMesh(unsigned splits, std::int32_t step, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_int_distribution<std::int32_t> coordinate(0, kUnits / step);
    Mesh mesh = pattern(1);
    while (splits > 0) {
        const ChartPoint p{coordinate(random) * step, coordinate(random) * step};
        if (split(mesh, p)) { --splits; }
    }
    return mesh;
}

using Point = std::array<double, 2>;

inline Point pointOf(const Mesh& mesh, std::uint32_t triangle, const std::array<double, 3>& weights)
{
    Point p{};
    for (std::size_t k = 0; k < 3; ++k) {
        const ChartPoint corner = mesh.points[mesh.triangles[triangle][k]];
        p[0] += weights[k] * corner.u;
        p[1] += weights[k] * corner.v;
    }
    return p;
}

/// A point with rational coordinates u / w, v / w in lowest terms; 64 bits are plenty.
using Rational = std::tuple<std::int64_t, std::int64_t, std::int64_t>;

inline std::int64_t greatestDivisor(std::int64_t a, std::int64_t b)
{
    a = a < 0 ? -a : a;
    b = b < 0 ? -b : b;
    while (b != 0) { std::tie(a, b) = std::tuple(b, a % b); }
    return a;
}

inline Rational reduced(std::int64_t u, std::int64_t v, std::int64_t w)
{
    const std::int64_t divisor = greatestDivisor(greatestDivisor(u, v), w);
    return {u / divisor, v / divisor, w / divisor};
}

inline std::set<std::pair<std::uint32_t, std::uint32_t>> edgesOf(const Mesh& mesh)
{
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const Triangle& t : mesh.triangles) {
        for (unsigned k = 0; k < 3; ++k) { edges.insert(std::minmax(t[k], t[(k + 1) % 3])); }
    }
    return edges;
}

/// All vertices and all crossings of edges that do not lie on one line, by all pairs.
inline std::set<Rational> allPairs(const Mesh& level, const Mesh& chart)
{
    std::set<Rational> points;
    for (const Mesh* mesh : {&level, &chart}) {
        for (const ChartPoint p : mesh->points) { points.insert(reduced(p.u, p.v, 1)); }
    }
    for (const auto& [p, q] : edgesOf(level)) {
        for (const auto& [a, b] : edgesOf(chart)) {
            const ChartPoint pp = level.points[p];
            const ChartPoint qq = level.points[q];
            const std::int64_t atA = orientation(pp, qq, chart.points[a]);
            const std::int64_t atB = orientation(pp, qq, chart.points[b]);
            const std::int64_t atP = orientation(chart.points[a], chart.points[b], pp);
            const std::int64_t atQ = orientation(chart.points[a], chart.points[b], qq);
            if ((atA < 0 && atB < 0) || (atA > 0 && atB > 0) || (atP < 0 && atQ < 0) || (atP > 0 && atQ > 0)) {
                continue;
            }
            const std::int64_t w = atP - atQ;
            if (w == 0) { continue; } // on one line, or an end on an end's line: vertices
            points.insert(reduced(pp.u * w + (qq.u - pp.u) * atP, pp.v * w + (qq.v - pp.v) * atP, w));
        }
    }
    std::set<Rational> positive;
    for (const auto& [u, v, w] : points) { positive.insert(w < 0 ? Rational{-u, -v, -w} : Rational{u, v, w}); }
    return positive;
}

inline std::vector<Point> sortedPoints(const std::vector<OverlaySample>& samples, const Mesh& level, const Mesh& chart)
{
    std::vector<Point> points;
    for (const OverlaySample& s : samples) {
        const Point onLevel = pointOf(level, s.levelTriangle, s.levelWeights);
        const Point onChart = pointOf(chart, s.chartTriangle, s.chartWeights);
        for (std::size_t k = 0; k < 2; ++k) { EXPECT_NEAR(onLevel[k], onChart[k], 1e-9 * kUnits); }
        for (const auto& weights : {s.levelWeights, s.chartWeights}) {
            EXPECT_NEAR(weights[0] + weights[1] + weights[2], 1.0, 1e-15);
            for (const double w : weights) { EXPECT_GE(w, 0.0); }
        }
        points.push_back(onLevel);
    }
    return points;
}

/// The samples are the points that all pairs give, each once.
inline void expectAllPairs(const Mesh& level, const Mesh& chart)
{
    const Triangulation levelTopology = level.topology();
    const Triangulation chartTopology = chart.topology();
    const auto samples = overlay({levelTopology, level.points}, {chartTopology, chart.points});
    const std::set<Rational> expected = allPairs(level, chart);
    ASSERT_EQ(samples.size(), expected.size());
    std::vector<Point> points = sortedPoints(samples, level, chart);
    for (const auto& [u, v, w] : expected) {
        const Point at{static_cast<double>(u) / static_cast<double>(w),
                       static_cast<double>(v) / static_cast<double>(w)};
        const auto nearest = std::min_element(points.begin(), points.end(), [&](const Point& a, const Point& b) {
            return std::hypot(a[0] - at[0], a[1] - at[1]) < std::hypot(b[0] - at[0], b[1] - at[1]);
        });
        ASSERT_NE(nearest, points.end());
        ASSERT_LT(std::hypot((*nearest)[0] - at[0], (*nearest)[1] - at[1]), 1e-6)
            << "missing " << at[0] << ' ' << at[1];
        points.erase(nearest);
    }
}

} // namespace osgTessLOD::bake
