// SPDX-License-Identifier: MIT
// Whole frames through osgViewer.
#include <render/GlTest.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Fog>
#include <osg/Light>
#include <osg/Material>
#include <osg/MatrixTransform>
#include <osg/PolygonMode>
#include <osg/ShapeDrawable>
#include <osg/TexMat>
#include <osg/Texture2D>

#include <array>
#include <cmath>
#include <random>

namespace osgTessLOD {
namespace {

constexpr int kSize = 200;
using Pixel = std::array<int, 3>;

class Rendering : public testing::Test {
protected:
    void SetUp() override
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        viewer.setRealizeOperation(nullptr);
        setUpHeadless(camera(), kSize, kSize);
        camera().setName("main");
        camera().setClearColor(osg::Vec4(0.0F, 0.0F, 1.0F, 1.0F));
        camera().setFinalDrawCallback(snapshot.get());
        lookFrom({5.0, 0.0, 0.0});
        drawable->setSelectionObserver(observer.get());
        root->addChild(drawable.get());
        viewer.setSceneData(root.get());
        viewer.realize();
    }
    void TearDown() override { EXPECT_EQ(warnings.text(), ""); }

    osg::Camera& camera() { return *viewer.getCamera(); }
    void lookFrom(const osg::Vec3d& eye)
    {
        camera().setViewMatrixAsLookAt(eye, osg::Vec3d(), osg::Vec3d(0.0, 0.1, 1.0));
    }
    void ask(double errorPixels)
    {
        SelectionOptions options = drawable->getOptions();
        options.errorPixels = errorPixels;
        drawable->setOptions(options);
    }
    void frame() { viewer.renderingTraversals(); }
    Pixel pixel(int x, int y) const
    {
        const unsigned char* p = snapshot->image().data(static_cast<unsigned>(x), static_cast<unsigned>(y));
        return {p[0], p[1], p[2]};
    }
    /// The middle of a picture of one child of the root alone.
    Pixel centerOf(unsigned shown)
    {
        for (unsigned k = 0; k < root->getNumChildren(); ++k) { root->getChild(k)->setNodeMask(k == shown ? ~0U : 0U); }
        frame();
        return pixel(kSize / 2, kSize / 2);
    }
    static bool isBackground(const Pixel& p) { return p == Pixel{0, 0, 255}; }
    SelectionView selectedView(const std::string& cameraName)
    {
        SelectionView view;
        for (const auto& entry : observer->take()) {
            if (entry.camera == cameraName) { view = entry.selection->view(); }
        }
        return view;
    }

