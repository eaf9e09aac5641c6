// SPDX-License-Identifier: MIT
// Selection in the control shader: the levels of PatchSelector, a closed surface, the same pictures.
#include <render/CapturedInstead.h>
#include <render/ClosedSurface.h>
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/ShaderSelection.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <support/RandomDirection.h>

#include <osg/GLExtensions>
#include <osg/Vec3d>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
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
    osg::Vec3d direction() { return randomDirection(_generator); }

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
    std::vector<LodAsset> assets = closedAssets();
    assets.push_back(withSeams(makeSyntheticSheet(16, 2, false)));
    for (const LodAsset& made : assets) {
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
                    }
                }
            }
        }
    }
    EXPECT_GT(between, 1000U); // or the test shows little
}

/// A captured triangle and the levels that its patch is drawn at.
using LeveledTriangle = std::pair<osg::Vec3f, std::array<osg::Vec3f, 3>>;

std::multiset<LeveledTriangle> leveledTriangles(const std::vector<osg::Vec3f>& levels,
                                                const std::vector<osg::Vec3f>& corners)
{
    EXPECT_EQ(levels.size(), corners.size());
    std::multiset<LeveledTriangle> triangles;
    for (std::size_t k = 0; k < std::min(levels.size(), corners.size()); k += 3) {
        std::array<osg::Vec3f, 3> triangle{corners[k], corners[k + 1], corners[k + 2]};
        std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
        triangles.emplace(levels[k], triangle);
    }
    return triangles;
}

TEST_F(ShaderSelectionGl, trianglesAreTheSelectorsAndClosed)
{
    const CapturedInstead levelsInstead("edgeLevels", "tessLodEyePosition", "eyePosition.xyz");
    std::size_t equalLevels = 0;
    std::size_t views = 0;
    std::vector<LodAsset> assets = closedAssets();
    assets.push_back(makeSyntheticDisplacedAsset(16, true));
    assets.push_back(withSeams(makeSyntheticSheet(16, 2, false))); // the only open one
    for (const LodAsset& made : assets) {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(made);
        Random random(2);
        for (const Kind& kind : allKinds()) {
            for (int k = 0; k < 4; ++k, ++views) {
                const SelectionRequest request = randomRequest(kind, random);
                const std::vector<osg::Vec3f> corners = capture(*asset, request);
                if (&made != &assets.back()) { ASSERT_EQ(unmatchedEdges(corners), 0U) << k; }
                const auto drawn = leveledTriangles(capture(*asset, request, "tessLodEyePosition"), corners);
                PatchSelector::Result selected = asset->selector().select(request.view, request.options, {});
                const osg::ref_ptr<PatchSelection> selection = new PatchSelection(
                    asset.get(), selected.records, selected.statistics, request.view, Backend::Tessellation);
                const auto expected = leveledTriangles(selection->capture(renderInfo, "tessLodEyePosition"),
                                                       selection->capture(renderInfo));
                // A level that another rounding makes differ gives other triangles.
                const auto levelsOf = [](const std::multiset<LeveledTriangle>& triangles) {
                    std::set<osg::Vec3f> levels;
                    for (const LeveledTriangle& triangle : triangles) { levels.insert(triangle.first); }
                    return levels;
                };
                if (levelsOf(drawn) != levelsOf(expected)) { continue; }
                ASSERT_EQ(drawn, expected);
                ++equalLevels;
            }
        }
    }
    EXPECT_GT(2 * equalLevels, views); // all of them where rounding is the CPU's
}

