// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace osgTessLOD {

/// A chunk of a .tlod file as its table of contents lists it.
struct TlodChunk {
    std::string type;               ///< four characters
    std::uint32_t level;            ///< for level chunks, else 0
    std::uint64_t storedBytes;
    std::uint64_t contentBytes;     ///< after decompression
};

/// Writes `asset` to `path`: first to a temporary file beside it, which is renamed once it is complete and flushed, so
/// that `path` holds the old content or the new one, never a part. Throws AssetError naming the path.
OSGTESSLOD_EXPORT void writeTlod(const std::string& path, const LodAsset& asset);
/// The same bytes to a stream.
OSGTESSLOD_EXPORT void writeTlod(std::ostream& stream, const LodAsset& asset);

/// Reads and validates. Throws AssetError naming the path and the fault for anything that is not a sound version 1
/// file; allocates no more than the file's own declared content, which is checked against the file's size first.
OSGTESSLOD_EXPORT LodAsset readTlod(const std::string& path);
/// The same from a seekable stream; `name` stands for the path in messages.
OSGTESSLOD_EXPORT LodAsset readTlod(std::istream& stream, const std::string& name);

/// The table of contents alone.
OSGTESSLOD_EXPORT std::vector<TlodChunk> readTlodContents(const std::string& path);

} // namespace osgTessLOD
