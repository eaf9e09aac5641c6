// SPDX-License-Identifier: MIT
// The OSG plugin for .tlod files. What is read becomes one TessLODDrawable, named after the file; under a translation
// where the asset's frame is not the source's. A scene without one is baked before it is written, by the plugin tesslod.
#include <osgTessLOD/asset/AssetImages.h>
#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/MaterialState.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <plugins/PluginOptions.h>

#include <osgDB/FileNameUtils>
#include <osgDB/FileUtils>
#include <osgDB/Registry>

#include <exception>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

namespace osgTessLOD {

namespace {

/// Of a file, read as it is needed.
std::shared_ptr<const StreamedAsset> openAsset(const std::string& path, const osgDB::Options* options)
{
    StreamedAsset::Options reading;
    reading.normals = !isOptionSet(options, kNoTextures);
    return std::make_shared<const StreamedAsset>(path, reading);
}

std::shared_ptr<const StreamedAsset> readAsset(std::istream& stream, const std::string& name, const osgDB::Options* options)
{
    auto asset = std::make_shared<LodAsset>(readTlod(stream, name));
    if (isOptionSet(options, kNoTextures)) { asset->normals = NormalTexture(); }
    return std::make_shared<const StreamedAsset>(asset);
}

/// `path` is empty for an asset that is not from a file.
osg::ref_ptr<osg::Node> makeNode(std::shared_ptr<const StreamedAsset> asset, const std::string& path,
                                 const osgDB::Options* options)
{
    SelectionOptions selection;
    applyOptions(options, selection);
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable;
    drawable->setStreamedAsset(std::move(asset));
    drawable->setOptions(selection);
    drawable->setName(osgDB::getSimpleFileName(path));
    if (!path.empty()) { drawable->setFileName(std::filesystem::absolute(path).lexically_normal().string()); }
    addMaterialStates(*drawable, osgDB::getFilePath(path), options, !isOptionSet(options, kNoTextures));
    return placeAtOrigin(*drawable);
}

/// Where the images of a drawable's asset are seen from.
std::string folderOf(const TessLODDrawable& drawable)
{
    return std::filesystem::path(drawable.getFileName()).parent_path().string();
}

/// The asset to be stored in `folder` for the scene's only TessLODDrawable, whose translation becomes the asset's origin.
std::shared_ptr<const LodAsset> assetOf(const std::vector<PlacedDrawable>& scene, const std::string& folder)
{
    if (scene.size() != 1) {
        throw std::runtime_error("a .tlod file holds exactly one TessLODDrawable, the scene has " +
                                 std::to_string(scene.size()) + "; .osgt, .osgb and .osgx files hold them all");
    }
    const auto& [drawable, matrix] = scene.front();
    const std::shared_ptr<const LodAsset> asset = drawable->getAsset();
    if (asset == nullptr) { throw std::runtime_error("the scene's TessLODDrawable has no asset"); }
    if (dynamic_cast<const TessLODInstances*>(drawable.get()) != nullptr) {
        throw std::runtime_error("a .tlod file cannot hold placements; .osgt, .osgb and .osgx files do");
    }
    if (matrix.isIdentity() && asset->materials.empty()) { return asset; }

    const osg::Vec3d origin = matrix.getTrans();
    if (matrix != osg::Matrixd::translate(origin)) {
        throw std::runtime_error("a .tlod file cannot hold a rotated or scaled TessLODDrawable");
    }
    auto moved = std::make_shared<LodAsset>(*asset);
    if (!matrix.isIdentity()) { moved->lattice.origin = {origin.x(), origin.y(), origin.z()}; }
    moveReferences(*moved, folderOf(*drawable), folder);
    return moved;
}

std::vector<PlacedDrawable> drawablesOf(const osg::Node& node)
{
    return findTessLODDrawables(const_cast<osg::Node&>(node)); // NodeVisitors take nodes to change; this one does not
}

/// Has the plugin that bakes, which this one is not linked to, bake the scene and write the result, which comes here again.
osgDB::ReaderWriter::WriteResult bakeAndWrite(const osg::Node& node, const std::string& fileName,
                                              const osgDB::Options* options)
{
    osgDB::ReaderWriter* baker = osgDB::Registry::instance()->getReaderWriterForExtension(kBakeExtension);
    if (baker == nullptr) {
        throw std::runtime_error(
            "the scene has no TessLODDrawable, and the plugin osgdb_tesslod, which could bake it, is "
            "not found");
    }
    return baker->writeNode(node, fileName + "." + kBakeExtension, options);
}

} // namespace

class ReaderWriterTLOD : public osgDB::ReaderWriter {
public:
    ReaderWriterTLOD()
    {
        supportsExtension("tlod", "osgTessLOD level-of-detail surface");
        for (const SelectionOption& option : selectionOptionTable()) {
            supportsOption(std::string(option.name) + "=" + option.values, option.purpose);
        }
        supportsOption(kNoTextures, "Leave the textures of normals and the images of materials out");
        supportsOption(std::string(kTechnique) + "=" + kTechniqueValues, kTechniquePurpose);
        supportsOption(std::string(kTolerance) + "=" + kToleranceValues, kTolerancePurpose);
        supportsOption(std::string(kAssetHint) + "=" + kAssetHintValues,
                       "When writing an .osgt, .osgb or .osgx scene of such models: put the .tlod files into it, or "
                       "write those of models that have none beside it; without, the scene names the models' files and "
                       "has those in it that are in none");
    }

