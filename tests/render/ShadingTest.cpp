// SPDX-License-Identifier: MIT
// Fragment stages of one's own: inherited, overridden and protected as state is, and no affair of other geometry.
#include <render/GlTest.h>
#include <render/PlainTwin.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/render/SurfaceShading.h>

#include <osg/Fog>
#include <osg/ShapeDrawable>

#include <array>

namespace osgTessLOD {
namespace {

constexpr int kSize = 100;
using Pixel = std::array<int, 3>;

osg::ref_ptr<SurfaceShading> flat(const std::string& color)
{
    return new SurfaceShading("vec4 tessLodShade(TessLodFragment fragment) { return vec4(" + color + ", 1.0); }\n");
}

/// Three in a row: left, middle, right.
class Shading : public testing::Test {
protected:
    Shading()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(*viewer.getCamera(), 3 * kSize, kSize);
        viewer.getCamera()->setFinalDrawCallback(snapshot.get());
        viewer.getCamera()->setViewMatrixAsLookAt(osg::Vec3d(0.0, 0.0, 5.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
        const auto asset = std::make_shared<const LodAsset>(makeSyntheticAsset(8, true));
        for (const double x : {-2.5, 0.0, 2.5}) {
            const osg::ref_ptr<osg::MatrixTransform> place =
                new osg::MatrixTransform(osg::Matrix::translate(x, 0.0, 0.0));
            place->addChild(new TessLODDrawable(asset));
            root->addChild(place.get());
        }
        viewer.setSceneData(root.get());
        viewer.realize();
        // In a context's first frame ambient colours follow glColor: OSG applies its own material only after that.
        for (int k = 0; k < 2; ++k) { frame(); }
    }

    void frame()
    {
        viewer.advance();
        viewer.updateTraversal();
        viewer.renderingTraversals();
    }
    osg::StateSet& stateOf(unsigned k) { return *root->getChild(k)->getOrCreateStateSet(); }
    Pixel pixelOf(unsigned k) const
    {
        const unsigned char* p = snapshot->image().data(kSize / 2 + k * kSize, kSize / 2);
        return {p[0], p[1], p[2]};
    }

    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
};

const Pixel kRed{255, 0, 0};
const Pixel kGreen{0, 255, 0};

TEST_F(Shading, isInheritedOverriddenAndProtected)
{
    const WarningCollector warnings;
    const Pixel usual = pixelOf(0);
    root->getOrCreateStateSet()->setAttribute(flat("1.0, 0.0, 0.0").get());
    stateOf(1).setAttribute(flat("0.0, 1.0, 0.0").get());
    stateOf(2).setAttribute(flat("0.0, 1.0, 0.0").get(), osg::StateAttribute::PROTECTED);
    frame();
    EXPECT_EQ(pixelOf(0), kRed);
    EXPECT_EQ(pixelOf(1), kGreen);
    EXPECT_EQ(pixelOf(2), kGreen);
    root->getStateSet()->setAttribute(flat("1.0, 0.0, 0.0").get(), osg::StateAttribute::OVERRIDE);
    frame();
    EXPECT_EQ(pixelOf(1), kRed);
    EXPECT_EQ(pixelOf(2), kGreen);
    root->getStateSet()->removeAttribute(SurfaceShading::kType);
    frame();
    EXPECT_EQ(pixelOf(0), usual);
    EXPECT_EQ(pixelOf(1), kGreen);
    EXPECT_EQ(warnings.text(), "");
}

TEST_F(Shading, leavesOtherGeometryAlone)
{
    root->getChild(1)->asGroup()->removeChildren(0, 1);
    root->getChild(1)->asGroup()->addChild(new osg::ShapeDrawable(new osg::Sphere(osg::Vec3(), 1.0F)));
    frame();
    const Pixel before = pixelOf(1);
    root->getOrCreateStateSet()->setAttribute(flat("1.0, 0.0, 0.0").get());
    frame();
    EXPECT_EQ(pixelOf(1), before);
    EXPECT_EQ(pixelOf(0), kRed);
    EXPECT_EQ(pixelOf(2), kRed);
}

TEST_F(Shading, mayUseWhatIsThereAndUniformsOfTheScene)
{
    const WarningCollector warnings;
    const Pixel usual = pixelOf(1);
    root->getOrCreateStateSet()->setAttribute(new SurfaceShading(R"(
        uniform float dim;
        vec4 tessLodShade(TessLodFragment fragment)
        {
            vec4 color = tessLodLitColor(fragment.position, fragment.normal, fragment.material);
            color.rgb *= dim * tessLodLightReceived(fragment.position);
            return tessLodFoggedColor(color, fragment.position);
        })"));
    root->getStateSet()->addUniform(new osg::Uniform("dim", 0.5F));
    stateOf(2).addUniform(new osg::Uniform("dim", 0.0F));
    frame();
    for (std::size_t k = 0; k < 3; ++k) { EXPECT_NEAR(pixelOf(1)[k], usual[k] * 0.5, 1.0); }
    EXPECT_EQ(pixelOf(2), (Pixel{0, 0, 0}));
    EXPECT_EQ(warnings.text(), "");
}

TEST_F(Shading, thatDoesNotCompileLeavesTheRestAlone)
{
    const Pixel background = [&] {
        const unsigned char* p = snapshot->image().data(0, 0);
        return Pixel{p[0], p[1], p[2]};
    }();
    const Pixel left = pixelOf(0);
    const Pixel right = pixelOf(2);
    const WarningCollector warnings;
    stateOf(1).setAttribute(new SurfaceShading("vec4 tessLodShade(TessLodFragment fragment)\n{ return vec3(; }\n"));
    for (int k = 0; k < 3; ++k) { frame(); }
    EXPECT_EQ(pixelOf(0), left);
    EXPECT_EQ(pixelOf(1), background);
    EXPECT_EQ(pixelOf(2), right);
    EXPECT_NE(warnings.text().find("100:2"), std::string::npos) << "says in which line\n" << warnings.text();
}

TEST(SurfaceShading, isComparedAndCopiedByItsSource)
{
    const osg::ref_ptr<SurfaceShading> red = flat("1.0, 0.0, 0.0");
    const osg::ref_ptr<SurfaceShading> copy = osg::clone(red.get(), osg::CopyOp::DEEP_COPY_ALL);
    EXPECT_EQ(*copy, *red);
    EXPECT_NE(*red, *flat("0.0, 1.0, 0.0"));
    const osg::ref_ptr<osg::Fog> other = new osg::Fog;
    EXPECT_EQ(red->compare(*other) < 0, other->compare(*red) > 0);
}

} // namespace
} // namespace osgTessLOD
