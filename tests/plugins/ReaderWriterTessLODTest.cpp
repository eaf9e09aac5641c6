// SPDX-License-Identifier: MIT
// Baking through OSG, as applications and osgconv do it.
#include <render/WarningCollector.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <osg/BoundingBox>
#include <osg/Geode>
#include <osg/Geometry>
#include <osg/Material>
#include <osg/MatrixTransform>
#include <osg/NodeVisitor>
#include <osg/ShapeDrawable>
#include <osg/TriangleFunctor>
#include <osg/ValueObject>
#include <osgDB/ReadFile>
#include <osgDB/Registry>
#include <osgDB/WriteFile>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

namespace osgTessLOD {
namespace {

using ReadResult = osgDB::ReaderWriter::ReadResult;
using WriteResult = osgDB::ReaderWriter::WriteResult;

constexpr unsigned kSide = 8; ///< quads along a side of the test surfaces

/// Quick to bake; nothing here depends on how the levels are made.
constexpr const char* kQuick = "technique=uniform maxFactor=4 ";

ReadResult read(const std::string& name, const std::string& options = "")
{
    const osg::ref_ptr<osgDB::Options> parsed = new osgDB::Options(kQuick + options);
    return osgDB::Registry::instance()->readNode(name, parsed);
}

WriteResult write(const osg::Node& scene, const std::string& name, const std::string& options = "")
{
    const osg::ref_ptr<osgDB::Options> parsed = new osgDB::Options(kQuick + options);
    return osgDB::Registry::instance()->writeNode(scene, name, parsed);
}

/// A closed surface, outside out: a sphere of radius 1 about `center` as a grid of kSide × kSide quads, without primitives.
template <typename Array> osg::ref_ptr<osg::Geometry> makePoints(const osg::Vec3d& center)
{
    const osg::ref_ptr<Array> points = new Array;
    for (unsigned j = 0; j <= kSide; ++j) {
        for (unsigned i = 0; i <= kSide; ++i) {
            // Exactly equal where the grid closes, so that the bake welds it.
            const double u = 2.0 * osg::PI * (i % kSide) / kSide;
            const double v = osg::PI * j / kSide;
            const double r = j % kSide == 0 ? 0.0 : std::sin(v);
            const osg::Vec3d p = center + osg::Vec3d(r * std::cos(u), r * std::sin(u), -std::cos(v));
            points->push_back(typename Array::ElementDataType(p));
        }
    }
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setVertexArray(points);
    return geometry;
}

void addPrimitives(osg::Geometry& geometry, GLenum mode)
{
    const auto index = [](unsigned i, unsigned j) { return j * (kSide + 1) + i; };
    osg::ref_ptr<osg::DrawElementsUInt> elements = new osg::DrawElementsUInt(mode);
    for (unsigned j = 0; j < kSide; ++j) {
        for (unsigned i = 0; i < kSide; ++i) {
            const unsigned a = index(i, j), b = index(i + 1, j), c = index(i + 1, j + 1), d = index(i, j + 1);
            if (mode == GL_TRIANGLES) {
                for (const unsigned k : {a, b, c, a, c, d}) { elements->push_back(k); }
            } else if (mode == GL_TRIANGLE_STRIP || mode == GL_QUAD_STRIP) {
                for (const unsigned k : {d, a, c, b}) { elements->push_back(k); }
            } else {
                for (const unsigned k : {a, b, c, d}) { elements->push_back(k); }
            }
            if (mode != GL_TRIANGLES && mode != GL_QUADS) {
                geometry.addPrimitiveSet(elements);
                elements = new osg::DrawElementsUInt(mode);
            }
        }
    }
    if (!elements->empty()) { geometry.addPrimitiveSet(elements); }
}

osg::ref_ptr<osg::Geometry> makeSphere(const osg::Vec3d& center = osg::Vec3d(), GLenum mode = GL_TRIANGLES)
{
    osg::ref_ptr<osg::Geometry> geometry = makePoints<osg::Vec3Array>(center);
    addPrimitives(*geometry, mode);
    return geometry;
}

osg::ref_ptr<osg::Geometry> makeLines()
{
    osg::ref_ptr<osg::Geometry> geometry = makePoints<osg::Vec3Array>(osg::Vec3d());
    geometry->addPrimitiveSet(new osg::DrawArrays(GL_LINE_STRIP, 0, 9));
    return geometry;
}

osg::ref_ptr<osg::Geometry> makeSliver()
{
    const osg::ref_ptr<osg::Vec3Array> points = new osg::Vec3Array;
    for (const float x : {0.0F, 1.0F, 2.0F}) { points->push_back(osg::Vec3(x, 0.0F, 0.0F)); }
    osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setVertexArray(points);
    geometry->addPrimitiveSet(new osg::DrawArrays(GL_TRIANGLES, 0, 3));
    return geometry;
}

struct SumVolume {
    double volume = 0.0;
    void operator()(const osg::Vec3& a, const osg::Vec3& b, const osg::Vec3& c, bool = false)
    {
        volume += osg::Vec3d(a) * (osg::Vec3d(b) ^ osg::Vec3d(c)) / 6.0;
    }
};

/// About the frame's origin: independent of it for closed surfaces.
double volumeOf(const osg::Drawable& drawable)
{
    osg::TriangleFunctor<SumVolume> sum;
    drawable.accept(sum);
    return sum.volume;
}

struct GrowBox {
    osg::Matrixd localToWorld;
    osg::BoundingBoxd box;
    void operator()(const osg::Vec3& a, const osg::Vec3& b, const osg::Vec3& c, bool = false)
    {
        for (const osg::Vec3& p : {a, b, c}) { box.expandBy(osg::Vec3d(p) * localToWorld); }
    }
};

/// Box around the triangles of a scene; of TessLODDrawables those at their finest, which their bounds are not tight around.
class ExtentVisitor : public osg::NodeVisitor {
public:
    ExtentVisitor()
        : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN)
    {
    }
    using osg::NodeVisitor::apply;
    void apply(osg::Drawable& drawable) override
    {
        osg::TriangleFunctor<GrowBox> grow;
        grow.localToWorld = osg::computeLocalToWorld(getNodePath());
        drawable.accept(grow);
        box.expandBy(grow.box);
    }
    osg::BoundingBoxd box;
};

osg::BoundingBoxd extentOf(osg::Node& node)
{
    ExtentVisitor visitor;
    node.accept(visitor);
    return visitor.box;
}

/// What levels of factor 4 may be off from the test surfaces at their corners.
constexpr double kNear = 0.03;

void expectNear(const osg::Vec3d& a, const osg::Vec3d& b, double tolerance = kNear)
{
    EXPECT_LE((a - b).length(), tolerance) << a.x() << " " << a.y() << " " << a.z();
}

TEST(ReaderWriterTessLOD, BakesTheGeometriesOfASceneAndKeepsTheRest)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<osg::Geometry> wheel = makeSphere();
    wheel->setName("wheel");
    wheel->setNodeMask(0x5);
    wheel->setUserValue("part", 7);
    wheel->getOrCreateStateSet()->setAttribute(new osg::Material);
    const osg::ref_ptr<osg::Geode> geode = new osg::Geode;
    geode->setName("its geode");
    geode->addDrawable(wheel);
    geode->addDrawable(makeLines());
    const osg::ref_ptr<osg::MatrixTransform> axle = new osg::MatrixTransform(osg::Matrixd::rotate(0.3, 1.0, 2.0, 3.0));
    axle->setName("axle");
    axle->getOrCreateStateSet()->setMode(GL_BLEND, osg::StateAttribute::ON);
    axle->addChild(geode);
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(axle);
    scene->addChild(makeSphere(osg::Vec3d(5.0, 0.0, 0.0)));
    scene->addChild(new osg::ShapeDrawable(new osg::Box));
    ASSERT_TRUE(write(*scene, folder.file("scene.osgb")).success());