    const char* className() const override { return "osgTessLOD reader/writer"; }

    ReadResult readObject(const std::string& fileName, const Options* options) const override
    {
        return readNode(fileName, options);
    }
    ReadResult readObject(std::istream& stream, const Options* options) const override
    {
        return readNode(stream, options);
    }

    ReadResult readNode(const std::string& fileName, const Options* options) const override
    {
        if (!acceptsExtension(osgDB::getLowerCaseFileExtension(fileName))) { return ReadResult::FILE_NOT_HANDLED; }
        const std::string path = osgDB::findDataFile(fileName, options);
        if (path.empty()) { return ReadResult::FILE_NOT_FOUND; }
        return guarded<ReadResult>(path, [&] { return ReadResult(makeNode(openAsset(path, options), path, options)); });
    }

    ReadResult readNode(std::istream& stream, const Options* options) const override
    {
        const std::string name = "(stream)";
        return guarded<ReadResult>(name, [&] { return ReadResult(makeNode(readAsset(stream, name, options), "", options)); });
    }

    WriteResult writeObject(const osg::Object& object, const std::string& fileName,
                            const Options* options) const override
    {
        const auto* node = dynamic_cast<const osg::Node*>(&object);
        return node ? writeNode(*node, fileName, options) : WriteResult(WriteResult::FILE_NOT_HANDLED);
    }
    WriteResult writeObject(const osg::Object& object, std::ostream& stream, const Options* options) const override
    {
        const auto* node = dynamic_cast<const osg::Node*>(&object);
        return node ? writeNode(*node, stream, options) : WriteResult(WriteResult::FILE_NOT_HANDLED);
    }

    WriteResult writeNode(const osg::Node& node, const std::string& fileName, const Options* options) const override
    {
        if (!acceptsExtension(osgDB::getLowerCaseFileExtension(fileName))) { return WriteResult::FILE_NOT_HANDLED; }
        return guarded<WriteResult>(fileName, [&] {
            const std::vector<PlacedDrawable> scene = drawablesOf(node);
            if (scene.empty()) { return bakeAndWrite(node, fileName, options); }
            writeTlod(fileName, *assetOf(scene, osgDB::getFilePath(fileName)));
            return WriteResult(WriteResult::FILE_SAVED);
        });
    }

    WriteResult writeNode(const osg::Node& node, std::ostream& stream, const Options*) const override
    {
        return guarded<WriteResult>("(stream)", [&] {
            writeTlod(stream, *assetOf(drawablesOf(node), ""));
            if (!stream) { throw std::runtime_error("writing failed"); }
            return WriteResult(WriteResult::FILE_SAVED);
        });
    }
};

} // namespace osgTessLOD

using osgTessLOD::ReaderWriterTLOD;
REGISTER_OSGPLUGIN(tlod, ReaderWriterTLOD)
