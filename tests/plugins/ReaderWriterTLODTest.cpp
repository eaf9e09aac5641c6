// SPDX-License-Identifier: MIT
// The plugin as applications meet it: through osgDB, found by OSG_LIBRARY_PATH.
#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <render/WarningCollector.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <osg/ComputeBoundsVisitor>
#include <osg/Group>
#include <osg/MatrixTransform>
#include <osg/Texture2D>
#include <osgDB/ReadFile>
#include <osgDB/Registry>
#include <osgDB/WriteFile>
#include <osgUtil/Optimizer>

#include <filesystem>
#include <sstream>

namespace osgTessLOD {
namespace {

using ReadResult = osgDB::ReaderWriter::ReadResult;
using WriteResult = osgDB::ReaderWriter::WriteResult;

std::string bytesOf(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

LodAsset assetAt(double x, double y, double z)
{
    LodAsset asset = makeSyntheticAsset();
    asset.lattice.origin = {x, y, z};
    return asset;
}

ReadResult read(const std::string& path, const std::string& options = "")
{
    const osg::ref_ptr<osgDB::Options> parsed = new osgDB::Options(options);
    return osgDB::Registry::instance()->readNode(path, parsed);
}

osgDB::ReaderWriter& plugin()
{
    osgDB::ReaderWriter* found = osgDB::Registry::instance()->getReaderWriterForExtension("tlod");
    if (!found) { throw std::runtime_error("the plugin was not found"); }
    return *found;
}

osg::ref_ptr<TessLODDrawable> drawableOf(const LodAsset& asset)
{
    return new TessLODDrawable(std::make_shared<const LodAsset>(asset));
}

osg::BoundingBox boundsOf(osg::Node& node)
{
    osg::ComputeBoundsVisitor visitor;
    node.accept(visitor);
    return visitor.getBoundingBox();
}

void expectNear(const osg::BoundingBox& a, const osg::BoundingBox& b, float tolerance)
{
    EXPECT_LE((a._min - b._min).length(), tolerance);
    EXPECT_LE((a._max - b._max).length(), tolerance);
}

TEST(ReaderWriterTLOD, GivesTheAssetAsOneDrawableNamedAfterTheFile)
{
    const TemporaryDirectory folder;
    const LodAsset asset = makeSyntheticAsset();
    writeTlod(folder.file("bumpy.tlod"), asset);

    const osg::ref_ptr<osg::Node> node = osgDB::readRefNodeFile(folder.file("bumpy.tlod"));
    const auto* drawable = dynamic_cast<const TessLODDrawable*>(node.get());
    ASSERT_NE(drawable, nullptr);
    EXPECT_EQ(drawable->getName(), "bumpy.tlod");
    EXPECT_EQ(drawable->getFileName(), folder.file("bumpy.tlod"));
    ASSERT_NE(drawable->getAsset(), nullptr);
    EXPECT_EQ(bytesOf(*drawable->getAsset()), bytesOf(asset));
}

TEST(ReaderWriterTLOD, ReadsObjectsAndUpperCaseExtensions)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("BUMPY.TLOD"), makeSyntheticAsset());
    const osg::ref_ptr<osg::Object> object = osgDB::readRefObjectFile(folder.file("BUMPY.TLOD"));
    EXPECT_NE(dynamic_cast<const TessLODDrawable*>(object.get()), nullptr);
}

TEST(ReaderWriterTLOD, PlacesAnAssetAtItsOrigin)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("far.tlod"), assetAt(1000.0, -20.0, 3e6));

    const osg::ref_ptr<osg::Node> node = osgDB::readRefNodeFile(folder.file("far.tlod"));
    auto* transform = dynamic_cast<osg::MatrixTransform*>(node.get());
    ASSERT_NE(transform, nullptr);
    EXPECT_EQ(transform->getMatrix(), osg::Matrixd::translate(1000.0, -20.0, 3e6));
    ASSERT_EQ(transform->getNumChildren(), 1U);
    EXPECT_NE(dynamic_cast<const TessLODDrawable*>(transform->getChild(0)), nullptr);
}

/// What a node keeps to itself.
struct BoundState : osg::Node {
    static bool isComputed(const osg::Node& node) { return node.*(&BoundState::_boundingSphereComputed); }
};

