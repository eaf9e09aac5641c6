// SPDX-License-Identifier: MIT
// Surfaces cast and receive the shadows of osgShadow's techniques as ordinary geometry of the same triangles does.
#include <render/GlTest.h>
#include <render/PlainTwin.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/CullFace>
#include <osg/LightModel>
#include <osg/LightSource>
#include <osg/Material>
#include <osgShadow/ShadowMap>
#include <osgShadow/ShadowedScene>
#include <osgShadow/ViewDependentShadowMap>

#include <map>

namespace osgTessLOD {
namespace {

constexpr int kSize = 320;

/// A body above a sheet, both ours, lit from above and one side.
class Shadows : public testing::Test {
protected:
    struct Thing {
        osg::ref_ptr<TessLODDrawable> drawable;
        osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
        osg::ref_ptr<LastCapture> capture = new LastCapture(*observer);
        osg::ref_ptr<osg::MatrixTransform> place;
    };

    Shadows()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        viewer.setLightingMode(osg::View::NO_LIGHT);
        setUpHeadless(camera(), kSize, kSize);
        camera().setName("main");
        camera().setClearColor(osg::Vec4(0.2F, 0.3F, 0.5F, 1.0F));
        camera().setFinalDrawCallback(snapshot.get());
        camera().setViewMatrixAsLookAt(osg::Vec3d(2.0, -9.0, 6.0), osg::Vec3d(0.0, 0.0, 0.5),
                                       osg::Vec3d(0.0, 0.0, 1.0));
        make(body, makeSyntheticAsset(32, false), osg::Matrixd::translate(0.0, 0.0, 1.6));
        make(sheet, makeSyntheticSheet(16, 4, false), osg::Matrixd::translate(-2.0, -2.0, 0.0));
        const osg::ref_ptr<osg::LightSource> source = new osg::LightSource;
        source->getLight()->setPosition(osg::Vec4(-0.5F, -0.2F, 1.0F, 0.0F));
        source->getLight()->setDiffuse(osg::Vec4(0.8F, 0.8F, 0.7F, 1.0F));
        source->getLight()->setAmbient(osg::Vec4(0.0F, 0.0F, 0.0F, 1.0F)); // ShadowMap would set it so
        scene->addChild(source.get());
        const osg::ref_ptr<osg::Material> material = new osg::Material;
        material->setDiffuse(osg::Material::FRONT_AND_BACK, osg::Vec4(0.9F, 0.7F, 0.4F, 1.0F));
        material->setAmbient(osg::Material::FRONT_AND_BACK, osg::Vec4(0.6F, 0.5F, 0.5F, 1.0F));
        scene->getOrCreateStateSet()->setAttributeAndModes(material.get());
        // What is left in the shadow is compared apart: where gl_FrontLightModelProduct.sceneColor is asked for beside
        // fixed-function vertices, as in ViewDependentShadowMap's program, Mesa 22.3 gives black.
        model->setAmbientIntensity(osg::Vec4(0.0F, 0.0F, 0.0F, 1.0F));
        scene->getStateSet()->setAttribute(model.get());
        settings->setTextureSize(osg::Vec2s(1024, 1024));
        scene->getStateSet()->setMode(GL_LIGHTING, osg::StateAttribute::ON);
        scene->getStateSet()->setMode(GL_LIGHT0, osg::StateAttribute::ON);
        // Backs alone cast shadows then, as both techniques would have it: nothing shadows itself in specks of rounding.
        scene->getStateSet()->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
        viewer.setSceneData(scene.get());
        viewer.realize();
        frame(); // a viewer's first frame is brighter
    }
    ~Shadows() override { EXPECT_EQ(warnings.text(), ""); }