    ReadResult result = read(folder.file("scene.osgb.tesslod"));
    ASSERT_TRUE(result.validNode()) << result.message();
    auto* baked = result.getNode()->asGroup();
    ASSERT_EQ(baked->getNumChildren(), 3U);
    const auto* place = dynamic_cast<osg::MatrixTransform*>(baked->getChild(0));
    ASSERT_NE(place, nullptr);
    EXPECT_EQ(place->getName(), "axle");
    EXPECT_EQ(place->getMatrix(), axle->getMatrix());
    EXPECT_EQ(place->getStateSet()->getMode(GL_BLEND), unsigned(osg::StateAttribute::ON));
    const auto* parts = dynamic_cast<const osg::Geode*>(place->getChild(0));
    ASSERT_NE(parts, nullptr);
    EXPECT_EQ(parts->getName(), "its geode");
    ASSERT_EQ(parts->getNumDrawables(), 2U);
    const auto* drawable = dynamic_cast<const TessLODDrawable*>(parts->getDrawable(0));
    ASSERT_NE(drawable, nullptr);
    EXPECT_EQ(drawable->getName(), "wheel");
    EXPECT_EQ(drawable->getNodeMask(), 0x5U);
    int part = 0;
    EXPECT_TRUE(drawable->getUserValue("part", part));
    EXPECT_EQ(part, 7);
    ASSERT_NE(drawable->getStateSet(), nullptr);
    EXPECT_NE(drawable->getStateSet()->getAttribute(osg::StateAttribute::MATERIAL), nullptr);
    EXPECT_EQ(drawable->getAsset()->sourceTriangles, 2U * kSide * (kSide - 1U)); // each pole: kSide without area
    EXPECT_EQ(drawable->getAsset()->source, "scene.osgb#wheel");
    EXPECT_NE(dynamic_cast<const osg::Geometry*>(parts->getDrawable(1)), nullptr) << "the lines";
    EXPECT_NE(dynamic_cast<const TessLODDrawable*>(baked->getChild(1)), nullptr);
    EXPECT_NE(dynamic_cast<const osg::ShapeDrawable*>(baked->getChild(2)), nullptr);
    const osg::BoundingBoxd before = extentOf(*scene), after = extentOf(*baked);
    expectNear(after._min, before._min);
    expectNear(after._max, before._max);
}

