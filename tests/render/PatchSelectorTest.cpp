// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>

#include <asset/SyntheticAsset.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

namespace osgTessLOD {
namespace {

SelectionView viewFrom(const osg::Vec3d& eye, double pixelScale = 1000.0)
{
    SelectionView view;
    view.eye = eye;
    view.pixelScale = pixelScale;
    return view;
}

SelectionOptions asking(double errorPixels)
{
    SelectionOptions options;
    options.errorPixels = errorPixels;
    return options;
}

SelectionOptions askingFirstOrder(double errorPixels)
{
    SelectionOptions options = asking(errorPixels);
    options.bound = SelectionOptions::Bound::FirstOrder;
    return options;
}

/// All ways to select.
std::vector<SelectionOptions> waysToSelect(double errorPixels)
{
    std::vector<SelectionOptions> ways;
    for (const auto metric : {SelectionOptions::Metric::View, SelectionOptions::Metric::Isotropic}) {
        for (const auto bound : {SelectionOptions::Bound::Conservative, SelectionOptions::Bound::FirstOrder}) {
            ways.push_back(asking(errorPixels));
            ways.back().metric = metric;
            ways.back().bound = bound;
        }
    }
    return ways;
}

/// Error of every patch at level k: 0.5 / factor². Edges are about 1 from the origin.
const LodAsset& sphere()
{
    static const LodAsset asset = makeSyntheticAsset(16, false);
    return asset;
}

TEST(PatchSelector, takesTheLowestLevelThatIsGoodEnough)
{
    const PatchSelector selector(sphere());
    // At distance d, level k's error is 1000 · 0.5 / factor² / d pixels. Asking for just that gives level k.
    for (std::uint32_t edge = 0; edge < sphere().edges.size(); ++edge) {
        const SelectionView view = viewFrom({0.0, 0.0, 100.0});
        for (unsigned k = 0; k < sphere().ladder.size(); ++k) {
            // Orthographic: no distance to know.
            SelectionView flat = view;
            flat.orthographic = true;
            const double error = 1000.0 * static_cast<double>(sphere().levels[k].errors[0].isotropic);
            EXPECT_FLOAT_EQ(selector.edgeLevel(edge, flat, askingFirstOrder(error)).level, static_cast<float>(k));
        }
    }
}

TEST(PatchSelector, interpolatesLinearlyInTheError)
{
    const PatchSelector selector(sphere());
    SelectionView view = viewFrom({0.0, 0.0, 0.0}, 1.0);
    view.orthographic = true;
    const double coarse = sphere().levels[1].errors[0].isotropic;
    const double fine = sphere().levels[2].errors[0].isotropic;
    const auto level = selector.edgeLevel(0, view, askingFirstOrder(0.25 * coarse + 0.75 * fine));
    EXPECT_NEAR(level.level, 1.75, 1e-6); // Lambert eq. 2.11
    EXPECT_FALSE(level.saturated);
}

TEST(PatchSelector, levelsFallWithTheErrorAndTheDistance)
{
    const PatchSelector selector(sphere());
    for (std::uint32_t edge = 0; edge < sphere().edges.size(); ++edge) {
        float last = std::numeric_limits<float>::max();
        for (double error = 0.01; error < 1000.0; error *= 1.1) {
            const float level = selector.edgeLevel(edge, viewFrom({3.0, 2.0, 1.0}), asking(error)).level;
            EXPECT_LE(level, last);
            last = level;
        }
        EXPECT_EQ(last, 0.0F);
        last = std::numeric_limits<float>::max();
        for (double distance = 2.0; distance < 1e5; distance *= 1.1) {
            const float level =
                selector.edgeLevel(edge, viewFrom(osg::Vec3d(3.0, 2.0, 1.0) * distance), asking(1.0)).level;
            EXPECT_LE(level, last);
            last = level;
        }
        EXPECT_EQ(last, 0.0F);
    }
}

TEST(PatchSelector, levelsAreContinuousEvenWhereErrorsAreEqual)
{
    LodAsset asset = makeSyntheticAsset(16, false);
    asset.levels[1].errors = asset.levels[0].errors;
    asset.levels[3].errors = asset.levels[2].errors;
    for (LevelError& error : asset.levels[4].errors) { error = LevelError(); } // exact
    const PatchSelector selector(asset);
    SelectionView view = viewFrom({}, 1.0);
    view.orthographic = true;
    float last = selector.edgeLevel(0, view, asking(1e-3)).level;
    for (double error = 1e-3; error < 1.0; error += 1e-5) {
        const float level = selector.edgeLevel(0, view, asking(error)).level;
        // The steepest piece runs through one level within a tenth of the finer error, 0.03: 1e-5 is 0.0033 levels.
        EXPECT_NEAR(level, last, 0.01) << error;
        last = level;
    }
    EXPECT_EQ(last, 0.0F);
}

TEST(PatchSelector, exactLevelsNeedNothingFiner)
{
    LodAsset asset = makeSyntheticAsset(16, false);
    for (std::size_t k = 1; k < asset.levels.size(); ++k) {
        for (LevelError& error : asset.levels[k].errors) { error = LevelError(); }
    }
    const PatchSelector selector(asset);
    const auto demanding = selector.edgeLevel(0, viewFrom({2.0, 0.0, 0.0}), asking(1e-9));
    EXPECT_NEAR(demanding.level, 1.0, 1e-6);
    EXPECT_FALSE(demanding.saturated);
    for (LevelError& error : asset.levels[0].errors) { error = LevelError(); }
    EXPECT_EQ(PatchSelector(asset).edgeLevel(0, viewFrom({2.0, 0.0, 0.0}), asking(0.0)).level, 0.0F);
}

TEST(PatchSelector, countsSaturatedPatches)
{
    const PatchSelector selector(sphere());
    const auto enough = selector.select(viewFrom({100.0, 0.0, 0.0}), asking(1.0), {});
    EXPECT_EQ(enough.statistics.saturatedPatches, 0U);
    const auto tooFew = selector.select(viewFrom({3.0, 0.0, 0.0}), asking(1e-6), {});
    EXPECT_EQ(tooFew.statistics.saturatedPatches, 8U);
    EXPECT_EQ(tooFew.statistics.triangles, 8U * 384U);
    EXPECT_EQ(tooFew.statistics.patchesByLevel, (std::vector<std::uint64_t>{0, 0, 0, 0, 8}));
}

TEST(PatchSelector, maxFactorCapsAndSaturates)
{
    const PatchSelector selector(sphere());
    for (unsigned maxFactor : {0U, 1U, 3U, 4U, 64U}) {
        SelectionOptions options = asking(1e-6);
        options.maxFactor = maxFactor;
        const auto result = selector.select(viewFrom({3.0, 0.0, 0.0}), options, {});
        const float expected = maxFactor < 2 ? 0.0F : maxFactor < 4 ? 1.0F : maxFactor == 4 ? 2.0F : 4.0F;
        for (const PatchRecord& record : result.records) { EXPECT_EQ(record.edgeLevels[0], expected); }
        EXPECT_EQ(result.statistics.saturatedPatches, 8U);
    }
}

TEST(PatchSelector, neverExceedsAnEdgesFinestLevel)
{
    const LodAsset asset = makeSyntheticMixedAsset(16);
    const PatchSelector selector(asset);
    for (const PatchRecord& record : selector.select(viewFrom({2.0, 0.0, 0.0}), asking(1e-6), {}).records) {
        for (std::size_t side = 0; side < 3; ++side) {
            EXPECT_EQ(record.edgeLevels[side], asset.edges[asset.patches[record.patch].edges[side]].finestLevel);
        }
    }
}

/// Asset whose patches end at different levels as a bake leaves them: each is next to exact at its finest.
LodAsset exactAtFinest(LodAsset asset)
{
    for (std::size_t k = 0; k < asset.levels.size(); ++k) {
        const std::vector<std::uint32_t> slots = asset.levelSlots(k);
        for (std::size_t p = 0; p < slots.size(); ++p) {
            if (asset.patches[p].finestLevel == k) { asset.levels[k].errors[slots[p]].isotropic = 1e-6F; }
        }
    }
    return asset;
}

/// The patch's own error at a continuous level, linear between levels.
double errorAt(const LodAsset& asset, std::uint32_t patch, float level)
{
    const auto at = [&](std::size_t k) {
        return static_cast<double>(asset.levels[k].errors[asset.levelSlots(k)[patch]].isotropic);
    };
    const double coarse = std::floor(static_cast<double>(level));
    const auto k = static_cast<std::size_t>(coarse);
    const double t = static_cast<double>(level) - coarse;
    return t > 0.0 ? (1.0 - t) * at(k) + t * at(k + 1) : at(k);
}

/// What each patch needs at its borders, by the isotropic error: simple enough to be computed here anew.
SelectionOptions askingIsotropicAtBorders(double errorPixels)
{
    SelectionOptions options = askingFirstOrder(errorPixels);
    options.metric = SelectionOptions::Metric::Isotropic;
    return options;
}

TEST(PatchSelector, patchesAreFineEnoughAlsoWhereTheirBordersEndBeforeThem)
{
    const LodAsset asset = exactAtFinest(
        synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(16), false, {4, 1, 4, 2, 0, 4, 3, 4}));
    ASSERT_NO_THROW(asset.validate());
    const PatchSelector selector(asset);
    const MorphedSurface surface(asset);
    std::mt19937 random(5);
    std::normal_distribution<double> coordinate;
    std::size_t beyondTheirBorders = 0;
    std::size_t carried = 0; // patches of which one border alone has the level that another one needs
    for (int trial = 0; trial < 400; ++trial) {
        osg::Vec3d eye(coordinate(random), coordinate(random), coordinate(random));
        eye *= (1.02 + 0.3 * std::fabs(coordinate(random))) / eye.length();
        const double errorPixels = std::exp(2.0 + coordinate(random));
        const auto result = selector.select(viewFrom(eye), askingIsotropicAtBorders(errorPixels), {});
        EXPECT_EQ(result.statistics.saturatedPatches, 0U);
        for (const PatchRecord& record : result.records) {
            const LodPatch& patch = asset.patches[record.patch];
            const float drawn = *std::max_element(record.edgeLevels.begin(), record.edgeLevels.end());
            for (std::uint32_t side = 0; side < 3; ++side) {
                const LodEdge& edge = asset.edges[patch.edges[side]];
                ASSERT_LE(record.edgeLevels[side], edge.finestLevel);
                const auto finest = static_cast<float>(edge.finestLevel);
                const unsigned factor = asset.ladder[edge.finestLevel];
                const std::uint32_t middle = (side * factor + factor / 2) % (3 * factor);
                auto at = surface.tessLodSurfacePoint(record.patch, {finest, finest, finest}, middle).position;
                if (factor == 1) {
                    const auto next =
                        surface.tessLodSurfacePoint(record.patch, {finest, finest, finest}, (side + 1) % 3).position;
                    for (std::size_t k = 0; k < 3; ++k) { at[k] = 0.5F * (at[k] + next[k]); }
                }
                const double bound = errorPixels * (eye - osg::Vec3d(at[0], at[1], at[2])).length() / 1000.0;
                EXPECT_LE(errorAt(asset, record.patch, drawn), bound * (1.0 + 1e-5))
                    << "patch " << record.patch << ", side " << side;
                beyondTheirBorders += drawn > finest ? 1 : 0;
                carried += errorAt(asset, record.patch, std::min(finest, drawn)) > bound ? 1 : 0;
            }
        }
    }
    EXPECT_GT(beyondTheirBorders, 100U);
    EXPECT_GT(carried, 100U);
}

TEST(PatchSelector, aPatchThatEndsSaturatesByItself)
{
    LodAsset asset = exactAtFinest(
        synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(16), false, {4, 1, 4, 4, 4, 4, 4, 4}));
    asset.levels[1].errors[1].isotropic = 0.01F;
    SelectionView view = viewFrom({}, 1.0);
    view.orthographic = true;
    const PatchSelector selector(asset);
    EXPECT_EQ(selector.select(view, askingIsotropicAtBorders(0.02), {}).statistics.saturatedPatches, 0U);
    EXPECT_EQ(selector.select(view, askingIsotropicAtBorders(0.005), {}).statistics.saturatedPatches, 1U);
}

