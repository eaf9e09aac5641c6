// SPDX-License-Identifier: MIT
#include "AssetReference.h"

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PlacedDrawable.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osgDB/FileNameUtils>
#include <osgDB/FileUtils>
#include <osgDB/Registry>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

namespace osgTessLOD {

namespace {

namespace fs = std::filesystem;
using ReadResult = osgDB::ReaderWriter::ReadResult;

fs::path sceneFolder(const osgDB::Options* options)
{
    const bool isKnown = options != nullptr && !options->getDatabasePathList().empty();
    return fs::current_path() / (isKnown ? options->getDatabasePathList().front() : std::string());
}

/// `file` as seen from `folder` if it is in it or below, else nothing. Both absolute.
std::string below(const fs::path& folder, const fs::path& file)
{
    const fs::path relative = file.lexically_relative(folder.lexically_normal());
    return relative.empty() || *relative.begin() == ".." ? std::string() : relative.string();
}

std::string reasonOf(const ReadResult& result)
{
    if (!result.message().empty()) { return result.message(); }
    return result.status() == ReadResult::FILE_NOT_FOUND ? "it is not found" : "no plugin reads it";
}

/// A name for a file of the drawable's asset, without extension.
std::string baseName(const TessLODDrawable& drawable)
{
    const std::string& name = drawable.getName().empty() ? drawable.getGpuAsset()->asset().source : drawable.getName();
    std::string base = osgDB::getStrippedName(name);
    std::replace_if(
        base.begin(), base.end(), [](unsigned char c) { return c < ' ' || c == ':' || c == '"'; }, '_');
    return base.empty() || base[0] == '.' ? "surface" : base;
}

bool holds(const fs::path& file, const std::string& bytes)
{
    std::error_code failure;
    if (fs::file_size(file, failure) != bytes.size() || failure) { return false; }
    std::ifstream stream(file, std::ios::binary);
    return std::equal(bytes.begin(), bytes.end(), std::istreambuf_iterator<char>(stream));
}

} // namespace

std::string referenceTo(const std::string& fileName, const osgDB::Options* options)
{
    if (osgDB::containsServerAddress(fileName)) { return fileName; }
    const std::string found = osgDB::findDataFile(fileName, options);
    if (found.empty()) { return fileName; }
    const fs::path file = fs::absolute(found).lexically_normal();
    std::string relative = below(sceneFolder(options), file);
    for (const std::string& folder : osgDB::getDataFilePathList()) {
        if (relative.empty() && !folder.empty()) { relative = below(fs::absolute(folder), file); }
    }
    return relative.empty() ? file.string() : relative;
}

void loadReferenced(TessLODDrawable& drawable, const std::string& name, const osgDB::Options* options)
{
    drawable.setAsset(nullptr);
    drawable.setFileName(name);
    std::string reason = "it is no .tlod file"; // a scene that refers to itself would never end
    if (osgDB::getLowerCaseFileExtension(name) == "tlod") {
        ReadResult result = osgDB::Registry::instance()->readNode(name, options);
        const osg::ref_ptr<osg::Node> node = result.getNode();
        const auto found = node.valid() ? findTessLODDrawables(*node) : std::vector<PlacedDrawable>();
        if (!found.empty()) {
            drawable.shareAsset(*found.front().drawable);
            if (drawable.getFileName().empty()) { drawable.setFileName(name); }
            return;
        }
        reason = reasonOf(result);
    }
    OSG_WARN << "osgTessLOD: a scene refers to " << name << ", which cannot be shown: " << reason << std::endl;
}

std::string writeBeside(const TessLODDrawable& drawable, const osgDB::Options* options)
{
    const std::string bytes = bytesOf(*drawable.getAsset());
    const fs::path folder = sceneFolder(options);
    const std::string base = baseName(drawable);
    for (unsigned number = 1;; ++number) {
        const std::string name = base + (number > 1 ? "_" + std::to_string(number) : "") + ".tlod";
        const fs::path file = folder / name;
        if (holds(file, bytes)) { return name; }
        if (fs::exists(file)) { continue; }
        writeTlod(file.string(), *drawable.getAsset());
        return name;
    }
}

std::string bytesOf(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

} // namespace osgTessLOD
