// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TessellationPattern.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

namespace osgTessLOD {
namespace {

using Triangle = TessellationPattern::Triangle;

std::vector<unsigned> allFactors()
{
    std::vector<unsigned> factors{1};
    for (unsigned f = 2; f <= TessellationPattern::kMaxFactor; f += 2) { factors.push_back(f); }
    return factors;
}

Triangle rotated(Triangle t)
{
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

std::array<float, 3> tessCoord(unsigned factor, std::uint32_t vertex)
{
    const auto b = TessellationPattern::barycentric(factor, vertex);
    const auto d = static_cast<float>(3 * factor);
    return {static_cast<float>(b[0]) / d, static_cast<float>(b[1]) / d, static_cast<float>(b[2]) / d};
}

/// Twice the area of a triangle in the parameter plane, in units of the whole patch over (3·factor)².
long long signedArea(unsigned factor, const Triangle& t)
{
    const auto a = TessellationPattern::barycentric(factor, t[0]);
    const auto b = TessellationPattern::barycentric(factor, t[1]);
    const auto c = TessellationPattern::barycentric(factor, t[2]);
    const auto d = [](unsigned x, unsigned y) { return static_cast<long long>(x) - static_cast<long long>(y); };
    return d(b[1], a[1]) * d(c[2], a[2]) - d(b[2], a[2]) * d(c[1], a[1]);
}

TEST(TessellationPattern, knowsItsFactors)
{
    EXPECT_TRUE(TessellationPattern::isValidFactor(1));
    EXPECT_TRUE(TessellationPattern::isValidFactor(2));
    EXPECT_TRUE(TessellationPattern::isValidFactor(128));
    EXPECT_FALSE(TessellationPattern::isValidFactor(0));
    EXPECT_FALSE(TessellationPattern::isValidFactor(3));
    EXPECT_FALSE(TessellationPattern::isValidFactor(130));
}

TEST(TessellationPattern, countsVerticesAndTriangles)
{
    EXPECT_EQ(TessellationPattern::vertexCount(2), 7U);
    EXPECT_EQ(TessellationPattern::vertexCount(64), 3169U);
    EXPECT_EQ(TessellationPattern::triangleCount(64), 6144U);
    EXPECT_EQ(TessellationPattern::triangleCount(128), 24576U); // Lambert fig. 4.6: 491,520 / 20
    for (unsigned f : allFactors()) {
        EXPECT_EQ(TessellationPattern(f).triangles().size(), TessellationPattern::triangleCount(f)) << f;
    }
}

TEST(TessellationPattern, numbersEveryVertexOnceAndBack)
{
    for (unsigned f : allFactors()) {
        std::set<TessellationPattern::Barycentric> seen;
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(f); ++v) {
            const auto b = TessellationPattern::barycentric(f, v);
            ASSERT_EQ(b[0] + b[1] + b[2], 3 * f);
            EXPECT_TRUE(seen.insert(b).second) << f << " " << v;
            EXPECT_EQ(TessellationPattern::index(f, b), v) << f;
            EXPECT_EQ(TessellationPattern::index(f, tessCoord(f, v)), v) << f;
            EXPECT_EQ(TessellationPattern::index(f, TessellationPattern::place(f, v)), v) << f;
        }
    }
}

TEST(TessellationPattern, anyWeightsGiveSomeVertex)
{
    for (const unsigned f : {1U, 2U, 4U, 6U, 16U}) {
        std::uint32_t found = 0;
        for (unsigned a = 0; a <= 3 * f; ++a) {
            for (unsigned b = 0; a + b <= 3 * f; ++b) {
                const TessellationPattern::Barycentric weights{a, b, 3 * f - a - b};
                const std::uint32_t v = TessellationPattern::index(f, weights);
                ASSERT_LT(v, TessellationPattern::vertexCount(f));
                found += TessellationPattern::barycentric(f, v) == weights ? 1 : 0;
            }
        }
        EXPECT_EQ(found, TessellationPattern::vertexCount(f)) << "each vertex from its own weights alone, factor " << f;
    }
}

TEST(TessellationPattern, bordersComeFirstSideBySide)
{
    for (unsigned f : allFactors()) {
        for (unsigned side = 0; side < 3; ++side) {
            for (unsigned t = 0; t < f; ++t) {
                const auto b = TessellationPattern::barycentric(f, side * f + t);
                EXPECT_EQ(b[(side + 2) % 3], 0U);
                EXPECT_EQ(b[(side + 1) % 3], 3 * t);
            }
        }
    }
}

TEST(TessellationPattern, trianglesTileThePatchCounterClockwise)
{
    for (unsigned f : allFactors()) {
        const TessellationPattern pattern(f);
        long long area = 0;
        std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
        for (const Triangle& t : pattern.triangles()) {
            const long long a = signedArea(f, t);
            EXPECT_GT(a, 0) << f;
            area += a;
            for (std::size_t k = 0; k < 3; ++k) { ++edges[{t[k], t[(k + 1) % 3]}]; }
        }
        EXPECT_EQ(area, 9LL * f * f) << f;
        std::size_t border = 0;
        for (const auto& [edge, count] : edges) {
            EXPECT_EQ(count, 1);
            border += edges.count({edge.second, edge.first}) == 0 ? 1 : 0;
        }
        EXPECT_EQ(border, 3 * f);
    }
}

TEST(TessellationPattern, collapsingByTheTessellatorsParentsGivesTheNextPattern)
{
    for (unsigned f = 4; f <= TessellationPattern::kMaxFactor; f += 2) {
        std::set<Triangle> collapsed;
        const TessellationPattern fine(f);
        for (const Triangle& t : fine.triangles()) {
            const Triangle p{TessellationPattern::tessellatorParent(f, t[0]),
                             TessellationPattern::tessellatorParent(f, t[1]),
                             TessellationPattern::tessellatorParent(f, t[2])};
            if (p[0] == p[1] || p[1] == p[2] || p[2] == p[0]) { continue; }
            EXPECT_TRUE(collapsed.insert(rotated(p)).second) << "twice the same triangle, factor " << f;
        }
        std::set<Triangle> expected;
        const TessellationPattern coarse(f - 2);
        for (const Triangle& t : coarse.triangles()) { expected.insert(rotated(t)); }
        EXPECT_EQ(collapsed, expected) << f;
    }
}

TEST(TessellationPattern, halvingGoesToTheCeilingOfHalfThePosition)
{
    for (unsigned f = 4; f <= TessellationPattern::kMaxFactor; f *= 2) {
        for (unsigned t = 0; t <= f / 2; ++t) {
            EXPECT_EQ(TessellationPattern::tessellatorAncestor(f, t, f / 2), (t + 1) / 2) << f << " " << t;
        }
    }
}

TEST(TessellationPattern, ancestorsTreatBothDirectionsOfABorderAlike)
{
    for (unsigned f = 4; f <= TessellationPattern::kMaxFactor; f += 2) {
        for (unsigned t = 0; t <= f; ++t) {
            const std::uint32_t forward = TessellationPattern::tessellatorParent(f, t);
            const std::uint32_t backward = TessellationPattern::tessellatorParent(f, f - t);
            EXPECT_EQ(forward + backward, f - 2) << f << " " << t;
        }
    }
}

TEST(TessellationPattern, locatesPointsInTheirTriangle)
{
    for (unsigned f : {1U, 2U, 4U, 6U, 10U, 64U}) {
        const TessellationPattern pattern(f);
        constexpr int kGrid = 90; // fine enough to fall on edges, vertices and inside of every triangle of factor 10
        for (int i = 0; i <= kGrid; ++i) {
            for (int j = 0; i + j <= kGrid; ++j) {
                const std::array<double, 3> b{double(kGrid - i - j) / kGrid, double(i) / kGrid, double(j) / kGrid};
                const auto at = pattern.locate(b);
                ASSERT_LT(at.triangle, pattern.triangles().size());
                std::array<double, 3> sum{};
                for (std::size_t k = 0; k < 3; ++k) {
                    EXPECT_GE(at.weights[k], 0.0);
                    const auto c = TessellationPattern::barycentric(f, pattern.triangles()[at.triangle][k]);
                    for (std::size_t x = 0; x < 3; ++x) { sum[x] += at.weights[k] * c[x] / (3.0 * f); }
                }
                // A dozen roundings of numbers below 1: 1e-14. A wrong triangle would be off by more than 1e-4.
                for (std::size_t x = 0; x < 3; ++x) { EXPECT_NEAR(sum[x], b[x], 1e-14) << f << " " << i << " " << j; }
            }
        }
    }
}

TEST(TessellationPattern, chartPointsAreTheNearestOnTheLattice)
{
    for (unsigned factor = 1; factor <= TessellationPattern::kMaxFactor; factor += factor == 1 ? 1 : 2) {
        const double units = ChartPoint::kUnits / (3.0 * factor);
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            const auto b = TessellationPattern::barycentric(factor, v);
            const ChartPoint point = TessellationPattern::chartPoint(factor, v);
            const double rounding = 128 % factor == 0 ? 0.0 : 0.5 + 1e-9;
            ASSERT_NEAR(point.u, units * b[1], rounding) << factor << " " << v;
            ASSERT_NEAR(point.v, units * b[2], rounding) << factor << " " << v;
            ASSERT_EQ(ChartPoint::fromBits(point.bits()), point);
        }
        for (unsigned side = 0; side < 3; ++side) { // exactly on it, and the same from both ends
            for (unsigned t = 0; t < factor; ++t) {
                const ChartPoint point = TessellationPattern::chartPoint(factor, side * factor + t);
                const ChartPoint back =
                    TessellationPattern::chartPoint(factor, (side * factor + factor - t) % (3 * factor));
                const std::int32_t along = alongBorder(side, point);
                ASSERT_EQ(borderParameter(side, along), point) << factor << " " << side << " " << t;
                ASSERT_EQ(borderParameter(side, ChartPoint::kUnits - along), back) << factor << " " << side << " " << t;
            }
        }
    }
}

} // namespace
} // namespace osgTessLOD
