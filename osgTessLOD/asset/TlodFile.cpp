// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodFile.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodContainer.h>
#include <osgTessLOD/asset/TlodContent.h>
#include <osgTessLOD/asset/VertexCodec.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <new>

namespace osgTessLOD {

namespace {

constexpr std::uint32_t kMeta = chunkType("META");
constexpr std::uint32_t kBase = chunkType("BASE");
constexpr std::uint32_t kEdge = chunkType("EDGE");
constexpr std::uint32_t kPatch = chunkType("PTCH");
constexpr std::uint32_t kErrors = chunkType("LVLE");
constexpr std::uint32_t kVertices = chunkType("LVLV");
constexpr std::uint32_t kParameters = chunkType("LVLP");
constexpr std::uint32_t kUvLattice = chunkType("UVGR");
constexpr std::uint32_t kUvErrors = chunkType("LVLT");
constexpr std::uint32_t kUvs = chunkType("LVLU");
constexpr std::uint32_t kColors = chunkType("LVLC");
constexpr std::uint32_t kMaterials = chunkType("MATL");
constexpr std::uint32_t kPatchMaterials = chunkType("PMAT");
constexpr std::uint32_t kImage = chunkType("IMAG");
constexpr std::uint32_t kNormals = chunkType("NRML");

constexpr std::size_t kVertexBytes = sizeof(LodVertex);
constexpr std::size_t kWordBytes = 4; ///< parameters, texture coordinates, colours and normals

using WordEncoder = void (*)(unsigned, const std::vector<std::uint32_t>&, std::uint8_t*);
using WordDecoder = void (*)(unsigned, std::vector<std::uint32_t>&);

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
    file.addChunk(kMeta, 0, encodeMeta(asset));
    file.addChunk(kBase, 0, encodeItems(asset.baseVertices));
    file.addChunk(kEdge, 0, encodeItems(asset.edges));
    file.addChunk(kPatch, 0, encodeItems(asset.patches));
    if (asset.hasUvs()) { file.addChunk(kUvLattice, 0, encodeItems(std::vector<UvLattice>{asset.uvLattice})); }
    if (!asset.materials.empty()) { file.addChunk(kMaterials, 0, encodeMaterials(asset.materials)); }
    if (!asset.patchMaterials.empty()) { file.addChunk(kPatchMaterials, 0, encodeItems(asset.patchMaterials)); }
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        const LodLevel& level = asset.levels[l];
        file.addChunk(kErrors, l, encodeItems(level.errors));
        Bytes content(level.vertices.size() * kVertexBytes);
        encodeVertices(asset.ladder[l], level.vertices, content.data());
        file.addChunk(kVertices, l, std::move(content));
        addWords(file, kParameters, l, encodeParameters, asset.ladder[l], level.parameters);
        if (asset.hasUvs()) { file.addChunk(kUvErrors, l, encodeItems(level.uvErrors)); }
        addWords(file, kUvs, l, encodeUvs, asset.ladder[l], level.uvs);
        addWords(file, kColors, l, encodeColors, asset.ladder[l], level.colors);
    }
    for (std::size_t k = 0; k < asset.images.size(); ++k) { file.addChunk(kImage, k, encodeImage(asset.images[k])); }
    for (std::size_t l = 0; l < asset.normals.levels.size(); ++l) {
        addWords(file, kNormals, l, encodeNormals, 1U << l, asset.normals.levels[l]);
    }
    return file;
}

// ---------------------------------------------------------------------------------------------------------------------
// Reading. Faults are thrown without the file's name, which the public functions put in front.

