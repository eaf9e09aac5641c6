// SPDX-License-Identifier: MIT
// What of an asset is on the GPU: what was needed, within limits, and surfaces without cracks meanwhile.
#include <render/ClosedSurface.h>
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/VideoMemory.h>

#include <support/TemporaryDirectory.h>

#include <osg/FrameStamp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <set>
#include <sstream>
#include <string>
#include <vector>

namespace osgTessLOD {
namespace {

/// Every test begins and ends without limits.
struct LimitsGuard {
    LimitsGuard() { VideoMemory::shared().setLimits({}); }
    ~LimitsGuard() { VideoMemory::shared().setLimits({}); }
    LimitsGuard(const LimitsGuard&) = delete;
    LimitsGuard& operator=(const LimitsGuard&) = delete;
};

PageDetail detailOf(const AssetPages& pages)
{
    PageDetail detail;
    for (const auto& page : pages.resident()) { detail = PageDetail::both(detail, page->detail); }
    return detail;
}

std::string bytesOf(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

constexpr int kSize = 160;
constexpr double kFar = 1000.0;

class VideoMemoryView : public testing::TestWithParam<Backend> {
protected:
    VideoMemoryView()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        SelectionOptions options;
        options.backend = GetParam();
        options.errorPixels = 0.02; // so few pixels do not need the finest levels otherwise
        drawable->setOptions(options);
        viewer.setSceneData(drawable.get());
        viewer.realize();
        lookFrom(kFar);
    }

    void lookFrom(double distance)
    {
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(0.0, -distance, 0.2 * distance), osg::Vec3d(),
                                                  osg::Vec3d(0.0, 0.0, 1.0));
    }
    const AssetPages& pages()
    {
        return *drawable->getGpuAsset()->pagesFor(*viewer.getCamera()->getGraphicsContext()->getState());
    }
    std::vector<unsigned char> picture()
    {
        viewer.frame();
        const osg::Image& image = snapshot->image();
        return {image.data(), image.data() + image.getTotalSizeInBytes()};
    }

