// SPDX-License-Identifier: MIT
// The OSG plugin for .tlod files. What is read becomes one TessLODDrawable, named after the file; under a translation
// where the asset's frame is not the source's.
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/MatrixTransform>
#include <osgDB/FileNameUtils>
#include <osgDB/FileUtils>
#include <osgDB/Registry>

#include <cmath>
#include <cstdlib>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

namespace osgTessLOD {

namespace {

constexpr const char* kErrorPixels = "errorPixels";
constexpr const char* kMaxFactor = "maxFactor";
constexpr const char* kMetric = "metric";
constexpr const char* kBound = "bound";
constexpr const char* kBackend = "backend";
constexpr const char* kNoTextures = "noTextures";

/// The number that option `name` asks for, or `fallback` where it is not given. Throws for anything but a number > 0.
double positiveOption(const osgDB::Options* options, const char* name, double fallback)
{
    const std::string text = options ? options->getPluginStringData(name) : std::string();
    if (text.empty()) { return fallback; }
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (*end != '\0' || !std::isfinite(value) || value <= 0.0) {
        throw std::runtime_error(std::string("option ") + name + "=" + text + " is not a number above 0");
    }
    return value;
}

/// What option `name` names, as `find` knows it, or `fallback` where it is not given. Throws for other names.
template <typename Value>
Value namedOption(const osgDB::Options* options, const char* name, std::optional<Value> (*find)(const std::string&),
                  Value fallback)
{
    const std::string text = options ? options->getPluginStringData(name) : std::string();
    if (text.empty()) { return fallback; }
    const std::optional<Value> value = find(text);
    if (!value) { throw std::runtime_error(std::string("option ") + name + "=" + text + " is not known"); }
    return *value;
}

bool isOptionSet(const osgDB::Options* options, const char* name)
{
    const std::string text = options ? options->getPluginStringData(name) : std::string();
    return !text.empty() && text != "false" && text != "0";
}

osg::ref_ptr<osg::Node> makeNode(LodAsset asset, const std::string& name, const osgDB::Options* options)
{
    SelectionOptions selection;
    selection.errorPixels = positiveOption(options, kErrorPixels, selection.errorPixels);
    selection.maxFactor =
        static_cast<unsigned>(std::fmin(positiveOption(options, kMaxFactor, selection.maxFactor), 1e6));
    selection.metric = namedOption(options, kMetric, metricNamed, selection.metric);
    selection.bound = namedOption(options, kBound, boundNamed, selection.bound);
    selection.backend = namedOption(options, kBackend, backendNamed, selection.backend);
    if (isOptionSet(options, kNoTextures)) { asset.normals = NormalTexture(); }
    const osg::Vec3d origin(asset.lattice.origin[0], asset.lattice.origin[1], asset.lattice.origin[2]);

    osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(std::make_shared<const LodAsset>(std::move(asset)));
    drawable->setOptions(selection);
    drawable->setName(osgDB::getSimpleFileName(name));
    drawable->getBound(); // now, so that no cull thread has to
    if (origin == osg::Vec3d()) { return drawable; }

    osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(osg::Matrixd::translate(origin));
    transform->setName(drawable->getName());
    // The Optimizer would try to apply a STATIC transform to vertices, which it cannot reach here.
    transform->setDataVariance(osg::Object::DYNAMIC);
    transform->addChild(drawable);
    return transform;
}

/// The asset to be stored for a scene: that of its only TessLODDrawable, whose translation becomes the asset's origin.
std::shared_ptr<const LodAsset> assetOf(const osg::Node& node)
{
    // NodeVisitors take nodes to change; this one does not.
    const std::vector<PlacedDrawable> found = findTessLODDrawables(const_cast<osg::Node&>(node));
    if (found.size() != 1) {
        throw std::runtime_error("a .tlod file holds exactly one TessLODDrawable, the scene has " +
                                 std::to_string(found.size()));
    }
    const auto& [drawable, matrix] = found.front();
    if (!drawable->getAsset()) { throw std::runtime_error("the scene's TessLODDrawable has no asset"); }
    if (matrix.isIdentity()) { return drawable->getAsset(); }

    const osg::Vec3d origin = matrix.getTrans();
    if (matrix != osg::Matrixd::translate(origin)) {
        throw std::runtime_error("a .tlod file cannot hold a rotated or scaled TessLODDrawable");
    }
    auto moved = std::make_shared<LodAsset>(*drawable->getAsset());
    moved->lattice.origin = {origin.x(), origin.y(), origin.z()};
    return moved;
}

} // namespace

class ReaderWriterTLOD : public osgDB::ReaderWriter {
public:
    ReaderWriterTLOD()
    {
        supportsExtension("tlod", "osgTessLOD level-of-detail surface");
        supportsOption(std::string(kErrorPixels) + "=<number>", "Largest error on screen, in pixels; 1 if not given");
        supportsOption(std::string(kMaxFactor) + "=<number>", "Levels of larger tessellation factors are not used");
        supportsOption(std::string(kMetric) + "=view|isotropic",
                       "Errors as seen, which is the default, or at their largest");
        supportsOption(std::string(kBound) + "=conservative|first-order",
                       "Keep the error everywhere on screen, which is the default, or about at the middles of borders");
        supportsOption(std::string(kBackend) + "=auto|tessellation|instanced",
                       "Draw with tessellation shaders or an instance per patch; auto, the default, tries which is faster");
        supportsOption(kNoTextures, "Leave the normal textures out");
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
        return guarded<ReadResult>(path, [&] { return ReadResult(makeNode(readTlod(path), path, options)); });
    }

    ReadResult readNode(std::istream& stream, const Options* options) const override
    {
        const std::string name = "(stream)";
        return guarded<ReadResult>(name, [&] { return ReadResult(makeNode(readTlod(stream, name), "", options)); });
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

    WriteResult writeNode(const osg::Node& node, const std::string& fileName, const Options*) const override
    {
        if (!acceptsExtension(osgDB::getLowerCaseFileExtension(fileName))) { return WriteResult::FILE_NOT_HANDLED; }
        return guarded<WriteResult>(fileName, [&] {
            writeTlod(fileName, *assetOf(node));
            return WriteResult(WriteResult::FILE_SAVED);
        });
    }

    WriteResult writeNode(const osg::Node& node, std::ostream& stream, const Options*) const override
    {
        return guarded<WriteResult>("(stream)", [&] {
            writeTlod(stream, *assetOf(node));
            if (!stream) { throw std::runtime_error("writing failed"); }
            return WriteResult(WriteResult::FILE_SAVED);
        });
    }

private:
    /// The result of `work`, or what went wrong with the file `name`: OSG's readers expect no exceptions.
    template <typename Result, typename Work> static Result guarded(const std::string& name, const Work& work)
    {
        try {
            return work();
        } catch (const std::exception& error) {
            const std::string message = error.what();
            return Result(message.find(name) == std::string::npos ? name + ": " + message : message);
        } catch (...) {
            return Result(name + ": unknown error");
        }
    }
};

} // namespace osgTessLOD

using osgTessLOD::ReaderWriterTLOD;
REGISTER_OSGPLUGIN(tlod, ReaderWriterTLOD)
