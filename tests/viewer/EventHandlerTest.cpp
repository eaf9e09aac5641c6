// SPDX-License-Identifier: MIT
// The viewer's keys and its status line, in a viewer that draws without a window.
#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgtesslodviewer/SelectionTotals.h>
#include <osgtesslodviewer/TessLODEventHandler.h>
#include <osgtesslodviewer/ViewerOptions.h>
#include <osgtesslodviewer/WindowRun.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>

#include <gtest/gtest.h>

#include <osg/ApplicationUsage>
#include <osg/Group>
#include <osgText/Text>
#include <osgViewer/Viewer>
#include <osgViewer/ViewerEventHandlers>

#include <set>

namespace osgTessLOD {
namespace {

/// All text below a node.
class TextFinder : public osg::NodeVisitor {
public:
    TextFinder()
        : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN)
    {
    }
    using osg::NodeVisitor::apply;
    void apply(osg::Drawable& drawable) override
    {
        if (const auto* text = dynamic_cast<const osgText::Text*>(&drawable)) {
            _text += text->getText().createUTF8EncodedString();
        }
    }
    std::string _text;
};

class EventHandler : public testing::TestWithParam<osgViewer::ViewerBase::ThreadingModel> {
protected:
    EventHandler()
    {
        scene->addChild(drawable);
        scene->getOrCreateStateSet()->setDataVariance(osg::Object::DYNAMIC);
        addHandlers(viewer, *scene, ViewerOptions(), usage);

        std::string error;
        const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(320, 200, error);
        if (!context) { throw std::runtime_error(error); }
        viewer.setThreadingModel(GetParam());
        viewer.getCamera()->setGraphicsContext(context);
        viewer.getCamera()->setViewport(0, 0, 320, 200);
        viewer.getCamera()->setDrawBuffer(GL_FRONT);
        viewer.getCamera()->setReadBuffer(GL_FRONT);
        viewer.getCamera()->setProjectionMatrixAsPerspective(30.0, 1.6, 1.0, 100.0);
        viewer.realize();
        frames(3);
    }

    void frames(int count)
    {
        for (int frame = 0; frame < count; ++frame) { viewer.frame(); }
    }
    void press(int key)
    {
        viewer.getEventQueue()->keyPress(key);
        viewer.getEventQueue()->keyRelease(key);
        frames(2);
    }
    const SelectionOptions& options() const { return drawable->getOptions(); }
    std::string statusText()
    {
        TextFinder finder;
        viewer.getSceneData()->accept(finder);
        return finder._text;
    }

    osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset()));
    osg::ref_ptr<osg::Group> scene = new osg::Group;
    osg::ref_ptr<osg::ApplicationUsage> usage = new osg::ApplicationUsage;
    osgViewer::Viewer viewer;
};

TEST_P(EventHandler, ChangesTheErrorAsked)
{
    const double before = options().errorPixels;
    for (int k = 0; k < 4; ++k) { press(']'); }
    EXPECT_NEAR(options().errorPixels, 2.0 * before, 1e-9);
    for (int k = 0; k < 8; ++k) { press('['); }
    EXPECT_NEAR(options().errorPixels, 0.5 * before, 1e-9);
}

TEST_P(EventHandler, TogglesPatchCulling)
{
    press('u');
    EXPECT_FALSE(options().cullPatches);
    press('u');
    EXPECT_TRUE(options().cullPatches);
}

TEST_P(EventHandler, FreezesTheSelectionAtItsView)
{
    press('x');
    ASSERT_TRUE(options().frozen);
    osg::Vec3d eye;
    osg::Vec3d center;
    osg::Vec3d up;
    viewer.getCamera()->getViewMatrixAsLookAt(eye, center, up);
    EXPECT_LE((options().frozenView.eye - eye).length(), 1e-4 * eye.length());
    // Vertical field of view 30° on 200 pixels.
    EXPECT_NEAR(options().frozenView.pixelScale, 100.0 / std::tan(osg::DegreesToRadians(15.0)), 0.5);

    const std::string frozen = statusText();
    EXPECT_NE(frozen.find("frozen"), std::string::npos) << frozen;
    const auto triangles = [](const std::string& line) {
        return line.substr(line.find(')'), line.find(" triangles") - line.find(')'));
    };
    viewer.setCameraManipulator(nullptr);
    viewer.getCamera()->setViewMatrixAsLookAt(eye * 20.0, center, up);
    frames(3);
    EXPECT_EQ(triangles(statusText()), triangles(frozen)) << "another view, the same selection";
    press('x');
    EXPECT_FALSE(options().frozen);
    frames(2);
    EXPECT_NE(triangles(statusText()), triangles(frozen));
}

TEST_P(EventHandler, ColorsByLevel)
{
    const auto isColored = [&] { return scene->getStateSet()->getDefinePair("TESSLOD_COLOR_BY_LEVEL") != nullptr; };
    EXPECT_FALSE(isColored());
    press('k');
    EXPECT_TRUE(isColored());
    press('k');
    EXPECT_FALSE(isColored());
}