    LimitsGuard guard;
    std::shared_ptr<const LodAsset> asset = std::make_shared<const LodAsset>(makeSyntheticAsset(64, true));
    osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osgViewer::Viewer viewer;
};

TEST_P(VideoMemoryView, levelsComeWhenTheyAreNeededAndStay)
{
    lookFrom(kFar);
    viewer.frame();
    EXPECT_EQ(detailOf(pages()), pages().least(0)) << "the least will do from afar";
    lookFrom(20.0);
    viewer.frame();
    const PageDetail some = detailOf(pages());
    EXPECT_GT(some.levels, pages().least(0).levels);
    EXPECT_LT(some.levels, pages().whole().levels);
    lookFrom(3.0);
    viewer.frame();
    EXPECT_EQ(detailOf(pages()), pages().whole());
    lookFrom(kFar);
    viewer.frame();
    EXPECT_EQ(detailOf(pages()), pages().whole());
}

TEST_P(VideoMemoryView, picturesAreThoseOfAllThatThereIs)
{
    std::vector<std::vector<unsigned char>> onDemand;
    const std::vector<double> distances{60.0, 30.0, 15.0, 8.0, 4.0};
    viewer.setSceneData(new TessLODDrawable(asset)); // the first picture of a context may be brighter
    lookFrom(10.0);
    picture();
    viewer.setSceneData(drawable.get());
    for (const double distance : distances) {
        lookFrom(distance);
        onDemand.push_back(picture());
    }
    EXPECT_EQ(detailOf(pages()), pages().whole());
    for (std::size_t k = 0; k < distances.size(); ++k) {
        lookFrom(distances[k]);
        EXPECT_EQ(picture(), onDemand[k]) << distances[k];
    }
}

TEST_P(VideoMemoryView, aBudgetOfBytesBringsCoarseLevelsFirstAndAllInTheEnd)
{
    picture();
    const std::uint64_t step = pages().bytes(0, pages().whole()) / 5;
    VideoMemory::shared().setLimits({step, VideoMemory::Limits::kNone});
    lookFrom(3.0);
    PageDetail before = pages().least(0);
    viewer.frame();
    EXPECT_EQ(detailOf(pages()), before) << "there is no more before the next frame";
    EXPECT_GT(VideoMemory::shared().statistics().waitingPages, 0U);
    unsigned frames = 0;
    for (; frames < 10 && VideoMemory::shared().statistics().waitingPages > 0; ++frames) {
        viewer.frame();
        const PageDetail after = detailOf(pages());
        EXPECT_TRUE(after.covers(before));
        EXPECT_TRUE(after.levels <= before.levels + 1 || pages().bytes(0, after) <= step) << frames;
        before = after;
    }
    EXPECT_EQ(before, pages().whole());
    EXPECT_GT(frames, 1U) << "it takes more than one frame's budget";
    const std::vector<unsigned char> slow = picture();
    VideoMemory::shared().setLimits({});
    EXPECT_EQ(picture(), slow);
}

TEST_P(VideoMemoryView, whatIsNotDrawnGivesWayAndComesBack)
{
    const osg::ref_ptr<TessLODDrawable> other = new TessLODDrawable(asset);
    other->setOptions(drawable->getOptions());
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(drawable.get());
    scene->addChild(other.get());
    viewer.setSceneData(scene.get());
    other->setNodeMask(0);
    lookFrom(3.0);
    picture();
    const std::uint64_t whole = pages().bytes(0, pages().whole());
    const std::uint64_t limit = whole + whole / 2;
    VideoMemory::shared().setLimits({VideoMemory::Limits::kNone, limit});
    const auto turn = [&](bool first) {
        drawable->setNodeMask(first ? ~0U : 0U);
        other->setNodeMask(first ? 0U : ~0U);
        for (int k = 0; k < 4; ++k) {
            viewer.frame();
            EXPECT_LE(VideoMemory::shared().statistics().bytes, limit);
        }
        const auto* of = first ? drawable.get() : other.get();
        const AssetPages& shown = *of->getGpuAsset()->pagesFor(*viewer.getCamera()->getGraphicsContext()->getState());
        EXPECT_EQ(detailOf(shown), shown.whole());
    };
    turn(false);
    EXPECT_EQ(detailOf(pages()), pages().least(0));
    turn(true);
    drawable->setNodeMask(~0U);
    other->setNodeMask(~0U);
    for (int k = 0; k < 6; ++k) {
        viewer.frame();
        EXPECT_LE(VideoMemory::shared().statistics().bytes, limit) << "not even where both are wanted whole";
    }
}

/// The same asset, read from a file as it is needed.
class StreamedView : public VideoMemoryView {
protected:
    StreamedView()
    {
        writeTlod(path, *asset);
        source = std::make_shared<const StreamedAsset>(path, StreamedAsset::Options{true, 0});
        streamed->setStreamedAsset(source);
        streamed->setOptions(drawable->getOptions());
        viewer.setSceneData(drawable.get());
        lookFrom(10.0);
        picture(); // the first picture of a context may be brighter
    }

    /// Of the asset that is all there.
    std::vector<unsigned char> expected()
    {
        viewer.setSceneData(drawable.get());
        std::vector<unsigned char> made = picture();
        viewer.setSceneData(streamed.get());
        return made;
    }
    PageDetail read() const { return {source->levelsRead(), source->normalsRead()}; }
    const AssetPages& streamedPages()
    {
        return *streamed->getGpuAsset()->pagesFor(*viewer.getCamera()->getGraphicsContext()->getState());
    }