void checkSize(const ChunkEntry& entry, std::uint64_t count, std::size_t itemBytes)
{
    if (entry.content != count * itemBytes) {
        failChunk(entry, "has " + std::to_string(entry.content) + " bytes of content, not " +
                             std::to_string(count * itemBytes));
    }
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

ContentCounts readMeta(TlodContainerReader& file, LodAsset& asset)
{
    return readWhole(file, kMeta, 0, kMaxMetaBytes, [&](const Bytes& content) { return decodeMeta(content, asset); });
}

template <class Item>
void readItems(TlodContainerReader& file, std::uint32_t type, std::uint32_t level, std::uint64_t count,
               std::vector<Item>& items)
{
    const ChunkEntry entry = file.take(type, level);
    checkSize(entry, count, ItemFormat<Item>::kBytes);
    const std::unique_ptr<std::uint8_t[]> content(new std::uint8_t[entry.content]);
    file.readContent(entry, content.get());
    items.resize(count);
    decodeChunk(entry, [&] { decodeItems(content.get(), items); });
}

/// Reads the content into the values' own memory, to be decoded there.
template <class Value>
void readInPlace(TlodContainerReader& file, std::uint32_t type, std::uint32_t level, std::uint64_t count,
                 std::vector<Value>& values)
{
    static_assert(std::is_trivially_copyable_v<Value>);
    const ChunkEntry entry = file.take(type, level);
    checkSize(entry, count, sizeof(Value));
    values.resize(count);
    void* memory = values.data();
    if (count > 0) { file.readContent(entry, static_cast<std::uint8_t*>(memory)); }
}

void checkNothingLeft(const TlodContainerReader& file)
{
    for (const ChunkEntry& entry : file.entries()) {
        for (const std::uint32_t known : {kMeta, kBase, kEdge, kPatch, kErrors, kVertices, kParameters, kUvLattice, kUvErrors,
                                          kUvs, kColors, kMaterials, kPatchMaterials, kImage, kNormals}) {
            if (entry.type == known) { failChunk(entry, "is there twice or belongs to no level"); }
        }
    }
}

/// Words of every vertex of a level, if the file has them.
void readLevelWords(TlodContainerReader& file, std::uint32_t type, std::uint32_t level, WordDecoder decode, unsigned factor,
                    std::uint64_t vertices, std::vector<std::uint32_t>& words)
{
    if (!file.has(type, level)) { return; }
    readInPlace(file, type, level, vertices, words);
    decode(factor, words);
}

void readAttributeFrame(TlodContainerReader& file, LodAsset& asset)
{
    if (file.has(kUvLattice, 0) || file.has(kUvs, 0)) {
        std::vector<UvLattice> lattice;
        readItems(file, kUvLattice, 0, 1, lattice);
        asset.uvLattice = lattice.front();
    }
}

void readMaterials(TlodContainerReader& file, LodAsset& asset)
{
    if (file.has(kMaterials, 0)) { asset.materials = readWhole(file, kMaterials, 0, kMaxMaterialBytes, decodeMaterials); }
    if (file.has(kPatchMaterials, 0)) { readItems(file, kPatchMaterials, 0, asset.patches.size(), asset.patchMaterials); }
    for (std::uint32_t k = 0; file.has(kImage, k); ++k) {
        asset.images.push_back(readWhole(file, kImage, k, std::numeric_limits<std::uint64_t>::max(), decodeImage));
    }
}

LodAsset readAsset(std::istream& stream)
{
    TlodContainerReader file(stream);
    LodAsset asset;
    const ContentCounts counts = readMeta(file, asset);
    readItems(file, kBase, 0, counts.baseVertices, asset.baseVertices);
    readItems(file, kEdge, 0, counts.edges, asset.edges);
    readItems(file, kPatch, 0, counts.patches, asset.patches);
    readAttributeFrame(file, asset);
    readMaterials(file, asset);
    asset.levels.resize(asset.ladder.size());
    for (std::uint32_t l = 0; l < asset.levels.size(); ++l) {
        LodLevel& level = asset.levels[l];
        const std::uint64_t reached = counts.levelPatches[l];
        readItems(file, kErrors, l, reached, level.errors);
        const std::uint64_t vertices = reached * TessellationPattern::vertexCount(asset.ladder[l]);
        readInPlace(file, kVertices, l, vertices, level.vertices);
        decodeVertices(asset.ladder[l], level.vertices);
        const unsigned factor = asset.ladder[l];
        readLevelWords(file, kParameters, l, decodeParameters, factor, vertices, level.parameters);
        if (file.has(kUvErrors, l)) { readItems(file, kUvErrors, l, reached, level.uvErrors); }
        readLevelWords(file, kUvs, l, decodeUvs, factor, vertices, level.uvs);
        readLevelWords(file, kColors, l, decodeColors, factor, vertices, level.colors);
    }
    asset.normals.resolution = counts.normalResolution;
    for (std::uint32_t l = 0; counts.normalResolution >> l != 0; ++l) {
        auto& normals = asset.normals.levels.emplace_back();
        readInPlace(file, kNormals, l, std::uint64_t{counts.patches} * NormalTexture::texelCount(1U << l), normals);
        decodeNormals(1U << l, normals);
    }
    checkNothingLeft(file);
    asset.validate();
    return asset;
}

[[noreturn]] void failWithName(const std::string& name, const char* fault)
{
    throw AssetError(name + ": " + fault);
}

std::ifstream openFile(const std::string& path)
{
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) { failWithName(path, "does not exist or cannot be reached"); }
    if (!std::filesystem::is_regular_file(status)) { failWithName(path, "is not a regular file"); }
    std::ifstream stream(path, std::ios::binary);
    if (!stream) { failWithName(path, "cannot be opened"); }
    return stream;
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
        failWithName(path, error.what());
    }
    file.commit();
}

LodAsset readTlod(std::istream& stream, const std::string& name)
{
    try {
        return readAsset(stream);
    } catch (const AssetError& error) {
        failWithName(name, error.what());
    } catch (const std::bad_alloc&) {
        failWithName(name, "not enough memory");
    }
}

LodAsset readTlod(const std::string& path)
{
    std::ifstream stream = openFile(path);
    return readTlod(stream, path);
}

std::vector<TlodChunk> readTlodContents(const std::string& path)
{
    std::ifstream stream = openFile(path);
    try {
        std::vector<TlodChunk> chunks;
        const TlodContainerReader reader(stream);
        for (const ChunkEntry& e : reader.entries()) {
            chunks.push_back({chunkTypeName(e.type), e.level, e.stored, e.content, e.offset});
        }
        return chunks;
    } catch (const AssetError& error) {
        failWithName(path, error.what());
    }
}

} // namespace osgTessLOD
