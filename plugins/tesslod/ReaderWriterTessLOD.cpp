// SPDX-License-Identifier: MIT
// The OSG pseudo-loader that bakes. "scan.ply.tesslod" is what any plugin reads of scan.ply with a TessLODDrawable in place of
// every geometry, "builtin:asteroid.tesslod" a built-in surface. Written to "scene.osgb.tesslod", a scene is baked and
// written to scene.osgb; the plugin for .tlod files has scenes without a TessLODDrawable written in the same way.
#include "SceneBaker.h"

#include <plugins/PluginOptions.h>

#include <osg/CopyOp>
#include <osgDB/FileNameUtils>
#include <osgDB/FileUtils>
#include <osgDB/Registry>

namespace osgTessLOD {

namespace {

using ReadResult = osgDB::ReaderWriter::ReadResult;
using WriteResult = osgDB::ReaderWriter::WriteResult;

constexpr const char* kBuiltinPrefix = "builtin:";

/// What the other plugins read, not shared with anybody: it is going to be changed.
ReadResult readSource(const std::string& source, const osgDB::Options* options)
{
    const osg::ref_ptr<osgDB::Options> own = options != nullptr ? options->cloneOptions() : new osgDB::Options;
    own->setObjectCacheHint(osgDB::Options::CACHE_NONE);
    ReadResult result = osgDB::Registry::instance()->readNode(source, own);
    if (result.validNode() || result.notFound() || result.error()) { return result; }
    return ReadResult(source + ": no plugin reads it");
}

ReadResult readAndBake(const std::string& source, const osgDB::Options* options)
{
    const SceneBakeOptions bakeOptions = sceneBakeOptions(options); // before anything takes long
    if (source.rfind(kBuiltinPrefix, 0) == 0) { return bakeByName(source, bakeOptions); }
    if (osgDB::getLowerCaseFileExtension(source) == "off") { // OSG has no plugin for it
        const std::string path = osgDB::findDataFile(source, options);
        return path.empty() ? ReadResult(ReadResult::FILE_NOT_FOUND) : ReadResult(bakeByName(path, bakeOptions));
    }
    ReadResult result = readSource(source, options);
    const osg::ref_ptr<osg::Node> scene = result.getNode();
    return scene.valid() ? ReadResult(bakeScene(*scene, source, bakeOptions)) : result;
}

WriteResult bakeAndWrite(const osg::Node& scene, const std::string& target, const osgDB::Options* options)
{
    const SceneBakeOptions bakeOptions = sceneBakeOptions(options);
    osg::ref_ptr<osg::Node> baked;
    if (osgDB::getLowerCaseFileExtension(target) == "tlod") {
        baked = bakeOnlyGeometry(const_cast<osg::Node&>(scene), target, bakeOptions); // which changes nothing in it
    } else {
        baked = bakeScene(*osg::clone(&scene, osg::CopyOp(osg::CopyOp::DEEP_COPY_NODES)), target, bakeOptions);
    }
    return osgDB::Registry::instance()->writeNode(*baked, target, options);
}

} // namespace

class ReaderWriterTessLOD : public osgDB::ReaderWriter {
public:
    ReaderWriterTessLOD()
    {
        supportsExtension(kBakeExtension, "osgTessLOD pseudo-loader, bakes what it reads or writes");
        for (const SelectionOption& option : selectionOptionTable()) {
            supportsOption(std::string(option.name) + "=" + option.values, option.purpose);
        }
        supportsOption(kNoTextures, "Bake neither normal textures nor texture coordinates");
        supportsOption(std::string(kTechnique) + "=" + kTechniqueValues, kTechniquePurpose);
        supportsOption(std::string(kTolerance) + "=" + kToleranceValues, kTolerancePurpose);
    }

    const char* className() const override { return "osgTessLOD baking pseudo-loader"; }

    ReadResult readObject(const std::string& fileName, const Options* options) const override
    {
        return readNode(fileName, options);
    }

    ReadResult readNode(const std::string& fileName, const Options* options) const override
    {
        const std::string source = nestedName(fileName);
        if (source.empty()) { return ReadResult::FILE_NOT_HANDLED; }
        return guarded<ReadResult>(source, [&] { return readAndBake(source, options); });
    }

    WriteResult writeObject(const osg::Object& object, const std::string& fileName,
                            const Options* options) const override
    {
        const auto* node = dynamic_cast<const osg::Node*>(&object);
        return node ? writeNode(*node, fileName, options) : WriteResult(WriteResult::FILE_NOT_HANDLED);
    }

    WriteResult writeNode(const osg::Node& node, const std::string& fileName, const Options* options) const override
    {
        const std::string target = nestedName(fileName);
        if (target.empty()) { return WriteResult::FILE_NOT_HANDLED; }
        return guarded<WriteResult>(target, [&] { return bakeAndWrite(node, target, options); });
    }

private:
    /// The file behind the pseudo-loader's name; empty for other names.
    std::string nestedName(const std::string& fileName) const
    {
        const bool isMine = acceptsExtension(osgDB::getLowerCaseFileExtension(fileName));
        return isMine ? osgDB::getNameLessExtension(fileName) : std::string();
    }
};

} // namespace osgTessLOD

using osgTessLOD::ReaderWriterTessLOD;
REGISTER_OSGPLUGIN(tesslod, ReaderWriterTessLOD)
