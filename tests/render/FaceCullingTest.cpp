// SPDX-License-Identifier: MIT
// Patches of which GL would cull every triangle are not drawn at all, and nothing else changes.
#include <render/GlTest.h>
#include <render/PlainTwin.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/CullFace>
#include <osg/FrontFace>
#include <osg/ShapeDrawable>

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

namespace osgTessLOD {
namespace {

constexpr int kSize = 150;

class FaceCulling : public testing::Test {
protected:
    FaceCulling()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        viewer.getCamera()->setClearColor(osg::Vec4(0.0F, 0.0F, 1.0F, 1.0F));
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        place->addChild(drawable.get());
        root->addChild(place.get());
        // There is always something to draw.
        root->addChild(new osg::ShapeDrawable(new osg::Box(osg::Vec3(1.0F, 1.0F, 0.8F), 0.1F)));
        drawable->setSelectionObserver(observer.get());
        viewer.setSceneData(root.get());
        viewer.realize();
        // In a context's first frame ambient colours follow glColor: OSG applies its own material only after that.
        for (int k = 0; k < 2; ++k) { viewer.frame(); }
    }

    void lookFrom(const osg::Vec3d& eye)
    {
        viewer.getCamera()->setViewMatrixAsLookAt(eye, osg::Vec3d(1.0, 1.0, 0.0), osg::Vec3d(0.3, 0.2, 1.0));
    }

    struct Frame {
        std::uint64_t patches;
        std::vector<unsigned char> picture;
    };
    Frame frame(bool cull)
    {
        SelectionOptions options = drawable->getOptions();
        options.cullPatches = cull;
        drawable->setOptions(options);
        observer->take();
        viewer.frame();
        Frame frame{0, {}};
        for (const auto& entry : observer->take()) { frame.patches += entry.selection->statistics().patches; }
        const osg::Image& image = snapshot->image();
        frame.picture.assign(image.data(), image.data() + image.getTotalSizeInBytes());
        return frame;
    }

    osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticSheet(8, 2, true)));
    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    osg::ref_ptr<osg::MatrixTransform> place = new osg::MatrixTransform;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osgViewer::Viewer viewer;
};

using State = osg::StateAttribute;
using SetState = std::function<void(osg::StateSet& root, osg::StateSet& drawable)>;

struct Setting {
    const char* name;
    SetState set;
    bool hidesFromAbove;
    bool hidesFromBelow;
};

const std::vector<Setting>& settings()
{
    static const std::vector<Setting> all{
        {"nothing", [](osg::StateSet&, osg::StateSet&) {}, false, false},
        {"back", [](osg::StateSet& r, osg::StateSet&) { r.setMode(GL_CULL_FACE, State::ON); }, false, true},
        {"front",
         [](osg::StateSet& r, osg::StateSet&) { r.setAttributeAndModes(new osg::CullFace(osg::CullFace::FRONT)); },
         true, false},
        {"back of clockwise",
         [](osg::StateSet& r, osg::StateSet& d) {
             r.setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
             d.setAttributeAndModes(new osg::FrontFace(osg::FrontFace::CLOCKWISE));
         },
         true, false},
        {"off below",
         [](osg::StateSet& r, osg::StateSet& d) {
             r.setMode(GL_CULL_FACE, State::ON);
             d.setMode(GL_CULL_FACE, State::OFF);
         },
         false, false},
        {"overridden",
         [](osg::StateSet& r, osg::StateSet& d) {
             r.setMode(GL_CULL_FACE, State::ON | State::OVERRIDE);
             d.setMode(GL_CULL_FACE, State::OFF);
         },
         false, true},
        {"protected",
         [](osg::StateSet& r, osg::StateSet& d) {
             r.setMode(GL_CULL_FACE, State::ON | State::OVERRIDE);
             d.setMode(GL_CULL_FACE, State::OFF | State::PROTECTED);
         },
         false, false},
    };
    return all;
}

