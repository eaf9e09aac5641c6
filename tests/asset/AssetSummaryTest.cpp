// SPDX-License-Identifier: MIT
#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/AssetSummary.h>

#include <gtest/gtest.h>

namespace osgTessLOD {
namespace {

TEST(AssetSummary, countsPatchesWhereTheyEnd)
{
    LodAsset asset = synthetic::build(synthetic::bumpySphere(), {1, 2, 4}, false, {2, 0, 0, 1, 2, 0, 0, 0});
    asset.levels[1].errors[1].isotropic = 0.25F; // of patch 3, the second that reaches level 1, which ends there
    asset.levels[1].errors[2].isotropic = 0.5F;  // of patch 4, which goes on
    asset.levels[0].errors.assign(8, LevelError());
    const AssetSummary summary = summarize(asset);
    ASSERT_EQ(summary.levels.size(), 3U);
    const auto expectLevel = [&](std::size_t l, std::uint64_t patches, std::uint64_t finest, std::uint64_t vertices,
                                 std::uint64_t triangles) {
        EXPECT_EQ(summary.levels[l].factor, asset.ladder[l]);
        EXPECT_EQ(summary.levels[l].patches, patches);
        EXPECT_EQ(summary.levels[l].finestPatches, finest);
        EXPECT_EQ(summary.levels[l].vertices, vertices);
        EXPECT_EQ(summary.levels[l].triangles, triangles);
    };
    expectLevel(0, 8, 5, 8 * 3, 8);
    expectLevel(1, 3, 1, 3 * 7, 3 * 6);
    expectLevel(2, 2, 2, 2 * 19, 2 * 24);
    EXPECT_EQ(summary.finestVertices, 5U * 3 + 7 + 2 * 19);
    EXPECT_EQ(summary.finestTriangles, 5U + 6 + 2 * 24);
    EXPECT_EQ(summary.levels[1].largestError, 0.5);
    EXPECT_NEAR(summary.levels[1].meanError, (0.5 + 0.25 + double{asset.levels[1].errors[0].isotropic}) / 3.0, 1e-12);
    EXPECT_EQ(summary.largestFinestError, 0.25);
}

TEST(AssetSummary, levelsThatNoPatchReachesAreEmpty)
{
    const AssetSummary summary =
        summarize(synthetic::build(synthetic::bumpySphere(), {1, 2}, false, {0, 0, 0, 0, 0, 0, 0, 0}));
    EXPECT_EQ(summary.levels[1].patches, 0U);
    EXPECT_EQ(summary.levels[1].triangles, 0U);
    EXPECT_EQ(summary.levels[1].meanError, 0.0);
    EXPECT_EQ(summary.finestTriangles, 8U);
}

} // namespace
} // namespace osgTessLOD
