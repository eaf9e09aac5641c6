// SPDX-License-Identifier: MIT
// What selection promises of what is drawn, measured on baked surfaces: by the CPU twin of the shaders against the charts.
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <support/ScreenDeviation.h>

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>

namespace osgTessLOD {
namespace {

struct BakedSurface {
    bake::PatchedSurface surface;
    LodAsset asset;
    std::unique_ptr<PatchSelector> selector;
    std::unique_ptr<ScreenDeviation> deviation;
};

BakedSurface bakeSurface(const std::string& name, unsigned maxFactor)
{
    bake::BakeOptions options;
    options.maxFactor = maxFactor;
    options.normals = false;
    bake::Progress progress;
    bake::BakeReport report;
    BakedSurface baked;
    baked.surface = bake::makeLevels("builtin:" + name, options, progress, report);
    baked.asset =
        bake::assembleAsset(*baked.surface.map, baked.surface.charts, baked.surface.hierarchy, options.tolerance, progress);
    baked.selector = std::make_unique<PatchSelector>(baked.asset);
    baked.deviation = std::make_unique<ScreenDeviation>(baked.surface, baked.asset);
    return baked;
}

/// The largest deviation in terms of the one asked for, over views and patches, and how many patches that was of.
struct Worst {
    double ratio = 0.0;
    std::size_t patches = 0;
    std::size_t refined = 0; ///< of them above the coarsest level
    std::mt19937_64 random{11};

    /// Over what is in view and not saturated.
    void add(const BakedSurface& baked, const ScreenCamera& camera, const SelectionOptions& options)
    {
        const SelectionView view = camera.view();
        for (const PatchRecord& record : baked.selector->select(view, options, camera.sides()).records) {
            if (hasSaturatedBorder(baked.asset, *baked.selector, record.patch, view, options)) { continue; }
            ratio = std::max(ratio, baked.deviation->pixels(record, camera) / options.errorPixels);
            ratio = std::max(ratio, baked.deviation->sample(record, camera, 50, random).pixels / options.errorPixels);
            ++patches;
            refined += MorphedSurface::drawnLevel(record.edgeLevels) > 0 ? 1 : 0;
        }
    }
};

// Vertices are drawn in single precision: some 10⁻⁷ of their coordinates, 10⁻⁵ of an error of 1 % of the model.
constexpr double kRounding = 1e-5;

class Bound : public testing::TestWithParam<const char*> {};

TEST_P(Bound, NoPointOnScreenIsFurtherOffThanAsked)
{
    const BakedSurface baked = bakeSurface(GetParam(), 8);
    for (const auto metric : {SelectionOptions::Metric::View, SelectionOptions::Metric::Isotropic}) {
        SelectionOptions options;
        options.metric = metric;
        RandomCameras cameras(baked.asset, 7);
        Worst worst;
        for (unsigned k = 0; k < 400; ++k) {
            options.errorPixels = k % 3 == 0 ? 0.5 : k % 3 == 1 ? 1.0 : 4.0;
            worst.add(baked, cameras.next(), options);
        }
        EXPECT_LE(worst.ratio, 1.0 + kRounding);
        EXPECT_GT(worst.ratio, 0.8) << "tight enough to mean something";
        EXPECT_GT(worst.refined, 500U);
    }
}

TEST_P(Bound, HoldsNearWhereThePatchesAreSeenFromTheirBestSide)
{
    // A patch that fills the view, seen from where the middle of it shows the least error: at its ends it shows more.
    const BakedSurface baked = bakeSurface(GetParam(), 8);
    std::mt19937 random(3);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    Worst worst;
    for (std::size_t p = 0; p < baked.asset.patches.size(); ++p) {
        const LodPatch& patch = baked.asset.patches[p];
        const osg::Vec3d center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
        for (std::size_t level = 0; level + 1 < baked.asset.levels.size(); ++level) {
            const LevelError& error = baked.asset.levels[level].errors[p];
            osg::Vec3d best;
            for (unsigned k = 0; k < 500; ++k) {
                osg::Vec3d d(uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0));
                d.normalize();
                const auto at = [&](const osg::Vec3d& x) { return error.quadratic.evaluate({x.x(), x.y(), x.z()}); };
                if (k == 0 || at(d) < at(best)) { best = d; }
            }
            for (const double distance : {1.3, 2.0, 4.0}) {
                ScreenCamera camera;
                camera.width = camera.height = 1000.0;
                camera.projection.makePerspective(100.0, 1.0, 0.001, 100.0);
                camera.localToEye = osg::Matrixd::lookAt(center + best * double{patch.boundRadius} * distance, center,
                                                         osg::Vec3d(best.y(), best.z(), best.x()));
                SelectionOptions options;
                const double largest = camera.view().pixelScale * error.isotropic / (patch.boundRadius * distance);
                for (const double part : {0.1, 0.2, 0.3, 0.5, 0.8}) {
                    options.errorPixels = part * largest;
                    worst.add(baked, camera, options);
                }
            }
        }
    }
    EXPECT_LE(worst.ratio, 1.0 + kRounding);
    EXPECT_GT(worst.ratio, 0.6);
    EXPECT_GT(worst.refined, 500U);
}

INSTANTIATE_TEST_SUITE_P(Surfaces, Bound, testing::Values("asteroid", "bricks", "glacier", "seashell"),
                         [](const testing::TestParamInfo<const char*>& parameter) { return parameter.param; });

} // namespace
} // namespace osgTessLOD
