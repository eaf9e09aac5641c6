// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodContent.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <array>

namespace osgTessLOD {

namespace {

/// What follows the counts.
template <class Stream, class Asset> void passConstants(Stream& stream, Asset& asset)
{
    stream.fields(asset.sourceTriangles, asset.lattice.origin, asset.lattice.step, asset.boundsMin, asset.boundsMax,
                  asset.technique, asset.source);
}

void checkCounts(const ContentCounts& counts)
{
    const std::uint64_t sides = 3 * std::uint64_t{counts.patches};
    if (counts.patches == 0 || counts.patches == kNoPatch) { throw AssetError("number of patches out of range"); }
    if (counts.edges > sides || 2 * std::uint64_t{counts.edges} < sides) {
        throw AssetError("number of edges does not go with the number of patches");
    }
    if (counts.baseVertices > sides || counts.baseVertices < 3) {
        throw AssetError("number of base vertices does not go with the number of patches");
    }
    const std::uint32_t r = counts.normalResolution;
    if ((r & (r - 1)) != 0 || r > NormalTexture::kMaxResolution) { throw AssetError("normal resolution is not valid"); }
    std::uint32_t coarser = counts.patches;
    for (const std::uint32_t reached : counts.levelPatches) {
        if (reached > coarser) { throw AssetError("more patches reach a level than the one before"); }
        coarser = reached;
    }
    if (counts.levelPatches.front() != counts.patches) { throw AssetError("not every patch has level 0"); }
}

template <class Stream, class Reflectance> void passReflectance(Stream& stream, Reflectance& r)
{
    stream.fields(r.ambient, r.diffuse, r.specular, r.emission, r.shininess);
}

LodTexture decodeTexture(ByteReader& in)
{
    std::uint8_t role = 0;
    LodTexture texture;
    in.fields(role, texture.name, texture.image);
    if (role >= LodTexture::kRoles) { throw AssetError("a texture has a role that is not known"); }
    texture.role = static_cast<LodTexture::Role>(role);
    return texture;
}

LodMaterial decodeMaterial(ByteReader& in)
{
    LodMaterial material;
    std::uint8_t hasReflectance = 0;
    std::uint32_t textures = 0;
    in.fields(material.name, hasReflectance);
    material.hasReflectance = hasReflectance != 0;
    passReflectance(in, material.reflectance);
    in.field(textures);
    for (std::uint32_t k = 0; k < textures; ++k) { material.textures.push_back(decodeTexture(in)); }
    return material;
}

} // namespace

bool isChunkType(std::uint32_t type)
{
    constexpr std::array kTypes{kMetaChunk, kBaseChunk, kEdgeChunk, kPatchChunk, kErrorsChunk, kVerticesChunk,
                                kParametersChunk, kUvLatticeChunk, kUvErrorsChunk, kUvsChunk, kColorsChunk,
                                kMaterialsChunk, kPatchMaterialsChunk, kImageChunk, kNormalsChunk};
    return std::find(kTypes.begin(), kTypes.end(), type) != kTypes.end();
}

Bytes encodeMeta(const LodAsset& asset)
{
    ByteWriter out;
    out.field(static_cast<std::uint32_t>(asset.baseVertices.size()));
    out.field(static_cast<std::uint32_t>(asset.edges.size()));
    out.field(static_cast<std::uint32_t>(asset.patches.size()));
    out.field(asset.normals.resolution);
    out.field(static_cast<std::uint32_t>(asset.ladder.size()));
    for (std::size_t level = 0; level < asset.ladder.size(); ++level) {
        out.field(std::uint32_t{asset.ladder[level]});
        out.field(static_cast<std::uint32_t>(asset.levels[level].errors.size()));
    }
    passConstants(out, asset);
    if (out.bytes.size() > kMaxMetaBytes) { throw AssetError("technique and source are longer than 1 MiB"); }
    return std::move(out.bytes);
}

ContentCounts decodeMeta(const Bytes& content, LodAsset& asset)
{
    ByteReader in(content.data(), content.size());
    ContentCounts counts;
    in.fields(counts.baseVertices, counts.edges, counts.patches, counts.normalResolution);
    std::uint32_t levels = 0;
    in.field(levels);
    if (levels == 0 || levels > LodAsset::kMaxLevels) { throw AssetError("number of levels out of range"); }
    for (std::uint32_t level = 0; level < levels; ++level) {
        std::uint32_t factor = 0;
        std::uint32_t reached = 0;
        in.fields(factor, reached);
        if (!TessellationPattern::isValidFactor(factor)) { throw AssetError("ladder has an invalid factor"); }
        asset.ladder.push_back(static_cast<std::uint16_t>(factor));
        counts.levelPatches.push_back(reached);
    }
    passConstants(in, asset);
    in.expectEnd();
    checkCounts(counts);
    return counts;
}

Bytes encodeMaterials(const std::vector<LodMaterial>& materials)
{
    ByteWriter out;
    out.field(static_cast<std::uint32_t>(materials.size()));
    for (const LodMaterial& material : materials) {
        out.fields(material.name, static_cast<std::uint8_t>(material.hasReflectance ? 1 : 0));
        passReflectance(out, material.reflectance);
        out.field(static_cast<std::uint32_t>(material.textures.size()));
        for (const LodTexture& texture : material.textures) {
            out.fields(static_cast<std::uint8_t>(texture.role), texture.name, texture.image);
        }
    }
    if (out.bytes.size() > kMaxMaterialBytes) { throw AssetError("the materials take more than 16 MiB"); }
    return std::move(out.bytes);
}

std::vector<LodMaterial> decodeMaterials(const Bytes& content)
{
    ByteReader in(content.data(), content.size());
    std::uint32_t count = 0;
    in.field(count);
    std::vector<LodMaterial> materials;
    for (std::uint32_t k = 0; k < count; ++k) { materials.push_back(decodeMaterial(in)); }
    in.expectEnd();
    return materials;
}

Bytes encodeImage(const LodImage& image)
{
    ByteWriter out;
    out.bytes.reserve(sizeof(std::uint32_t) + image.name.size() + image.bytes.size()); // and GCC sees where it writes
    out.field(image.name);
    out.bytes.insert(out.bytes.end(), image.bytes.begin(), image.bytes.end());
    return std::move(out.bytes);
}

LodImage decodeImage(const Bytes& content)
{
    ByteReader in(content.data(), content.size());
    LodImage image;
    in.field(image.name);
    image.bytes.assign(content.begin() + static_cast<std::ptrdiff_t>(sizeof(std::uint32_t) + image.name.size()), content.end());
    return image;
}

} // namespace osgTessLOD