TEST(PatchSelector, levelsAreContinuousWhereBordersEnd)
{
    const LodAsset asset = exactAtFinest(makeSyntheticMixedAsset(16));
    const PatchSelector selector(asset);
    SelectionView view = viewFrom({}, 1.0);
    view.orthographic = true;
    for (std::uint32_t edge = 0; edge < asset.edges.size(); ++edge) {
        float last = selector.edgeLevel(edge, view, askingIsotropicAtBorders(1e-3)).level;
        for (double error = 1e-3; error < 1.0; error += 1e-5) {
            const float level = selector.edgeLevel(edge, view, askingIsotropicAtBorders(error)).level;
            EXPECT_NEAR(level, last, 0.15) << "edge " << edge << ", error " << error; // a tenth of 1e-3 is 10 steps
            last = level;
        }
    }
}

TEST(PatchSelector, anOrthographicViewDoesNotCareWhereTheEyeIs)
{
    const PatchSelector selector(sphere());
    SelectionView near = viewFrom({1.0, 0.0, 0.0}, 100.0);
    SelectionView far = viewFrom({1e6, 0.0, 0.0}, 100.0);
    near.orthographic = true;
    far.orthographic = true;
    for (std::uint32_t edge = 0; edge < sphere().edges.size(); ++edge) {
        EXPECT_EQ(selector.edgeLevel(edge, near, asking(2.0)).level, selector.edgeLevel(edge, far, asking(2.0)).level);
    }
}

