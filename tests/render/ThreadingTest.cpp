// SPDX-License-Identifier: MIT
// Selections made in cull traversals while earlier ones are being drawn: under every threading model, with two contexts,
// a texture camera and several parents.
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/MatrixTransform>
#include <osgUtil/UpdateVisitor>

#include <cmath>
#include <cstring>

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

INSTANTIATE_TEST_SUITE_P(EveryModel, Threading,
                         testing::Values(osgViewer::ViewerBase::SingleThreaded,
                                         osgViewer::ViewerBase::CullDrawThreadPerContext,
                                         osgViewer::ViewerBase::DrawThreadPerContext,
                                         osgViewer::ViewerBase::CullThreadPerCameraDrawThreadPerContext));

} // namespace
} // namespace osgTessLOD
