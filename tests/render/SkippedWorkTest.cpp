// SPDX-License-Identifier: MIT
// What a scene does not need is not done: counted in bytes sent, draws made, buffers and libraries.
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/GLExtensions>
#include <osg/MatrixTransform>

#include <array>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

namespace osgTessLOD {
namespace {

/// Counts what a context's buffers are sent, by taking the place of OpenGL's functions in OSG's table of them.
class SentBytes {
public:
    explicit SentBytes(osg::GLExtensions& gl)
        : _gl(gl)
    {
        s_data = gl.glBufferData;
        s_subData = gl.glBufferSubData;
        gl.glBufferData = countData;
        gl.glBufferSubData = countSubData;
    }
    ~SentBytes()
    {
        _gl.glBufferData = s_data;
        _gl.glBufferSubData = s_subData;
    }
    SentBytes(const SentBytes&) = delete;
    SentBytes& operator=(const SentBytes&) = delete;

    /// Since the last call.
    static std::uint64_t take() { return std::exchange(s_bytes, 0); }

private:
    static void GL_APIENTRY countData(GLenum target, GLsizeiptr size, const GLvoid* data, GLenum usage)
    {
        if (data != nullptr) { s_bytes += static_cast<std::uint64_t>(size); }
        s_data(target, size, data, usage);
    }
    static void GL_APIENTRY countSubData(GLenum target, GLintptr offset, GLsizeiptr size, const GLvoid* data)
    {
        s_bytes += static_cast<std::uint64_t>(size);
        s_subData(target, offset, size, data);
    }

    static inline decltype(osg::GLExtensions::glBufferData) s_data = nullptr;
    static inline decltype(osg::GLExtensions::glBufferSubData) s_subData = nullptr;
    static inline std::uint64_t s_bytes = 0;
    osg::GLExtensions& _gl;
};

constexpr int kSize = 120;
constexpr double kErrorPixels = 0.4; // for levels between the first and the last

class SkippedWork : public testing::TestWithParam<Backend> {
protected:
    SkippedWork()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        for (const osg::ref_ptr<TessLODDrawable>& drawable : drawables) {
            SelectionOptions options;
            options.backend = GetParam();
            options.errorPixels = kErrorPixels;
            drawable->setOptions(options);
            drawable->setSelectionObserver(observer.get());
        }
        const osg::ref_ptr<osg::MatrixTransform> aside =
            new osg::MatrixTransform(osg::Matrixd::translate(3.0, 0.0, 0.0));
        aside->addChild(drawables[1].get());
        root->addChild(drawables[0].get());
        root->addChild(aside.get());
        viewer.setSceneData(root.get());
        viewer.realize();
        lookAt(osg::Vec3d(1.5, 0.0, 0.0));
        for (int k = 0; k < 2; ++k) { viewer.frame(); }
        counter = std::make_unique<SentBytes>(*state().get<osg::GLExtensions>());
        take();
    }

    osg::State& state() { return *viewer.getCamera()->getGraphicsContext()->getState(); }
    void lookAt(const osg::Vec3d& center)
    {
        viewer.getCamera()->setViewMatrixAsLookAt(center + osg::Vec3d(0.0, -20.0, 4.0), center,
                                                  osg::Vec3d(0.0, 0.0, 1.0));
    }

    struct Work {
        std::uint64_t bytes;
        std::uint64_t draws;
        std::uint64_t patches;
    };
    Work take()
    {
        Work work{SentBytes::take(), DrawContext::of(state()).drawCalls() - drawsBefore, 0};
        drawsBefore += work.draws;
        for (const auto& entry : observer->take()) { work.patches += entry.records.size(); }
        return work;
    }
    Work frame()
    {
        viewer.frame();
        return take();
    }

    const std::uint64_t allPatches = 2 * makeSyntheticAsset(8, false).patches.size();
    std::shared_ptr<const LodAsset> asset = std::make_shared<const LodAsset>(makeSyntheticAsset(8, false));
    std::array<osg::ref_ptr<TessLODDrawable>, 2> drawables{new TessLODDrawable(asset), new TessLODDrawable(asset)};
    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
    std::unique_ptr<SentBytes> counter;
    std::uint64_t drawsBefore = 0;
};

TEST_P(SkippedWork, aCameraAtRestSendsNothing)
{
    for (int k = 0; k < 3; ++k) {
        const Work work = frame();
        EXPECT_EQ(work.bytes, 0U) << k;
        EXPECT_GT(work.draws, 0U) << k;
        EXPECT_EQ(work.patches, allPatches) << k;
    }
}

TEST_P(SkippedWork, aCameraThatMovesSendsTheRecordsOfWhatItSees)
{
    std::uint64_t sent = 0;
    std::uint64_t seen = 0;
    for (int k = 0; k < 6; ++k) {
        lookAt(osg::Vec3d(1.5 + 0.01 * k, 0.3 * k, 0.0));
        const Work work = frame();
        EXPECT_LE(work.bytes, work.patches * sizeof(PatchRecord)) << k;
        sent += work.bytes;
        seen += work.patches * sizeof(PatchRecord);
    }
    EXPECT_GT(sent, seen / 2) << "other distances, other levels";
}

TEST_P(SkippedWork, whatWasSeenAFrameAgoIsNotSentAgain)
{
    lookAt(osg::Vec3d(1.5, 6.0, 0.0));
    EXPECT_GT(frame().bytes, 0U);
    lookAt(osg::Vec3d(1.5, 0.0, 0.0)); // and back
    EXPECT_EQ(frame().bytes, 0U);
}

TEST_P(SkippedWork, whatIsOutOfViewCostsNothing)
{
    viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(0.0, -20.0, 0.0), osg::Vec3d(0.0, -40.0, 0.0),
                                              osg::Vec3d(0.0, 0.0, 1.0));
    const Work work = frame();
    EXPECT_EQ(work.bytes, 0U);
    EXPECT_EQ(work.draws, 0U);
    EXPECT_EQ(work.patches, 0U);
}

