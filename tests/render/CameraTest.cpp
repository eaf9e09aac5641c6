// SPDX-License-Identifier: MIT
// Cameras of every kind select what plain ones that see the same do.
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/MatrixTransform>

#include <array>
#include <cmath>
#include <map>

namespace osgTessLOD {
namespace {

constexpr int kWidth = 192;
constexpr int kHeight = 128;

class Cameras : public testing::Test {
protected:
    using Levels = std::map<std::uint32_t, std::array<float, 3>>; ///< of a patch's borders

    Cameras()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(camera(), kWidth, kHeight);
        camera().setName("main");
        // OSG would put planes of its own into the projections.
        camera().setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
        camera().setViewMatrixAsLookAt(osg::Vec3d(2.0, -0.9, 0.5), osg::Vec3d(0.0, 0.2, 0.0),
                                       osg::Vec3d(0.0, 0.1, 1.0));
        camera().setProjectionMatrix(plain);
        drawable->setSelectionObserver(observer.get());
        ask(2.0);
        place->addChild(drawable.get());
        root->addChild(place.get());
        viewer.setSceneData(root.get());
        viewer.realize();
    }
    ~Cameras() override { EXPECT_EQ(warnings.text(), ""); }

    osg::Camera& camera() { return *viewer.getCamera(); }
    void ask(double errorPixels)
    {
        SelectionOptions options;
        options.errorPixels = errorPixels;
        drawable->setOptions(options);
    }
    /// What the camera of this name selects in a frame.
    Levels selected(const std::string& name = "main")
    {
        observer->take();
        viewer.renderingTraversals();
        Levels levels;
        for (const auto& entry : observer->take()) {
            if (entry.camera != name) { continue; }
            for (const PatchRecord& record : entry.records) { levels[record.patch] = record.edgeLevels; }
        }
        const auto shows = [](const auto& patch) { return patch.second[0] > 0.5F && patch.second[0] < 4.9F; };
        EXPECT_TRUE(std::all_of(levels.begin(), levels.end(), shows))
            << name << ": what is at either end shows nothing";
        EXPECT_FALSE(levels.empty()) << name;
        return levels;
    }
    Levels selectedThrough(const osg::Matrixd& projection)
    {
        camera().setProjectionMatrix(projection);
        return selected();
    }
    osg::ref_ptr<osg::Camera> addTextureCamera(int sizePixels, osg::Transform::ReferenceFrame frame)
    {
        osg::ref_ptr<osg::Camera> texture = makeTextureCamera(place.get(), sizePixels);
        texture->setReferenceFrame(frame);
        texture->setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
        root->addChild(texture.get());
        return texture;
    }
    static void expectNear(const Levels& levels, const Levels& expected, float tolerance)
    {
        for (const auto& [patch, edges] : levels) {
            ASSERT_EQ(expected.count(patch), 1U) << patch;
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_NEAR(edges[k], expected.at(patch)[k], tolerance) << "patch " << patch;
            }
        }
    }

    const osg::Matrixd plain = osg::Matrixd::perspective(40.0, 1.5, 0.1, 100.0);
    WarningCollector warnings;
    osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(32, false)));
    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    osg::ref_ptr<osg::MatrixTransform> place = new osg::MatrixTransform;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
};

TEST_F(Cameras, depthRangesDoNotMatter)
{
    const Levels expected = selectedThrough(plain);
    const auto withDepth = [&](double ofZ, double ofOne) {
        osg::Matrixd projection = plain;
        projection(2, 2) = ofZ;
        projection(3, 2) = ofOne;
        return projection;
    };
    EXPECT_EQ(selectedThrough(plain * osg::Matrixd::scale(1.0, 1.0, -1.0)), expected) << "reversed";
    EXPECT_EQ(selectedThrough(withDepth(-1.0, -0.2)), expected) << "infinite";
    EXPECT_EQ(selectedThrough(withDepth(0.0, 0.1)), expected) << "reversed and infinite, depth from 1 to 0";
    EXPECT_EQ(selectedThrough(osg::Matrixd::perspective(40.0, 1.5, 1e-3, 10.0)), expected) << "other planes";
}