    void frame()
    {
        viewer.advance();
        viewer.updateTraversal();
        viewer.renderingTraversals();
    }
    osg::Camera& camera() { return *viewer.getCamera(); }
    void make(Thing& thing, LodAsset asset, const osg::Matrixd& matrix)
    {
        thing.drawable = new TessLODDrawable(std::make_shared<const LodAsset>(std::move(asset)));
        thing.drawable->setSelectionObserver(thing.observer.get());
        SelectionOptions options;
        options.cullPatches = false;
        options.errorPixels = 4.0;
        thing.drawable->setOptions(options);
        thing.place = new osg::MatrixTransform(matrix);
        thing.place->addChild(thing.drawable.get());
        scene->addChild(thing.place.get());
    }
    void showWith(osgShadow::ShadowTechnique* technique)
    {
        if (technique == nullptr) {
            viewer.setSceneData(scene.get());
        } else {
            const osg::ref_ptr<osgShadow::ShadowedScene> shadowed = new osgShadow::ShadowedScene(technique);
            shadowed->setShadowSettings(settings.get());
            shadowed->addChild(scene.get());
            viewer.setSceneData(shadowed.get());
        }
    }
    osg::ref_ptr<osg::Image> picture()
    {
        for (int k = 0; k < 3; ++k) { frame(); } // techniques set themselves up on the way
        return osg::clone(&snapshot->image(), osg::CopyOp::DEEP_COPY_ALL);
    }
    /// Ordinary geometry of what was drawn in place of our surfaces.
    void replaceByPlain()
    {
        for (Thing* thing : {&body, &sheet}) {
            thing->observer->take();
            camera().setPostDrawCallback(thing->capture.get());
            frame();
            thing->place->removeChildren(0, 1);
            thing->place->addChild(plainGeometry(thing->capture->corners).get());
        }
        camera().setPostDrawCallback(nullptr);
    }
    void expectShadowsOf(osgShadow::ShadowTechnique* technique)
    {
        const osg::ref_ptr<osg::Image> without = picture();
        showWith(technique);
        const osg::ref_ptr<osg::Image> ours = picture();
        checkSelections();
        replaceByPlain();
        const osg::ref_ptr<osg::Image> theirs = picture();
        showWith(nullptr);
        const osg::ref_ptr<osg::Image> plain = picture();
        EXPECT_LT(differingPixels(*without, *plain, 2), 20U) << "without shadows";
        const std::size_t shadowed = differingPixels(*theirs, *plain, 20);
        EXPECT_GT(shadowed, 2000U) << "no shadow to compare";
        // Along the edges of shadows and of what is unlit a texel more or less may count as dark.
        EXPECT_LT(differingPixels(*ours, *theirs, 4), shadowed / 20);
        // The body's shadow falls on the sheet, to the right, in both; beside it is light.
        const auto brightness = [](const osg::Image& image, unsigned x, unsigned y) {
            const osg::Vec4 c = image.getColor(x, y);
            return c.r() + c.g() + c.b();
        };
        EXPECT_LT(brightness(*ours, inShadow().first, inShadow().second),
                  0.8F * brightness(*without, inShadow().first, inShadow().second));
    }
    /// A pixel of the sheet that the body's shadow falls on.
    std::pair<unsigned, unsigned> inShadow()
    {
        const osg::Vec3d at = osg::Vec3d(0.8, 0.3, 0.0) * camera().getViewMatrix() * camera().getProjectionMatrix() *
                              camera().getViewport()->computeWindowMatrix();
        return {static_cast<unsigned>(at.x()), static_cast<unsigned>(at.y())};
    }
    /// What is drawn into the map is what is drawn on screen.
    void checkSelections()
    {
        for (Thing* thing : {&body, &sheet}) {
            thing->observer->take();
            frame();
            std::map<std::uint32_t, std::array<float, 3>> onScreen;
            std::size_t compared = 0;
            const auto entries = thing->observer->take();
            for (const auto& entry : entries) {
                if (entry.camera != "main") { continue; }
                for (const PatchRecord& record : entry.records) { onScreen[record.patch] = record.edgeLevels; }
            }
            for (const auto& entry : entries) {
                if (entry.camera == "main") { continue; }
                for (const PatchRecord& record : entry.records) {
                    EXPECT_EQ(record.edgeLevels, onScreen[record.patch]);
                    ++compared;
                }
            }
            EXPECT_GE(compared, onScreen.size());
            EXPECT_EQ(compared % onScreen.size(), 0U) << "every map has all of it";
        }
    }

    WarningCollector warnings;
    Thing body;
    Thing sheet;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<osg::Group> scene = new osg::Group;
    osg::ref_ptr<osg::LightModel> model = new osg::LightModel;
    osg::ref_ptr<osgShadow::ShadowSettings> settings = new osgShadow::ShadowSettings;
    osgViewer::Viewer viewer;
};

TEST_F(Shadows, ofShadowMap)
{
    expectShadowsOf(new osgShadow::ShadowMap);
}

TEST_F(Shadows, ofShadowMapsThatAreSetUpOtherwise)
{
    const osg::ref_ptr<osgShadow::ShadowMap> technique = new osgShadow::ShadowMap;
    technique->setAmbientBias(osg::Vec2(0.2F, 0.8F));
    technique->setTextureSize(osg::Vec2s(512, 512));
    expectShadowsOf(technique.get());
}

TEST_F(Shadows, ofViewDependentShadowMap)
{
    expectShadowsOf(new osgShadow::ViewDependentShadowMap);
}

TEST_F(Shadows, ofPlacementsAreThoseOfDrawablesUnderTransforms)
{
    for (const bool isViewDependent : {false, true}) {
        const auto showAll = [&] {
            if (isViewDependent) {
                showWith(new osgShadow::ViewDependentShadowMap);
            } else {
                showWith(new osgShadow::ShadowMap);
            }
            return picture();
        };
        const osg::ref_ptr<osg::Image> without = picture();
        const osg::ref_ptr<osg::Image> theirs = showAll();
        for (Thing* thing : {&body, &sheet}) {
            const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(thing->drawable->getAsset());
            instances->setOptions(thing->drawable->getOptions());
            instances->setPlacements({thing->place->getMatrix()});
            scene->replaceChild(thing->place.get(), instances.get());
        }
        const std::size_t shadowed = differingPixels(*theirs, *without, 20);
        EXPECT_GT(shadowed, 2000U) << "no shadow to compare";
        EXPECT_LT(differingPixels(*showAll(), *theirs, 4), shadowed / 20);
        for (unsigned k = scene->getNumChildren(); k-- > 0;) {
            if (dynamic_cast<TessLODInstances*>(scene->getChild(k)) != nullptr) { scene->removeChild(k); }
        }
        scene->addChild(body.place.get());
        scene->addChild(sheet.place.get());
        showWith(nullptr);
    }
}

TEST_F(Shadows, leaveWhatIsThereWithoutLight)
{
    model->setAmbientIntensity(osg::Vec4(0.5F, 0.5F, 0.5F, 1.0F)); // of a material's ambient (0.6, 0.5, 0.5)
    showWith(new osgShadow::ViewDependentShadowMap);
    const osg::Vec4 color = picture()->getColor(inShadow().first, inShadow().second);
    EXPECT_NEAR(color.r(), 0.30F, 0.004F); // rounded to 8 bits
    EXPECT_NEAR(color.g(), 0.25F, 0.004F);
    EXPECT_NEAR(color.b(), 0.25F, 0.004F);
}

TEST_F(Shadows, ofTwoMapsPerLightOnOtherUnits)
{
    settings->setNumShadowMapsPerLight(2);
    settings->setBaseShadowTextureUnit(3);
    expectShadowsOf(new osgShadow::ViewDependentShadowMap);
}

} // namespace
} // namespace osgTessLOD