    const TemporaryDirectory folder;
    const std::string path = folder.file("streamed.tlod");
    std::shared_ptr<const StreamedAsset> source;
    osg::ref_ptr<TessLODDrawable> streamed = new TessLODDrawable;
};

TEST_P(StreamedView, readsWhatIsDrawnAndNoMore)
{
    EXPECT_EQ(read(), streamedPages().least(0)) << "to begin with";
    for (const double distance : {kFar, 20.0, 3.0, kFar}) {
        lookFrom(distance);
        EXPECT_EQ(expected(), picture()) << distance;
        EXPECT_EQ(read(), detailOf(streamedPages())) << distance;
        EXPECT_EQ(read() == streamedPages().whole(), distance < 20.0 || detailOf(pages()) == pages().whole()) << distance;
    }
    EXPECT_EQ(bytesOf(*streamed->getAsset()), bytesOf(*asset));
}

TEST_P(StreamedView, underLimitsReadsMeanwhile)
{
    lookFrom(3.0);
    const std::vector<unsigned char> whole = expected();
    VideoMemory::shared().setLimits({std::uint64_t{1} << 40, VideoMemory::Limits::kNone});
    unsigned frames = 0;
    do {
        const PageDetail before = read();
        viewer.frame();
        EXPECT_TRUE(before == PageDetail::common(before, detailOf(streamedPages())) || frames == 0 ||
                    before.covers(detailOf(streamedPages())))
            << frames;
        source->read(read().levels, read().normals); // waits for what is being read
    } while (VideoMemory::shared().statistics().waitingPages > 0 && ++frames < 1000);
    EXPECT_GT(frames, 2U);
    EXPECT_EQ(picture(), whole);
}

TEST_P(StreamedView, showsWhatItHasWhereTheFileIsGone)
{
    viewer.setSceneData(streamed.get());
    lookFrom(20.0);
    picture();
    const PageDetail before = read();
    ASSERT_FALSE(before == streamedPages().whole());
    std::filesystem::remove(path);
    lookFrom(3.0);
    for (int k = 0; k < 3; ++k) {
        const std::vector<unsigned char> shown = picture();
        EXPECT_TRUE(std::any_of(shown.begin(), shown.end(), [&](unsigned char c) { return c != shown.front(); }));
        EXPECT_EQ(detailOf(streamedPages()), before);
        EXPECT_EQ(streamedPages().whole(), before);
    }
    EXPECT_THROW(streamed->getAsset(), AssetError);
    EXPECT_NE(streamed->getPickingSurface(), nullptr) << "of what there is";
    EXPECT_EQ(streamed->getPickingSurface()->level(), before.levels - 1);
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, StreamedView, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

INSTANTIATE_TEST_SUITE_P(EveryBackend, VideoMemoryView, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

class VideoMemorySurface : public GlTest, public testing::WithParamInterface<Backend> {
protected:
    VideoMemorySurface() { backend = GetParam(); }

    LimitsGuard guard;
};

/// A page per patch, each with a different number of levels there, as a budget leaves them half way.
TEST_P(VideoMemorySurface, isClosedWhileItsPagesFill)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticAsset(64, false));
    DrawContext::of(state()).limitTextureBufferTexels(1);
    const AssetPages& pages = *asset->pagesFor(state());
    ASSERT_EQ(pages.size(), asset->asset().patches.size());
    const std::uint64_t whole = pages.bytes(0, pages.whole());
    VideoMemory::shared().setLimits({2 * whole / 3, VideoMemory::Limits::kNone});
    const osg::ref_ptr<osg::FrameStamp> frames = new osg::FrameStamp;
    state().setFrameStamp(frames.get());
    const auto finest = static_cast<float>(asset->asset().ladder.size() - 1);
    std::vector<PatchRecord> records;
    for (std::uint32_t p = 0; p < pages.size(); ++p) { records.push_back({p, {finest, finest, finest}}); }
    std::set<std::size_t> sizes;
    std::size_t mixed = 0;
    for (unsigned frame = 0; frame < 40; ++frame) {
        frames->setFrameNumber(frame);
        const std::vector<osg::Vec3f> captured = capture(*asset, records);
        EXPECT_FALSE(captured.empty());
        EXPECT_EQ(unmatchedEdges(captured), 0U) << frame;
        EXPECT_EQ(capture(*asset, records), captured) << "the same all through a frame";
        sizes.insert(captured.size());
        std::set<unsigned> levels;
        for (const auto& page : pages.resident()) { levels.insert(page->detail.levels); }
        mixed += levels.size() > 1 ? 1 : 0;
    }
    state().setFrameStamp(nullptr);
    DrawContext::of(state()).limitTextureBufferTexels(std::numeric_limits<std::int64_t>::max());
    EXPECT_GT(sizes.size(), 3U);
    EXPECT_GT(mixed, 3U);
    EXPECT_EQ(detailOf(pages), pages.whole());
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, VideoMemorySurface, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

} // namespace
} // namespace osgTessLOD