/// That all patches of the sphere get levels that they have, however they are selected.
void expectLevels(const PatchSelector& selector, const SelectionView& view, double errorPixels)
{
    for (const SelectionOptions& options : waysToSelect(errorPixels)) {
        const auto result = selector.select(view, options, {});
        ASSERT_EQ(result.records.size(), 8U);
        for (const PatchRecord& record : result.records) {
            for (float level : record.edgeLevels) {
                EXPECT_GE(level, 0.0F);
                EXPECT_LE(level, 4.0F);
            }
        }
    }
}

TEST(PatchSelector, strangeViewsGiveFiniteLevels)
{
    const PatchSelector selector(sphere());
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    for (double eye : {0.0, 1.0, 1e-30, 1e30, 1e200, kInfinity, kNan}) {
        for (double scale : {0.0, 1e-300, 1.0, 1e300, kInfinity, kNan}) {
            for (double error : {-1.0, 0.0, 1.0, 1e300, kInfinity, kNan}) {
                SelectionView view = viewFrom({eye, 0.0, 0.0}, scale);
                expectLevels(selector, view, error);
                view.axis.z() = eye;
                view.leastCosine = eye;
                expectLevels(selector, view, error);
                view.orthographic = true;
                expectLevels(selector, view, error);
            }
        }
    }
}

