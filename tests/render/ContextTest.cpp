// SPDX-License-Identifier: MIT
// GL objects come and go with contexts, threads and drawables.
#include <render/GlTest.h>
#include <render/PlainTwin.h>

#include <asset/SyntheticAsset.h>

#include <osg/DeleteHandler>
#include <osg/GLObjects>
#include <osgUtil/IncrementalCompileOperation>

#include <thread>

namespace osgTessLOD {
namespace {

constexpr int kSize = 120;
using Model = osgViewer::ViewerBase::ThreadingModel;

std::shared_ptr<const LodAsset> makeAsset()
{
    return std::make_shared<const LodAsset>(makeSyntheticAsset(16, true));
}

/// A viewer that looks at a scene through a context of its own.
class Window {
public:
    Window(osg::Node& scene, Model model)
    {
        viewer.setThreadingModel(model);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(5.0, 1.0, 0.0), osg::Vec3d(), osg::Vec3d(0.0, 0.0, 1.0));
        viewer.setSceneData(&scene);
        viewer.realize();
        picture(); // a viewer's first frame is brighter
    }
    osg::ref_ptr<osg::Image> picture()
    {
        for (int k = 0; k < 3; ++k) { viewer.frame(); }
        viewer.stopThreading(); // the frame is finished
        osg::ref_ptr<osg::Image> image = osg::clone(&snapshot->image(), osg::CopyOp::DEEP_COPY_ALL);
        viewer.startThreading();
        return image;
    }

    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osgViewer::Viewer viewer;
};

void expectSame(const osg::Image& a, const osg::Image& b, const char* what)
{
    EXPECT_EQ(differingPixels(a, b, 0), 0U) << what;
}

std::size_t drawnPixels(const osg::Image& image)
{
    std::size_t count = 0;
    const unsigned char* background = image.data(0, 0);
    for (unsigned y = 0; y < kSize; ++y) {
        for (unsigned x = 0; x < kSize; ++x) { count += std::equal(background, background + 3, image.data(x, y)) ? 0 : 1; }
    }
    return count;
}

class Contexts : public testing::TestWithParam<Model> {
protected:
    Contexts() { scene->addChild(drawable.get()); }
    ~Contexts() override { EXPECT_EQ(warnings.text(), ""); }

