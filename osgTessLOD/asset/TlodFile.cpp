// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodFile.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/asset/TlodAssetReader.h>
#include <osgTessLOD/asset/TlodContainer.h>
#include <osgTessLOD/asset/TlodContent.h>
#include <osgTessLOD/asset/VertexCodec.h>

#include <fstream>
#include <new>
#include <utility>

namespace osgTessLOD {

namespace {

constexpr std::size_t kVertexBytes = sizeof(LodVertex);
constexpr std::size_t kWordBytes = 4; ///< parameters, texture coordinates, colours and normals

using WordEncoder = void (*)(unsigned, const std::vector<std::uint32_t>&, std::uint8_t*);

/// Adds a chunk of words, if there are any.
void addWords(TlodContainerWriter& file, std::uint32_t type, std::size_t level, WordEncoder encode, unsigned factor,
              const std::vector<std::uint32_t>& words)
{
    if (words.empty()) { return; }
    Bytes content(words.size() * kWordBytes);
    encode(factor, words, content.data());
    file.addChunk(type, level, std::move(content));
}

TlodContainerWriter makeFile(const LodAsset& asset)
{
    asset.validate();
    TlodContainerWriter file;
    file.addChunk(kMetaChunk, 0, encodeMeta(asset));
    file.addChunk(kBaseChunk, 0, encodeItems(asset.baseVertices));
    file.addChunk(kEdgeChunk, 0, encodeItems(asset.edges));
    file.addChunk(kPatchChunk, 0, encodeItems(asset.patches));
    if (asset.hasUvs()) { file.addChunk(kUvLatticeChunk, 0, encodeItems(std::vector<UvLattice>{asset.uvLattice})); }
    if (!asset.materials.empty()) { file.addChunk(kMaterialsChunk, 0, encodeMaterials(asset.materials)); }
    if (!asset.patchMaterials.empty()) { file.addChunk(kPatchMaterialsChunk, 0, encodeItems(asset.patchMaterials)); }
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        const LodLevel& level = asset.levels[l];
        file.addChunk(kErrorsChunk, l, encodeItems(level.errors));
        Bytes content(level.vertices.size() * kVertexBytes);
        encodeVertices(asset.ladder[l], level.vertices, content.data());
        file.addChunk(kVerticesChunk, l, std::move(content));
        addWords(file, kParametersChunk, l, encodeParameters, asset.ladder[l], level.parameters);
        if (asset.hasUvs()) { file.addChunk(kUvErrorsChunk, l, encodeItems(level.uvErrors)); }
        addWords(file, kUvsChunk, l, encodeUvs, asset.ladder[l], level.uvs);
        addWords(file, kColorsChunk, l, encodeColors, asset.ladder[l], level.colors);
    }
    for (std::size_t k = 0; k < asset.images.size(); ++k) { file.addChunk(kImageChunk, k, encodeImage(asset.images[k])); }
    for (std::size_t l = 0; l < asset.normals.levels.size(); ++l) {
        addWords(file, kNormalsChunk, l, encodeNormals, 1U << l, asset.normals.levels[l]);
    }
    return file;
}

LodAsset readAsset(std::istream& stream)
{
    TlodContainerReader file(stream);
    TlodAssetReader reader(file);
    LodAsset asset = std::move(reader.frame());
    for (std::size_t level = 1; level < asset.levels.size(); ++level) { reader.readLevel(file, level, asset); }
    for (std::size_t level = 0; level < asset.normals.levels.size(); ++level) { reader.readNormals(file, level, asset); }
    asset.validate();
    return asset;
}

/// Calls `read`, whose faults are those of the file of this name.
template <class Read> auto named(const std::string& name, const Read& read)
{
    try {
        return read();
    } catch (const AssetError& error) {
        throw AssetError(name + ": " + error.what());
    } catch (const std::bad_alloc&) {
        throw AssetError(name + ": not enough memory");
    }
}

} // namespace

void writeTlod(std::ostream& stream, const LodAsset& asset)
{
    makeFile(asset).write(stream);
    if (!stream.flush()) { throw AssetError("output failed"); }
}

void writeTlod(const std::string& path, const LodAsset& asset)
{
    AtomicFile file(path);
    try {
        makeFile(asset).write(file.stream());
    } catch (const AssetError& error) {
        throw AssetError(path + ": " + error.what());
    }
    file.commit();
}

LodAsset readTlod(std::istream& stream, const std::string& name)
{
    return named(name, [&] { return readAsset(stream); });
}

LodAsset readTlod(const std::string& path)
{
    return named(path, [&] {
        std::ifstream stream = openTlodFile(path);
        return readAsset(stream);
    });
}

std::vector<TlodChunk> readTlodContents(const std::string& path)
{
    return named(path, [&] {
        std::vector<TlodChunk> chunks;
        std::ifstream stream = openTlodFile(path);
        const TlodContainerReader reader(stream);
        for (const ChunkEntry& e : reader.entries()) {
            chunks.push_back({chunkTypeName(e.type), e.level, e.stored, e.content, e.offset});
        }
        return chunks;
    });
}

} // namespace osgTessLOD
