// SPDX-License-Identifier: MIT
// Selections made in cull traversals while earlier ones are being drawn: under every threading model, with two contexts,
// a texture camera and several parents.
#include <render/GlTest.h>
#include <render/Poses.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/MatrixTransform>
#include <osgUtil/UpdateVisitor>
#include <osgViewer/CompositeViewer>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <functional>

namespace osgTessLOD {
namespace {

constexpr int kParents = 6;
constexpr int kFrames = 60;

class Threading : public testing::TestWithParam<osgViewer::ViewerBase::ThreadingModel> {};

TEST_P(Threading, selectionsStayAsTheyWereMade)
{
    const WarningCollector warnings;
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    const osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    drawable->setSelectionObserver(observer.get());
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    for (int k = 0; k < kParents; ++k) {
        const osg::ref_ptr<osg::MatrixTransform> parent =
            new osg::MatrixTransform(osg::Matrix::translate(2.5 * (k % 3) - 2.5, 2.5 * (k / 3) - 1.25, 0.0));
        parent->addChild(drawable.get());
        scene->addChild(parent.get());
    }
    const osg::ref_ptr<osg::Group> root = new osg::Group;
    root->addChild(scene.get());
    const osg::ref_ptr<osg::Camera> texture = makeTextureCamera(scene.get(), 64);
    texture->setReferenceFrame(osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT);
    texture->setProjectionMatrixAsPerspective(60.0, 1.0, 0.1, 100.0);
    texture->setViewMatrixAsLookAt(osg::Vec3d(0.0, 0.0, 12.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    root->addChild(texture.get());

    std::vector<RecordingObserver::Entry> entries;
    {
        osgViewer::Viewer viewer;
        viewer.setThreadingModel(GetParam());
        for (const double turn : {0.0, 90.0}) {
            const osg::ref_ptr<osg::Camera> camera = new osg::Camera;
            setUpHeadless(*camera, 96, 64);
            viewer.addSlave(camera.get(), osg::Matrix(),
                            osg::Matrix::rotate(osg::DegreesToRadians(turn), 0.0, 1.0, 0.0));
        }
        viewer.getCamera()->setProjectionMatrixAsPerspective(45.0, 1.5, 0.1, 100.0);
        viewer.setSceneData(root.get());
        viewer.realize();
        for (int frame = 0; frame < kFrames; ++frame) {
            const double t = 0.1 * frame;
            viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(10.0 * std::cos(t), 3.0, 10.0 * std::sin(t)),
                                                      osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
            SelectionOptions options;
            options.errorPixels = std::exp(2.0 * std::sin(3.0 * t));
            drawable->setOptions(options);
            viewer.frame();
            for (auto& entry : observer->take()) { entries.push_back(std::move(entry)); }
        }
        viewer.stopThreading();
    }
    EXPECT_EQ(warnings.text(), "");
    EXPECT_GE(entries.size(), static_cast<std::size_t>(kFrames * kParents * 2));
    for (const RecordingObserver::Entry& entry : entries) {
        const PatchRecords& now = entry.selection->records();
        ASSERT_EQ(now.size(), entry.records.size());
        ASSERT_EQ(std::memcmp(now.data(), entry.records.data(), now.size() * sizeof(PatchRecord)), 0);
    }
}

/// Keeps the picture of every frame that its camera draws.
class Film : public osg::Camera::DrawCallback {
public:
    void operator()(osg::RenderInfo&) const override
    {
        std::vector<unsigned char> picture(3U * 96U * 64U);
        glReadPixels(0, 0, 96, 64, GL_RGB, GL_UNSIGNED_BYTE, picture.data());
        _pictures.push_back(std::move(picture));
    }
    const std::vector<std::vector<unsigned char>>& pictures() const { return _pictures; }

private:
    mutable std::vector<std::vector<unsigned char>> _pictures;
};

/// Two contexts' films of a flight around several parents of one drawable. `prepare`: called before each frame with the time.
std::array<osg::ref_ptr<Film>, 2> filmOf(
    TessLODDrawable& drawable, osgViewer::ViewerBase::ThreadingModel model, SelectionOptions options,
    const std::function<void(double)>& prepare = [](double) {})
{
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    for (int k = 0; k < kParents; ++k) {
        const osg::ref_ptr<osg::MatrixTransform> parent =
            new osg::MatrixTransform(osg::Matrix::scale(1.0, 1.0, 0.5 + 0.2 * k) *
                                     osg::Matrix::translate(2.5 * (k % 3) - 2.5, 2.5 * (k / 3) - 1.25, 0.0));
        parent->addChild(&drawable);
        scene->addChild(parent.get());
    }
    std::array<osg::ref_ptr<Film>, 2> films{new Film, new Film};
    osgViewer::Viewer viewer;
    viewer.setThreadingModel(model);
    for (std::size_t view = 0; view < films.size(); ++view) {
        const osg::ref_ptr<osg::Camera> camera = new osg::Camera;
        setUpHeadless(*camera, 96, 64);
        camera->setFinalDrawCallback(films[view].get());
        viewer.addSlave(camera.get(), osg::Matrix(),
                        osg::Matrix::rotate(0.2 * static_cast<double>(view), 0.0, 1.0, 0.0));
    }
    viewer.getCamera()->setProjectionMatrixAsPerspective(45.0, 1.5, 0.1, 100.0);
    viewer.setSceneData(scene.get());
    viewer.realize();
    for (int frame = 0; frame < kFrames; ++frame) {
        const double t = 0.1 * frame;
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(10.0 * std::cos(t), 3.0, 10.0 * std::sin(t)), osg::Vec3d(),
                                                  osg::Vec3d(0.0, 1.0, 0.0));
        options.errorPixels = std::exp(2.0 * std::sin(3.0 * t));
        drawable.setOptions(options);
        prepare(t);
        viewer.frame();
    }
    viewer.stopThreading();
    return films;
}

/// Each of the leaves that the control shader selects for sees its own view. A pixel on an edge may show either side.
TEST_P(Threading, theControlShaderSelectsForEveryView)
{
    const WarningCollector warnings;
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    SelectionOptions options;
    options.backend = Backend::Tessellation;
    const auto expected = filmOf(*drawable, GetParam(), options);
    options.selector = SelectionOptions::Selector::Gpu;
    const auto films = filmOf(*drawable, GetParam(), options);
    for (std::size_t view = 0; view < films.size(); ++view) {
        ASSERT_EQ(films[view]->pictures().size(), static_cast<std::size_t>(kFrames));
        ASSERT_EQ(expected[view]->pictures().size(), static_cast<std::size_t>(kFrames));
        for (std::size_t frame = 0; frame < kFrames; ++frame) {
            const std::vector<unsigned char>& picture = films[view]->pictures()[frame];
            std::size_t different = 0;
            for (std::size_t k = 0; k < picture.size(); ++k) {
                different += std::abs(picture[k] - expected[view]->pictures()[frame][k]) > 2 ? 1 : 0;
            }
            EXPECT_LE(different, 12U) << "view " << view << ", frame " << frame;
        }
    }
    EXPECT_EQ(warnings.text(), "");
}

TEST_P(Threading, posesMayChangeWhileTheLastOnesAreDrawn)
{
    const WarningCollector warnings;
    const osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    const auto pose = [&](double time) {
        drawable->setDeformation(deformed(*drawable->getGpuAsset(), bending, 3.0 * time));
    };
    SelectionOptions options;
    options.backend = Backend::Tessellation;
    const auto expected = filmOf(*drawable, osgViewer::ViewerBase::SingleThreaded, options, pose);
    const auto films = filmOf(*drawable, GetParam(), options, pose);
    for (std::size_t view = 0; view < films.size(); ++view) {
        ASSERT_EQ(films[view]->pictures().size(), static_cast<std::size_t>(kFrames));
        for (std::size_t frame = 0; frame < kFrames; ++frame) {
            ASSERT_EQ(films[view]->pictures()[frame], expected[view]->pictures()[frame]) << "frame " << frame;
        }
    }
    EXPECT_NE(films[0]->pictures().front(), films[0]->pictures().back());
    EXPECT_EQ(warnings.text(), "");
}

TEST_P(Threading, placementsMayChangeWhileTheLastOnesAreDrawn)
{
    const WarningCollector warnings;
    const osg::ref_ptr<TessLODInstances> instances =
        new TessLODInstances(std::make_shared<const LodAsset>(makeSyntheticAsset(16, true)));
    const osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    instances->setSelectionObserver(observer.get());
    const osg::ref_ptr<osg::Group> root = new osg::Group;
    root->addChild(instances.get());
    const osg::ref_ptr<osg::Camera> texture = makeTextureCamera(instances.get(), 64);
    texture->setReferenceFrame(osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT);
    texture->setProjectionMatrixAsPerspective(60.0, 1.0, 0.1, 100.0);
    texture->setViewMatrixAsLookAt(osg::Vec3d(0.0, 0.0, 12.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    root->addChild(texture.get());

    std::vector<RecordingObserver::Entry> entries;
    std::vector<std::size_t> placed; // in the frame of each entry
    {
        osgViewer::Viewer viewer;
        viewer.setThreadingModel(GetParam());
        for (const double turn : {0.0, 90.0}) {
            const osg::ref_ptr<osg::Camera> camera = new osg::Camera;
            setUpHeadless(*camera, 96, 64);
            viewer.addSlave(camera.get(), osg::Matrix(),
                            osg::Matrix::rotate(osg::DegreesToRadians(turn), 0.0, 1.0, 0.0));
        }
        viewer.getCamera()->setProjectionMatrixAsPerspective(45.0, 1.5, 0.1, 100.0);
        viewer.setSceneData(root.get());
        viewer.realize();
        for (int frame = 0; frame < kFrames; ++frame) {
            const double t = 0.1 * frame;
            viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(10.0 * std::cos(t), 3.0, 10.0 * std::sin(t)),
                                                      osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
            std::vector<osg::Matrixd> placements;
            for (int k = 0; k < 3 + frame % 7; ++k) {
                placements.push_back(
                    osg::Matrixd::rotate(t, 1.0, 0.3, 0.0) *
                    osg::Matrixd::translate(2.5 * (k % 3) - 2.5, 2.5 * (k / 3) - 1.25, std::sin(t + k)));
            }
            instances->setPlacements(placements);
            viewer.frame();
            for (auto& entry : observer->take()) {
                entries.push_back(std::move(entry));
                placed.push_back(placements.size());
            }
        }
        viewer.stopThreading();
    }
    EXPECT_EQ(warnings.text(), "");
    ASSERT_GE(entries.size(), static_cast<std::size_t>(kFrames * 2));
    for (std::size_t e = 0; e < entries.size(); ++e) {
        const PatchSelection& selection = *entries[e].selection;
        ASSERT_EQ(selection.placements().set->matrices().size(), placed[e]);
        ASSERT_EQ(selection.placements().numbers.size(), selection.records().size());
        for (const std::uint32_t number : selection.placements().numbers) { ASSERT_LT(number, placed[e]); }
        ASSERT_EQ(selection.records().size(), entries[e].records.size());
    }
}

/// Counts the frames that its camera has drawn.
class FrameCounter : public osg::Camera::DrawCallback {
public:
    void operator()(osg::RenderInfo&) const override { ++count; }
    mutable std::atomic<int> count{0};
};

/// Four views with contexts of their own onto one scene, in which a drawable has eight parents and a texture camera.
class FourViews {
public:
    static constexpr int kParents = 8;

    explicit FourViews(osgViewer::ViewerBase::ThreadingModel model)
    {
        drawable->setSelectionObserver(observer.get());
        const osg::ref_ptr<osg::Group> copies = new osg::Group;
        for (int k = 0; k < kParents; ++k) {
            const osg::ref_ptr<osg::MatrixTransform> parent =
                new osg::MatrixTransform(osg::Matrix::translate(2.5 * (k % 4) - 3.75, 2.5 * (k / 4) - 1.25, 0.0));
            parent->addChild(drawable.get());
            copies->addChild(parent.get());
        }
        const osg::ref_ptr<osg::Camera> texture = makeTextureCamera(copies.get(), 32);
        texture->setReferenceFrame(osg::Transform::ABSOLUTE_RF);
        texture->setProjectionMatrix(_textureProjection);
        texture->setViewMatrix(_textureLook);
        const osg::ref_ptr<osg::Group> root = new osg::Group;
        root->addChild(copies.get());
        root->addChild(texture.get());
        viewer.setThreadingModel(model);
        for (std::size_t k = 0; k < drawn.size(); ++k) {
            _views[k] = new osgViewer::View;
            osg::Camera& camera = *_views[k]->getCamera();
            setUpHeadless(camera, 48, 32);
            camera.setName(std::to_string(k));
            drawn[k] = new FrameCounter;
            camera.setFinalDrawCallback(drawn[k].get());
            _views[k]->setSceneData(root.get());
            viewer.addView(_views[k].get());
        }
        viewer.realize();
    }

    /// Draws the frame with this number, for which every view and the error are others than for the one before.
    void frame(int number)
    {
        for (std::size_t k = 0; k < _views.size(); ++k) {
            const double t = 0.05 * number + 1.5 * static_cast<double>(k);
            const double distance = 12.0 + 6.0 * std::sin(0.7 * t);
            _looks[std::to_string(k)] =
                osg::Matrixd::lookAt(osg::Vec3d(distance * std::cos(t), 3.0, distance * std::sin(t)), osg::Vec3d(),
                                     osg::Vec3d(0.0, 1.0, 0.0));
            _views[k]->getCamera()->setViewMatrix(_looks[std::to_string(k)]);
        }
        SelectionOptions options;
        options.errorPixels = std::exp(2.0 * std::sin(0.3 * number));
        drawable->setOptions(options);
        viewer.frame();
    }

    /// Is it what the drawable's selector selects for its camera in the frame drawn last?
    void expectConsistent(const RecordingObserver::Entry& entry) const
    {
        const bool isTexture = entry.camera == "texture";
        const osg::Matrixd look = isTexture ? _textureLook : _looks.at(entry.camera);
        const osg::Matrixd projection =
            isTexture ? _textureProjection : osg::Matrixd::perspective(30.0, 1.5, 0.1, 100.0); // its sides are kept
        const SelectionView expected =
            makeSelectionView(entry.localToWorld * look, projection, isTexture ? 32.0 : 48.0, 32.0);
        const SelectionView& view = entry.selection->view();
        ASSERT_LT((view.eye - expected.eye).length(), 1e-5) << entry.camera;
        ASSERT_LT((view.axis - expected.axis).length(), 1e-6) << entry.camera;
        ASSERT_NEAR(view.pixelScale, expected.pixelScale, 1e-5 * expected.pixelScale) << entry.camera;
        const PatchSelector& selector = drawable->getGpuAsset()->selector();
        std::map<std::uint32_t, std::array<float, 3>> levels;
        for (const PatchRecord& record : selector.select(view, drawable->getOptions(), {}).records) {
            levels[record.patch] = record.edgeLevels;
        }
        for (const PatchRecord& record : entry.records) { ASSERT_EQ(record.edgeLevels, levels.at(record.patch)); }
    }

    osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(8, true)));
    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    std::array<osg::ref_ptr<FrameCounter>, 4> drawn; ///< by each view
    osgViewer::CompositeViewer viewer;

private:
    const osg::Matrixd _textureProjection = osg::Matrixd::perspective(60.0, 1.0, 0.1, 100.0);
    const osg::Matrixd _textureLook =
        osg::Matrixd::lookAt(osg::Vec3d(0.0, 0.0, 12.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    std::array<osg::ref_ptr<osgViewer::View>, 4> _views;
    std::map<std::string, osg::Matrixd> _looks; ///< of the cameras by name
};

TEST_P(Threading, fourViewsDrawAThousandFrames)
{
    constexpr int kThousand = 1000;
    constexpr int kAhead = 3; // frames that may be on their way
    const WarningCollector warnings;
    FourViews views(GetParam());
    std::deque<std::vector<RecordingObserver::Entry>> lastFrames;
    std::size_t selections = 0;
    for (int frame = 0; frame < kThousand + kAhead; ++frame) {
        views.frame(frame);
        std::vector<RecordingObserver::Entry> entries = views.observer->take();
        // Texture cameras are culled with each view, and see all copies; each view sees some.
        EXPECT_GE(entries.size(), 4U * FourViews::kParents);
        selections += entries.size();
        for (const RecordingObserver::Entry& entry : entries) { views.expectConsistent(entry); }
        lastFrames.push_back(std::move(entries));
        if (lastFrames.size() > kAhead) { // long since drawn
            for (const RecordingObserver::Entry& entry : lastFrames.front()) {
                const PatchRecords& now = entry.selection->records();
                ASSERT_EQ(now.size(), entry.records.size());
                ASSERT_EQ(std::memcmp(now.data(), entry.records.data(), now.size() * sizeof(PatchRecord)), 0);
            }
            lastFrames.pop_front();
        }
        ASSERT_FALSE(HasFailure()) << "frame " << frame;
    }
    views.viewer.stopThreading();
    for (const auto& counter : views.drawn) { EXPECT_GE(counter->count.load(), kThousand); }
    EXPECT_EQ(warnings.text(), "");
}

INSTANTIATE_TEST_SUITE_P(EveryModel, Threading,
                         testing::Values(osgViewer::ViewerBase::SingleThreaded,
                                         osgViewer::ViewerBase::CullDrawThreadPerContext,
                                         osgViewer::ViewerBase::DrawThreadPerContext,
                                         osgViewer::ViewerBase::CullThreadPerCameraDrawThreadPerContext));

} // namespace
} // namespace osgTessLOD
