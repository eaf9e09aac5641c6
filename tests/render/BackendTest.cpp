// SPDX-License-Identifier: MIT
// Which backend draws, and that it makes no difference to what is drawn.
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/PatternCheck.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <cstdlib>
#include <set>

namespace osgTessLOD {
namespace {

class BackendChoice : public GlTest {
protected:
    std::optional<Backend> chosen(Backend wanted)
    {
        const osg::ref_ptr<PatchSelection> selection =
            new PatchSelection(asset.get(), {}, SelectionStatistics(), SelectionView(), wanted);
        return selection->backend(renderInfo);
    }

    osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticAsset(16, true));
};

TEST_F(BackendChoice, followsWhatIsAskedFor)
{
    EXPECT_EQ(chosen(Backend::Tessellation), Backend::Tessellation);
    EXPECT_EQ(chosen(Backend::Instanced), Backend::Instanced);
    EXPECT_FALSE(DrawContext::of(state()).fastestBackend()) << "nothing had to be tried for that";
}

TEST_F(BackendChoice, isTriedOncePerContext)
{
    const std::optional<Backend> first = chosen(Backend::Auto);
    ASSERT_TRUE(first);
    EXPECT_NE(*first, Backend::Auto);
    EXPECT_EQ(DrawContext::of(state()).fastestBackend(), first);
    const Backend other = *first == Backend::Instanced ? Backend::Tessellation : Backend::Instanced;
    DrawContext::of(state()).setFastestBackend(other);
    EXPECT_EQ(chosen(Backend::Auto), other) << "what is remembered counts";
}

TEST_F(BackendChoice, trialShowsNothing)
{
    glClearColor(0.25F, 0.5F, 0.75F, 1.0F);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glReadBuffer(GL_FRONT);
    chosen(Backend::Auto);
    for (int x = 0; x < 64; x += 9) {
        std::array<unsigned char, 4> pixel{};
        float depth = 0.0F;
        glReadPixels(x, x, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
        glReadPixels(x, x, 1, 1, GL_DEPTH_COMPONENT, GL_FLOAT, &depth);
        EXPECT_EQ(pixel[0], 64);
        EXPECT_EQ(depth, 1.0F);
    }
}

TEST_F(BackendChoice, instancesDrawWhereTheTessellatorsPatternIsAnother)
{
    std::multiset<unsigned> checked;
    DrawContext::of(state()).setPatternCheck([&](osg::State&, unsigned factor) {
        checked.insert(factor);
        return factor != 4;
    });
    {
        const WarningCollector collector;
        for (const Backend wanted : {Backend::Auto, Backend::Tessellation, Backend::Instanced, Backend::Tessellation}) {
            EXPECT_EQ(chosen(wanted), Backend::Instanced) << nameOf(wanted);
        }
        EXPECT_NE(collector.text().find("another pattern of factor 4"), std::string::npos) << collector.text();
        EXPECT_EQ(collector.text().find("another pattern"), collector.text().rfind("another pattern"))
            << "once is enough";
    }
    EXPECT_EQ(checked, (std::multiset<unsigned>{1, 2, 4}));
    std::vector<PatchRecord> records = asset->selector().uniformRecords(3).vector();
    EXPECT_EQ(capture(*asset, records).size(), 3U * 8U * 96U);
}

TEST_F(BackendChoice, everyFactorOfALadderIsCheckedOnce)
{
    std::multiset<unsigned> checked;
    DrawContext::of(state()).setPatternCheck([&](osg::State& at, unsigned factor) {
        checked.insert(factor);
        return driverMakesPattern(at, factor);
    });
    const osg::ref_ptr<GpuAsset> other = makeGpuAsset(synthetic::build(synthetic::bumpySphere(), {2, 6, 10}, false));
    for (const auto& a : {asset, other, asset}) {
        EXPECT_TRUE(DrawContext::of(state()).canTessellate(state(), a->asset().ladder));
    }
    EXPECT_EQ(checked, (std::multiset<unsigned>{1, 2, 4, 6, 8, 10, 16}));
}

/// How many are more than `more` apart.
std::size_t differingBytes(const osg::Image& a, const osg::Image& b, int more)
{
    std::size_t count = 0;
    for (unsigned k = 0; k < a.getTotalSizeInBytes(); ++k) {
        count += std::abs(a.data()[k] - b.data()[k]) > more ? 1 : 0;
    }
    return count;
}

/// Whole frames by each backend. Positions are the same bits, but a triangle's corners may come in another order, and what is
/// interpolated between them then differs in the last places: pixels in one grey, those on edges in which triangle has them.
TEST(BackendPictures, areTheSame)
{
    const WarningCollector warnings;
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticDisplacedAsset(32, true)));
    std::vector<osg::ref_ptr<const osg::Image>> pictures;
    osgViewer::Viewer viewer;
    viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
    setUpHeadless(*viewer.getCamera(), 200, 200);
    const osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    viewer.getCamera()->setFinalDrawCallback(snapshot.get());
    viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(4.0, 1.0, 2.0), osg::Vec3d(), osg::Vec3d(0.0, 0.0, 1.0));
    viewer.setSceneData(drawable.get());
    viewer.realize();
    viewer.renderingTraversals(); // a viewer's first frame is brighter
    for (const double errorPixels : {0.5, 3.0, 20.0}) {
        pictures.clear();
        for (const Backend backend : {Backend::Tessellation, Backend::Instanced, Backend::Auto}) {
            SelectionOptions options;
            options.errorPixels = errorPixels;
            options.backend = backend;
            drawable->setOptions(options);
            viewer.renderingTraversals();
            pictures.push_back(new osg::Image(snapshot->image()));
        }
        for (const auto& picture : pictures) {
            ASSERT_EQ(picture->getTotalSizeInBytes(), 200U * 200U * 3U);
            EXPECT_LE(differingBytes(*picture, *pictures.front(), 1), 3U);
        }
    }
    EXPECT_EQ(warnings.text(), "");
}

} // namespace
} // namespace osgTessLOD