TEST(ReaderWriterTLOD, ComputesBoundsBeforeAnyCullThreadCanAskForThem)
{
    const TemporaryDirectory folder;
    for (const double origin : {0.0, 1e5}) {
        writeTlod(folder.file("x.tlod"), assetAt(origin, 0.0, 0.0));
        const osg::ref_ptr<osg::Node> node = osgDB::readRefNodeFile(folder.file("x.tlod"));
        EXPECT_TRUE(BoundState::isComputed(*node));
        EXPECT_NEAR(node->getBound().center().x(), origin, 0.1);
    }
}

TEST(ReaderWriterTLOD, StaysInPlaceWhenOptimized)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("moved.tlod"), assetAt(10.0, 20.0, 30.0));
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(osgDB::readRefNodeFile(folder.file("moved.tlod")));
    const osg::BoundingBox before = boundsOf(*scene);
    ASSERT_NEAR(before.center().x(), 10.0, 0.1);

    osgUtil::Optimizer().optimize(scene, osgUtil::Optimizer::ALL_OPTIMIZATIONS);
    expectNear(boundsOf(*scene), before, 0.0F);
}

TEST(ReaderWriterTLOD, WritesWhatItRead)
{
    const TemporaryDirectory folder;
    for (const double origin : {0.0, 1e5}) {
        writeTlod(folder.file("a.tlod"), assetAt(origin, 0.0, 0.0));
        const osg::ref_ptr<osg::Node> node = osgDB::readRefNodeFile(folder.file("a.tlod"));
        ASSERT_TRUE(node);
        ASSERT_TRUE(osgDB::writeNodeFile(*node, folder.file("b.tlod")));
        EXPECT_EQ(readBytes(folder.file("b.tlod")), readBytes(folder.file("a.tlod")));
    }
}

TEST(ReaderWriterTLOD, KeepsTranslationsAsTheOrigin)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<osg::MatrixTransform> outer = new osg::MatrixTransform(osg::Matrixd::translate(1.0, 2.0, 3.0));
    const osg::ref_ptr<osg::MatrixTransform> inner = new osg::MatrixTransform(osg::Matrixd::translate(4.0, 5.0, 6.0));
    outer->addChild(inner);
    inner->addChild(drawableOf(makeSyntheticAsset()));
    ASSERT_TRUE(osgDB::writeNodeFile(*outer, folder.file("moved.tlod")));
    EXPECT_EQ(readTlod(folder.file("moved.tlod")).lattice.origin, (std::array<double, 3>{5.0, 7.0, 9.0}));
}

TEST(ReaderWriterTLOD, RefusesScenesThatAFileCannotHold)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("kept.tlod");
    writeTlod(path, makeSyntheticAsset());
    const std::string before = readBytes(path);
    const auto expectRefused = [&](const osg::Node& node, const char* why) {
        const WriteResult result = plugin().writeNode(node, path);
        EXPECT_EQ(result.status(), WriteResult::ERROR_IN_WRITING_FILE);
        EXPECT_NE(result.message().find(why), std::string::npos) << result.message();
        EXPECT_NE(result.message().find(path), std::string::npos) << result.message();
        EXPECT_EQ(readBytes(path), before);
    };

    const osg::ref_ptr<osg::Group> none = new osg::Group;
    expectRefused(*none, "exactly one");
    const osg::ref_ptr<osg::Group> two = new osg::Group;
    two->addChild(drawableOf(makeSyntheticAsset()));
    two->addChild(drawableOf(makeSyntheticAsset()));
    expectRefused(*two, "exactly one");
    const osg::ref_ptr<osg::MatrixTransform> turned =
        new osg::MatrixTransform(osg::Matrixd::rotate(1.0, 0.0, 0.0, 1.0));
    turned->addChild(drawableOf(makeSyntheticAsset()));
    expectRefused(*turned, "rotated");
    const osg::ref_ptr<TessLODDrawable> empty = new TessLODDrawable;
    expectRefused(*empty, "no asset");
    const osg::ref_ptr<TessLODInstances> many =
        new TessLODInstances(std::make_shared<const LodAsset>(makeSyntheticAsset()));
    many->setPlacements({osg::Matrixd()});
    expectRefused(*many, "placements");
}

