// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace osgTessLOD {

// Version 2 of the format; all numbers little-endian.
//
//     header, 32 bytes      magic 89 'T' 'L' 'O' 'D' 0D 0A 0A · version u32 · number of chunks u32 (at most 1024) ·
//                           bytes of the file u64 · CRC-32C u32 of header (this field as 0) and table · 0 u32
//     table, 48 per chunk   type 4 characters · level u32 · codec u32 · CRC-32C u32 of the stored bytes ·
//                           offset u64 · stored bytes u64 · content bytes u64 · 0 u64
//     chunks                in the table's order, without gaps, up to the end of the file
//
// Codec 0: the content as it is. Codec 1: one zstd frame that tells the content's size, shorter than it, then skippable
// frames if any; no chunk has more than 256 bytes of content per stored byte (a writer pads with a skippable frame), so that
// a small file cannot ask for much memory. Chunks of unknown type are not looked at; those of a known type come once
// per level. In the order they are written, coarse before fine:
//
//     META                the asset's counts, of which every other chunk's content bytes follow exactly, and its constants
//     BASE EDGE PTCH      12 bytes a base vertex, 20 an edge, 72 a patch: the structs' fields in order, 0 up to the size
//     LVLE LVLV           per ladder level: errors (32 bytes each), vertices (8 bytes, VertexCodec.h)
//     LVLP                after a level's LVLV where the level has parameters (4 bytes a vertex, VertexCodec.h)
//     UVGR                if the asset has texture coordinates: their UvLattice, origin and step (16 bytes)
//     LVLT LVLU           after a level's LVLP, if so: their errors (4 bytes a patch), texture coordinates (4 bytes a vertex)
//     LVLC                after these, if the asset has colours (4 bytes a vertex)
//     MATL                the materials, if there are any: their number u32, then each one's fields in order; texts are
//                         length u32 and bytes, lists number u32 and items, booleans and roles u8
//     PMAT                with several materials: each patch's (2 bytes)
//     IMAG                per image in the asset, `level` its number: name as a text, then the bytes
//     NRML                per normal resolution, `level` its logarithm (4 bytes a texel, VertexCodec.h)

/// A chunk of a .tlod file as its table of contents lists it.
struct TlodChunk {
    std::string type;    ///< four characters
    std::uint32_t level; ///< for level chunks, else 0
    std::uint64_t storedBytes;
    std::uint64_t contentBytes; ///< after decompression
    std::uint64_t offset;       ///< of the stored bytes from the file's beginning
};

/// Writes `asset` to `path`: first to a temporary file beside it, which is renamed once it is complete and flushed, so
/// that `path` holds the old content or the new one, never a part. Throws AssetError naming the path, also if the asset
/// is not valid. The same asset gives the same bytes (with the same version of zstd).
OSGTESSLOD_EXPORT void writeTlod(const std::string& path, const LodAsset& asset);
/// The same bytes to a stream.
OSGTESSLOD_EXPORT void writeTlod(std::ostream& stream, const LodAsset& asset);

/// Reads and validates. Throws AssetError naming the path and the fault for anything that is not a sound version 2
/// file. Memory stays below twice the declared content, which is the sum of contentBytes of readTlodContents, plus 2 MiB
/// (the codec's block, zstd's tables, the table of contents), but for materials, of which texts of a few bytes may take 24 times
/// theirs; sizes are checked before anything is allocated.
OSGTESSLOD_EXPORT LodAsset readTlod(const std::string& path);
/// The same from a seekable stream, from its present position to its end; `name` stands for the path in messages.
OSGTESSLOD_EXPORT LodAsset readTlod(std::istream& stream, const std::string& name);

/// The table of contents alone, checked as far as header and table go.
OSGTESSLOD_EXPORT std::vector<TlodChunk> readTlodContents(const std::string& path);

} // namespace osgTessLOD