TEST_P(EventHandler, ShowsWhatWasDrawn)
{
    SelectionTotals totals(DrawableList{drawable}); // takes the status line's place as observer
    totals.beginFrame();
    viewer.frame();
    const SelectionSums sums = SelectionTotals::sum(totals.thisFrame(viewer.getCamera()));
    EXPECT_EQ(sums.selections, 1U);
    EXPECT_EQ(sums.patches, 8U);
    EXPECT_GT(sums.triangles, 0U);
    std::uint64_t patches = 0;
    for (const auto& [factor, count] : sums.patchesByFactor) { patches += count; }
    EXPECT_EQ(patches, sums.patches);

    const std::string line = statusText();
    EXPECT_NE(line.find("8 patches"), std::string::npos) << line;
    EXPECT_NE(line.find(std::to_string(sums.triangles) + " triangles"), std::string::npos) << line;
    EXPECT_NE(line.find("error asked 1.00 px"), std::string::npos) << line;
}

TEST_P(EventHandler, EntersItsFiguresInTheStatistics)
{
    press('s');
    press('s'); // the viewer's statistics, with our lines
    frames(3);
    viewer.stopThreading();
    const unsigned number = viewer.getFrameStamp()->getFrameNumber();
    const auto valueOf = [&](const char* name) {
        double value = -1.0;
        EXPECT_TRUE(viewer.getViewerStats()->getAttribute(number, name, value)) << name;
        return value;
    };
    EXPECT_EQ(valueOf("Surface patches"), 8.0);
    EXPECT_GT(valueOf("Surface triangles"), 8.0);
    EXPECT_EQ(valueOf("Surface error asked"), options().errorPixels);
    EXPECT_EQ(valueOf("Surface saturated patches"), 0.0);
    viewer.startThreading();
    for (int k = 0; k < 28; ++k) { press('['); } // more than there is to be had
    viewer.stopThreading();
    double saturated = 0.0;
    viewer.getViewerStats()->getAttribute(viewer.getFrameStamp()->getFrameNumber(), "Surface saturated patches", saturated);
    EXPECT_EQ(saturated, 8.0);
    TextFinder texts;
    for (const auto& handler : viewer.getEventHandlers()) {
        if (auto* statistics = dynamic_cast<osgViewer::StatsHandler*>(handler.get())) { statistics->getCamera()->accept(texts); }
    }
    for (const char* label : {"Surface patches", "Surface triangles", "Saturated patches", "Error asked"}) {
        EXPECT_NE(texts._text.find(label), std::string::npos) << texts._text;
    }
    viewer.startThreading();
}

TEST_P(EventHandler, TogglesTheStatusLine)
{
    TextFinder hidden;
    press('y');
    viewer.getSceneData()->accept(hidden);
    EXPECT_EQ(hidden._text, "");
    press('y');
    EXPECT_NE(statusText(), "");
}

INSTANTIATE_TEST_SUITE_P(Threading, EventHandler,
                         testing::Values(osgViewer::ViewerBase::SingleThreaded,
                                         osgViewer::ViewerBase::DrawThreadPerContext,
                                         osgViewer::ViewerBase::CullThreadPerCameraDrawThreadPerContext));

TEST(Keys, DoNotCollideWithThoseOfOsg)
{
    osgViewer::Viewer viewer;
    const osg::ref_ptr<osg::ApplicationUsage> own = new osg::ApplicationUsage;
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    const osg::ref_ptr<TessLODEventHandler> handler = new TessLODEventHandler(scene, {}, false);
    handler->getUsage(*own);

    const osg::ref_ptr<osg::ApplicationUsage> all = new osg::ApplicationUsage;
    addHandlers(viewer, *scene, ViewerOptions(), all);
    std::set<std::string> taken;
    for (const auto& eventHandler : viewer.getEventHandlers()) {
        if (dynamic_cast<TessLODEventHandler*>(eventHandler.get())) { continue; }
        const osg::ref_ptr<osg::ApplicationUsage> usage = new osg::ApplicationUsage;
        eventHandler->getUsage(*usage);
        for (const auto& [key, purpose] : usage->getKeyboardMouseBindings()) { taken.insert(key); }
    }
    const osg::ref_ptr<osg::ApplicationUsage> manipulators = new osg::ApplicationUsage;
    viewer.getCameraManipulator()->getUsage(*manipulators);
    for (const auto& [key, purpose] : manipulators->getKeyboardMouseBindings()) {
        taken.insert(key.substr(key.rfind(' ') + 1)); // "Flight: q"
    }
    // One key of each of osgviewer's handlers, and the last of its manipulators.
    for (const char* key : {"l", "m", "f", "s", "h", "z", "*", "c", "7"}) { EXPECT_EQ(taken.count(key), 1U) << key; }
    ASSERT_TRUE(taken.count("q")) << "a manipulator's own key";
    EXPECT_EQ(own->getKeyboardMouseBindings().size(), 6U);
    for (const auto& [key, purpose] : own->getKeyboardMouseBindings()) { EXPECT_EQ(taken.count(key), 0U) << key; }
}

} // namespace
} // namespace osgTessLOD
