// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/ByteStream.h>

#include <cstdint>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

struct ZSTD_CCtx_s;

namespace osgTessLOD {

// A .tlod file as a sequence of chunks, whatever is in them: header, table of contents, checksums and compression, as
// TlodFile.h describes them. Private to the asset room. Faults are thrown without the file's name.

/// Four characters as a number, the first one lowest.
constexpr std::uint32_t chunkType(const char (&name)[5])
{
    std::uint32_t value = 0;
    for (std::size_t k = 4; k > 0; --k) { value = value << 8 | static_cast<std::uint8_t>(name[k - 1]); }
    return value;
}

/// The four characters; what cannot be printed as '?'.
std::string chunkTypeName(std::uint32_t type);

/// A line of the table of contents.
struct ChunkEntry {
    std::uint32_t type;
    std::uint32_t level;
    std::uint32_t codec;
    std::uint32_t crc;     ///< of the stored bytes
    std::uint64_t offset;  ///< of the stored bytes from the file's beginning
    std::uint64_t stored;  ///< bytes
    std::uint64_t content; ///< bytes after decompression
};

/// Throws an AssetError that names the chunk.
[[noreturn]] void failChunk(const ChunkEntry& entry, const std::string& fault);

/// Collects chunks, compressed where that makes them shorter, then writes them with header and table.
class TlodContainerWriter {
public:
    TlodContainerWriter();
    void addChunk(std::uint32_t type, std::size_t level, Bytes content);
    void write(std::ostream& stream) const;

private:
    Bytes compress(const Bytes& content);
    Bytes makeHeader() const;

    struct FreeContext {
        void operator()(ZSTD_CCtx_s* context) const;
    };
    std::unique_ptr<ZSTD_CCtx_s, FreeContext> _context;
    std::vector<ChunkEntry> _entries;
    std::vector<Bytes> _chunks;
};

/// Throws AssetError if it is no regular file or cannot be opened.
std::ifstream openTlodFile(const std::string& path);

/// Reads chunks from a seekable stream.
class TlodContainerReader {
public:
    /// Reads and checks header and table: chunks follow each other up to the end of the file, and none claims more content
    /// per stored byte than the format allows.
    explicit TlodContainerReader(std::istream& stream);

    std::uint64_t fileBytes() const { return _fileBytes; }
    /// Of header and table of contents, which have the checksums of all chunks: files of the same one have the same content.
    std::uint32_t checksum() const { return _checksum; }
    /// The chunks that were not yet taken.
    const std::vector<ChunkEntry>& entries() const { return _entries; }
    bool has(std::uint32_t type, std::uint32_t level) const;
    /// The chunk of this type and level, which is taken off the list.
    ChunkEntry take(std::uint32_t type, std::uint32_t level);
    /// Fills `content`, entry.content bytes, and checks it against the checksum.
    void readContent(const ChunkEntry& entry, std::uint8_t* content);

private:
    struct Header;

    void readBytes(std::uint64_t offset, void* data, std::uint64_t bytes);
    void readTable();
    Header parseHeader(const Bytes& bytes) const;
    void parseEntries(const Bytes& bytes);
    void readStored(const ChunkEntry& entry, std::uint8_t* stored);

    std::istream& _stream;
    std::streamoff _begin = 0;
    std::uint64_t _fileBytes = 0;
    std::uint32_t _checksum = 0;
    std::vector<ChunkEntry> _entries;
};

} // namespace osgTessLOD