TEST_F(ShaderSelectionGl, patchesOutOfViewAreLeftOut)
{
    const CapturedInstead levelsInstead("edgeLevels");
    const CapturedInstead patchesInstead("vec3(float(patchId))", "tessLodEyePosition", "eyePosition.xyz");
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticSheet(8, 6, false));
    const osg::BoundingBox& bounds = asset->bounds();
    Random random(3);
    std::size_t left = 0;
    std::size_t drawnInAll = 0;
    for (const std::size_t planes : {1U, 5U, 8U, 11U}) {
        for (int k = 0; k < 40; ++k) {
            SelectionRequest request = randomRequest(allKinds()[static_cast<std::size_t>(k) % 8], random);
            const std::map<std::uint32_t, EdgeLevels> all = levelsOf(*asset, request);
            request.options.cullPatches = true;
            for (std::size_t p = 0; p < planes; ++p) {
                const osg::Vec3d normal = random.direction();
                const osg::Vec3d through =
                    osg::Vec3d(bounds.center()) - normal * bounds.radius() * random.between(0.0, 0.8);
                request.frustum.emplace_back(normal * random.between(0.1, 10.0), through);
            }
            std::set<std::uint32_t> expected;
            const std::vector<osg::Plane> first(
                request.frustum.begin(),
                request.frustum.begin() + static_cast<std::ptrdiff_t>(std::min(planes, ShaderSelection::kMostPlanes)));
            for (const PatchRecord& record : asset->selector().select(request.view, request.options, first).records) {
                expected.insert(record.patch);
            }
            std::set<std::uint32_t> drawn;
            for (const auto& [patch, levels] : levelsOf(*asset, request)) {
                drawn.insert(patch);
                EXPECT_EQ(levels, all.at(patch)) << "as if all were in view";
            }
            ASSERT_EQ(drawn, expected);
            left += asset->asset().patches.size() - drawn.size();
            drawnInAll += drawn.size();
        }
    }
    EXPECT_GT(left, 1000U);
    EXPECT_GT(drawnInAll, 1000U);
}

TEST_F(ShaderSelectionGl, theCpuSelectsWhereTheShaderCannot)
{
    const auto expectSelectors = [&](GpuAsset& asset, Backend wanted, Backend expected) {
        Random random(4);
        SelectionRequest request = randomRequest(allKinds().front(), random);
        request.options.backend = wanted;
        const osg::ref_ptr<PatchSelection> selection = new PatchSelection(&asset, request);
        EXPECT_EQ(selection->backend(renderInfo), expected);
        std::vector<PatchRecord> records = asset.selector().select(request.view, request.options, {}).records.vector();
        EXPECT_FALSE(records.empty());
        backend = expected;
        EXPECT_EQ(selection->capture(renderInfo), GlTest::capture(asset, records));
        state().apply();
        selection->drawImplementation(renderInfo);
    };
    DrawContext& drawContext = DrawContext::of(state());
    drawContext.limitTextureBufferTexels(1000);
    const osg::ref_ptr<GpuAsset> inPages = makeGpuAsset(makeSyntheticAsset(16, false));
    EXPECT_GT(inPages->pagesFor(state())->size(), 1U);
    EXPECT_EQ(inPages->shaderSelectionFor(state()), nullptr);
    expectSelectors(*inPages, Backend::Tessellation, Backend::Tessellation);

    // Of one level: fewer vertices than there are texels to select by.
    const osg::ref_ptr<GpuAsset> coarse = makeGpuAsset(synthetic::build(synthetic::bumpySphere(), {1}, false));
    drawContext.limitTextureBufferTexels(8 * 6);
    EXPECT_EQ(coarse->pagesFor(state())->size(), 1U);
    EXPECT_EQ(coarse->shaderSelectionFor(state()), nullptr);
    expectSelectors(*coarse, Backend::Tessellation, Backend::Tessellation);

    drawContext.limitTextureBufferTexels(1 << 27);
    EXPECT_NE(inPages->shaderSelectionFor(state()), nullptr) << "now that it fits";
    expectSelectors(*inPages, Backend::Instanced, Backend::Instanced);
    drawContext.setPatternCheck([](osg::State&, unsigned) { return false; });
    const WarningCollector collector; // of the tessellator
    EXPECT_EQ(inPages->shaderSelectionFor(state()), nullptr);
    expectSelectors(*inPages, Backend::Tessellation, Backend::Instanced);
}