TEST(PatchSelector, withoutAViewportEverythingIsAtLevelZero)
{
    const auto result = PatchSelector(sphere()).select(viewFrom({2.0, 0.0, 0.0}, 0.0), asking(1.0), {});
    EXPECT_EQ(result.statistics.patchesByLevel, (std::vector<std::uint64_t>{8, 0, 0, 0, 0}));
}

TEST(PatchSelector, theEyeOnAnEdgesCentreIsSafe)
{
    // The middle of the border between base vertices (1,0,0) and (0,1,0), approached and reached.
    const PatchSelector selector(sphere());
    const MorphedSurface surface(sphere());
    const auto center = surface.tessLodSurfacePoint(0, {4.0F, 4.0F, 4.0F}, 8).position;
    const auto level =
        selector.edgeLevel(sphere().patches[0].edges[0], viewFrom({center[0], center[1], center[2]}), asking(1.0));
    EXPECT_EQ(level.level, 4.0F);
    EXPECT_TRUE(level.saturated);
}

TEST(PatchSelector, cullsWhatIsOutsideAndLeavesLevelsAlone)
{
    const PatchSelector selector(sphere());
    const SelectionView view = viewFrom({4.0, 3.0, 2.0});
    const auto all = selector.select(view, asking(2.0), {});
    std::map<std::uint32_t, std::array<float, 3>> levels;
    for (const PatchRecord& record : all.records) { levels[record.patch] = record.edgeLevels; }

    // x ≥ 0.6, not of unit length: keeps the patches of corner (1,0,0) only.
    const std::vector<osg::Plane> frustum{osg::Plane(10.0, 0.0, 0.0, -6.0)};
    const auto part = selector.select(view, asking(2.0), frustum);
    EXPECT_GE(part.records.size(), 4U);
    EXPECT_LT(part.records.size(), 8U);
    EXPECT_EQ(part.statistics.patches, part.records.size());
    EXPECT_EQ(part.statistics.culledPatches, 8 - part.records.size());
    for (const PatchRecord& record : part.records) {
        EXPECT_EQ(record.edgeLevels, levels[record.patch]);
        levels.erase(record.patch);
    }
    for (const auto& [patch, unused] : levels) {
        const LodPatch& culled = sphere().patches[patch];
        EXPECT_LT(culled.boundCenter[0] + culled.boundRadius, 0.6F);
    }

    SelectionOptions keepAll = asking(2.0);
    keepAll.cullPatches = false;
    EXPECT_EQ(selector.select(view, keepAll, frustum).records.size(), 8U);
}

