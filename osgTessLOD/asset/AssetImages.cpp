// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AssetImages.h>

#include <osgTessLOD/asset/AssetError.h>

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

namespace osgTessLOD {

namespace {

namespace fs = std::filesystem;

std::vector<std::uint8_t> bytesOf(const std::string& path)
{
    std::ifstream stream(path, std::ios::binary);
    std::vector<std::uint8_t> bytes(std::istreambuf_iterator<char>(stream), {});
    if (stream.bad() || bytes.empty()) { throw AssetError(path + ": cannot be read, or is empty"); }
    return bytes;
}

template <typename Visit> void forEachTexture(LodAsset& asset, const Visit& visit)
{
    for (LodMaterial& material : asset.materials) {
        for (LodTexture& texture : material.textures) { visit(texture); }
    }
}

bool hasImage(const LodAsset& asset, const std::string& name)
{
    return std::any_of(asset.images.begin(), asset.images.end(), [&](const LodImage& image) { return image.name == name; });
}

/// The file by a name that none of the asset's own images has.
std::string outside(const LodAsset& asset, const std::string& file)
{
    return hasImage(asset, file) ? "./" + file : file;
}

/// "a.png", or "a_2.png" and so on where the asset has one of that name.
std::string freeName(const LodAsset& asset, const fs::path& file)
{
    std::string name = file.filename().string();
    for (unsigned number = 2; hasImage(asset, name); ++number) {
        name = file.stem().string() + "_" + std::to_string(number) + file.extension().string();
    }
    return name;
}

} // namespace

void setColorImage(LodAsset& asset, const std::string& image)
{
    if (!asset.hasUvs()) { throw AssetError("no texture coordinates for a colour image"); }
    if (asset.materials.empty()) { asset.materials.emplace_back(); }
    for (LodMaterial& material : asset.materials) {
        std::vector<LodTexture>& textures = material.textures;
        textures.erase(std::remove_if(textures.begin(), textures.end(),
                                      [](const LodTexture& t) { return t.role == LodTexture::Role::Color; }),
                       textures.end());
        textures.insert(textures.begin(), {LodTexture::Role::Color, "color", outside(asset, image)});
    }
}

void embedImages(LodAsset& asset)
{
    std::map<std::string, std::string> names; // by file
    const std::size_t before = asset.images.size();
    const auto isEmbedded = [&](const LodTexture& texture) { // before any was: a file may have the name of one that is put in
        const auto end = asset.images.begin() + static_cast<std::ptrdiff_t>(before);
        return std::any_of(asset.images.begin(), end, [&](const LodImage& image) { return image.name == texture.image; });
    };
    forEachTexture(asset, [&](LodTexture& texture) {
        std::error_code failure;
        if (isEmbedded(texture) || !fs::is_regular_file(texture.image, failure)) { return; }
        std::string& name = names[texture.image];
        if (name.empty()) {
            name = freeName(asset, texture.image);
            asset.images.push_back({name, bytesOf(texture.image)});
        }
        texture.image = name;
    });
}

void moveReferences(LodAsset& asset, const std::string& from, const std::string& to)
{
    const fs::path base = fs::current_path() / to;
    forEachTexture(asset, [&](LodTexture& texture) {
        if (asset.imageOf(texture) != nullptr) { return; }
        const std::string file = (fs::current_path() / from / texture.image).lexically_proximate(base).generic_string();
        texture.image = outside(asset, file);
    });
}

} // namespace osgTessLOD