TEST_F(ShaderSelectionGl, drawsAgainAfterItsObjectsWereReleased)
{
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    Random random(5);
    SelectionRequest request = randomRequest(allKinds().front(), random);
    request.options.selector = Options::Selector::Gpu;
    drawable->setOptions(request.options);
    drawable->compileGLObjects(renderInfo);
    const std::vector<osg::Vec3f> first = capture(*drawable->getGpuAsset(), request);
    EXPECT_FALSE(first.empty());
    for (osg::State* which : {&state(), static_cast<osg::State*>(nullptr)}) {
        drawable->releaseGLObjects(which);
        osg::flushAllDeletedGLObjects(state().getContextID());
        state().reset();
        state().setCheckForGLErrors(osg::State::ONCE_PER_ATTRIBUTE);
        drawable->resizeGLObjectBuffers(8);
        EXPECT_EQ(capture(*drawable->getGpuAsset(), request), first);
    }
}

TEST_F(ShaderSelectionGl, isCompiledAhead)
{
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    Random random(7);
    SelectionRequest request = randomRequest(allKinds().front(), random);
    request.options.selector = Options::Selector::Gpu;
    drawable->setOptions(request.options);
    drawable->compileGLObjects(renderInfo);
    const osg::ref_ptr<PatchSelection> selection = new PatchSelection(drawable->getGpuAsset(), request);
    const auto* gl = state().get<osg::GLExtensions>();
    const auto namesTaken = [&](auto draw) {
        std::array<GLuint, 2> buffers{};
        const GLuint program = gl->glCreateProgram();
        gl->glGenBuffers(1, &buffers[0]);
        draw();
        gl->glGenBuffers(1, &buffers[1]);
        const GLuint after = gl->glCreateProgram();
        const std::pair<GLuint, GLuint> taken{after - program - 1, buffers[1] - buffers[0] - 1};
        gl->glDeleteProgram(program);
        gl->glDeleteProgram(after);
        gl->glDeleteBuffers(2, buffers.data());
        return taken;
    };
    state().apply();
    const auto [programs, buffers] = namesTaken([&] { selection->drawImplementation(renderInfo); });
    EXPECT_EQ(programs, 0U);
    EXPECT_LE(buffers, 1U) << "the numbers of the patches alone";
    const osg::ref_ptr<PatchSelection> uniform =
        new PatchSelection(drawable->getGpuAsset(), drawable->getGpuAsset()->selector().uniformRecords(1), {},
                           SelectionView(), Backend::Tessellation);
    EXPECT_GT(namesTaken([&] { uniform->drawImplementation(renderInfo); }).first, 0U) << "or the test shows nothing";
}

TEST(ShaderSelection, countsWhatMayBeDrawnAtMost)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticMixedAsset(16));
    Random random(6);
    SelectionRequest request = randomRequest(allKinds().front(), random);
    for (const unsigned maxFactor : {1U, 4U, 64U}) {
        request.options.maxFactor = maxFactor;
        const osg::ref_ptr<PatchSelection> selection = new PatchSelection(asset.get(), request);
        const SelectionStatistics expected = asset->selector().statisticsOf(selection->records());
        EXPECT_TRUE(selection->statistics().isUpperBound);
        EXPECT_EQ(selection->statistics().patches, asset->asset().patches.size());
        EXPECT_EQ(selection->statistics().triangles, expected.triangles);
        EXPECT_EQ(selection->statistics().patchesByLevel, expected.patchesByLevel);
        EXPECT_LE(asset->selector().select(request.view, request.options, {}).statistics.triangles, expected.triangles);
    }
}