TEST_P(SkippedWork, whatIsHiddenCostsNothing)
{
    for (const osg::ref_ptr<TessLODDrawable>& drawable : drawables) { drawable->setNodeMask(0); }
    const Work work = frame();
    EXPECT_EQ(work.bytes, 0U);
    EXPECT_EQ(work.draws, 0U);
}

TEST_P(SkippedWork, patchesOutOfViewCostNothing)
{
    Work work{};
    for (const double height : {0.9, 0.91}) { // the second time with the patterns of these levels there
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(0.0, -1.5, height), osg::Vec3d(0.0, 0.0, height),
                                                  osg::Vec3d(0.0, 0.0, 1.0));
        work = frame();
    }
    EXPECT_GT(work.patches, 0U);
    EXPECT_LE(work.patches, allPatches / 2) << "one of the two is out of view";
    EXPECT_LE(work.bytes, work.patches * sizeof(PatchRecord));
}

TEST_P(SkippedWork, buffersStayFewWhileTheCameraMoves)
{
    GLuint before = 0;
    const auto* gl = state().get<osg::GLExtensions>();
    gl->glGenBuffers(1, &before);
    for (int k = 0; k < 40; ++k) {
        lookAt(osg::Vec3d(1.5, 0.1 * k, 0.0));
        frame();
    }
    GLuint after = 0;
    gl->glGenBuffers(1, &after); // a driver counts them up
    EXPECT_LE(after - before, 1 + 2 * (StreamBuffers::kKeptFrames + 1)) << "two drawables";
    gl->glDeleteBuffers(1, &before);
    gl->glDeleteBuffers(1, &after);
}

INSTANTIATE_TEST_SUITE_P(Backends, SkippedWork, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& backend) { return std::string(nameOf(backend.param)); });

/// All that is sent to the GPU of an asset.
std::uint64_t bytesOf(const LodAsset& asset)
{
    const StreamedAsset whole(std::make_shared<const LodAsset>(asset));
    const osg::ref_ptr<AssetPages> pages = new AssetPages(whole, std::int64_t{1} << 27);
    std::uint64_t bytes = 0;
    for (std::size_t k = 0; k < pages->size(); ++k) { bytes += pages->make(k, pages->whole())->bytes(); }
    return bytes;
}

TEST(SkippedBytes, anAssetHasBuffersOfWhatItHasAlone)
{
    const LodAsset plain = makeSyntheticAsset(8, false);
    std::uint64_t vertices = 0;
    for (const LodLevel& level : plain.levels) { vertices += level.vertices.size(); }
    const std::uint64_t table = 4 * plain.patches.size() * (3 + plain.levels.size());
    EXPECT_EQ(bytesOf(plain), 8 * vertices + table);
    EXPECT_EQ(bytesOf(withAttributes(plain)), (8 + 4 + 4) * vertices + table) << "texture coordinates and colours";

    const LodAsset shaded = makeSyntheticAsset(8, true);
    std::uint64_t normals = 0;
    for (const auto& level : shaded.normals.levels) { normals += level.size(); }
    EXPECT_GT(normals, 0U);
    EXPECT_EQ(bytesOf(shaded), 8 * vertices + table + 4 * normals)
        << "its vertices lie where the pattern has them: no parameters";
}

TEST(SkippedLibraries, whatOnlyBakesNeedIsNotLoaded)
{
    std::ifstream maps("/proc/self/maps");
    if (!maps) { GTEST_SKIP() << "no /proc/self/maps"; }
    const std::string text{std::istreambuf_iterator<char>(maps), {}};
    ASSERT_NE(text.find("libosgTessLOD.so"), std::string::npos);
    for (const char* library : {"embree", "OpenMesh", "tbb", "OpenImageIO", "geotiff", "osgTessLODBake"}) {
        EXPECT_EQ(text.find(library), std::string::npos) << library;
    }
}

} // namespace
} // namespace osgTessLOD
