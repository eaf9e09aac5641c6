// SPDX-License-Identifier: MIT
// TessLODDrawable in .osgt, .osgb and .osgx files: selection options that are not the defaults, and the asset, either as
// the name of its .tlod file or as that file's bytes (Base64 in files of text).
#include "AssetReference.h"
#include "Base64.h"

#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/MaterialState.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <plugins/PluginOptions.h>

#include <osgDB/InputStream>
#include <osgDB/ObjectWrapper>
#include <osgDB/OutputStream>

#include <algorithm>
#include <climits>
#include <exception>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace {

using osgTessLOD::SelectionOption;
using osgTessLOD::SelectionOptions;
using osgTessLOD::TessLODDrawable;

/// "errorPixels=2 metric=isotropic": what differs from the defaults.
std::string textOf(const SelectionOptions& options)
{
    const SelectionOptions defaults;
    std::string text;
    for (const SelectionOption& option : osgTessLOD::selectionOptionTable()) {
        if (option.text(options) == option.text(defaults)) { continue; }
        text += (text.empty() ? "" : " ") + std::string(option.name) + "=" + option.text(options);
    }
    return text;
}

/// Warns of what `options` has that is not known, and applies the rest.
void applyText(const std::string& text, SelectionOptions& options)
{
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const std::string name = word.substr(0, word.find('='));
        const std::string value = word.substr(std::min(word.size(), name.size() + 1));
        bool taken = false;
        for (const SelectionOption& option : osgTessLOD::selectionOptionTable()) {
            taken = taken || (name == option.name && option.read(value, options));
        }
        if (!taken) {
            OSG_WARN << "osgTessLOD: a scene file's selection option " << word << " is not known" << std::endl;
        }
    }
}

bool checkSelection(const TessLODDrawable& drawable)
{
    return !textOf(drawable.getOptions()).empty();
}

bool readSelection(osgDB::InputStream& is, TessLODDrawable& drawable)
{
    std::string text;
    is.readWrappedString(text);
    SelectionOptions options = drawable.getOptions();
    applyText(text, options);
    drawable.setOptions(options);
    return true;
}

bool writeSelection(osgDB::OutputStream& os, const TessLODDrawable& drawable)
{
    os.writeWrappedString(textOf(drawable.getOptions()));
    os << std::endl;
    return true;
}

// ------------------------------------------------------------------------------------------------------- assets ---

constexpr const char* kFile = "File";
constexpr const char* kData = "Data";

bool checkAsset(const TessLODDrawable& drawable)
{
    return drawable.getGpuAsset() != nullptr || !drawable.getFileName().empty();
}

void readData(osgDB::InputStream& is, TessLODDrawable& drawable, const std::string& text)
{
    try {
        std::istringstream stream(is.isBinary() ? text : osgTessLOD::fromBase64(text));
        osgTessLOD::LodAsset asset = osgTessLOD::readTlod(stream, "the asset in a scene file");
        if (osgTessLOD::isOptionSet(is.getOptions(), osgTessLOD::kNoTextures)) { asset.normals = {}; }
        drawable.setAsset(std::make_shared<const osgTessLOD::LodAsset>(std::move(asset)));
        osgTessLOD::addMaterialStates(drawable, "", is.getOptions(),
                                      !osgTessLOD::isOptionSet(is.getOptions(), osgTessLOD::kNoTextures));
    } catch (const std::exception& error) {
        OSG_WARN << "osgTessLOD: " << drawable.getName() << " cannot be shown: " << error.what() << std::endl;
    }
}

bool readAsset(osgDB::InputStream& is, TessLODDrawable& drawable)
{
    std::string kind;
    std::string text;
    is >> kind;
    if (kind == kFile) {
        is.readWrappedString(text);
        osgTessLOD::loadReferenced(drawable, text, is.getOptions());
        return true;
    }
    if (kind == kData) {
        is >> text;
        readData(is, drawable, text);
        return true;
    }
    return false;
}

/// The name to store; empty for the bytes instead.
std::string nameToStore(const TessLODDrawable& drawable, const osgDB::Options* options)
{
    const std::string hint = osgTessLOD::optionText(options, osgTessLOD::kAssetHint);
    const bool includes = hint == osgTessLOD::kIncludeFile;
    const bool writesOut = hint == osgTessLOD::kWriteOut;
    if (!hint.empty() && !includes && !writesOut) {
        osgTessLOD::throwBadOption(osgTessLOD::kAssetHint, hint, osgTessLOD::kAssetHintValues);
    }
    const bool hasAsset = drawable.getGpuAsset() != nullptr;
    if (hasAsset && includes) { return {}; }
    if (!drawable.getFileName().empty()) { return osgTessLOD::referenceTo(drawable.getFileName(), options); }
    return writesOut ? osgTessLOD::writeBeside(drawable, options) : std::string();
}

/// The bytes as one word.
std::string dataText(const osgTessLOD::LodAsset& asset, bool isBinary)
{
    std::string bytes = osgTessLOD::bytesOf(asset);
    if (!isBinary) { bytes = osgTessLOD::toBase64(bytes); }
    if (bytes.size() > INT_MAX) { throw std::runtime_error("the asset is too large to be put into a scene file"); }
    return bytes;
}

bool writeAsset(osgDB::OutputStream& os, const TessLODDrawable& drawable)
{
    try {
        const std::string name = nameToStore(drawable, os.getOptions());
        if (name.empty()) {
            const std::string text = dataText(*drawable.getAsset(), os.isBinary());
            os << std::string(kData) << text << std::endl;
        } else {
            os << std::string(kFile);
            os.writeWrappedString(name);
            os << std::endl;
        }
    } catch (const std::exception& error) {
        os.throwException("osgTessLOD: " + drawable.getName() + ": " + error.what());
        return false;
    }
    return true;
}

/// The options that a scene is read with count more than those stored in it.
struct ApplyReadOptions : osgDB::FinishedObjectReadCallback {
    void objectRead(osgDB::InputStream& is, osg::Object& object) override
    {
        auto& drawable = static_cast<TessLODDrawable&>(object);
        SelectionOptions selection = drawable.getOptions();
        try {
            osgTessLOD::applyOptions(is.getOptions(), selection);
            drawable.setOptions(selection);
        } catch (const std::exception& error) {
            OSG_WARN << "osgTessLOD: " << error.what() << std::endl;
        }
    }
};

} // namespace

REGISTER_OBJECT_WRAPPER(osgTessLOD_TessLODDrawable, new osgTessLOD::TessLODDrawable, osgTessLOD::TessLODDrawable,
                        "osg::Object osg::Node osg::Drawable osgTessLOD::TessLODDrawable")
{
    ADD_USER_SERIALIZER(Selection);
    ADD_USER_SERIALIZER(Asset);
    wrapper->addFinishedObjectReadCallback(new ApplyReadOptions);
}