TEST(ReaderWriterTessLOD, TakesPrimitivesAndPositionsOfAllKinds)
{
    const TemporaryDirectory folder;
    const double volume = volumeOf(*makeSphere());
    ASSERT_GT(volume, 3.0);
    const auto expectBaked = [&](osg::Geometry& geometry, const std::string& what) {
        ASSERT_TRUE(write(geometry, folder.file("x.tlod"), "tolerance=0").success()) << what;
        ReadResult result = read(folder.file("x.tlod"));
        const auto* drawable = dynamic_cast<const TessLODDrawable*>(result.getNode());
        ASSERT_NE(drawable, nullptr) << what;
        EXPECT_EQ(drawable->getAsset()->sourceTriangles, 2U * kSide * (kSide - 1U)) << what;
        EXPECT_NEAR(volumeOf(*drawable), volume, 0.02 * volume) << what; // of which the finest level falls short
    };
    for (const GLenum mode : {GL_TRIANGLES, GL_TRIANGLE_STRIP, GL_TRIANGLE_FAN, GL_QUADS, GL_QUAD_STRIP, GL_POLYGON}) {
        expectBaked(*makeSphere(osg::Vec3d(), mode), "mode " + std::to_string(mode));
    }
    const osg::ref_ptr<osg::Geometry> doubles = makePoints<osg::Vec3dArray>(osg::Vec3d());
    addPrimitives(*doubles, GL_TRIANGLES);
    expectBaked(*doubles, "doubles");
    const osg::ref_ptr<osg::Geometry> homogeneous = makePoints<osg::Vec3Array>(osg::Vec3d());
    const osg::ref_ptr<osg::Vec4Array> four = new osg::Vec4Array;
    for (const osg::Vec3& p : *static_cast<osg::Vec3Array*>(homogeneous->getVertexArray())) {
        four->push_back(osg::Vec4(p * 2.0F, 2.0F));
    }
    homogeneous->setVertexArray(four);
    addPrimitives(*homogeneous, GL_TRIANGLES);
    expectBaked(*homogeneous, "four numbers");
}

