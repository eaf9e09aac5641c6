// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MaterialFiles.h>

#include <osgTessLOD/asset/AssetError.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

namespace osgTessLOD::bake {

namespace {

namespace fs = std::filesystem;

/// The file that another one beside `path` calls `name`.
std::string besideOf(const std::string& path, const std::string& name)
{
    return (fs::path(path).parent_path() / name).lexically_normal().generic_string();
}

/// By name; the first of each counts.
std::map<std::string, LodMaterial> readLibraries(const RawMesh& raw, const std::string& path, SourceMesh& mesh)
{
    std::map<std::string, LodMaterial> known;
    std::set<std::string> files;
    for (const std::string& name : raw.materialFiles) {
        const std::string file = besideOf(path, name);
        if (!files.insert(file).second) { continue; } // named again
        try {
            for (LodMaterial& material : parseMtl(readFile(file))) {
                for (LodTexture& texture : material.textures) { texture.image = besideOf(file, texture.image); }
                const std::string key = material.name;
                known.emplace(key, std::move(material));
            }
        } catch (const AssetError& error) {
            mesh.warnings.push_back(file + ": " + error.what());
        }
    }
    return known;
}

void warnOfMissingImages(const LodMaterial& material, SourceMesh& mesh)
{
    for (const LodTexture& texture : material.textures) {
        std::error_code failure;
        if (fs::is_regular_file(texture.image, failure)) { continue; }
        mesh.warnings.push_back(texture.image + ": no such file, which is " + texture.name + " of the material " +
                                material.name);
    }
}

} // namespace

std::string readFile(const std::string& path)
{
    std::error_code error;
    const auto status = fs::status(path, error);
    if (!fs::exists(status)) { throw AssetError("no such file"); }
    if (!fs::is_regular_file(status)) { throw AssetError("not a regular file"); }
    const std::uintmax_t bytes = fs::file_size(path, error);
    std::ifstream stream(path, std::ios::binary);
    if (error || !stream) { throw AssetError("cannot be opened"); }
    std::string content(static_cast<std::size_t>(bytes), '\0');
    if (!stream.read(content.data(), static_cast<std::streamsize>(content.size()))) {
        throw AssetError("cannot be read");
    }
    return content;
}

void addMaterials(const RawMesh& raw, const std::string& path, SourceMesh& mesh)
{
    if (raw.materials.empty()) { return; }
    const std::map<std::string, LodMaterial> known = readLibraries(raw, path, mesh);
    for (const std::string& name : raw.materials) {
        const auto found = known.find(name);
        LodMaterial& material = mesh.materials.emplace_back();
        if (found != known.end()) { material = found->second; }
        material.name = name;
        if (found == known.end() && !name.empty() && !raw.materialFiles.empty()) {
            mesh.warnings.push_back("the material " + name + " is in none of the files it should be in");
        }
        warnOfMissingImages(material, mesh);
    }
    if (mesh.materials.size() > 1) { mesh.triangleMaterials = raw.triangleMaterials; }
}

} // namespace osgTessLOD::bake