// ---- by direction, tree and view

/// A sheet of 200 patches over (0,0) to (10,10), each with the errors of difference vectors of its own: long ones in the left
/// half, which tell directions apart. Every fifth patch is two levels short.
const LodAsset& unevenSheet()
{
    static const LodAsset asset = [] {
        std::vector<std::uint8_t> finest(200, 4);
        for (std::size_t p = 0; p < finest.size(); p += 5) { finest[p] = 2; }
        LodAsset made = synthetic::build(synthetic::wavySheet(10), synthetic::powersOfTwo(16), false, finest);
        std::mt19937 random(11);
        std::normal_distribution<float> normal;
        for (std::size_t level = 0; level < made.levels.size(); ++level) {
            for (LevelError& error : made.levels[level].errors) {
                const float size =
                    0.05F * std::exp2(-2.0F * static_cast<float>(level)) * std::exp(0.3F * normal(random));
                const float x = 0.3F * size * normal(random);
                const float z = size;
                const float small = 0.01F * size * size; // |v × d|² plus some: Q = |v|² I − v vᵀ
                error.quadratic.q = {z * z + small, x * x + z * z + small, x * x + small, 0.0F, -x * z, 0.0F};
                error.isotropic = std::sqrt(x * x + z * z + small);
            }
        }
        return made;
    }();
    return asset;
}

/// Views of the sheet from near and far, wide and narrow, and orthographic ones; with the sides of the view.
struct SheetView {
    SelectionView view;
    std::vector<osg::Plane> frustum;
};

SheetView randomSheetView(std::mt19937& random)
{
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    const osg::Vec3d target(uniform(-5.0, 15.0), uniform(-5.0, 15.0), 0.0);
    osg::Vec3d direction(uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-0.2, 1.0));
    direction.normalize();
    const double distance = std::pow(10.0, uniform(-1.0, 4.5));
    const osg::Matrixd look = osg::Matrixd::lookAt(target + direction * distance, target, osg::Vec3d(0.3, 0.2, 0.1));
    osg::Matrixd projection = osg::Matrixd::perspective(uniform(3.0, 140.0), 1.5, 0.01, 1e6);
    if (uniform(0.0, 1.0) < 0.2) {
        projection = osg::Matrixd::ortho(-distance, distance, -distance, distance, 0.01, 1e6);
    }
    const osg::Matrixd clip = look * projection;
    const auto side = [&](int axis, double sign) {
        return osg::Plane(clip(0, 3) + sign * clip(0, axis), clip(1, 3) + sign * clip(1, axis),
                          clip(2, 3) + sign * clip(2, axis), clip(3, 3) + sign * clip(3, axis));
    };
    return {makeSelectionView(look, projection, 900.0, 600.0),
            {side(0, 1.0), side(0, -1.0), side(1, 1.0), side(1, -1.0)}};
}