TEST(ReaderWriterTLOD, ReportsWhereAFileCannotBeWritten)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("absent/x.tlod");
    const WriteResult result = plugin().writeNode(*drawableOf(makeSyntheticAsset()), path);
    EXPECT_EQ(result.status(), WriteResult::ERROR_IN_WRITING_FILE);
    EXPECT_NE(result.message().find(path), std::string::npos) << result.message();
}

TEST(ReaderWriterTLOD, ReadsAndWritesStreams)
{
    const LodAsset asset = makeSyntheticAsset();
    std::istringstream in(bytesOf(asset));
    ReadResult result = plugin().readNode(in);
    ASSERT_TRUE(result.validNode()) << result.message();

    std::ostringstream out;
    EXPECT_TRUE(plugin().writeNode(*result.getNode(), out).success());
    EXPECT_EQ(out.str(), bytesOf(asset));

    std::istringstream cut(bytesOf(asset).substr(0, 100));
    EXPECT_EQ(plugin().readNode(cut).status(), ReadResult::ERROR_IN_READING_FILE);
    std::ostringstream broken;
    broken.setstate(std::ios::badbit);
    EXPECT_FALSE(plugin().writeNode(*result.getNode(), broken).success());
}

TEST(ReaderWriterTLOD, TakesOptions)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("x.tlod"), makeSyntheticAsset(16, true));
    const auto readWith = [&](const char* options) {
        return osg::ref_ptr<TessLODDrawable>(
            dynamic_cast<TessLODDrawable*>(read(folder.file("x.tlod"), options).getNode()));
    };

    const osg::ref_ptr<TessLODDrawable> plain = readWith("");
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->getOptions().errorPixels, SelectionOptions().errorPixels);
    EXPECT_EQ(plain->getOptions().maxFactor, SelectionOptions().maxFactor);
    EXPECT_EQ(plain->getOptions().metric, SelectionOptions::Metric::View);
    EXPECT_EQ(plain->getOptions().bound, SelectionOptions::Bound::Conservative);
    EXPECT_EQ(plain->getOptions().selector, SelectionOptions::Selector::Cpu);
    EXPECT_EQ(plain->getOptions().backend, Backend::Auto);
    EXPECT_GT(plain->getAsset()->normals.resolution, 0U);

    const osg::ref_ptr<TessLODDrawable> set = readWith("errorPixels=2.5 maxFactor=8 metric=isotropic bound=first-order "
                                                       "selection=gpu backend=instanced cullPatches=false noTextures");
    ASSERT_TRUE(set);
    EXPECT_EQ(set->getOptions().errorPixels, 2.5);
    EXPECT_EQ(set->getOptions().maxFactor, 8U);
    EXPECT_EQ(set->getOptions().metric, SelectionOptions::Metric::Isotropic);
    EXPECT_EQ(set->getOptions().bound, SelectionOptions::Bound::FirstOrder);
    EXPECT_EQ(set->getOptions().selector, SelectionOptions::Selector::Gpu);
    EXPECT_EQ(set->getOptions().backend, Backend::Instanced);
    EXPECT_FALSE(set->getOptions().cullPatches);
    EXPECT_EQ(set->getAsset()->normals.resolution, 0U);
    EXPECT_TRUE(set->getAsset()->normals.levels.empty());
}

TEST(ReaderWriterTLOD, HasTheColourImageAsATexture)
{
    const TemporaryDirectory folder;
    LodAsset asset = makeSyntheticAsset();
    asset.materials.emplace_back().textures = {{LodTexture::Role::Color, "map_Kd", "maps/red.ppm"}};
    writeTlod(folder.file("x.tlod"), asset);
    const auto textureWith = [&](const char* options) -> osg::ref_ptr<osg::StateAttribute> {
        const osg::ref_ptr<osg::Node> node = read(folder.file("x.tlod"), options).getNode();
        const auto* drawable = dynamic_cast<const TessLODDrawable*>(node.get());
        const osg::StateSet* state = drawable != nullptr ? drawable->getMaterialState(0) : nullptr;
        return state != nullptr
                   ? const_cast<osg::StateAttribute*>(state->getTextureAttribute(0, osg::StateAttribute::TEXTURE))
                   : nullptr;
    };
    {
        const WarningCollector warnings;
        EXPECT_FALSE(textureWith(""));
        EXPECT_NE(warnings.text().find("maps/red.ppm"), std::string::npos) << warnings.text();
    }
    std::filesystem::create_directory(folder.file("maps"));
    writeBytes(folder.file("maps/red.ppm"), std::string("P6\n1 1\n255\n\xFF\0\0", 14));
    const osg::ref_ptr<osg::StateAttribute> texture = textureWith("");
    ASSERT_TRUE(texture);
    const osg::Image* image = static_cast<const osg::Texture2D&>(*texture).getImage();
    ASSERT_NE(image, nullptr);
    EXPECT_EQ(image->getColor(0U), osg::Vec4(1.0F, 0.0F, 0.0F, 1.0F));
    EXPECT_FALSE(textureWith("noTextures"));
}