    WarningCollector warnings;
    osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(makeAsset());
    osg::ref_ptr<osg::Group> scene = new osg::Group;
};

TEST_P(Contexts, oneAfterTheOther)
{
    osg::ref_ptr<osg::Image> first;
    {
        Window window(*scene, GetParam());
        first = window.picture();
        EXPECT_GT(drawnPixels(*first), 1000U);
    }
    for (int k = 0; k < 2; ++k) {
        Window window(*scene, GetParam()); // gets the id of the one that is gone
        expectSame(*window.picture(), *first, "another context");
    }
}

TEST_P(Contexts, twoAtOnceOfWhichOneGoes)
{
    Window stays(*scene, GetParam());
    const osg::ref_ptr<osg::Image> first = stays.picture();
    {
        Window goes(*scene, GetParam());
        expectSame(*goes.picture(), *first, "second context");
        expectSame(*stays.picture(), *first, "first context beside it");
    }
    expectSame(*stays.picture(), *first, "first context after it");
}

TEST_P(Contexts, lostAndMadeAgain)
{
    osg::ref_ptr<osg::Image> first;
    {
        Window window(*scene, GetParam());
        first = window.picture();
        // What an application does when the driver has taken the context away: names are forgotten, not deleted.
        window.viewer.stopThreading();
        osg::GraphicsContext& context = *window.viewer.getCamera()->getGraphicsContext();
        const unsigned id = context.getState()->getContextID();
        scene->releaseGLObjects(context.getState());
        osg::discardAllGLObjects(id);
        context.getState()->reset();
        context.close(true);
    }
    Window window(*scene, GetParam());
    expectSame(*window.picture(), *first, "after the loss");
}

TEST_P(Contexts, objectsReleasedWhileItRuns)
{
    Window window(*scene, GetParam());
    const osg::ref_ptr<osg::Image> first = window.picture();
    window.viewer.stopThreading();
    std::thread([&] { scene->releaseGLObjects(); }).join(); // a thread without a context: nothing may be deleted here
    scene->resizeGLObjectBuffers(16);
    window.viewer.startThreading();
    expectSame(*window.picture(), *first, "released and made again");
}

TEST_P(Contexts, threadingModelsChanged)
{
    Window window(*scene, GetParam());
    const osg::ref_ptr<osg::Image> first = window.picture();
    for (const Model model : {osgViewer::ViewerBase::SingleThreaded, osgViewer::ViewerBase::DrawThreadPerContext,
                              osgViewer::ViewerBase::CullThreadPerCameraDrawThreadPerContext,
                              osgViewer::ViewerBase::CullDrawThreadPerContext, GetParam()}) {
        window.viewer.setThreadingModel(model);
        expectSame(*window.picture(), *first, "another threading model");
    }
}

TEST_P(Contexts, drawablesMadeAndDroppedByOtherThreads)
{
    Window window(*scene, GetParam());
    const osg::ref_ptr<osg::Image> first = window.picture();
    for (int k = 0; k < 6; ++k) {
        osg::ref_ptr<TessLODDrawable> guest;
        std::thread([&] { guest = new TessLODDrawable(makeAsset()); }).join();
        scene->addChild(guest.get());
        for (int frame = 0; frame < 3; ++frame) { window.viewer.frame(); }
        window.viewer.stopThreading();
        scene->removeChild(guest.get());
        std::thread([&] { guest = nullptr; }).join(); // the last reference, in a thread without a context
        window.viewer.startThreading();
    }
    expectSame(*window.picture(), *first, "after guests");
}

TEST_P(Contexts, copiesDrawTheSame)
{
    Window window(*scene, GetParam());
    const osg::ref_ptr<osg::Image> first = window.picture();
    for (const auto flags : {osg::CopyOp::SHALLOW_COPY, osg::CopyOp::DEEP_COPY_ALL}) {
        const osg::ref_ptr<osg::Group> copy = osg::clone(scene.get(), osg::CopyOp(flags));
        window.viewer.stopThreading();
        window.viewer.setSceneData(copy.get());
        window.viewer.startThreading();
        expectSame(*window.picture(), *first, "a copy");
    }
}

INSTANTIATE_TEST_SUITE_P(EveryModel, Contexts,
                         testing::Values(osgViewer::ViewerBase::SingleThreaded,
                                         osgViewer::ViewerBase::CullDrawThreadPerContext,
                                         osgViewer::ViewerBase::DrawThreadPerContext,
                                         osgViewer::ViewerBase::CullThreadPerCameraDrawThreadPerContext));

class CompileGl : public GlTest {};

TEST_F(CompileGl, makesAllThatDrawingNeeds)
{
    // Compiled ahead, as a pager does it; the draw then creates neither buffers nor programs.
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(makeAsset());
    SelectionOptions options;
    options.backend = Backend::Tessellation; // Auto would try what is faster first
    drawable->setOptions(options);
    scene->addChild(drawable.get());
    const osg::ref_ptr<osgUtil::IncrementalCompileOperation> compiler = new osgUtil::IncrementalCompileOperation;
    compiler->addGraphicsContext(context.get());
    const osg::ref_ptr<osgUtil::IncrementalCompileOperation::CompileSet> set =
        new osgUtil::IncrementalCompileOperation::CompileSet(scene.get());
    compiler->add(set.get());
    for (int k = 0; k < 50 && !set->compiled(); ++k) { (*compiler)(context.get()); }
    EXPECT_TRUE(set->compiled());

    GpuAsset& asset = *drawable->getGpuAsset();
    state().apply();
    GLuint before = 0;
    state().get<osg::GLExtensions>()->glGenBuffers(1, &before);
    drawable->drawImplementation(renderInfo);
    GLuint after = 0;
    state().get<osg::GLExtensions>()->glGenBuffers(1, &after);
    EXPECT_LE(after - before, 2U) << "the stream of records alone is new";
    std::vector<PatchRecord> records = asset.selector().uniformRecords(2).vector();
    EXPECT_EQ(capture(asset, records).size(), 3U * 8U * 24U);
    compiler->removeGraphicsContext(context.get());
}

} // namespace
} // namespace osgTessLOD