TEST(ReaderWriterTessLOD, HandsTextureCoordinatesAndColoursOn)
{
    const TemporaryDirectory folder;
    const auto bake = [&](osg::Geometry& geometry, const char* options = "") -> std::shared_ptr<const LodAsset> {
        EXPECT_TRUE(write(geometry, folder.file("x.tlod"), options).success());
        ReadResult result = read(folder.file("x.tlod"));
        const auto* drawable = dynamic_cast<const TessLODDrawable*>(result.getNode());
        return drawable != nullptr ? drawable->getAsset() : std::make_shared<const LodAsset>();
    };
    const osg::ref_ptr<osg::Geometry> geometry = makeSphere();
    const osg::ref_ptr<osg::Vec2Array> uvs = new osg::Vec2Array(osg::Array::BIND_PER_VERTEX);
    for (unsigned v = 0; v < geometry->getVertexArray()->getNumElements(); ++v) {
        uvs->push_back(
            osg::Vec2(static_cast<float>(v % (kSide + 1)) / kSide, static_cast<float>(v / (kSide + 1)) / kSide));
    }
    geometry->setTexCoordArray(0, uvs);
    const osg::ref_ptr<osg::Vec4Array> white = new osg::Vec4Array(osg::Array::BIND_OVERALL, 1);
    white->front() = osg::Vec4(1.0F, 1.0F, 1.0F, 1.0F);
    geometry->setColorArray(white);
    std::shared_ptr<const LodAsset> asset = bake(*geometry);
    EXPECT_TRUE(asset->hasUvs());
    EXPECT_FALSE(asset->hasColors());
    EXPECT_FALSE(bake(*geometry, "noTextures")->hasUvs());

    geometry->setTexCoordArray(0, nullptr);
    white->front() = osg::Vec4(1.0F, 0.5F, 0.0F, 1.0F); // no longer
    asset = bake(*geometry);
    EXPECT_FALSE(asset->hasUvs());
    ASSERT_TRUE(asset->hasColors());
    for (const LodLevel& level : asset->levels) {
        for (const std::uint32_t color : level.colors) { EXPECT_EQ(color, 0xFF0080FFU); }
    }

    const osg::ref_ptr<osg::Vec4ubArray> two = new osg::Vec4ubArray(osg::Array::BIND_PER_VERTEX);
    for (unsigned v = 0; v < geometry->getVertexArray()->getNumElements(); ++v) {
        two->push_back(v / (kSide + 1) < kSide / 2 ? osg::Vec4ub(255, 0, 0, 255) : osg::Vec4ub(0, 0, 255, 255));
    }
    geometry->setColorArray(two);
    asset = bake(*geometry);
    ASSERT_TRUE(asset->hasColors());
    std::vector<std::uint32_t> colors;
    for (const LodLevel& level : asset->levels) { colors.insert(colors.end(), level.colors.begin(), level.colors.end()); }
    EXPECT_GT(std::count(colors.begin(), colors.end(), 0xFF0000FFU), 0) << "red";
    EXPECT_GT(std::count(colors.begin(), colors.end(), 0xFFFF0000U), 0) << "blue";
}

TEST(ReaderWriterTessLOD, BakesASharedGeometryOnce)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<osg::Geometry> shared = makeSphere();
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    for (const double x : {0.0, 3.0}) {
        const osg::ref_ptr<osg::MatrixTransform> place = new osg::MatrixTransform(osg::Matrixd::translate(x, 0.0, 0.0));
        place->addChild(shared);
        scene->addChild(place);
    }
    ASSERT_TRUE(write(*scene, folder.file("scene.osgb.tesslod")).success());
    EXPECT_EQ(shared->getNumParents(), 2U) << "what is written is left as it is";
    ReadResult result = read(folder.file("scene.osgb"));
    ASSERT_TRUE(result.validNode());
    const std::vector<PlacedDrawable> found = findTessLODDrawables(*result.getNode());
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].drawable, found[1].drawable);
    EXPECT_EQ(found[1].localToWorld, osg::Matrixd::translate(3.0, 0.0, 0.0));
}