TEST_F(FaceCulling, leavesOutWhatGlWouldNotDrawAnyway)
{
    const WarningCollector warnings;
    const std::array<std::pair<osg::Matrixd, bool>, 4> transforms{
        std::pair{osg::Matrixd(), false},
        std::pair{osg::Matrixd::scale(0.5, 1.5, 1.0), false},
        std::pair{osg::Matrixd::scale(1.0, -1.0, 1.0) * osg::Matrixd::translate(0.0, 2.0, 0.0), true},
        std::pair{osg::Matrixd::rotate(1.0, 0.0, 0.0, 1.0), false},
    };
    for (const bool orthographic : {false, true}) {
        if (orthographic) {
            viewer.getCamera()->setProjectionMatrixAsOrtho(-2.0, 2.0, -2.0, 2.0, 0.1, 100.0);
        } else {
            viewer.getCamera()->setProjectionMatrixAsPerspective(40.0, 1.0, 0.1, 100.0);
        }
        for (const auto& [matrix, mirrors] : transforms) {
            place->setMatrix(matrix);
            for (const Setting& setting : settings()) {
                root->setStateSet(new osg::StateSet);
                drawable->setStateSet(new osg::StateSet);
                setting.set(*root->getStateSet(), *drawable->getStateSet());
                for (const bool above : {true, false}) {
                    lookFrom(osg::Vec3d(2.0, 0.5, above ? 5.0 : -5.0));
                    const Frame all = frame(false);
                    const Frame part = frame(true);
                    const bool hidden = above != mirrors ? setting.hidesFromAbove : setting.hidesFromBelow;
                    EXPECT_EQ(part.patches, hidden ? 0U : all.patches) << setting.name << " above " << above;
                    EXPECT_TRUE(part.picture == all.picture) << setting.name << " above " << above;
                }
            }
        }
    }
    EXPECT_EQ(warnings.text(), "");
}

TEST_F(FaceCulling, ofASphereLeavesOutPartAndKeepsThePicture)
{
    const WarningCollector warnings;
    drawable->setAsset(std::make_shared<const LodAsset>(makeSyntheticAsset(8, true)));
    root->getOrCreateStateSet()->setMode(GL_CULL_FACE, State::ON);
    viewer.getCamera()->setProjectionMatrixAsPerspective(30.0, 1.0, 0.01, 100.0);
    const osg::Vec3d middle(drawable->getBound().center());
    std::uint64_t left = 0;
    std::uint64_t shown = 0;
    for (int k = 0; k < 24; ++k) {
        const double turn = 0.26 * k;
        const osg::Vec3d eye =
            middle + osg::Vec3d(std::cos(turn), std::sin(turn), 0.7) * (5.0 * drawable->getBound().radius());
        viewer.getCamera()->setViewMatrixAsLookAt(eye, middle, osg::Vec3d(0.0, 0.0, 1.0));
        for (const double error : {0.5, 20.0}) {
            SelectionOptions options = drawable->getOptions();
            options.errorPixels = error;
            drawable->setOptions(options);
            root->getStateSet()->setMode(GL_CULL_FACE, State::OFF);
            const Frame inView = frame(true);
            root->getStateSet()->setMode(GL_CULL_FACE, State::ON);
            const Frame all = frame(false);
            const Frame part = frame(true);
            EXPECT_TRUE(part.picture == all.picture) << k;
            left += inView.patches - part.patches;
            shown += part.patches;
        }
    }
    EXPECT_GT(left, 20U);
    EXPECT_GT(shown, 20U);
    EXPECT_EQ(warnings.text(), "");
}

TEST_F(FaceCulling, followsThePlacementsThatMirror)
{
    const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(drawable->getAsset());
    instances->setPlacements({osg::Matrixd(), osg::Matrixd::scale(1.0, -1.0, 1.0)});
    instances->setSelectionObserver(observer.get());
    place->removeChildren(0, 1);
    place->addChild(instances.get());
    drawable = instances;
    root->getOrCreateStateSet()->setMode(GL_CULL_FACE, State::ON);
    viewer.getCamera()->setProjectionMatrixAsPerspective(60.0, 1.0, 0.1, 100.0);
    for (const double z : {5.0, -5.0}) {
        lookFrom(osg::Vec3d(2.0, 0.5, z));
        const Frame all = frame(false);
        const Frame part = frame(true);
        EXPECT_EQ(2 * part.patches, all.patches) << z;
        EXPECT_TRUE(part.picture == all.picture) << z;
    }
}

TEST_F(FaceCulling, smallModelsGoWhereSmallFeaturesAreCulled)
{
    lookFrom(osg::Vec3d(1.0, 1.0, 5000.0));
    viewer.getCamera()->setProjectionMatrixAsPerspective(40.0, 1.0, 0.1, 10000.0);
    // Beside something large, so that it is up to the drawable.
    const osg::ref_ptr<osg::MatrixTransform> large = new osg::MatrixTransform(osg::Matrixd::scale(500.0, 500.0, 500.0));
    large->addChild(new TessLODDrawable(drawable->getAsset()));
    place->addChild(large.get());
    viewer.getCamera()->setCullingMode(viewer.getCamera()->getCullingMode() &
                                       ~osg::CullSettings::SMALL_FEATURE_CULLING);
    EXPECT_EQ(frame(true).patches, drawable->getAsset()->patches.size());
    viewer.getCamera()->setCullingMode(viewer.getCamera()->getCullingMode() | osg::CullSettings::SMALL_FEATURE_CULLING);
    EXPECT_EQ(frame(true).patches, 0U);
}

} // namespace
} // namespace osgTessLOD