TEST(ReaderWriterTLOD, RefusesMalformedOptions)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("x.tlod"), makeSyntheticAsset());
    for (const char* option :
         {"errorPixels=fine", "errorPixels=0", "errorPixels=-1", "errorPixels=nan", "errorPixels=1e999", "maxFactor=8x",
          "maxFactor=0", "metric=best", "bound=firstorder", "selection=both", "backend=gl", "cullPatches=maybe"}) {
        const ReadResult result = read(folder.file("x.tlod"), option);
        EXPECT_EQ(result.status(), ReadResult::ERROR_IN_READING_FILE) << option;
        EXPECT_NE(result.message().find(option), std::string::npos) << result.message();
    }
}

TEST(ReaderWriterTLOD, DeclaresWhatItHandles)
{
    EXPECT_EQ(plugin().supportedExtensions().count("tlod"), 1U);
    std::string declared;
    for (const auto& [option, purpose] : plugin().supportedOptions()) { declared += option + " "; }
    for (const char* option : {"errorPixels", "maxFactor", "metric", "bound", "selection", "backend", "cullPatches",
                               "noTextures", "WriteTlodHint"}) {
        EXPECT_NE(declared.find(option), std::string::npos) << declared;
    }
}

TEST(ReaderWriterTLOD, WorksUnderPseudoLoaders)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("x.tlod"), assetAt(0.0, 10.0, 0.0));
    const osg::ref_ptr<osg::Node> turned = osgDB::readRefNodeFile(folder.file("x.tlod.[90,0,0].rot"));
    ASSERT_TRUE(turned);
    const osg::Vec3 center = boundsOf(*turned).center(); // about x by 90°: y becomes z
    EXPECT_NEAR(center.y(), 0.0F, 0.1F);
    EXPECT_NEAR(std::fabs(center.z()), 10.0F, 0.1F);
}

TEST(ReaderWriterTLOD, TellsApartAbsentForeignAndCorruptFiles)
{
    const TemporaryDirectory folder;
    EXPECT_EQ(plugin().readNode(folder.file("absent.tlod")).status(), ReadResult::FILE_NOT_FOUND);
    EXPECT_EQ(plugin().readNode(folder.file("x.obj")).status(), ReadResult::FILE_NOT_HANDLED);
    const osg::ref_ptr<TessLODDrawable> drawable = drawableOf(makeSyntheticAsset());
    EXPECT_EQ(plugin().writeNode(*drawable, folder.file("x.obj")).status(), WriteResult::FILE_NOT_HANDLED);

    const std::string sound = bytesOf(makeSyntheticAsset());
    std::string flipped = sound;
    flipped[flipped.size() / 2] = static_cast<char>(~flipped[flipped.size() / 2]);
    const std::string path = folder.file("corrupt.tlod");
    for (const std::string& bytes : {std::string(), std::string("ply\n"), sound.substr(0, sound.size() / 2), flipped}) {
        writeBytes(path, bytes);
        const ReadResult result = plugin().readNode(path);
        EXPECT_EQ(result.status(), ReadResult::ERROR_IN_READING_FILE) << bytes.size() << " bytes";
        EXPECT_NE(result.message().find(path), std::string::npos) << result.message();
        EXPECT_GT(result.message().size(), path.size() + 5) << "no reason given";
    }
}

} // namespace
} // namespace osgTessLOD
