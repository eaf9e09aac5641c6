// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/BuiltinSurface.h>

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

/// Weights of the point at `along` ∈ [0, 1] of side `side`.
Vector3d onSide(unsigned side, double along)
{
    Vector3d weights = Vector3d::Zero();
    weights[side] = 1.0 - along;
    weights[(side + 1) % 3] = along;
    return weights;
}

/// Calls visit(patch, weights) for a regular grid on every patch.
template <typename Visit>
void sample(const PatchMap& map, int steps, Visit visit)
{
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (int j = 0; j <= steps; ++j) {
            for (int i = 0; i + j <= steps; ++i) { visit(p, Vector3d(Vector3d(steps - i - j, i, j) / steps)); }
        }
    }
}

struct Expected {
    const char* name;
    std::size_t patches;
    std::uint64_t triangles;
    bool closed;
};

class BuiltinSurfaces : public testing::TestWithParam<Expected> {
protected:
    std::unique_ptr<PatchMap> make(std::uint64_t triangles = 0) const { return makeBuiltinSurface(GetParam().name, triangles); }
};

TEST_P(BuiltinSurfaces, HasTheNumbersOfTheThesis)
{
    const auto map = make();
    EXPECT_EQ(map->name(), GetParam().name);
    EXPECT_EQ(map->topology().patches.size(), GetParam().patches);
    EXPECT_EQ(map->sourceTriangles(), GetParam().triangles);
    EXPECT_EQ(map->referenceFactor(), 128U);
}

/// Euler characteristic 2 and no open edge, or 1 and the 16 open edges of the sheet; every vertex used.
void expectTopology(const PatchTopology& t, bool closed, std::size_t openEdges)
{
    std::set<std::uint32_t> used;
    for (const auto& patch : t.patches) { used.insert(patch.begin(), patch.end()); }
    EXPECT_EQ(used.size(), t.vertexCount);
    const auto open = std::count_if(t.edges.begin(), t.edges.end(), [](const auto& e) { return e.patches[1] == kNoPatch; });
    EXPECT_EQ(static_cast<std::size_t>(open), closed ? 0U : openEdges);
    const long euler = static_cast<long>(t.vertexCount) - static_cast<long>(t.edges.size()) + static_cast<long>(t.patches.size());
    EXPECT_EQ(euler, closed ? 2 : 1);
}

TEST_P(BuiltinSurfaces, IsOneSphereOrOneSheet)
{
    expectTopology(make()->topology(), GetParam().closed, 16);
    expectTopology(make(GetParam().triangles * 9)->topology(), GetParam().closed, 48);
}

TEST_P(BuiltinSurfaces, NeighboursAgreeOnTheirBorders)
{
    for (const std::uint64_t triangles : {std::uint64_t{0}, 4 * GetParam().triangles}) {
        const auto map = make(triangles);
        for (const auto& edge : map->topology().edges) {
            if (edge.patches[1] == kNoPatch) { continue; }
            for (int k = 0; k <= 16; ++k) {
                const SurfacePoint a = map->evaluate(edge.patches[0], onSide(edge.sides[0], k / 16.0));
                const SurfacePoint b = map->evaluate(edge.patches[1], onSide(edge.sides[1], 1.0 - k / 16.0));
                ASSERT_LT((a.position - b.position).norm(), 1e-12) << edge.patches[0] << " | " << edge.patches[1];
                ASSERT_GT(a.normal.dot(b.normal), 0.99) << edge.patches[0] << " | " << edge.patches[1] << " at " << k;
            }
        }
    }
}

TEST_P(BuiltinSurfaces, CornersOfAllPatchesAroundAVertexCoincide)
{
    const auto map = make();
    std::map<std::uint32_t, Vector3d> corners;
    for (std::uint32_t p = 0; p < map->topology().patches.size(); ++p) {
        for (unsigned c = 0; c < 3; ++c) {
            const Vector3d position = map->evaluate(p, Vector3d::Unit(c)).position;
            const auto [known, isNew] = corners.emplace(map->topology().patches[p][c], position);
            if (!isNew) { EXPECT_LT((known->second - position).norm(), 1e-12); }
        }
    }
    EXPECT_EQ(corners.size(), map->topology().vertexCount);
}

TEST_P(BuiltinSurfaces, IsFiniteAndFillsTheWorkingFrame)
{
    const auto map = make();
    Vector3d low = Vector3d::Constant(1e9), high = -low;
    sample(*map, 64, [&](std::uint32_t p, const Vector3d& weights) {
        const SurfacePoint s = map->evaluate(p, weights);
        ASSERT_TRUE(s.position.allFinite() && s.normal.allFinite());
        ASSERT_NEAR(s.normal.norm(), 1.0, 1e-12);
        low = low.cwiseMin(s.position);
        high = high.cwiseMax(s.position);
    });
    EXPECT_NEAR((high - low).norm(), 1.0, 0.03);
    EXPECT_LT((high + low).norm(), 0.03);
}

