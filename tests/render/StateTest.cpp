// SPDX-License-Identifier: MIT
// OSG's state does to our surface what it does to ordinary geometry of the very triangles that are drawn.
#include <render/GlTest.h>
#include <render/PlainTwin.h>

#include <asset/SyntheticAsset.h>

#include <osg/AlphaFunc>
#include <osg/BlendFunc>
#include <osg/ClipPlane>
#include <osg/CullFace>
#include <osg/Fog>
#include <osg/FrontFace>
#include <osg/Light>
#include <osg/LightModel>
#include <osg/Material>
#include <osg/PolygonMode>
#include <osg/PolygonOffset>

namespace osgTessLOD {
namespace {

constexpr int kSize = 200;
// Both round colours to 8 bits, from sums in different orders.
constexpr int kRounding = 2;
// Lights that are near are computed at vertices by fixed function and at pixels by us: over triangles as small as these that is
// this much.
constexpr int kPerVertex = 6;
// Silhouettes and seams, where positions rounded otherwise by another order of multiplications cover another pixel: of 10⁴ drawn.
constexpr std::size_t kEdgePixels = 30;

class State : public testing::Test {
protected:
    State()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        viewer.setLightingMode(osg::View::NO_LIGHT);
        setUpHeadless(*viewer.getCamera(), kSize, kSize);
        viewer.getCamera()->setClearColor(osg::Vec4(0.1F, 0.2F, 0.5F, 1.0F));
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        viewer.getCamera()->setPostDrawCallback(capture.get());
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(5.0, 0.0, 0.0), osg::Vec3d(), osg::Vec3d(0.0, 0.1, 1.0));
        light->setPosition(osg::Vec4(0.7F, 0.4F, 0.6F, 0.0F));
        light->setAmbient(osg::Vec4(0.1F, 0.1F, 0.2F, 1.0F));
        light->setDiffuse(osg::Vec4(0.8F, 0.7F, 0.6F, 1.0F));
        light->setSpecular(osg::Vec4(0.9F, 0.9F, 0.7F, 1.0F));
        material->setAmbient(kBoth, osg::Vec4(0.5F, 0.4F, 0.3F, 1.0F));
        material->setDiffuse(kBoth, osg::Vec4(0.8F, 0.5F, 0.3F, 1.0F));
        state->setMode(GL_LIGHTING, osg::StateAttribute::ON);
        state->setAttributeAndModes(light.get());
        state->setAttributeAndModes(material.get());
        viewer.setSceneData(root.get());
        show(makeSyntheticAsset(32, false), 0.01);
        viewer.realize();
        viewer.renderingTraversals(); // a viewer's first frame is brighter
    }
    ~State() override { EXPECT_EQ(warnings.text(), ""); }

    void show(LodAsset asset, double errorPixels)
    {
        drawable = new TessLODDrawable(std::make_shared<const LodAsset>(std::move(asset)));
        drawable->setSelectionObserver(observer.get());
        SelectionOptions options;
        options.errorPixels = errorPixels;
        options.cullPatches = false;
        drawable->setOptions(options);
    }
    osg::ref_ptr<osg::Image> pictureOf(osg::Node& node)
    {
        subject->removeChildren(0, subject->getNumChildren());
        subject->addChild(&node);
        viewer.renderingTraversals();
        return osg::clone(&snapshot->image(), osg::CopyOp::DEEP_COPY_ALL);
    }
    /// Draws both under the same state. At least `drawn` pixels must be other than the background.
    void expectAlike(const char* what, int tolerance = kRounding, std::size_t drawn = 2000)
    {
        const osg::ref_ptr<osg::Image> nothing = pictureOf(*new osg::Group);
        const osg::ref_ptr<osg::Image> ours = pictureOf(*drawable);
        const osg::ref_ptr<osg::Image> theirs = pictureOf(*plainGeometry(capture->corners));
        EXPECT_LE(differingPixels(*ours, *theirs, tolerance), kEdgePixels) << what;
        EXPECT_GE(differingPixels(*theirs, *nothing, 0), drawn) << what;
        last = ours;
    }
    /// The last picture is not the one before it: what was changed in between is seen.
    void expectChanged(const osg::Image& before, const char* what)
    {
        EXPECT_GT(differingPixels(before, *last, kPerVertex), 500U) << what;
    }

    static constexpr osg::Material::Face kBoth = osg::Material::FRONT_AND_BACK;
    WarningCollector warnings;
    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    osg::ref_ptr<LastCapture> capture = new LastCapture(*observer);
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osg::ref_ptr<osg::Group> subject = [this] {
        root->addChild(new osg::Group);
        return root->getChild(0)->asGroup();
    }();
    osg::ref_ptr<osg::StateSet> state = subject->getOrCreateStateSet();
    osg::ref_ptr<osg::Light> light = new osg::Light(0);
    osg::ref_ptr<osg::Material> material = new osg::Material;
    osg::ref_ptr<TessLODDrawable> drawable;
    osg::ref_ptr<osg::Image> last;
    osgViewer::Viewer viewer;
};

