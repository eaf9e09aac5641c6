// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/ByteStream.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodContainer.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD {

// What is in the chunks of a .tlod file, byte by byte. Private to the asset room.

constexpr std::uint32_t kMetaChunk = chunkType("META");
constexpr std::uint32_t kBaseChunk = chunkType("BASE");
constexpr std::uint32_t kEdgeChunk = chunkType("EDGE");
constexpr std::uint32_t kPatchChunk = chunkType("PTCH");
constexpr std::uint32_t kErrorsChunk = chunkType("LVLE");
constexpr std::uint32_t kVerticesChunk = chunkType("LVLV");
constexpr std::uint32_t kParametersChunk = chunkType("LVLP");
constexpr std::uint32_t kUvLatticeChunk = chunkType("UVGR");
constexpr std::uint32_t kUvErrorsChunk = chunkType("LVLT");
constexpr std::uint32_t kUvsChunk = chunkType("LVLU");
constexpr std::uint32_t kColorsChunk = chunkType("LVLC");
constexpr std::uint32_t kMaterialsChunk = chunkType("MATL");
constexpr std::uint32_t kPatchMaterialsChunk = chunkType("PMAT");
constexpr std::uint32_t kImageChunk = chunkType("IMAG");
constexpr std::uint32_t kNormalsChunk = chunkType("NRML");

/// Is it one of these?
bool isChunkType(std::uint32_t type);

// Of the chunks whose sizes nothing else tells.
constexpr std::uint64_t kMaxMetaBytes = 1U << 20;
constexpr std::uint64_t kMaxMaterialBytes = 1U << 24;

/// What META tells of the other chunks.
struct ContentCounts {
    std::uint32_t baseVertices = 0;
    std::uint32_t edges = 0;
    std::uint32_t patches = 0;
    std::uint32_t normalResolution = 0;
    std::vector<std::uint32_t> levelPatches; ///< patches that reach each level
};

/// Throws AssetError if the asset's texts make it longer than kMaxMetaBytes.
Bytes encodeMeta(const LodAsset& asset);
/// Fills in the asset's ladder and constants. The counts keep each other in bounds: no chunk can be much larger than what
/// the patches ask for. Throws AssetError where they do not, and where the content ends early or late.
ContentCounts decodeMeta(const Bytes& content, LodAsset& asset);

/// Throws AssetError if there is more than kMaxMaterialBytes.
Bytes encodeMaterials(const std::vector<LodMaterial>& materials);
/// Throws AssetError where the content ends early or late, or a role is none.
std::vector<LodMaterial> decodeMaterials(const Bytes& content);

Bytes encodeImage(const LodImage& image);
/// Throws AssetError where the content ends within the name.
LodImage decodeImage(const Bytes& content);

/// Of what a chunk lists: bytes an item, and the fields in their order for ByteWriter and ByteReader alike.
template <class Item> struct ItemFormat;

template <> struct ItemFormat<std::array<std::int32_t, 3>> {
    static constexpr std::size_t kBytes = 12;
    template <class Stream, class Point> static void pass(Stream& stream, Point& point) { stream.field(point); }
};

template <> struct ItemFormat<LodEdge> {
    static constexpr std::size_t kBytes = 20;
    template <class Stream, class Edge> static void pass(Stream& stream, Edge& edge)
    {
        stream.fields(edge.baseVertices, edge.patches, edge.finestLevel, edge.coarsestLevel);
        stream.zeros(2);
    }
};

template <> struct ItemFormat<LodPatch> {
    static constexpr std::size_t kBytes = 72;
    template <class Stream, class Patch> static void pass(Stream& stream, Patch& patch)
    {
        stream.fields(patch.baseVertices, patch.edges, patch.latticeOrigin, patch.boundCenter, patch.boundRadius,
                      patch.coneAxis, patch.chartError, patch.finestLevel);
        stream.zeros(3);
    }
};

template <> struct ItemFormat<LevelError> {
    static constexpr std::size_t kBytes = 32;
    template <class Stream, class Error> static void pass(Stream& stream, Error& error)
    {
        stream.fields(error.quadratic.q, error.isotropic, error.coneCosine);
    }
};

template <> struct ItemFormat<UvLattice> {
    static constexpr std::size_t kBytes = 16;
    template <class Stream, class Grid> static void pass(Stream& stream, Grid& grid) { stream.fields(grid.origin, grid.step); }
};

template <> struct ItemFormat<std::uint16_t> {
    static constexpr std::size_t kBytes = 2;
    template <class Stream, class Number> static void pass(Stream& stream, Number& number) { stream.field(number); }
};

template <> struct ItemFormat<float> {
    static constexpr std::size_t kBytes = 4;
    template <class Stream, class Number> static void pass(Stream& stream, Number& number) { stream.field(number); }
};

template <class Item> Bytes encodeItems(const std::vector<Item>& items)
{
    ByteWriter out;
    out.bytes.reserve(items.size() * ItemFormat<Item>::kBytes);
    for (const Item& item : items) { ItemFormat<Item>::pass(out, item); }
    return std::move(out.bytes);
}

/// Fills all of `items`; `content` holds as many. Throws AssetError where reserved bytes are not zero.
template <class Item> void decodeItems(const std::uint8_t* content, std::vector<Item>& items)
{
    ByteReader in(content, items.size() * ItemFormat<Item>::kBytes);
    for (Item& item : items) { ItemFormat<Item>::pass(in, item); }
}

} // namespace osgTessLOD
