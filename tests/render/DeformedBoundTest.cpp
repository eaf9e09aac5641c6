// SPDX-License-Identifier: MIT
// What selection promises of a deformed surface: by the CPU twin of the shaders against charts that are deformed point by point.
#include <render/Poses.h>

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
    std::shared_ptr<LodAsset> asset = std::make_shared<LodAsset>();
    osg::ref_ptr<GpuAsset> gpuAsset;
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
    *baked.asset = bake::assembleAsset(*baked.surface.map, baked.surface.charts, baked.surface.hierarchy,
                                       options.tolerance, progress);
    baked.gpuAsset = new GpuAsset(baked.asset);
    baked.deviation = std::make_unique<ScreenDeviation>(baked.surface, *baked.asset);
    return baked;
}

/// The asset's length is `size`; motions are made for one of 2.
Motion scaledTo(double size, const Motion& motion)
{
    return [=](const osg::Vec3d& at, double time) {
        return osg::Matrixd::scale(osg::Vec3d(2.0, 2.0, 2.0) / size) * motion(at * (2.0 / size), time) *
               osg::Matrixd::scale(osg::Vec3d(1.0, 1.0, 1.0) * (size / 2.0));
    };
}

double sizeOf(const LodAsset& asset)
{
    double size = 0.0;
    for (std::size_t k = 0; k < 3; ++k) { size = std::max(size, double{asset.boundsMax[k]} - asset.boundsMin[k]); }
    return size;
}

/// As `asset`, where the deformation has its corners: what cameras look at.
LodAsset posedFrame(const LodAsset& asset, const ControlMeshDeformation& deformation)
{
    LodAsset frame = asset;
    for (std::size_t k = 0; k < 3; ++k) {
        frame.boundsMin[k] = deformation.bounds()._min[static_cast<int>(k)];
        frame.boundsMax[k] = deformation.bounds()._max[static_cast<int>(k)];
    }
    return frame;
}

struct Worst {
    double ratio = 0.0;
    std::size_t patches = 0;
    std::size_t refined = 0; ///< of them above the coarsest level
    std::mt19937_64 random{11};

    /// Over what is in view and not saturated.
    void add(const BakedSurface& baked, const ControlMeshDeformation& deformation, const ScreenCamera& camera,
             const SelectionOptions& options)
    {
        const SelectionView view = camera.view();
        const PatchSelector& selector = deformation.selector();
        for (const PatchRecord& record : selector.select(view, options, camera.sides()).records) {
            if (hasSaturatedBorder(*baked.asset, selector, record.patch, view, options)) { continue; }
            const double overlaid = baked.deviation->pixels(record, camera, &deformation);
            const double sampled = baked.deviation->sample(record, camera, 100, random, &deformation).pixels;
            ratio = std::max({ratio, overlaid / options.errorPixels, sampled / options.errorPixels});
            ++patches;
            refined += MorphedSurface::drawnLevel(record.edgeLevels) > 0 ? 1 : 0;
        }
    }
};

// Vertices are drawn in single precision: some 10⁻⁷ of their coordinates and moves, 3 · 10⁻⁵ of an error of 1 % of the model.
constexpr double kRounding = 3e-5;

class DeformedBound : public testing::TestWithParam<const char*> {};

TEST_P(DeformedBound, NoPointOnScreenIsFurtherOffThanAsked)
{
    const BakedSurface baked = bakeSurface(GetParam(), 16);
    const double size = sizeOf(*baked.asset);
    for (const Motion& motion : {Motion(waves), Motion(bending), Motion(turning)}) {
        for (const auto metric : {SelectionOptions::Metric::View, SelectionOptions::Metric::Isotropic}) {
            Worst worst;
            SelectionOptions options;
            options.metric = metric;
            for (unsigned k = 0; k < 60; ++k) {
                const osg::ref_ptr<ControlMeshDeformation> deformation =
                    deformed(*baked.gpuAsset, scaledTo(size, motion), 0.1 * k);
                const LodAsset frame = posedFrame(*baked.asset, *deformation);
                RandomCameras cameras(frame, k);
                for (unsigned view = 0; view < 6; ++view) {
                    options.errorPixels = view % 3 == 0 ? 0.5 : view % 3 == 1 ? 1.0 : 4.0;
                    worst.add(baked, *deformation, cameras.next(), options);
                }
            }
            EXPECT_LE(worst.ratio, 1.0 + kRounding);
            EXPECT_GT(worst.ratio, 0.6) << "tight enough to mean something";
            EXPECT_GT(worst.refined, 200U);
        }
    }
}

TEST_P(DeformedBound, HoldsWhereEveryVertexGoesItsOwnWay)
{
    const BakedSurface baked = bakeSurface(GetParam(), 8);
    Worst worst;
    SelectionOptions options;
    for (unsigned k = 0; k < 60; ++k) {
        const osg::ref_ptr<ControlMeshDeformation> deformation = wildlyDeformed(*baked.gpuAsset, k);
        const LodAsset frame = posedFrame(*baked.asset, *deformation);
        RandomCameras cameras(frame, k);
        for (const double errorPixels : {4.0, 30.0}) {
            options.errorPixels = errorPixels;
            for (int view = 0; view < 5; ++view) { worst.add(baked, *deformation, cameras.next(), options); }
        }
    }
    EXPECT_LE(worst.ratio, 1.0 + kRounding);
    EXPECT_GT(worst.patches, 50U);
}

INSTANTIATE_TEST_SUITE_P(Surfaces, DeformedBound, testing::Values("asteroid", "bricks", "glacier", "seashell"),
                         [](const testing::TestParamInfo<const char*>& parameter) { return parameter.param; });

} // namespace
} // namespace osgTessLOD