TEST_F(State, materials)
{
    expectAlike("ambient and diffuse");
    const osg::ref_ptr<osg::Image> before = last;
    material->setEmission(kBoth, osg::Vec4(0.2F, 0.0F, 0.1F, 1.0F));
    expectAlike("emission");
    material->setSpecular(kBoth, osg::Vec4(0.9F, 0.8F, 0.9F, 1.0F));
    material->setShininess(kBoth, 20.0F);
    expectAlike("specular", kPerVertex);
    expectChanged(*before, "emission and specular");
}

TEST_F(State, lights)
{
    const osg::ref_ptr<osg::LightModel> model = new osg::LightModel;
    model->setAmbientIntensity(osg::Vec4(0.3F, 0.1F, 0.1F, 1.0F));
    state->setAttribute(model.get());
    expectAlike("light model's ambient");
    const osg::ref_ptr<osg::Image> one = last;

    const osg::ref_ptr<osg::Light> other = new osg::Light(5);
    other->setPosition(osg::Vec4(0.0F, -1.0F, 0.2F, 0.0F));
    other->setDiffuse(osg::Vec4(0.0F, 0.5F, 0.9F, 1.0F));
    state->setAttributeAndModes(other.get());
    expectAlike("two directional lights");
    expectChanged(*one, "second light");

    const osg::ref_ptr<osg::Image> directional = last;
    other->setPosition(osg::Vec4(2.0F, -2.0F, 0.5F, 1.0F));
    other->setConstantAttenuation(0.5F);
    other->setLinearAttenuation(0.2F);
    other->setQuadraticAttenuation(0.1F);
    expectAlike("point light", kPerVertex);
    expectChanged(*directional, "point light");

    const osg::ref_ptr<osg::Image> point = last;
    other->setPosition(osg::Vec4(3.0F, -1.0F, 0.5F, 1.0F));
    other->setDirection(osg::Vec3(-3.0F, 1.0F, -0.5F));
    other->setSpotCutoff(40.0F); // wider than the body: no edge that vertices would blur
    other->setSpotExponent(8.0F);
    expectAlike("spot light", kPerVertex);
    expectChanged(*point, "spot light");

    model->setLocalViewer(true);
    material->setSpecular(kBoth, osg::Vec4(0.9F, 0.8F, 0.9F, 1.0F));
    material->setShininess(kBoth, 10.0F);
    expectAlike("local viewer", kPerVertex);

    state->setMode(GL_LIGHT0, osg::StateAttribute::OFF);
    state->setMode(GL_LIGHT5, osg::StateAttribute::OFF);
    expectAlike("no light");
}

TEST_F(State, fog)
{
    const osg::ref_ptr<osg::Fog> fog = new osg::Fog;
    fog->setColor(osg::Vec4(0.1F, 0.9F, 0.3F, 1.0F));
    fog->setStart(4.0F);
    fog->setEnd(5.2F);
    fog->setDensity(0.17F);
    expectAlike("without");
    state->setAttributeAndModes(fog.get());
    for (const auto mode : {osg::Fog::LINEAR, osg::Fog::EXP, osg::Fog::EXP2}) {
        const osg::ref_ptr<osg::Image> before = last;
        fog->setMode(mode);
        expectAlike("fog", 4); // through Mesa's own table-free fog: one more rounding each way
        expectChanged(*before, "fog");
    }
}

TEST_F(State, clipPlanes)
{
    expectAlike("whole");
    const osg::ref_ptr<osg::Image> whole = last;
    for (unsigned k = 0; k < 3; ++k) {
        state->setAttributeAndModes(new osg::ClipPlane(k, k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.3, k == 2 ? 1.0 : 0.1, -0.2));
    }
    expectAlike("clipped", kRounding, 500);
    expectChanged(*whole, "clipped");
}

TEST_F(State, wireframeAndPoints)
{
    show(makeSyntheticAsset(8, false), 0.01);
    state->setMode(GL_LIGHTING, osg::StateAttribute::OFF); // lines have no face to take a normal from
    material->setDiffuse(kBoth, osg::Vec4(1.0F, 1.0F, 1.0F, 1.0F)); // unlit, it is ours and the colour theirs
    expectAlike("filled");
    for (const auto mode : {osg::PolygonMode::LINE, osg::PolygonMode::POINT}) {
        const osg::ref_ptr<osg::Image> before = last;
        state->setAttributeAndModes(new osg::PolygonMode(osg::PolygonMode::FRONT_AND_BACK, mode));
        expectAlike("mode", kRounding, 300);
        expectChanged(*before, "mode");
    }
}

