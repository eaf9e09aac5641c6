// SPDX-License-Identifier: MIT
// Selection in the control shader: the levels of PatchSelector, a closed surface, the same pictures.
#include <render/CapturedInstead.h>
#include <render/ClosedSurface.h>
#include <render/GlTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/ShaderSelection.h>

#include <osg/Vec3d>

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace osgTessLOD {
namespace {

using Options = SelectionOptions;

class Random {
public:
    explicit Random(unsigned seed)
        : _generator(seed)
    {
    }
    double between(double from, double to) { return std::uniform_real_distribution<double>(from, to)(_generator); }
    osg::Vec3d direction()
    {
        std::normal_distribution<double> normal;
        osg::Vec3d d(normal(_generator), normal(_generator), normal(_generator));
        d.normalize();
        return d;
    }

private:
    std::mt19937 _generator;
};

struct Kind {
    Options::Bound bound;
    Options::Metric metric;
    bool orthographic;
};

std::vector<Kind> allKinds()
{
    std::vector<Kind> kinds;
    for (const Options::Bound bound : {Options::Bound::Conservative, Options::Bound::FirstOrder}) {
        for (const Options::Metric metric : {Options::Metric::View, Options::Metric::Isotropic}) {
            for (const bool orthographic : {false, true}) { kinds.push_back({bound, metric, orthographic}); }
        }
    }
    return kinds;
}

/// Of all of a model about the origin, from within a patch of it to far away.
SelectionRequest randomRequest(const Kind& kind, Random& random)
{
    SelectionRequest request;
    request.view.orthographic = kind.orthographic;
    request.view.eye = random.direction() * (1.0 + std::exp(random.between(-4.0, 4.0)));
    request.view.axis = random.direction() * 0.3 - request.view.eye / request.view.eye.length();
    request.view.axis.normalize();
    request.view.leastCosine = random.between(0.3, 0.99);
    request.view.pixelScale = kind.orthographic ? std::exp(random.between(2.0, 6.0)) : 1000.0;
    request.options.bound = kind.bound;
    request.options.metric = kind.metric;
    request.options.errorPixels = std::exp(random.between(-1.5, 5.0));
    request.options.maxFactor = random.between(0.0, 1.0) < 0.2 ? 8 : 64;
    request.options.cullPatches = false;
    return request;
}

/// Ends at different levels, so that borders end before their patches.
LodAsset assetOfManyReaches()
{
    return synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(32), false, {5, 2, 1, 5, 0, 3, 2, 4},
                            true);
}

std::vector<LodAsset> closedAssets()
{
    return {makeSyntheticAsset(32, false), makeSyntheticMixedAsset(32), assetOfManyReaches(),
            synthetic::build(synthetic::bumpySphere(), {1, 2, 4, 6, 8, 12, 16, 24, 32}, false)};
}

class ShaderSelectionGl : public GlTest {
protected:
    using EdgeLevels = std::array<float, 3>;

    std::vector<osg::Vec3f> capture(const GpuAsset& asset, const SelectionRequest& request,
                                    const std::string& varying = "tessLodObjectPosition")
    {
        const osg::ref_ptr<PatchSelection> selection = new PatchSelection(&asset, request);
        return selection->capture(renderInfo, varying);
    }

    /// Of the patches that are drawn. The asset's programs put out levels and patches.
    std::map<std::uint32_t, EdgeLevels> levelsOf(const GpuAsset& asset, const SelectionRequest& request)
    {
        const std::vector<osg::Vec3f> levels = capture(asset, request, "tessLodObjectPosition");
        const std::vector<osg::Vec3f> patches = capture(asset, request, "tessLodEyePosition");
        EXPECT_EQ(levels.size(), patches.size());
        std::map<std::uint32_t, EdgeLevels> found;
        for (std::size_t k = 0; k < std::min(levels.size(), patches.size()); ++k) {
            const EdgeLevels here{levels[k].x(), levels[k].y(), levels[k].z()};
            const auto patch = static_cast<std::uint32_t>(patches[k].x());
            EXPECT_EQ(found.emplace(patch, here).first->second, here);
        }
        return found;
    }
};

/// A level is 10 or 11 times the difference of an error and a tolerance, relative to the error, or steeper where two errors of
/// FirstOrder are near each other; and GLSL lets a division be off by 2.5 units in the last place, a square root by more.
constexpr double kLevelTolerance = 1e-4;

TEST_F(ShaderSelectionGl, levelsAreTheSelectors)
{
    const CapturedInstead levelsInstead("edgeLevels");
    const CapturedInstead patchesInstead("vec3(float(patchId))", "tessLodEyePosition", "eyePosition.xyz");
    std::size_t between = 0;
    double largest = 0.0;
    std::size_t compared = 0;
    std::size_t different = 0;
    for (const LodAsset& made : closedAssets()) {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(made);
        Random random(1);
        for (const Kind& kind : allKinds()) {
            for (int k = 0; k < 25; ++k) {
                const SelectionRequest request = randomRequest(kind, random);
                const std::map<std::uint32_t, EdgeLevels> levels = levelsOf(*asset, request);
                ASSERT_EQ(levels.size(), made.patches.size());
                std::map<std::uint32_t, float> ofEdges;
                for (const auto& [patch, ofSides] : levels) {
                    for (std::size_t side = 0; side < 3; ++side) {
                        const std::uint32_t edge = made.patches[patch].edges[side];
                        const float expected = asset->selector().edgeLevel(edge, request.view, request.options).level;
                        ASSERT_NEAR(ofSides[side], expected, kLevelTolerance)
                            << "patch " << patch << ", side " << side << ", view " << k;
                        ASSERT_EQ(ofEdges.emplace(edge, ofSides[side]).first->second, ofSides[side]) << edge;
                        between += expected != std::floor(expected) ? 1 : 0;
                        largest = std::max(largest, std::fabs(double(ofSides[side]) - double(expected)));
                        ++compared;
                        different += ofSides[side] != expected ? 1 : 0;
                    }
                }
            }
        }
    }
    EXPECT_GT(between, 1000U); // or the test shows little
}

} // namespace
} // namespace osgTessLOD