bool isInView(const LodPatch& patch, const std::vector<osg::Plane>& frustum)
{
    const osg::Vec3d center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
    for (osg::Plane plane : frustum) {
        plane.makeUnitLength();
        if (plane.distance(center) < -static_cast<double>(patch.boundRadius)) { return false; }
    }
    return true;
}

TEST(PatchSelector, selectsWhatEveryEdgeAndPatchByItselfAsksFor)
{
    const LodAsset& asset = unevenSheet();
    const PatchSelector selector(asset);
    std::mt19937 random(1);
    std::size_t culled = 0;
    std::map<std::size_t, std::size_t> levelsInUse; // how many views use so many levels
    for (int k = 0; k < 300; ++k) {
        const SheetView sheet = randomSheetView(random);
        for (const SelectionOptions& options : waysToSelect(1.0)) {
            std::map<std::uint32_t, std::array<float, 3>> expected;
            for (std::uint32_t p = 0; p < asset.patches.size(); ++p) {
                if (!isInView(asset.patches[p], sheet.frustum)) { continue; }
                for (std::size_t side = 0; side < 3; ++side) {
                    expected[p][side] = selector.edgeLevel(asset.patches[p].edges[side], sheet.view, options).level;
                }
            }
            const auto result = selector.select(sheet.view, options, sheet.frustum);
            std::map<std::uint32_t, std::array<float, 3>> selected;
            for (const PatchRecord& record : result.records) { selected[record.patch] = record.edgeLevels; }
            ASSERT_EQ(selected, expected) << "view " << k;
            EXPECT_EQ(result.statistics.patches + result.statistics.culledPatches, asset.patches.size());
            culled += result.statistics.culledPatches;
            const auto& byLevel = result.statistics.patchesByLevel;
            ++levelsInUse[byLevel.size() - static_cast<std::size_t>(std::count(byLevel.begin(), byLevel.end(), 0U))];
        }
    }
    EXPECT_GT(culled, 10000U);
    EXPECT_GT(levelsInUse[0], 5U) << "nothing in view";
    EXPECT_GT(levelsInUse[1], 50U) << "one level everywhere";
    EXPECT_GT(levelsInUse[3] + levelsInUse[4], 50U);
}

TEST(PatchSelector, errorsAsSeenAskForNoMoreThanIsotropicOnes)
{
    const PatchSelector selector(unevenSheet());
    std::mt19937 random(2);
    double saved = 0.0;
    for (int k = 0; k < 200; ++k) {
        const SelectionView view = randomSheetView(random).view;
        for (SelectionOptions options : waysToSelect(1.0)) {
            for (std::uint32_t edge = 0; edge < unevenSheet().edges.size(); ++edge) {
                options.metric = SelectionOptions::Metric::View;
                const float seen = selector.edgeLevel(edge, view, options).level;
                options.metric = SelectionOptions::Metric::Isotropic;
                const float isotropic = selector.edgeLevel(edge, view, options).level;
                ASSERT_LE(seen, isotropic);
                saved += static_cast<double>(isotropic - seen);
            }
        }
    }
    EXPECT_GT(saved, 1000.0);
}

TEST(PatchSelector, seenFromAboveWhatMovesUpAndDownNeedsLess)
{
    const PatchSelector selector(unevenSheet());
    for (const SelectionOptions& options : waysToSelect(1.0)) {
        const bool tellsApart = options.metric == SelectionOptions::Metric::View;
        const auto above = selector.select(viewFrom({5.0, 5.0, 60.0}), options, {}).statistics;
        const auto beside = selector.select(viewFrom({65.0, 5.0, 0.0}), options, {}).statistics;
        EXPECT_EQ(2 * above.triangles < beside.triangles, tellsApart) << above.triangles << " " << beside.triangles;
    }
}