TEST_F(State, polygonOffset)
{
    // Over a copy in another colour that has been drawn before: the offset alone decides.
    pictureOf(*drawable);
    const osg::ref_ptr<osg::Geometry> below = plainGeometry(capture->corners);
    below->getOrCreateStateSet()->setMode(GL_LIGHTING, osg::StateAttribute::OFF);
    below->getOrCreateStateSet()->setRenderBinDetails(-1, "RenderBin");
    root->addChild(below.get());
    const osg::ref_ptr<osg::PolygonOffset> offset = new osg::PolygonOffset(0.0F, 0.0F);
    state->setAttributeAndModes(offset.get());
    std::vector<osg::ref_ptr<osg::Image>> pictures;
    for (const float units : {-20.0F, 20.0F}) {
        offset->setUnits(units);
        offset->setFactor(units / 20.0F);
        expectAlike("offset", kRounding, units < 0.0F ? 2000 : 0);
        pictures.push_back(last);
    }
    EXPECT_GT(differingPixels(*pictures[0], *pictures[1], kRounding), 2000U);
}

TEST_F(State, blendingAndAlphaTest)
{
    material->setAlpha(kBoth, 0.4F);
    state->setAttributeAndModes(new osg::BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA));
    state->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK)); // one layer
    expectAlike("blended");
    const osg::ref_ptr<osg::Image> blended = last;
    state->setMode(GL_BLEND, osg::StateAttribute::OFF);
    expectAlike("opaque");
    expectChanged(*blended, "opaque");
    state->setAttributeAndModes(new osg::AlphaFunc(osg::AlphaFunc::GREATER, 0.3F));
    expectAlike("passes");
    state->setAttributeAndModes(new osg::AlphaFunc(osg::AlphaFunc::GREATER, 0.5F));
    expectAlike("does not pass", kRounding, 0);
    const osg::ref_ptr<osg::Image> nothing = pictureOf(*new osg::Group);
    EXPECT_EQ(differingPixels(*last, *nothing, 0), 0U);
}

TEST_F(State, cullFaceAndFrontFace)
{
    show(makeSyntheticSheet(8, 2, false), 0.01); // open: lies in the plane z = 0
    const osg::Vec3d target(1.0, 1.0, 0.0);
    viewer.getCamera()->setViewMatrixAsLookAt(target + osg::Vec3d(0.3, -1.0, 4.5), target, osg::Vec3d(0.0, 1.0, 0.0));
    const auto visible = [&] { return differingPixels(*last, *pictureOf(*new osg::Group), 0) > 2000U; };
    state->setAttributeAndModes(new osg::CullFace(osg::CullFace::BACK));
    expectAlike("front seen");
    EXPECT_TRUE(visible());
    state->setAttributeAndModes(new osg::CullFace(osg::CullFace::FRONT));
    expectAlike("front culled", kRounding, 0);
    EXPECT_FALSE(visible());
    state->setAttributeAndModes(new osg::FrontFace(osg::FrontFace::CLOCKWISE));
    const osg::ref_ptr<osg::Image> nothing = pictureOf(*new osg::Group);
    EXPECT_GT(differingPixels(*pictureOf(*drawable), *nothing, 0), 2000U);
}

TEST_F(State, twoSidedLighting)
{
    show(makeSyntheticSheet(8, 2, false), 0.01);
    const osg::ref_ptr<osg::LightModel> model = new osg::LightModel;
    model->setTwoSided(true);
    state->setAttribute(model.get());
    material->setDiffuse(osg::Material::BACK, osg::Vec4(0.1F, 0.2F, 0.9F, 1.0F));
    material->setAmbient(osg::Material::BACK, osg::Vec4(0.4F, 0.1F, 0.1F, 1.0F));
    material->setSpecular(osg::Material::BACK, osg::Vec4(0.6F, 0.6F, 0.1F, 1.0F));
    material->setShininess(osg::Material::BACK, 5.0F);
    const osg::Vec3d target(1.0, 1.0, 0.0);
    std::vector<osg::ref_ptr<osg::Image>> pictures;
    for (const double side : {1.0, -1.0}) {
        light->setPosition(osg::Vec4(0.3F, 0.4F, static_cast<float>(side), 0.0F));
        viewer.getCamera()->setViewMatrixAsLookAt(target + osg::Vec3d(0.3, -1.0, 4.5 * side), target,
                                                  osg::Vec3d(0.0, 1.0, 0.0));
        expectAlike(side > 0.0 ? "front" : "back", kPerVertex);
        pictures.push_back(last);
    }
    const auto blueInTheMiddle = [](const osg::Image& image) { return image.getColor(kSize / 2U, kSize / 2U).b(); };
    EXPECT_GT(blueInTheMiddle(*pictures[1]), 1.5F * blueInTheMiddle(*pictures[0]));
}

} // namespace
} // namespace osgTessLOD