/// A viewer of one drawable without a window, and the options of its frames.
class ShaderSelectionPictures : public testing::Test {
protected:
    void show(TessLODDrawable& drawable)
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), 200, 200);
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        drawable.setSelectionObserver(observer.get());
        viewer.setSceneData(&drawable);
        viewer.realize();
        viewer.renderingTraversals(); // a viewer's first frame is brighter
    }

    osg::ref_ptr<const osg::Image> picture(TessLODDrawable& drawable, const Options& options)
    {
        drawable.setOptions(options);
        observer->take();
        viewer.renderingTraversals();
        return new osg::Image(snapshot->image());
    }

    static std::size_t differingBytes(const osg::Image& a, const osg::Image& b)
    {
        std::size_t count = 0;
        for (unsigned k = 0; k < a.getTotalSizeInBytes(); ++k) {
            count += std::abs(a.data()[k] - b.data()[k]) > 1 ? 1 : 0;
        }
        return count;
    }

    const WarningCollector warnings;
    osgViewer::Viewer viewer;
    const osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    const osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
};

/// The triangles are the same, but patches come in another order: a pixel on a shared edge may take its neighbour's grey.
TEST_F(ShaderSelectionPictures, areTheSame)
{
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticDisplacedAsset(32, true)));
    show(*drawable);
    for (const osg::Vec3d& eye : {osg::Vec3d(4.0, 1.0, 2.0), osg::Vec3d(1.5, 0.2, 0.3)}) { // all of it, and a part
        viewer.getCamera()->setViewMatrixAsLookAt(eye, osg::Vec3d(0.0, 0.0, 0.5), osg::Vec3d(0.0, 0.0, 1.0));
        for (const double errorPixels : {0.5, 3.0, 20.0}) {
            for (const auto mode : {osg::CullSettings::COMPUTE_NEAR_FAR_USING_BOUNDING_VOLUMES,
                                    osg::CullSettings::COMPUTE_NEAR_FAR_USING_PRIMITIVES}) {
                viewer.getCamera()->setComputeNearFarMode(mode);
                Options options;
                options.errorPixels = errorPixels;
                options.backend = Backend::Tessellation;
                const osg::ref_ptr<const osg::Image> expected = picture(*drawable, options);
                ASSERT_EQ(observer->take().size(), 1U);
                options.selector = Options::Selector::Gpu;
                const osg::ref_ptr<const osg::Image> found = picture(*drawable, options);
                const std::vector<RecordingObserver::Entry> entries = observer->take();
                ASSERT_EQ(entries.size(), 1U);
                EXPECT_TRUE(entries.front().selection->isSelectedWhenDrawn());
                EXPECT_LE(differingBytes(*found, *expected), 6U);
                options.backend = Backend::Auto;
                EXPECT_EQ(differingBytes(*picture(*drawable, options), *found), 0U);
            }
        }
    }
    EXPECT_EQ(warnings.text(), "");
}

TEST_F(ShaderSelectionPictures, instancesOfEitherKindAreSelectedOnTheCpu)
{
    const auto asset = std::make_shared<const LodAsset>(makeSyntheticAsset(16, true));
    const osg::ref_ptr<TessLODDrawable> plain = new TessLODDrawable(asset);
    const osg::ref_ptr<TessLODInstances> placed = new TessLODInstances(asset);
    placed->setPlacements({osg::Matrixd::translate(0.0, 0.0, 0.5)});
    for (const osg::ref_ptr<TessLODDrawable>& drawable : {plain, osg::ref_ptr<TessLODDrawable>(placed)}) {
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(4.0, 1.0, 2.0), osg::Vec3d(), osg::Vec3d(0.0, 0.0, 1.0));
        if (drawable == plain) {
            show(*drawable);
        } else {
            drawable->setSelectionObserver(observer.get());
            viewer.setSceneData(drawable.get());
        }
        Options options;
        options.selector = Options::Selector::Gpu;
        options.backend = Backend::Instanced;
        picture(*drawable, options);
        const std::vector<RecordingObserver::Entry> entries = observer->take();
        ASSERT_EQ(entries.size(), 1U);
        EXPECT_FALSE(entries.front().selection->isSelectedWhenDrawn());
        EXPECT_FALSE(entries.front().selection->statistics().isUpperBound);
    }
    EXPECT_EQ(warnings.text(), "");
}

} // namespace
} // namespace osgTessLOD