TEST(ReaderWriterTessLOD, PlacesWhatIsFarFromItsOrigin)
{
    const TemporaryDirectory folder;
    const osg::Vec3d center(4e6, -2e6, 1e6);
    const osg::ref_ptr<osg::Geode> geode = new osg::Geode;
    geode->setName("far");
    geode->getOrCreateStateSet()->setMode(GL_BLEND, osg::StateAttribute::ON);
    for (int k = 0; k < 2; ++k) {
        const osg::ref_ptr<osg::Geometry> geometry = makePoints<osg::Vec3dArray>(center);
        addPrimitives(*geometry, GL_TRIANGLES);
        geode->addDrawable(geometry);
    }
    geode->addDrawable(makeLines());
    ASSERT_TRUE(write(*geode, folder.file("scene.osgb")).success());
    ReadResult result = read(folder.file("scene.osgb.tesslod")); // the scene itself has to be replaced
    ASSERT_TRUE(result.validNode()) << result.message();
    osg::Node& baked = *result.getNode();
    EXPECT_EQ(baked.asGeode(), nullptr);
    EXPECT_EQ(baked.getName(), "far");
    EXPECT_EQ(baked.getStateSet()->getMode(GL_BLEND), unsigned(osg::StateAttribute::ON));
    ASSERT_EQ(baked.asGroup()->getNumChildren(), 3U);
    const std::vector<PlacedDrawable> found = findTessLODDrawables(baked);
    ASSERT_EQ(found.size(), 2U);
    for (const PlacedDrawable& placed : found) {
        const osg::BoundingBoxd local = extentOf(*placed.drawable);
        expectNear(local.center() * placed.localToWorld, center);
        EXPECT_LT(placed.drawable->getBoundingBox().center().length(), 10.0F);
    }
}

TEST(ReaderWriterTessLOD, MovesTheOnlyGeometryToWhereItIsInATlodFile)
{
    const TemporaryDirectory folder;
    // Mirrored: the outside must stay outside.
    const osg::ref_ptr<osg::MatrixTransform> scene =
        new osg::MatrixTransform(osg::Matrixd::scale(2.0, -1.0, 1.0) * osg::Matrixd::translate(10.0, 0.0, 0.0));
    scene->addChild(makeSphere());
    ASSERT_TRUE(write(*scene, folder.file("x.tlod")).success());
    ReadResult result = read(folder.file("x.tlod"));
    const std::vector<PlacedDrawable> found = findTessLODDrawables(*result.getNode());
    ASSERT_EQ(found.size(), 1U);
    EXPECT_GT(volumeOf(*found.front().drawable), 5.0);
    const osg::BoundingBoxd box = extentOf(*result.getNode());
    expectNear(box._min, osg::Vec3d(8.0, -1.0, -1.0), 2.0 * kNear);
    expectNear(box._max, osg::Vec3d(12.0, 1.0, 1.0), 2.0 * kNear);
}

TEST(ReaderWriterTessLOD, RefusesWhatATlodFileCannotHold)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(makeSphere());
    scene->addChild(makeSphere(osg::Vec3d(3.0, 0.0, 0.0)));
    const WriteResult result = write(*scene, folder.file("x.tlod"));
    EXPECT_FALSE(result.success());
    EXPECT_NE(result.message().find("exactly one"), std::string::npos) << result.message();
    EXPECT_NE(result.message().find(".osgt"), std::string::npos) << result.message();
    EXPECT_EQ(folder.entryCount(), 0U);
    EXPECT_NE(dynamic_cast<osg::Geometry*>(scene->getChild(0)), nullptr);
}