TEST_F(Cameras, tilesOfAViewSelectWhatAllOfItDoes)
{
    const auto frustum = [](double left, double right, double bottom, double top) {
        return osg::Matrixd::frustum(0.03 * left, 0.03 * right, 0.02 * bottom, 0.02 * top, 0.1, 100.0);
    };
    const Levels whole = selectedThrough(frustum(-1.0, 1.0, -1.0, 1.0));
    camera().setViewport(0, 0, kWidth / 2, kHeight / 2);
    Levels ofTiles;
    for (const double x : {-1.0, 0.0}) {
        for (const double y : {-1.0, 0.0}) {
            const Levels tile = selectedThrough(frustum(x, x + 1.0, y, y + 1.0));
            expectNear(tile, whole, 1e-4F);
            ofTiles.insert(tile.begin(), tile.end());
        }
    }
    EXPECT_EQ(ofTiles.size(), whole.size());
}

TEST_F(Cameras, lodScaleMultipliesTheErrorAsked)
{
    const osg::ref_ptr<osg::Camera> texture = addTextureCamera(64, osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT);
    for (const float scale : {0.5F, 4.0F}) {
        ask(2.0);
        camera().setLODScale(scale);
        const Levels scaled = selected();
        EXPECT_EQ(selected("texture"), scaled) << scale;
        camera().setLODScale(1.0F);
        EXPECT_NE(selected(), scaled) << scale;
        ask(2.0 * double{scale});
        EXPECT_EQ(selected(), scaled) << scale;
    }
}

TEST_F(Cameras, orthographicViewsAreThoseFromAfar)
{
    constexpr double kAfar = 1e5;
    constexpr double kHalfHeight = 1.1;
    for (const osg::Vec3d& direction : {osg::Vec3d(1.0, 0.0, 0.0), osg::Vec3d(-0.3, 0.5, 0.8)}) {
        camera().setProjectionMatrixAsOrtho(-1.5 * kHalfHeight, 1.5 * kHalfHeight, -kHalfHeight, kHalfHeight, -10.0,
                                            10.0);
        camera().setViewMatrixAsLookAt(direction, osg::Vec3d(), osg::Vec3d(0.0, 0.1, 1.0));
        const Levels orthographic = selected();
        const osg::Vec3d eye = direction * (kAfar / direction.length());
        camera().setViewMatrixAsLookAt(eye, osg::Vec3d(), osg::Vec3d(0.0, 0.1, 1.0));
        const double angle = 2.0 * std::atan(kHalfHeight / kAfar);
        const Levels distant =
            selectedThrough(osg::Matrixd::perspective(osg::RadiansToDegrees(angle), 1.5, 0.9 * kAfar, 1.1 * kAfar));
        EXPECT_EQ(orthographic.size(), distant.size());
        expectNear(orthographic, distant, 1e-3F);
    }
}

TEST_F(Cameras, textureCamerasSelectForTheirOwnViewAndPixels)
{
    place->setMatrix(osg::Matrixd::scale(0.8, 0.8, 0.8) * osg::Matrixd::rotate(0.4, 1.0, 2.0, 3.0) *
                     osg::Matrixd::translate(0.3, 0.0, -0.2));
    constexpr int kTexels = 64;
    const osg::Matrixd projection = osg::Matrixd::perspective(60.0, 1.0, 0.1, 100.0);
    const osg::Matrixd look = osg::Matrixd::lookAt(osg::Vec3d(-0.5, 0.9, 2.5), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    const osg::Matrixd mainLook = camera().getViewMatrix();

    camera().setViewport(0, 0, kTexels, kTexels);
    camera().setViewMatrix(look);
    const Levels own = selectedThrough(projection);
    camera().setViewMatrix(mainLook);
    const Levels mains = selectedThrough(plain);
    camera().setViewport(0, 0, kWidth, kHeight);
    const Levels onScreen = selected();

    const osg::ref_ptr<osg::Camera> texture = addTextureCamera(kTexels, osg::Transform::ABSOLUTE_RF);
    texture->setViewMatrix(look);
    texture->setProjectionMatrix(projection);
    EXPECT_EQ(selected("texture"), own);
    EXPECT_EQ(selected(), onScreen);

    texture->setReferenceFrame(osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT);
    SelectionOptions options = drawable->getOptions();
    options.cullPatches = false;
    drawable->setOptions(options);
    expectNear(selected("texture"), selected(), 1e-6F);

    ask(2.0);
    texture->setReferenceFrame(osg::Transform::RELATIVE_RF);
    texture->setViewMatrix(osg::Matrixd());
    texture->setProjectionMatrix(osg::Matrixd());
    EXPECT_EQ(selected("texture"), mains) << "the main camera's matrices, its own pixels";
}

} // namespace
} // namespace osgTessLOD
