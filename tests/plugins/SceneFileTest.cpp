// SPDX-License-Identifier: MIT
// Models in OSG's own scene files, written and read as applications do it.
#include <asset/SyntheticAsset.h>
#include <render/WarningCollector.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/PatchCullCallback.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <osg/Group>
#include <osg/Material>
#include <osg/MatrixTransform>
#include <osgDB/FileUtils>
#include <osgDB/ReadFile>
#include <osgDB/Registry>
#include <osgDB/WriteFile>
#include <osgUtil/IntersectionVisitor>
#include <osgUtil/LineSegmentIntersector>

#include <cmath>
#include <filesystem>
#include <sstream>

namespace osgTessLOD {
namespace {

constexpr const char* kFormats[] = {"osgt", "osgb", "osgx"};

std::string bytesOf(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

osg::ref_ptr<TessLODDrawable> makeDrawable(const LodAsset& asset = makeSyntheticAsset())
{
    return new TessLODDrawable(std::make_shared<const LodAsset>(asset));
}

bool write(const osg::Node& scene, const std::string& path, const std::string& options = "")
{
    return osgDB::writeNodeFile(scene, path, new osgDB::Options(options));
}

osg::ref_ptr<osg::Node> read(const std::string& path, const std::string& options = "")
{
    return osgDB::readRefNodeFile(path, new osgDB::Options(options));
}

/// The scene's only drawable, null if there is none or another number.
osg::ref_ptr<TessLODDrawable> onlyDrawable(const osg::ref_ptr<osg::Node>& scene)
{
    if (!scene.valid()) { return nullptr; }
    const std::vector<PlacedDrawable> found = findTessLODDrawables(*scene);
    return found.size() == 1 ? found.front().drawable : nullptr;
}

int countCallbacks(const osg::Drawable& drawable)
{
    int count = 0;
    for (const osg::Callback* c = drawable.getCullCallback(); c != nullptr; c = c->getNestedCallback()) { ++count; }
    return count;
}

/// A model under a transform, with a material and options of its own.
osg::ref_ptr<osg::MatrixTransform> makeScene(TessLODDrawable& drawable)
{
    SelectionOptions options;
    options.errorPixels = 0.1; // no power of two: its text must give the same bits again
    options.maxFactor = 8;
    options.metric = SelectionOptions::Metric::Isotropic;
    options.bound = SelectionOptions::Bound::FirstOrder;
    options.selector = SelectionOptions::Selector::Gpu;
    options.cullPatches = false;
    drawable.setOptions(options);
    drawable.setName("the model");
    const osg::ref_ptr<osg::Material> material = new osg::Material;
    material->setDiffuse(osg::Material::FRONT, osg::Vec4(1.0F, 0.5F, 0.25F, 1.0F));
    drawable.getOrCreateStateSet()->setAttribute(material);
    osg::ref_ptr<osg::MatrixTransform> root = new osg::MatrixTransform(osg::Matrixd::translate(1.0, 2.0, 3.0));
    root->addChild(&drawable);
    return root;
}

void expectTheScene(const osg::ref_ptr<osg::Node>& scene, const LodAsset& asset)
{
    const osg::ref_ptr<TessLODDrawable> drawable = onlyDrawable(scene);
    ASSERT_TRUE(drawable);
    ASSERT_NE(drawable->getAsset(), nullptr);
    EXPECT_EQ(bytesOf(*drawable->getAsset()), bytesOf(asset));
    EXPECT_EQ(drawable->getName(), "the model");
    EXPECT_EQ(countCallbacks(*drawable), 1);
    EXPECT_NE(dynamic_cast<const PatchCullCallback*>(drawable->getCullCallback()), nullptr);
    EXPECT_FALSE(drawable->getUseDisplayList());
    EXPECT_TRUE(drawable->getUseVertexBufferObjects());
    EXPECT_TRUE(drawable->getBoundingBox().valid());

    const SelectionOptions& options = drawable->getOptions();
    EXPECT_EQ(options.errorPixels, 0.1);
    EXPECT_EQ(options.maxFactor, 8U);
    EXPECT_EQ(options.metric, SelectionOptions::Metric::Isotropic);
    EXPECT_EQ(options.bound, SelectionOptions::Bound::FirstOrder);
    EXPECT_EQ(options.selector, SelectionOptions::Selector::Gpu);
    EXPECT_FALSE(options.cullPatches);

    ASSERT_NE(drawable->getStateSet(), nullptr);
    const auto* material =
        dynamic_cast<const osg::Material*>(drawable->getStateSet()->getAttribute(osg::StateAttribute::MATERIAL));
    ASSERT_NE(material, nullptr);
    EXPECT_EQ(material->getDiffuse(osg::Material::FRONT), osg::Vec4(1.0F, 0.5F, 0.25F, 1.0F));
    EXPECT_EQ(findTessLODDrawables(*scene).front().localToWorld, osg::Matrixd::translate(1.0, 2.0, 3.0));
}

TEST(SceneFile, HoldsWhatHasNoFile)
{
    const TemporaryDirectory folder;
    const WarningCollector warnings;
    const LodAsset asset = makeSyntheticDisplacedAsset();
    for (const std::string format : kFormats) {
        SCOPED_TRACE(format);
        const std::string path = folder.file("scene." + format);
        ASSERT_TRUE(write(*makeScene(*makeDrawable(asset)), path));
        const osg::ref_ptr<osg::Node> scene = read(path);
        expectTheScene(scene, asset);
        EXPECT_EQ(onlyDrawable(scene)->getFileName(), "");
    }
    EXPECT_EQ(warnings.text(), "");
}

TEST(SceneFile, HoldsPlacements)
{
    const TemporaryDirectory folder;
    const WarningCollector warnings;
    const LodAsset asset = makeSyntheticAsset();
    writeTlod(folder.file("rock.tlod"), asset);
    // Numbers whose texts must give the same bits again, and more of them than a line has.
    std::vector<osg::Matrixd> placements;
    for (int k = 0; k < 30; ++k) {
        placements.push_back(osg::Matrixd::scale(0.1 * k + 0.1, 1.0 / 3.0, 1e-7) *
                             osg::Matrixd::rotate(0.1 * k, osg::Vec3d(1.0, 2.0, 3.0)) *
                             osg::Matrixd::translate(1e6 / 7.0 * k, -0.1, 3e-9));
    }
    for (const std::string format : kFormats) {
        for (const bool isReferenced : {false, true}) {
            SCOPED_TRACE(format);
            const osg::ref_ptr<TessLODInstances> instances =
                new TessLODInstances(std::make_shared<const LodAsset>(asset));
            if (isReferenced) { instances->setFileName(folder.file("rock.tlod")); }
            instances->setPlacements(placements);
            const std::string path = folder.file("scene." + format);
            ASSERT_TRUE(write(*makeScene(*instances), path));
            const osg::ref_ptr<osg::Node> scene = read(path);
            expectTheScene(scene, asset);
            const osg::ref_ptr<TessLODDrawable> found = onlyDrawable(scene);
            const auto* again = dynamic_cast<const TessLODInstances*>(found.get());
            ASSERT_NE(again, nullptr);
            ASSERT_EQ(again->getPlacements().size(), placements.size());
            for (std::size_t k = 0; k < placements.size(); ++k) {
                for (int i = 0; i < 16; ++i) {
                    const double stored = placements[k].ptr()[i];
                    // OSG reads numbers of text digit by digit.
                    const double rounding = format == "osgb" ? 0.0 : 1e-14 * std::fabs(stored);
                    EXPECT_NEAR(again->getPlacements()[k].ptr()[i], stored, rounding) << k;
                }
            }
            EXPECT_EQ(again->getBoundingBox()._max, instances->getBoundingBox()._max);
            EXPECT_EQ(again->getFileName(), isReferenced ? folder.file("rock.tlod") : "");
        }
    }
    const osg::ref_ptr<TessLODInstances> none = new TessLODInstances(std::make_shared<const LodAsset>(asset));
    ASSERT_TRUE(write(*none, folder.file("none.osgt")));
    const osg::ref_ptr<osg::Node> scene = read(folder.file("none.osgt"));
    EXPECT_NE(dynamic_cast<const TessLODInstances*>(onlyDrawable(scene).get()), nullptr);
    EXPECT_EQ(warnings.text(), "");
}

TEST(SceneFile, SurvivesTheLossOfPlacements)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances;
    instances->setPlacements(std::vector<osg::Matrixd>(20, osg::Matrixd::translate(1.0, 2.0, 3.0)));
    for (const std::string format : kFormats) {
        const std::string path = folder.file("scene." + format);
        ASSERT_TRUE(write(*instances, path));
        const std::string bytes = readBytes(path);
        for (std::size_t length = bytes.size() / 2; length + 40 < bytes.size(); length += bytes.size() / 29) {
            writeBytes(path, bytes.substr(0, length));
            const WarningCollector warnings;
            read(path);
            EXPECT_TRUE(format == "osgx" || !warnings.text().empty()) << format << " " << length;
        }
    }
    writeBytes(folder.file("scene.osgt"),
               "#Ascii Scene\n#Version 161\n#Generator OpenSceneGraph 3.6.5\n\nosgTessLOD::TessLODInstances {\n"
               "  UniqueID 1\n  Placements 4000000000 {\n    1 0 0 0\n    0 1 0 0\n  }\n}\n");
    const WarningCollector warnings;
    read(folder.file("scene.osgt"));
    EXPECT_NE(warnings.text(), "");
}

TEST(SceneFile, DoesNotHoldTheTreeThatPickingMakes)
{
    const TemporaryDirectory folder;
    const LodAsset asset = makeSyntheticAsset();
    const osg::ref_ptr<TessLODDrawable> drawable = makeDrawable(asset);
    const osg::ref_ptr<osg::MatrixTransform> scene = makeScene(*drawable);
    osgUtil::IntersectionVisitor visitor(
        new osgUtil::LineSegmentIntersector(osg::Vec3d(1.0, 2.0, 9.0), osg::Vec3d(1.0, 2.0, -9.0)));
    scene->accept(visitor);
    ASSERT_NE(drawable->getShape(), nullptr);
    const WarningCollector warnings;
    for (const std::string format : kFormats) {
        SCOPED_TRACE(format);
        ASSERT_TRUE(write(*scene, folder.file("scene." + format)));
        const osg::ref_ptr<osg::Node> again = read(folder.file("scene." + format));
        expectTheScene(again, asset);
        EXPECT_EQ(onlyDrawable(again)->getShape(), nullptr);
    }
    EXPECT_EQ(warnings.text(), "");
}

TEST(SceneFile, NamesTheFileThatAModelIsFrom)
{
    const TemporaryDirectory folder;
    const WarningCollector warnings;
    const LodAsset asset = makeSyntheticAsset();
    std::filesystem::create_directories(folder.file("a/models"));
    writeTlod(folder.file("a/models/its \"name\".tlod"), asset);
    for (const std::string format : kFormats) {
        SCOPED_TRACE(format);
        const osg::ref_ptr<TessLODDrawable> drawable = onlyDrawable(read(folder.file("a/models/its \"name\".tlod")));
        ASSERT_TRUE(drawable);
        EXPECT_EQ(drawable->getFileName(), folder.file("a/models/its \"name\".tlod"));
        ASSERT_TRUE(write(*makeScene(*drawable), folder.file("a/scene." + format)));
        EXPECT_LT(readBytes(folder.file("a/scene." + format)).size(), 4000U);
        expectTheScene(read(folder.file("a/scene." + format)), asset);
    }
    // Below the scene's folder, the name is relative: both can be moved.
    std::filesystem::rename(folder.file("a"), folder.file("b"));
    for (const std::string format : kFormats) { expectTheScene(read(folder.file("b/scene." + format)), asset); }
    EXPECT_EQ(warnings.text(), "");
}

TEST(SceneFile, FindsModelsElsewhere)
{
    const TemporaryDirectory folder;
    std::filesystem::create_directories(folder.file("models"));
    std::filesystem::create_directories(folder.file("scenes"));
    writeTlod(folder.file("models/x.tlod"), makeSyntheticAsset());
    ASSERT_TRUE(write(*read(folder.file("models/x.tlod")), folder.file("scenes/absolute.osgt")));
    EXPECT_NE(readBytes(folder.file("scenes/absolute.osgt")).find(folder.file("models/x.tlod")), std::string::npos);

    osgDB::Registry::instance()->getDataFilePathList().push_back(folder.file("models"));
    ASSERT_TRUE(write(*read("x.tlod"), folder.file("scenes/data.osgt")));
    EXPECT_NE(readBytes(folder.file("scenes/data.osgt")).find("\"x.tlod\""), std::string::npos);
    for (const char* scene : {"absolute", "data"}) {
        const auto drawable = onlyDrawable(read(folder.file(std::string("scenes/") + scene + ".osgt")));
        ASSERT_TRUE(drawable) << scene;
        EXPECT_NE(drawable->getAsset(), nullptr) << scene;
        EXPECT_EQ(drawable->getFileName(), folder.file("models/x.tlod")) << scene;
    }
    osgDB::Registry::instance()->getDataFilePathList().pop_back();
}

TEST(SceneFile, WarnsOfAMissingFileAndKeepsItsName)
{
    const TemporaryDirectory folder;
    writeTlod(folder.file("gone.tlod"), makeSyntheticAsset());
    ASSERT_TRUE(write(*read(folder.file("gone.tlod")), folder.file("scene.osgt")));
    std::filesystem::remove(folder.file("gone.tlod"));

    const WarningCollector warnings;
    const osg::ref_ptr<TessLODDrawable> drawable = onlyDrawable(read(folder.file("scene.osgt")));
    ASSERT_TRUE(drawable);
    EXPECT_EQ(drawable->getAsset(), nullptr);
    EXPECT_FALSE(drawable->getBoundingBox().valid());
    EXPECT_NE(warnings.text().find("gone.tlod"), std::string::npos) << warnings.text();
    EXPECT_NE(warnings.text().find("not found"), std::string::npos) << warnings.text();
    EXPECT_EQ(drawable->getFileName(), "gone.tlod");
    ASSERT_TRUE(write(*drawable, folder.file("again.osgt"), "WriteTlodHint=IncludeFile"));
    EXPECT_EQ(readBytes(folder.file("again.osgt")), readBytes(folder.file("scene.osgt")));
}

TEST(SceneFile, WarnsOfWhatIsNoModel)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("scene.osgt");
    const auto sceneWith = [&](const std::string& asset) {
        writeBytes(path,
                   "#Ascii Scene\n#Version 161\n#Generator OpenSceneGraph 3.6.5\n\nosgTessLOD::TessLODDrawable {\n"
                   "  UniqueID 1\n  Asset " +
                       asset + "\n}\n");
    };
    const auto expectWarning = [&](const std::string& why) {
        const WarningCollector warnings;
        const osg::ref_ptr<TessLODDrawable> drawable = onlyDrawable(read(path));
        ASSERT_TRUE(drawable) << why;
        EXPECT_EQ(drawable->getAsset(), nullptr) << why;
        EXPECT_NE(warnings.text().find(why), std::string::npos) << warnings.text();
    };
    sceneWith("File \"scene.osgt\""); // itself
    expectWarning("no .tlod file");
    sceneWith("Data iVRM");
    expectWarning("cannot be shown");
    sceneWith("Data iVR");
    expectWarning("Base64");
    sceneWith("Data iV*M");
    expectWarning("Base64");
    sceneWith("Data ====");
    expectWarning("Base64");
    sceneWith("Else iVRM");
    expectWarning("Error reading property");
    writeBytes(folder.file("corrupt.tlod"), bytesOf(makeSyntheticAsset()).substr(0, 300));
    sceneWith("File \"corrupt.tlod\"");
    expectWarning("corrupt.tlod");
}

TEST(SceneFile, TakesTheAssetsInWhenAsked)
{
    const TemporaryDirectory folder;
    const LodAsset asset = makeSyntheticAsset();
    writeTlod(folder.file("x.tlod"), asset);
    const osg::ref_ptr<osg::Node> model = read(folder.file("x.tlod"));
    ASSERT_TRUE(write(*makeScene(*onlyDrawable(model)), folder.file("scene.osgb"), "WriteTlodHint=IncludeFile"));
    std::filesystem::remove(folder.file("x.tlod"));
    expectTheScene(read(folder.file("scene.osgb")), asset);
}

TEST(SceneFile, WritesAssetsBesideItWhenAsked)
{
    const TemporaryDirectory folder;
    const LodAsset first = makeSyntheticAsset();
    const LodAsset second = makeSyntheticAsset(8);
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    for (const LodAsset* asset : {&first, &second, &first}) {
        const osg::ref_ptr<TessLODDrawable> drawable = makeDrawable(*asset);
        drawable->setName("rock");
        scene->addChild(drawable);
    }
    for (int run = 0; run < 2; ++run) { // the second finds its own files and writes no others
        ASSERT_TRUE(write(*scene, folder.file("scene.osgt"), "WriteTlodHint=WriteOut"));
        EXPECT_EQ(folder.entryCount(), 3U);
        EXPECT_EQ(readBytes(folder.file("rock.tlod")), bytesOf(first));
        EXPECT_EQ(readBytes(folder.file("rock_2.tlod")), bytesOf(second));
    }
    const osg::ref_ptr<osg::Node> again = read(folder.file("scene.osgt"));
    const std::vector<PlacedDrawable> found = findTessLODDrawables(*again);
    ASSERT_EQ(found.size(), 3U);
    EXPECT_EQ(bytesOf(*found[1].drawable->getAsset()), bytesOf(second));
    EXPECT_EQ(found[2].drawable->getFileName(), folder.file("rock.tlod"));
}

TEST(SceneFile, IsNotWrittenWithoutItsAssets)
{
    const TemporaryDirectory folder;
    osgDB::ReaderWriter* osgt = osgDB::Registry::instance()->getReaderWriterForExtension("osgt");
    ASSERT_NE(osgt, nullptr);
    const osg::ref_ptr<osgDB::Options> options = new osgDB::Options("WriteTlodHint=Sometimes");
    const auto result = osgt->writeNode(*makeDrawable(), folder.file("scene.osgt"), options);
    EXPECT_FALSE(result.success());
    EXPECT_NE(result.message().find("WriteTlodHint=Sometimes"), std::string::npos) << result.message();
}

TEST(SceneFile, ReadOptionsCountMoreThanStoredOnes)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<TessLODDrawable> drawable = makeDrawable(makeSyntheticAsset(16, true));
    makeScene(*drawable);
    ASSERT_TRUE(write(*drawable, folder.file("scene.osgb")));
    const auto read1 = onlyDrawable(read(folder.file("scene.osgb"), "errorPixels=7 noTextures"));
    ASSERT_TRUE(read1);
    EXPECT_EQ(read1->getOptions().errorPixels, 7.0);
    EXPECT_EQ(read1->getOptions().maxFactor, 8U);
    EXPECT_EQ(read1->getAsset()->normals.resolution, 0U);