TEST_P(BuiltinSurfaces, GivesTheSameBitsEveryTime)
{
    const auto a = make(), b = make();
    sample(*a, 7, [&](std::uint32_t p, const Vector3d& weights) {
        EXPECT_EQ(a->evaluate(p, weights).position, b->evaluate(p, weights).position);
        EXPECT_EQ(a->evaluate(p, weights).normal, b->evaluate(p, weights).normal);
    });
}

TEST_P(BuiltinSurfaces, NormalsAreThoseOfSmallTrianglesAroundThem)
{
    // Against finite differences within the patch: another parametrization than the one they were made with.
    const auto map = make();
    int compared = 0, agreeing = 0;
    sample(*map, 5, [&](std::uint32_t p, const Vector3d& weights) {
        if (weights.minCoeff() < 0.1) { return; }
        constexpr double kStep = 1e-6;
        const Vector3d o = map->evaluate(p, weights).position;
        const Vector3d a = map->evaluate(p, weights + kStep * Vector3d(-1, 1, 0)).position - o;
        const Vector3d b = map->evaluate(p, weights + kStep * Vector3d(-1, 0, 1)).position - o;
        ++compared;
        agreeing += a.cross(b).normalized().dot(map->evaluate(p, weights).normal) > 0.999 ? 1 : 0;
    });
    ASSERT_GT(compared, 60);
    EXPECT_GE(agreeing, compared * 95 / 100) << "but for a few samples on creases";
}