TEST(PatchSelector, levelsAreContinuousInAllOfTheView)
{
    constexpr double kStep = 1e-8;
    const LodAsset& asset = unevenSheet();
    const PatchSelector selector(asset);
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::size_t between = 0;
    for (int k = 0; k < 300; ++k) {
        const SelectionView view = randomSheetView(random).view;
        SelectionView moved = view;
        const double scale = view.orthographic ? 1.0 : std::max(view.eye.z(), 0.05);
        for (int axis = 0; axis < 3; ++axis) {
            moved.eye[axis] += kStep * scale * normal(random);
            moved.axis[axis] += kStep * normal(random);
        }
        moved.axis.normalize();
        moved.pixelScale *= 1.0 + kStep;
        moved.leastCosine *= 1.0 - kStep;
        for (const SelectionOptions& options : waysToSelect(1.0)) {
            for (std::uint32_t edge = 0; edge < asset.edges.size(); ++edge) {
                const float level = selector.edgeLevel(edge, view, options).level;
                // Slopes: 11 in the tolerance, which falls by the distance from spheres and the cosine; 1e4 is ample.
                ASSERT_NEAR(level, selector.edgeLevel(edge, moved, options).level, 1e4 * kStep) << "view " << k;
                between += level != std::floor(level) ? 1 : 0;
            }
        }
    }
    EXPECT_GT(between, 10000U) << "nothing could have jumped";
}

TEST(PatchSelector, withTheEyeInItsSphereAPatchIsAtItsFinest)
{
    const LodPatch& patch = unevenSheet().patches[42];
    const PatchSelector selector(unevenSheet());
    const osg::Vec3d center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
    for (const double part : {0.0, 0.5, 0.999}) {
        const SelectionView view = viewFrom(center + osg::Vec3d(0.0, 0.0, part * double{patch.boundRadius}), 1e-3);
        for (const std::uint32_t edge : patch.edges) {
            const auto level = selector.edgeLevel(edge, view, asking(1.0));
            EXPECT_EQ(level.level, static_cast<float>(unevenSheet().edges[edge].finestLevel));
            EXPECT_TRUE(level.saturated);
        }
    }
}

TEST(PatchSelector, seamsStayAtTheirLevelWhateverTheView)
{
    const LodAsset asset = withSeams(makeSyntheticSheet(16, 4, false));
    ASSERT_NO_THROW(asset.validate());
    const PatchSelector selector(asset);
    const MorphedSurface surface(asset);
    const auto expectSeams = [&](const PatchRecords& records) {
        ASSERT_EQ(records.size(), asset.patches.size());
        for (const PatchRecord& record : records) {
            const unsigned drawn = asset.ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
            for (std::uint32_t side = 0; side < 3; ++side) {
                const LodEdge& edge = asset.edges[asset.patches[record.patch].edges[side]];
                if (edge.patches[1] != kNoPatch) { continue; }
                ASSERT_EQ(record.edgeLevels[side], static_cast<float>(edge.coarsestLevel));
                // What is drawn along it are the vertices of that level, all of them.
                const auto finest = static_cast<float>(edge.coarsestLevel);
                std::set<std::array<float, 3>> expected;
                const unsigned factor = asset.ladder[edge.coarsestLevel];
                for (unsigned step = 0; step <= factor; ++step) {
                    const std::uint32_t index = (side * factor + step) % (3 * factor);
                    expected.insert(surface.tessLodSurfacePoint(record.patch, {finest, finest, finest}, index).position);
                }
                std::set<std::array<float, 3>> found;
                for (unsigned step = 0; step <= drawn; ++step) {
                    const std::uint32_t index = (side * drawn + step) % (3 * drawn);
                    found.insert(surface.tessLodSurfacePoint(record.patch, record.edgeLevels, index).position);
                }
                ASSERT_EQ(found, expected);
            }
        }
    };
    for (const double distance : {0.1, 1.5, 20.0, 1e4, 1e30}) {
        for (const double errorPixels : {1e-3, 1.0, 300.0, 1e30}) {
            for (SelectionOptions options : waysToSelect(errorPixels)) {
                for (const unsigned maxFactor : {64U, 4U, 1U}) {
                    options.maxFactor = maxFactor;
                    const auto result = selector.select(viewFrom({0.1, -0.2, distance}), options, {});
                    expectSeams(result.records);
                    EXPECT_EQ(result.statistics.triangles, selector.statisticsOf(result.records).triangles);
                }
            }
        }
    }
    for (unsigned level = 0; level < asset.ladder.size(); ++level) {
        expectSeams(selector.uniformRecords(level));
        EXPECT_EQ(selector.uniformStatistics(level).triangles,
                  selector.statisticsOf(selector.uniformRecords(level)).triangles);
    }
}

