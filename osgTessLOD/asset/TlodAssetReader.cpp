// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodAssetReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodContent.h>
#include <osgTessLOD/asset/VertexCodec.h>

#include <limits>
#include <memory>
#include <string>
#include <type_traits>

namespace osgTessLOD {

namespace {

using WordDecoder = void (*)(unsigned, std::vector<std::uint32_t>&);

void checkSize(const ChunkEntry& entry, std::uint64_t count, std::size_t itemBytes)
{
    if (entry.content != count * itemBytes) {
        failChunk(entry, "has " + std::to_string(entry.content) + " bytes of content, not " +
                             std::to_string(count * itemBytes));
    }
}

/// The chunk, which has `count` items of `itemBytes`.
ChunkEntry takeSized(TlodContainerReader& file, std::uint32_t type, std::uint32_t level, std::uint64_t count,
                     std::size_t itemBytes)
{
    const ChunkEntry entry = file.take(type, level);
    checkSize(entry, count, itemBytes);
    return entry;
}

/// The same of words of every vertex of a level, if the file has them.
std::optional<ChunkEntry> takeWords(TlodContainerReader& file, std::uint32_t type, std::uint32_t level,
                                    std::uint64_t vertices)
{
    if (!file.has(type, level)) { return std::nullopt; }
    return takeSized(file, type, level, vertices, sizeof(std::uint32_t));
}

/// Calls `decode`, whose AssetErrors are about the chunk.
template <class Decode> auto decodeChunk(const ChunkEntry& entry, const Decode& decode)
{
    try {
        return decode();
    } catch (const AssetError& error) {
        failChunk(entry, error.what());
    }
}

/// What `decode` makes of a chunk of which nothing else tells the size.
template <class Decode>
auto readWhole(TlodContainerReader& file, std::uint32_t type, std::uint32_t level, std::uint64_t most, const Decode& decode)
{
    const ChunkEntry entry = file.take(type, level);
    if (entry.content > most) { failChunk(entry, "is too large"); }
    Bytes content(entry.content);
    if (!content.empty()) { file.readContent(entry, content.data()); }
    return decodeChunk(entry, [&] { return decode(content); });
}

template <class Item>
void readItems(TlodContainerReader& file, std::uint32_t type, std::uint32_t level, std::uint64_t count,
               std::vector<Item>& items)
{
    const ChunkEntry entry = takeSized(file, type, level, count, ItemFormat<Item>::kBytes);
    const std::unique_ptr<std::uint8_t[]> content(new std::uint8_t[entry.content]);
    file.readContent(entry, content.get());
    items.resize(count);
    decodeChunk(entry, [&] { decodeItems(content.get(), items); });
}

/// Reads the content into the values' own memory, to be decoded there.
template <class Value>
void readInPlace(TlodContainerReader& file, const ChunkEntry& entry, std::vector<Value>& values)
{
    static_assert(std::is_trivially_copyable_v<Value>);
    values.resize(entry.content / sizeof(Value));
    void* memory = values.data();
    if (!values.empty()) { file.readContent(entry, static_cast<std::uint8_t*>(memory)); }
}

void readWords(TlodContainerReader& file, const std::optional<ChunkEntry>& entry, WordDecoder decode, unsigned factor,
               std::vector<std::uint32_t>& words)
{
    if (!entry.has_value()) { return; }
    readInPlace(file, *entry, words);
    decode(factor, words);
}

void checkNothingLeft(const TlodContainerReader& file)
{
    for (const ChunkEntry& entry : file.entries()) {
        if (isChunkType(entry.type)) { failChunk(entry, "is there twice or belongs to no level"); }
    }
}

} // namespace

TlodAssetReader::TlodAssetReader(TlodContainerReader& file)
{
    const ContentCounts counts = readWhole(file, kMetaChunk, 0, kMaxMetaBytes,
                                           [&](const Bytes& content) { return decodeMeta(content, _frame); });
    readItems(file, kBaseChunk, 0, counts.baseVertices, _frame.baseVertices);
    readItems(file, kEdgeChunk, 0, counts.edges, _frame.edges);
    readItems(file, kPatchChunk, 0, counts.patches, _frame.patches);
    if (file.has(kUvLatticeChunk, 0) || file.has(kUvsChunk, 0)) {
        std::vector<UvLattice> lattice;
        readItems(file, kUvLatticeChunk, 0, 1, lattice);
        _frame.uvLattice = lattice.front();
    }
    readMaterials(file);
    _frame.levels.resize(_frame.ladder.size());
    for (std::uint32_t level = 0; level < _frame.levels.size(); ++level) {
        takeLevel(file, level, counts.levelPatches[level]);
    }
    _frame.normals.resolution = counts.normalResolution;
    takeNormals(file);
    checkNothingLeft(file);
    readLevel(file, 0, _frame);
}

void TlodAssetReader::readMaterials(TlodContainerReader& file)
{
    if (file.has(kMaterialsChunk, 0)) {
        _frame.materials = readWhole(file, kMaterialsChunk, 0, kMaxMaterialBytes, decodeMaterials);
    }
    if (file.has(kPatchMaterialsChunk, 0)) {
        readItems(file, kPatchMaterialsChunk, 0, _frame.patches.size(), _frame.patchMaterials);
    }
    for (std::uint32_t k = 0; file.has(kImageChunk, k); ++k) {
        _frame.images.push_back(
            readWhole(file, kImageChunk, k, std::numeric_limits<std::uint64_t>::max(), decodeImage));
    }
}

void TlodAssetReader::takeLevel(TlodContainerReader& file, std::uint32_t level, std::uint64_t patches)
{
    LodLevel& of = _frame.levels[level];
    readItems(file, kErrorsChunk, level, patches, of.errors);
    if (file.has(kUvErrorsChunk, level)) { readItems(file, kUvErrorsChunk, level, patches, of.uvErrors); }
    const std::uint64_t vertices = patches * TessellationPattern::vertexCount(_frame.ladder[level]);
    _levels.push_back({takeSized(file, kVerticesChunk, level, vertices, sizeof(LodVertex)),
                       takeWords(file, kParametersChunk, level, vertices), takeWords(file, kUvsChunk, level, vertices),
                       takeWords(file, kColorsChunk, level, vertices)});
}

void TlodAssetReader::takeNormals(TlodContainerReader& file)
{
    const std::size_t count = _frame.normals.resolutionCount();
    for (std::uint32_t level = 0; level < count; ++level) {
        const std::uint64_t texels = std::uint64_t{_frame.patches.size()} * NormalTexture::texelCount(1U << level);
        _normals.push_back(takeSized(file, kNormalsChunk, level, texels, sizeof(std::uint32_t)));
    }
    _frame.normals.levels.resize(count);
}

void TlodAssetReader::readLevel(TlodContainerReader& file, std::size_t level, LodAsset& asset) const
{
    const LevelChunks& chunks = _levels[level];
    const unsigned factor = asset.ladder[level];
    LodLevel& of = asset.levels[level];
    readInPlace(file, chunks.vertices, of.vertices);
    decodeVertices(factor, of.vertices);
    readWords(file, chunks.parameters, decodeParameters, factor, of.parameters);
    readWords(file, chunks.uvs, decodeUvs, factor, of.uvs);
    readWords(file, chunks.colors, decodeColors, factor, of.colors);
}

void TlodAssetReader::readNormals(TlodContainerReader& file, std::size_t level, LodAsset& asset) const
{
    readWords(file, _normals[level], decodeNormals, 1U << level, asset.normals.levels[level]);
}

} // namespace osgTessLOD