TEST_P(BuiltinSurfaces, TakesTheNumberOfTrianglesAskedFor)
{
    for (const std::uint64_t asked : {std::uint64_t{20'000}, std::uint64_t{1'000'000}, std::uint64_t{28'000'000}}) {
        const auto map = make(asked);
        const double got = static_cast<double>(map->sourceTriangles());
        EXPECT_NEAR(got / static_cast<double>(asked), 1.0, asked < 100'000 ? 0.25 : 0.06);
        EXPECT_EQ(map->referenceFactor() % 2, 0U);
        EXPECT_LE(map->referenceFactor(), 128U);
        const std::uint64_t each = 3 * std::uint64_t{map->referenceFactor()} * map->referenceFactor() / 2;
        EXPECT_EQ(map->sourceTriangles(), each * map->topology().patches.size());
        const double splits = std::sqrt(static_cast<double>(map->topology().patches.size() / GetParam().patches));
        EXPECT_EQ(splits, std::round(splits));
        const double withFewer = static_cast<double>(GetParam().patches) * (splits - 1) * (splits - 1) * 24576;
        EXPECT_GT(static_cast<double>(asked), withFewer) << "fewer splits would have done";
    }
}

TEST_P(BuiltinSurfaces, SplitPatchesCoverTheSameDomain)
{
    // Corner 0 of the first part is corner 0 of the first patch; the surfaces differ by the finer octaves alone.
    const auto coarse = make(), fine = make(4 * GetParam().triangles);
    const auto source = [](const PatchMap& map, std::uint32_t patch) {
        return Vector3d(map.frame().center + map.frame().scale * map.evaluate(patch, Vector3d::UnitX()).position);
    };
    EXPECT_EQ(fine->topology().patches.size(), 4 * coarse->topology().patches.size());
    for (std::uint32_t p = 0; p < coarse->topology().patches.size(); ++p) {
        EXPECT_LT((source(*coarse, p) - source(*fine, 4 * p)).norm(), 0.02 * coarse->frame().scale) << p;
    }
}

INSTANTIATE_TEST_SUITE_P(All, BuiltinSurfaces,
                         testing::Values(Expected{"asteroid", 20, 491'520, true}, Expected{"bricks", 32, 786'432, false},
                                         Expected{"seashell", 60, 1'474'560, true}, Expected{"glacier", 32, 786'432, false}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(BuiltinSurface, KnowsItsNames)
{
    EXPECT_EQ(builtinSurfaceNames(), (std::vector<std::string>{"asteroid", "bricks", "seashell", "glacier"}));
    try {
        makeBuiltinSurface("teapot");
        FAIL();
    } catch (const AssetError& error) {
        EXPECT_NE(std::string(error.what()).find("teapot"), std::string::npos);
        EXPECT_NE(std::string(error.what()).find("glacier"), std::string::npos);
    }
    EXPECT_THROW(makeBuiltinSurface("asteroid", ~std::uint64_t{0}), AssetError);
}

/// Volume enclosed, by the divergence theorem over a coarse sampling.
double enclosedVolume(const PatchMap& map)
{
    constexpr int kSteps = 24;
    double volume = 0.0;
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        const auto at = [&](int i, int j) { return map.evaluate(p, Vector3d(kSteps - i - j, i, j) / kSteps).position; };
        for (int j = 0; j < kSteps; ++j) {
            for (int i = 0; i + j < kSteps; ++i) {
                volume += at(i, j).dot(at(i + 1, j).cross(at(i, j + 1))) / 6.0;
                if (i + j + 1 < kSteps) { volume += at(i + 1, j).dot(at(i + 1, j + 1).cross(at(i, j + 1))) / 6.0; }
            }
        }
    }
    return volume;
}

TEST(BuiltinSurface, ClosedOnesAreTurnedOutwards)
{
    EXPECT_GT(enclosedVolume(*makeBuiltinSurface("asteroid")), 0.05);
    EXPECT_GT(enclosedVolume(*makeBuiltinSurface("seashell")), 0.005);
}

TEST(BuiltinSurface, AsteroidNormalsPointOutwards)
{
    const auto map = makeBuiltinSurface("asteroid");
    sample(*map, 12, [&](std::uint32_t p, const Vector3d& weights) {
        const SurfacePoint s = map->evaluate(p, weights);
        const Vector3d fromMiddle = map->frame().center + map->frame().scale * s.position;
        EXPECT_GT(s.normal.dot(fromMiddle), 0.0); // star-shaped about the source's origin
    });
}

TEST(BuiltinSurface, BricksOverhang)
{
    const auto map = makeBuiltinSurface("bricks");
    int under = 0, all = 0;
    sample(*map, 64, [&](std::uint32_t p, const Vector3d& weights) {
        under += map->evaluate(p, weights).normal.z() < -0.2 ? 1 : 0;
        ++all;
    });
    EXPECT_GT(under, all / 50);
    EXPECT_LT(under, all / 4);
}

/// Direction away from the middle of the shell's tube, across it, at a source point of the given way from tip to inside:
/// the tube's own normal, whatever thorn stands there and however far it leans along the tube.
Vector3d tubeNormal(const Vector3d& source, double way)
{
    constexpr double kPi = 3.14159265358979323846;
    const double turn = 11.0 * kPi * way; // the lip, at 9/11, ends four turns and a half
    const Vector3d radial(std::cos(turn), std::sin(turn), 0.0), along(-radial.y(), radial.x(), 0.0);
    const double scale = std::pow(1.9, (turn - 9.0 * kPi) / (2.0 * kPi));
    const Vector3d fromMiddle = source - scale * (0.47 * radial - 1.36 * Vector3d::UnitZ());
    return (fromMiddle - along * along.dot(fromMiddle)).normalized();
}

TEST(BuiltinSurface, SeashellThornsFoldOver)
{
    const auto map = makeBuiltinSurface("seashell");
    const auto wayOf = [](std::uint32_t vertex) { return vertex < 30 ? (vertex / 3 + 1) / 11.0 : vertex == 30 ? 0.0 : 1.0; };
    int folded = 0, all = 0;
    sample(*map, 64, [&](std::uint32_t p, const Vector3d& weights) {
        double way = 0.0;
        for (unsigned c = 0; c < 3; ++c) { way += weights[c] * wayOf(map->topology().patches[p][c]); }
        if (way < 0.3 || way > 0.8) { return; } // where there are thorns, outside
        const SurfacePoint s = map->evaluate(p, weights);
        const Vector3d source = map->frame().center + map->frame().scale * s.position;
        folded += s.normal.dot(tubeNormal(source, way)) < -0.05 ? 1 : 0;
        ++all;
    });
    EXPECT_GT(folded, all / 200);
    EXPECT_LT(folded, all / 4);
}

TEST(BuiltinSurface, GlacierIsAHeightField)
{
    const auto map = makeBuiltinSurface("glacier");
    for (std::uint32_t p = 0; p < map->topology().patches.size(); ++p) {
        std::array<SurfacePoint, 3> corners;
        for (unsigned c = 0; c < 3; ++c) { corners[c] = map->evaluate(p, Vector3d::Unit(c)); }
        for (const Vector3d& w : {Vector3d(0.2, 0.3, 0.5), Vector3d(0.7, 0.2, 0.1), Vector3d(0.0, 0.5, 0.5)}) {
            const SurfacePoint s = map->evaluate(p, w);
            const Vector3d flat = w[0] * corners[0].position + w[1] * corners[1].position + w[2] * corners[2].position;
            EXPECT_NEAR(s.position.x(), flat.x(), 1e-14);
            EXPECT_NEAR(s.position.y(), flat.y(), 1e-14);
            EXPECT_GT(s.normal.z(), 0.0);
        }
    }
}

} // namespace
} // namespace osgTessLOD::bake
