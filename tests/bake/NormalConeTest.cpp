// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/Triangulation.h>
#include <osgTessLOD/bake/MorphedLevels.h>
#include <osgTessLOD/bake/NormalCone.h>
#include <osgTessLOD/bake/UniformLevels.h>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

const std::vector<std::uint16_t> kLadder{1, 2, 4, 8, 16};

LevelHierarchy makeHierarchy(const char* name)
{
    Progress progress;
    const std::unique_ptr<PatchMap> map = makeBuiltinSurface(name, 20000);
    const ChartSet charts = makeCharts(*map, 32, progress);
    return makeUniformLevels(map->topology(), charts, kLadder, progress);
}

/// The least cosine of any drawn normal and the axis, at random levels.
double leastCosine(const PatchLevels& levels, const FinestLevels& finest, const Vector3d& axis, std::mt19937& random)
{
    const std::vector<std::vector<ChartPoint>> places = [] {
        std::vector<std::vector<ChartPoint>> result;
        for (const std::uint16_t factor : kLadder) { result.push_back(patternPoints(factor)); }
        return result;
    }();
    const auto between = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
    double least = 1.0;
    for (int trial = 0; trial < 60; ++trial) {
        double patchLevel = between(0.0, finest.patch);
        if (trial % 4 == 0) { patchLevel = std::ceil(patchLevel); }
        std::array<double, 3> borders{};
        for (std::size_t side = 0; side < 3; ++side) {
            borders[side] = std::min<double>(trial % 3 == 0 ? patchLevel : between(0.0, patchLevel), finest.borders[side]);
        }
        const MorphedPatch patch = morphPatch(levels, kLadder, places, patchLevel, borders);
        const TessellationPattern pattern(kLadder[static_cast<std::size_t>(std::ceil(patchLevel))]);
        for (const auto& t : pattern.triangles()) {
            const Vector3d& a = patch.positions[t[0]];
            const Vector3d n = (patch.positions[t[1]] - a).cross(patch.positions[t[2]] - a);
            // Slivers of a border far behind are thin to the last digits, and turn by rounding.
            const double longest = std::max((patch.positions[t[1]] - a).norm(), (patch.positions[t[2]] - a).norm());
            if (n.norm() > 1e-9 * longest * longest) { least = std::min(least, n.dot(axis) / n.norm()); }
        }
    }
    return least;
}

class NormalCones : public testing::TestWithParam<const char*> {};

TEST_P(NormalCones, HoldAllThatIsDrawn)
{
    const LevelHierarchy hierarchy = makeHierarchy(GetParam());
    std::mt19937 random(1);
    std::size_t useful = 0;
    double slack = 0.0;
    for (const PatchLevels& levels : hierarchy.patches) {
        for (const FinestLevels& finest : {FinestLevels::all(4), FinestLevels{3, {3, 1, 2}}}) {
            const NormalCone cone = coneOfDrawnNormals(levels, kLadder, finest);
            EXPECT_NEAR(cone.axis.norm(), 1.0, 1e-9);
            if (cone.cosine <= 0.0) { continue; }
            ++useful;
            const double least = leastCosine(levels, finest, cone.axis, random);
            EXPECT_GE(least, cone.cosine - 1e-9);
            slack += std::acos(cone.cosine) - std::acos(std::min(1.0, least));
        }
    }
    RecordProperty("useful", static_cast<int>(useful));
    ASSERT_GT(useful, 0U);
    EXPECT_LT(slack / static_cast<double>(useful), 0.35) << "radians more than what was seen, on average";
}

INSTANTIATE_TEST_SUITE_P(Surfaces, NormalCones, testing::Values("glacier", "seashell"),
                         [](const testing::TestParamInfo<const char*>& parameter) { return parameter.param; });

TEST(NormalCone, ofAPlaneIsItsNormal)
{
    PatchLevels levels;
    levels.positions = {{Vector3d(0, 0, 0), Vector3d(1, 0, 0), Vector3d(0, 1, 0)}};
    levels.parents = {{}};
    const NormalCone cone = coneOfDrawnNormals(levels, {1}, FinestLevels::all(0));
    EXPECT_EQ(cone.axis, Vector3d::UnitZ());
    EXPECT_EQ(cone.cosine, 1.0);
}

} // namespace
} // namespace osgTessLOD::bake