TEST(ReaderWriterTessLOD, LeavesWhatCannotBeBaked)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(makeSliver());
    ASSERT_TRUE(write(*scene, folder.file("sliver.osgt")).success());
    const ReadResult nothing = read(folder.file("sliver.osgt.tesslod"));
    EXPECT_EQ(nothing.status(), ReadResult::ERROR_IN_READING_FILE);
    EXPECT_NE(nothing.message().find("no face has an area"), std::string::npos) << nothing.message();

    scene->addChild(makeSphere());
    ASSERT_TRUE(write(*scene, folder.file("both.osgt")).success());
    const WarningCollector warnings;
    ReadResult one = read(folder.file("both.osgt.tesslod"));
    ASSERT_TRUE(one.validNode()) << one.message();
    EXPECT_NE(dynamic_cast<const osg::Geometry*>(one.getNode()->asGroup()->getChild(0)), nullptr);
    EXPECT_NE(dynamic_cast<const TessLODDrawable*>(one.getNode()->asGroup()->getChild(1)), nullptr);
    EXPECT_NE(warnings.text().find("stays as it is"), std::string::npos) << warnings.text();
}

TEST(ReaderWriterTessLOD, SaysWhatIsWrong)
{
    const TemporaryDirectory folder;
    EXPECT_EQ(read(folder.file("absent.osgt.tesslod")).status(), ReadResult::FILE_NOT_FOUND);
    EXPECT_EQ(read(folder.file("absent.off.tesslod")).status(), ReadResult::FILE_NOT_FOUND);
    const auto expectError = [&](const std::string& name, const std::string& options, const std::string& why) {
        const ReadResult result = read(name, options);
        EXPECT_EQ(result.status(), ReadResult::ERROR_IN_READING_FILE) << name;
        EXPECT_NE(result.message().find(why), std::string::npos) << result.message();
    };
    expectError("builtin:pebble.tesslod", "", "pebble");
    for (const char* option : {"technique=best", "tolerance=-1", "tolerance=nan", "errorPixels=0", "maxFactor=x"}) {
        expectError("builtin:bricks.tesslod", option, option);
    }
    const osg::ref_ptr<osg::Group> empty = new osg::Group;
    ASSERT_TRUE(write(*empty, folder.file("empty.osgt")).success());
    expectError(folder.file("empty.osgt.tesslod"), "", "no geometry");
    writeBytes(folder.file("broken.off"), "OFF\n3 1 0\n0 0 0\n");
    expectError(folder.file("broken.off.tesslod"), "", "broken.off");
}

TEST(ReaderWriterTessLOD, ReadsBuiltinSurfacesAndFilesThatOsgDoesNotKnow)
{
    const TemporaryDirectory folder;
    ReadResult bricks = read("builtin:bricks.tesslod");
    const auto* drawable = dynamic_cast<const TessLODDrawable*>(bricks.getNode());
    ASSERT_NE(drawable, nullptr) << bricks.message();
    EXPECT_EQ(drawable->getName(), "builtin:bricks");
    EXPECT_EQ(drawable->getFileName(), "");

    writeBytes(folder.file("tetrahedron.off"),
               "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
    ReadResult off = read(folder.file("tetrahedron.off.tesslod"));
    drawable = dynamic_cast<const TessLODDrawable*>(off.getNode());
    ASSERT_NE(drawable, nullptr) << off.message();
    EXPECT_EQ(drawable->getAsset()->sourceTriangles, 4U);
}

TEST(ReaderWriterTessLOD, PassesOptionsOn)
{
    const osg::ref_ptr<osgDB::Options> options =
        new osgDB::Options("errorPixels=3 maxFactor=5 technique=uniform noTextures");
    ReadResult result = osgDB::Registry::instance()->readNode("builtin:bricks.tesslod", options);
    const auto* drawable = dynamic_cast<const TessLODDrawable*>(result.getNode());
    ASSERT_NE(drawable, nullptr) << result.message();
    EXPECT_EQ(drawable->getOptions().errorPixels, 3.0);
    EXPECT_EQ(drawable->getOptions().maxFactor, 5U);
    EXPECT_EQ(drawable->getAsset()->ladder.back(), 8U); // the power of two that has 5
    EXPECT_EQ(drawable->getAsset()->technique, "uniform");
    EXPECT_EQ(drawable->getAsset()->normals.resolution, 0U);
}

} // namespace
} // namespace osgTessLOD