    const WarningCollector warnings;
    const auto read2 = onlyDrawable(read(folder.file("scene.osgb"), "errorPixels=few"));
    ASSERT_TRUE(read2);
    EXPECT_EQ(read2->getOptions().errorPixels, 0.1);
    EXPECT_NE(warnings.text().find("errorPixels=few"), std::string::npos) << warnings.text();
}

TEST(SceneFile, WarnsOfUnknownSelectionOptionsAndTakesTheOthers)
{
    const TemporaryDirectory folder;
    writeBytes(folder.file("scene.osgt"),
               "#Ascii Scene\n#Version 161\n#Generator OpenSceneGraph 3.6.5\n\nosgTessLOD::TessLODDrawable {\n"
               "  UniqueID 1\n  Selection \"later=1 errorPixels=3 metric maxFactor=x\"\n}\n");
    const WarningCollector warnings;
    const auto drawable = onlyDrawable(read(folder.file("scene.osgt")));
    ASSERT_TRUE(drawable);
    EXPECT_EQ(drawable->getOptions().errorPixels, 3.0);
    EXPECT_EQ(drawable->getOptions().maxFactor, SelectionOptions().maxFactor);
    for (const char* word : {"later=1", "metric", "maxFactor=x"}) {
        EXPECT_NE(warnings.text().find(word), std::string::npos) << warnings.text();
    }
    EXPECT_EQ(countCallbacks(*drawable), 1); // also where a file says nothing of it
}

TEST(SceneFile, KeepsSharedDrawablesShared)
{
    const TemporaryDirectory folder;
    const osg::ref_ptr<TessLODDrawable> drawable = makeDrawable();
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    for (const double x : {0.0, 5.0}) {
        const osg::ref_ptr<osg::MatrixTransform> place = new osg::MatrixTransform(osg::Matrixd::translate(x, 0.0, 0.0));
        place->addChild(drawable);
        scene->addChild(place);
    }
    ASSERT_TRUE(write(*scene, folder.file("scene.osgb")));
    const osg::ref_ptr<osg::Node> again = read(folder.file("scene.osgb"));
    const std::vector<PlacedDrawable> found = findTessLODDrawables(*again);
    ASSERT_EQ(found.size(), 2U);
    EXPECT_EQ(found[0].drawable, found[1].drawable);
}

} // namespace
} // namespace osgTessLOD