    WarningCollector warnings;
    osg::ref_ptr<TessLODDrawable> drawable =
        new TessLODDrawable(std::make_shared<const LodAsset>(makeSyntheticAsset(32, true)));
    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
};

TEST_F(Rendering, noBackgroundShinesThrough)
{
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    for (int k = 0; k < 30; ++k) {
        osg::Vec3d eye(normal(random), normal(random), normal(random));
        eye.normalize();
        lookFrom(eye * (k % 3 == 0 ? 4.5 : 3.0 + k % 3)); // the nearest views do not see all of it
        ask(std::exp(std::uniform_real_distribution<double>(-1.0, 4.0)(random)));
        frame();
        int covered = 0;
        for (int y = 0; y < kSize;
             ++y) { // the silhouette of a nearly round body: one run per row, but for its very ends
            int runs = 0;
            for (int x = 0; x < kSize; ++x) {
                const bool inside = !isBackground(pixel(x, y));
                runs += inside && (x == 0 || isBackground(pixel(x - 1, y))) ? 1 : 0;
                covered += inside ? 1 : 0;
            }
            if (y > kSize / 4 && y < 3 * kSize / 4) { EXPECT_EQ(runs, 1) << "row " << y << " of view " << k; }
        }
        EXPECT_GT(covered, kSize * kSize / 10);
    }
}

TEST_F(Rendering, isLitAsFixedFunctionGeometryIs)
{
    // A smooth sphere of the same size beside it, drawn by OSG: the same material and light give about the same colour.
    const osg::ref_ptr<osg::Material> material = new osg::Material;
    material->setDiffuse(osg::Material::FRONT_AND_BACK, osg::Vec4(0.9F, 0.5F, 0.2F, 1.0F));
    material->setAmbient(osg::Material::FRONT_AND_BACK, osg::Vec4(0.1F, 0.4F, 0.2F, 1.0F));
    root->getOrCreateStateSet()->setAttributeAndModes(material.get(),
                                                      osg::StateAttribute::OVERRIDE | osg::StateAttribute::ON);
    const osg::ref_ptr<osg::ShapeDrawable> sphere = new osg::ShapeDrawable(new osg::Sphere(osg::Vec3(), 1.0F));
    root->addChild(sphere.get());
    for (const bool lighting : {true, false}) {
        root->getStateSet()->setMode(GL_LIGHTING, (lighting ? osg::StateAttribute::ON : osg::StateAttribute::OFF) |
                                                      osg::StateAttribute::OVERRIDE);
        const Pixel ours = centerOf(0);
        if (!lighting) {
            EXPECT_EQ(ours, (Pixel{230, 128, 51})); // the diffuse colour as it is
            continue;
        }
        const Pixel theirs = centerOf(1);
        for (std::size_t k = 0; k < 3; ++k) { EXPECT_NEAR(ours[k], theirs[k], 25); }
        EXPECT_GT(ours[0], ours[1]);
        EXPECT_GT(ours[1], ours[2]);
    }
}

TEST_F(Rendering, pointAndSpotLightsAreThoseOfFixedFunctionGeometry)
{
    viewer.setLightingMode(osg::View::NO_LIGHT);
    root->addChild(new osg::ShapeDrawable(new osg::Sphere(osg::Vec3(), 1.0F)));
    const osg::ref_ptr<osg::Light> light = new osg::Light(3);
    light->setPosition(osg::Vec4(4.0F, 1.0F, 1.0F, 1.0F));
    light->setDiffuse(osg::Vec4(1.0F, 0.6F, 0.3F, 1.0F));
    light->setLinearAttenuation(0.1F);
    osg::StateSet* state = root->getOrCreateStateSet();
    state->setMode(GL_LIGHTING, osg::StateAttribute::ON);
    state->setAttributeAndModes(light.get());
    state->setAttributeAndModes(new osg::Material, osg::StateAttribute::OVERRIDE | osg::StateAttribute::ON);

    struct Case {
        osg::Vec3 direction;
        float cutoffDegrees;
        bool reaches;
    };
    for (const Case& c : {Case{{-1.0F, 0.0F, 0.0F}, 180.0F, true}, Case{{-3.0F, -1.0F, -1.0F}, 30.0F, true},
                          Case{{0.0F, 0.0F, 1.0F}, 30.0F, false}}) {
        light->setDirection(c.direction);
        light->setSpotCutoff(c.cutoffDegrees);
        const Pixel ours = centerOf(0);
        const Pixel theirs = centerOf(1);
        for (std::size_t k = 0; k < 3; ++k) { EXPECT_NEAR(ours[k], theirs[k], 25) << c.cutoffDegrees; }
        EXPECT_EQ(ours[0] > 100, c.reaches) << c.cutoffDegrees;
    }
}

TEST_F(Rendering, normalsAreLookedUpWhereVerticesLie)
{
    // A plane with the normals of steep waves: wherever its vertices lie, all levels and morphs are the same surface, and
    // must look like the finest.
    synthetic::Shape waves = synthetic::wavySheet(1);
    waves.base = {{0.0, -0.5, -0.5}, {0.0, 0.5, -0.5}, {0.0, -0.5, 0.5}, {0.0, 0.5, 0.5}}; // faces the camera
    synthetic::Shape plane = waves;
    plane.surface = [](const synthetic::Point& p) { return p; };
    waves.surface = [](const synthetic::Point& p) {
        return synthetic::Point{0.2 * std::sin(9.0 * p[1]) * std::cos(8.0 * p[2]), p[1], p[2]};
    };
    const auto ladder = synthetic::powersOfTwo(16);
    const auto withWaves = [&](bool displaced) {
        LodAsset asset = synthetic::build(plane, ladder, false, {}, displaced);
        asset.normals = synthetic::build(waves, ladder, true).normals;
        asset.validate();
        return asset;
    };
    const auto picture = [&](const LodAsset& asset, double errorPixels) {
        root->removeChild(drawable.get());
        drawable = new TessLODDrawable(std::make_shared<const LodAsset>(asset));
        root->addChild(drawable.get());
        SelectionOptions options;
        options.errorPixels = errorPixels;
        options.bound = SelectionOptions::Bound::FirstOrder; // which is between levels at nearly all errors
        drawable->setOptions(options);
        frame();
        std::vector<int> greys;
        for (int y = 0; y < kSize; ++y) {
            for (int x = 0; x < kSize; ++x) { greys.push_back(pixel(x, y)[1]); }
        }
        return greys;
    };
    const auto differing = [](const std::vector<int>& a, const std::vector<int>& b, int more) {
        std::size_t count = 0;
        for (std::size_t k = 0; k < a.size(); ++k) { count += std::abs(a[k] - b[k]) > more ? 1 : 0; }
        return count;
    };
    lookFrom({3.0, 0.0, 0.0});
    const LodAsset displaced = withWaves(true);
    LodAsset dropped = displaced;
    for (LodLevel& level : dropped.levels) { level.parameters.clear(); }
    frame(); // a viewer's first frame is brighter
    const std::vector<int> finest = picture(withWaves(false), 1e-6);
    EXPECT_GT(differing(finest, std::vector<int>(finest.size(), finest[kSize * kSize / 2]), 40), 2000U) << "no waves";
    for (const double errorPixels : {20.0, 10.0, 5.0, 3.0, 1.5, 0.7, 0.3}) {
        EXPECT_LT(differing(finest, picture(displaced, errorPixels), 3), 20U) << errorPixels;
    }
    EXPECT_GT(differing(finest, picture(dropped, 1.5), 20), 500U); // or it does not matter where they lie
}

TEST_F(Rendering, showsLevelsAsColours)
{
    root->getOrCreateStateSet()->setMode(GL_LIGHTING, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
    frame();
    const Pixel plain = pixel(kSize / 2, kSize / 2);
    EXPECT_EQ(plain[0], plain[2]); // grey
    root->getStateSet()->setDefine("TESSLOD_COLOR_BY_LEVEL");
    ask(1e-6); // level 5 everywhere
    frame();
    const Pixel finest = pixel(kSize / 2, kSize / 2);
    EXPECT_NEAR(finest[0], 0.98 * 255, 2);
    EXPECT_NEAR(finest[1], 0.60 * 255, 2);
    EXPECT_NEAR(finest[2], 0.15 * 255, 2);
    ask(1e6); // level 0
    frame();
    EXPECT_NEAR(pixel(kSize / 2, kSize / 2)[2], 0.55 * 255, 2);
}

TEST_F(Rendering, wireframeLeavesGaps)
{
    root->getOrCreateStateSet()->setAttribute(
        new osg::PolygonMode(osg::PolygonMode::FRONT_AND_BACK, osg::PolygonMode::LINE), osg::StateAttribute::OVERRIDE);
    ask(50.0);
    frame();
    int covered = 0;
    for (int x = 0; x < kSize; ++x) { covered += isBackground(pixel(x, kSize / 2)) ? 0 : 1; }
    EXPECT_GT(covered, 2);
    EXPECT_LT(covered, kSize / 3);
}

TEST_F(Rendering, fogHidesIt)
{
    const osg::ref_ptr<osg::Fog> fog = new osg::Fog;
    fog->setMode(osg::Fog::LINEAR);
    fog->setStart(0.0F);
    fog->setEnd(1.0F); // all of it is farther
    fog->setColor(osg::Vec4(0.0F, 1.0F, 0.0F, 1.0F));
    root->getOrCreateStateSet()->setAttributeAndModes(fog.get());
    frame();
    EXPECT_EQ(pixel(kSize / 2, kSize / 2), (Pixel{0, 255, 0}));
}

TEST_F(Rendering, livesBesideOtherGeometry)
{
    // Geometry leaves vertex arrays enabled and buffers bound; ours must neither suffer nor leave anything behind.
    const osg::ref_ptr<osg::MatrixTransform> aside = new osg::MatrixTransform(osg::Matrix::translate(0.0, 1.2, 0.0));
    const osg::ref_ptr<osg::ShapeDrawable> sphere = new osg::ShapeDrawable(new osg::Sphere(osg::Vec3(), 0.3F));
    sphere->setUseDisplayList(false);
    sphere->setUseVertexBufferObjects(true);
    aside->addChild(sphere.get());
    root->addChild(aside.get());
    root->addChild(osg::clone(drawable.get(), osg::CopyOp::SHALLOW_COPY));
    for (int order = 0; order < 2; ++order) {
        sphere->getOrCreateStateSet()->setRenderBinDetails(order == 0 ? -1 : 1, "RenderBin");
        for (int k = 0; k < 3; ++k) { frame(); }
        EXPECT_FALSE(isBackground(pixel(kSize / 2, kSize / 2)));
    }
}

TEST_F(Rendering, emptyViewportsAndViewsFromInsideAreSafe)
{
    for (const osg::Vec3d& eye : {osg::Vec3d(0.01, 0.0, 0.0), osg::Vec3d(0.99, 0.0, 0.0), osg::Vec3d(1e6, 0.0, 0.0)}) {
        lookFrom(eye);
        frame();
    }
    camera().setViewport(0, 0, 0, 0);
    camera().setFinalDrawCallback(nullptr);
    observer->take();
    frame();
    for (const auto& entry : observer->take()) {
        EXPECT_EQ(entry.selection->view().pixelScale, 0.0);
        EXPECT_EQ(entry.selection->statistics().triangles, entry.selection->statistics().patches);
    }
}

TEST_F(Rendering, pixelScaleIsWhatTheProjectionMagnifies)
{
    frame();
    const SelectionView view = selectedView("main");
    EXPECT_FALSE(view.orthographic);
    // A unit at distance 5, seen under the whole projection.
    const double expected = kSize / 2.0 / std::tan(osg::DegreesToRadians(15.0));
    EXPECT_NEAR(view.pixelScale, expected, 1e-6 * expected);
    EXPECT_NEAR((view.eye - osg::Vec3d(5.0, 0.0, 0.0)).length(), 0.0, 1e-5);

    camera().setLODScale(2.0F);
    frame();
    EXPECT_NEAR(selectedView("main").pixelScale, expected / 2.0, 1e-6 * expected);
    camera().setLODScale(1.0F);

    const osg::ref_ptr<osg::MatrixTransform> scaled = new osg::MatrixTransform(osg::Matrix::scale(3.0, 3.0, 3.0));
    root->removeChild(drawable.get());
    root->addChild(scaled.get());
    scaled->addChild(drawable.get());
    camera().setProjectionMatrixAsOrtho(-10.0, 10.0, -10.0, 10.0, -50.0, 50.0);
    frame();
    const SelectionView flat = selectedView("main");
    EXPECT_TRUE(flat.orthographic);
    EXPECT_NEAR(flat.pixelScale, 3.0 * kSize / 20.0, 1e-6);
}

TEST_F(Rendering, frozenSelectionsIgnoreTheCamera)
{
    SelectionOptions options;
    options.frozen = true;
    options.frozenView.eye = osg::Vec3d(0.0, 7.0, 0.0);
    options.frozenView.pixelScale = 321.0;
    drawable->setOptions(options);
    frame();
    const SelectionView view = selectedView("main");
    EXPECT_EQ(view.eye, options.frozenView.eye);
    EXPECT_EQ(view.pixelScale, 321.0);
}

TEST_F(Rendering, orthographicSelectionsFreezeToo)
{
    SelectionOptions options;
    options.frozen = true;
    options.frozenView.orthographic = true;
    options.frozenView.pixelScale = 5.0;
    options.frozenView.axis = osg::Vec3d(1.0, 0.0, 0.0);
    drawable->setOptions(options);
    frame();
    const SelectionView view = selectedView("main");
    EXPECT_TRUE(view.orthographic);
    EXPECT_EQ(view.axis, options.frozenView.axis);
}

TEST_F(Rendering, camerasThatInheritTheViewpointSelectWhatTheMainViewSelects)
{
    const osg::ref_ptr<osg::Camera> texture = makeTextureCamera(drawable.get(), 64);
    texture->setProjectionMatrixAsOrtho(-2.0, 2.0, -2.0, 2.0, 0.1, 100.0);
    texture->setViewMatrixAsLookAt(osg::Vec3d(0.0, 0.0, 10.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    root->addChild(texture.get());
    for (const bool inherits : {false, true}) {
        texture->setReferenceFrame(inherits ? osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT
                                            : osg::Transform::ABSOLUTE_RF);
        observer->take();
        frame();
        std::map<std::string, RecordingObserver::Entry> byCamera;
        for (const auto& entry : observer->take()) { byCamera[entry.camera] = entry; }
        ASSERT_EQ(byCamera.size(), 2U);
        const SelectionView main = byCamera["main"].selection->view();
        const SelectionView other = byCamera["texture"].selection->view();
        EXPECT_EQ(other.orthographic, !inherits);
        if (!inherits) { continue; }
        EXPECT_NEAR((other.eye - main.eye).length(), 0.0, 1e-4);
        EXPECT_EQ(other.pixelScale, main.pixelScale);
        EXPECT_NEAR((other.axis - main.axis).length(), 0.0, 1e-9);
        EXPECT_NEAR(other.leastCosine, main.leastCosine, 1e-9);
        EXPECT_TRUE(byCamera["main"].localToWorld.isIdentity());
    }
}

/// The synthetic asset with attributes that are linear in place: y and z from −2 to 2 as texture coordinates and as red and
/// green from 0 to 1.
LodAsset linearAsset(bool withUvs, bool withColors)
{
    LodAsset asset = makeSyntheticAsset(16, true);
    asset.uvLattice = {{0.0F, 0.0F}, {1.0F / UvLattice::kUnits, 1.0F / UvLattice::kUnits}};
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        LodLevel& level = asset.levels[l];
        const std::size_t count = TessellationPattern::vertexCount(asset.ladder[l]);
        if (withUvs) { level.uvErrors.assign(level.errors.size(), 0.0F); }
        for (std::size_t v = 0; v < level.vertices.size(); ++v) {
            const auto at = asset.position(asset.patches[v / count], level.vertices[v]); // all patches reach all levels
            const float right = (at[1] + 2.0F) / 4.0F;
            const float up = (at[2] + 2.0F) / 4.0F;
            if (withUvs) { level.uvs.push_back(asset.uvLattice.encode(right, up)); }
            const auto byte = [](float x) { return static_cast<std::uint32_t>(std::lround(255.0F * x)); };
            if (withColors) { level.colors.push_back(byte(right) | byte(up) << 8 | 255U << 16 | 255U << 24); }
        }
    }
    asset.validate();
    return asset;
}

/// 256 × 256 texels with red along u, green along v, and blue.
osg::ref_ptr<osg::Texture2D> gradientTexture()
{
    const osg::ref_ptr<osg::Image> image = new osg::Image;
    image->allocateImage(256, 256, 1, GL_RGB, GL_UNSIGNED_BYTE);
    for (int t = 0; t < 256; ++t) {
        for (int u = 0; u < 256; ++u) {
            unsigned char* texel = image->data(static_cast<unsigned>(u), static_cast<unsigned>(t));
            texel[0] = static_cast<unsigned char>(u);
            texel[1] = static_cast<unsigned char>(t);
            texel[2] = 255;
        }
    }
    const osg::ref_ptr<osg::Texture2D> texture = new osg::Texture2D(image.get());
    texture->setFilter(osg::Texture::MIN_FILTER, osg::Texture::LINEAR);
    texture->setWrap(osg::Texture::WRAP_S, osg::Texture::CLAMP_TO_EDGE);
    return texture;
}

class ColoredRendering : public Rendering {
protected:
    /// Looks along −x at the yz-plane from −2 to 2, unlit; the material is white.
    void show(LodAsset asset)
    {
        drawable->setAsset(std::make_shared<const LodAsset>(std::move(asset)));
        camera().setViewMatrixAsLookAt({5.0, 0.0, 0.0}, osg::Vec3d(), osg::Vec3d(0.0, 0.0, 1.0));
        camera().setProjectionMatrixAsOrtho(-2.0, 2.0, -2.0, 2.0, 1.0, 10.0);
        root->getOrCreateStateSet()->setMode(GL_LIGHTING, osg::StateAttribute::OFF | osg::StateAttribute::OVERRIDE);
        root->getStateSet()->setTextureAttributeAndModes(0, gradientTexture().get(), osg::StateAttribute::ON);
        const osg::ref_ptr<osg::Material> material = new osg::Material;
        material->setDiffuse(osg::Material::FRONT_AND_BACK, osg::Vec4(1.0F, 1.0F, 1.0F, 1.0F));
        root->getStateSet()->setAttribute(material.get());
        ask(1.0);
        frame();
    }
    /// Red and green follow the place on the screen to within `tolerance`.
    void expectGradient(double tolerance)
    {
        for (int y = 70; y < 130; y += 5) {
            for (int x = 70; x < 130; x += 5) {
                const Pixel p = pixel(x, y);
                EXPECT_NEAR(p[0], 255.0 * (x + 0.5) / kSize, tolerance) << x << " " << y;
                EXPECT_NEAR(p[1], 255.0 * (y + 0.5) / kSize, tolerance) << x << " " << y;
                EXPECT_EQ(p[2], 255);
            }
        }
    }
    void setTextureMode(unsigned mode) { root->getStateSet()->setTextureMode(0, GL_TEXTURE_2D, mode); }
};

TEST_F(ColoredRendering, textureLiesWhereTheUvsSay)
{
    show(linearAsset(true, false));
    // Half a texel between texel centres and texel numbers, and rounding to 8 bits twice.
    expectGradient(1.5);
    setTextureMode(osg::StateAttribute::OFF);
    frame();
    EXPECT_EQ(pixel(100, 100), (Pixel{255, 255, 255})); // the material's
}

TEST_F(ColoredRendering, textureMatrixApplies)
{
    show(linearAsset(true, false));
    const Pixel before = pixel(100, 120);
    root->getStateSet()->setTextureAttributeAndModes(0, new osg::TexMat(osg::Matrix::translate(0.25, 0.0, 0.0)));
    frame();
    EXPECT_NEAR(pixel(100, 120)[0], before[0] + 64, 1);
    EXPECT_EQ(pixel(100, 120)[1], before[1]);
}

TEST_F(ColoredRendering, sourceColoursAreShown)
{
    show(linearAsset(false, true));
    expectGradient(1.5); // rounded to 8 bits at the vertices and in the picture
}

TEST_F(ColoredRendering, textureIsMultipliedWithColours)
{
    show(linearAsset(true, true));
    const Pixel p = pixel(110, 90);
    EXPECT_NEAR(p[0], 255.0 * (110.5 / kSize) * (110.5 / kSize), 2.0);
    EXPECT_NEAR(p[1], 255.0 * (90.5 / kSize) * (90.5 / kSize), 2.0);
}

TEST_F(ColoredRendering, facesWithoutUvsShowNoTexture)
{
    LodAsset asset = linearAsset(true, false);
    for (LodLevel& level : asset.levels) {
        for (std::uint32_t& uv : level.uvs) { uv = UvLattice::kNone; }
    }
    show(std::move(asset));
    EXPECT_EQ(pixel(100, 100), (Pixel{255, 255, 255}));
}

TEST_F(ColoredRendering, everyMaterialHasItsState)
{
    LodAsset asset = linearAsset(true, false);
    asset.materials.resize(2);
    for (const LodPatch& patch : asset.patches) {
        float y = 0.0F;
        for (const std::uint32_t v : patch.baseVertices) { y += static_cast<float>(asset.baseVertices[v][1]); }
        asset.patchMaterials.push_back(y > 0.0F ? 1 : 0);
    }
    show(std::move(asset));
    const auto stateOf = [](const osg::Vec4& color) {
        const osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
        const osg::ref_ptr<osg::Material> material = new osg::Material;
        material->setDiffuse(osg::Material::FRONT_AND_BACK, color);
        state->setAttribute(material);
        state->setTextureMode(0, GL_TEXTURE_2D, osg::StateAttribute::OFF);
        return state;
    };
    const auto expectColors = [&](const Pixel& left, const Pixel& right, const char* what) {
        frame();
        for (int y = 70; y < 130; y += 10) {
            EXPECT_EQ(pixel(kSize / 2 - 20, y), left) << what << " " << y;
            EXPECT_EQ(pixel(kSize / 2 + 20, y), right) << what << " " << y;
        }
    };
    drawable->setMaterialState(0, stateOf({1.0F, 0.0F, 0.0F, 1.0F}));
    drawable->setMaterialState(1, stateOf({0.0F, 1.0F, 0.0F, 1.0F}));
    for (const Backend backend : {Backend::Tessellation, Backend::Instanced}) {
        for (const auto selector : {SelectionOptions::Selector::Cpu, SelectionOptions::Selector::Gpu}) {
            SelectionOptions options = drawable->getOptions();
            options.backend = backend;
            options.selector = selector;
            drawable->setOptions(options);
            expectColors({255, 0, 0}, {0, 255, 0}, backend == Backend::Instanced ? "instanced" : "tessellation");
        }
    }
    const osg::ref_ptr<TessLODDrawable> copy = osg::clone(drawable.get(), osg::CopyOp::SHALLOW_COPY);
    EXPECT_EQ(copy->getMaterialState(1), drawable->getMaterialState(1));
    drawable->setMaterialState(0, drawable->getMaterialState(1));
    expectColors({0, 255, 0}, {0, 255, 0}, "the same state twice");
}

TEST_F(ColoredRendering, withoutUvsTheTextureIsNotAsked)
{
    show(makeSyntheticAsset(16, true));
    EXPECT_EQ(pixel(100, 100), (Pixel{255, 255, 255}));
}

} // namespace
} // namespace osgTessLOD