TEST(PatchSelector, groupsRecordsByLevel)
{
    const auto result = PatchSelector(sphere()).select(viewFrom({1.3, 0.2, 0.1}), asking(30.0), {});
    unsigned last = 0;
    for (const PatchRecord& record : result.records) {
        const unsigned level = MorphedSurface::drawnLevel(record.edgeLevels);
        EXPECT_GE(level, last);
        last = level;
    }
    EXPECT_GT(last, MorphedSurface::drawnLevel(result.records.front().edgeLevels)); // a view of several levels
}

TEST(MorphedSurface, weightsAreWhereThePositionIs)
{
    // On a plane positions are linear in the weights: at any levels, the one must be at the place of the other.
    synthetic::Shape shape = synthetic::wavySheet(1);
    shape.surface = [](const synthetic::Point& p) { return p; };
    const LodAsset asset = synthetic::build(shape, synthetic::powersOfTwo(16), false, {}, true);
    asset.validate();
    const MorphedSurface surface(asset);
    double largestShift = 0.0;
    for (const std::array<float, 3>& levels : {std::array<float, 3>{2.0F, 2.0F, 2.0F},
                                               {3.0F, 3.0F, 3.0F},
                                               {2.3F, 2.3F, 2.3F},
                                               {0.4F, 1.0F, 2.6F},
                                               {3.9F, 1.2F, 0.0F}}) {
        const unsigned factor = asset.ladder[MorphedSurface::drawnLevel(levels)];
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            for (std::uint32_t patch = 0; patch < 2; ++patch) {
                const auto point = surface.tessLodSurfacePoint(patch, levels, v);
                const TessellationPattern::Barycentric b = TessellationPattern::barycentric(factor, v);
                for (std::size_t k = 0; k < 3; ++k) {
                    double expected = 0.0;
                    for (std::size_t c = 0; c < 3; ++c) {
                        expected += double{point.weights[c]} * shape.base[asset.patches[patch].baseVertices[c]][k];
                    }
                    EXPECT_NEAR(point.position[k], expected, 2e-5) << "patch " << patch << ", vertex " << v;
                    largestShift = std::max(largestShift, std::fabs(double{point.weights[k]} - b[k] / (3.0 * factor)));
                }
            }
        }
    }
    EXPECT_GT(largestShift, 0.1); // or the test shows little
}

TEST(MorphedSurface, borderLevelsReachTheirLimits)
{
    const MorphedSurface surface(sphere());
    for (std::uint32_t patch = 0; patch < 8; ++patch) {
        // A level just above k is k's surface: each vertex at its parent.
        const float justAbove = std::nextafter(2.0F, 3.0F);
        const std::uint32_t fineCount = TessellationPattern::vertexCount(8);
        const std::uint32_t slot = sphere().levelSlots(3)[patch];
        for (std::uint32_t v = 0; v < fineCount; ++v) {
            const std::uint32_t parent = sphere().levels[3].vertices[slot * fineCount + v].parent();
            const auto fine = surface.tessLodSurfacePoint(patch, {justAbove, justAbove, justAbove}, v).position;
            const auto coarse = surface.tessLodSurfacePoint(patch, {2.0F, 2.0F, 2.0F}, parent).position;
            for (std::size_t k = 0; k < 3; ++k) { EXPECT_NEAR(fine[k], coarse[k], 1e-6); }
        }
    }
}

} // namespace
} // namespace osgTessLOD
