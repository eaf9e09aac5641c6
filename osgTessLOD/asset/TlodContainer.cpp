// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodContainer.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/Crc32c.h>

#include <zstd.h>

#include <algorithm>
#include <filesystem>
#include <istream>
#include <new>
#include <ostream>
#include <system_error>

namespace osgTessLOD {

namespace {

constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'T', 'L', 'O', 'D', '\r', '\n', '\n'};
constexpr std::uint32_t kVersion = 2;
constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kHeaderCrcAt = 24;
constexpr std::size_t kEntryBytes = 48;
constexpr std::uint32_t kMaxChunks = 1024;
constexpr std::uint64_t kMaxRatio = 256; // content bytes per stored byte
// Measured on smooth and noisy synthetic surfaces, 10 MB each: against 6, level 3 takes two thirds of the time and up to
// 11 % more space, level 12 three times as long for 1 to 4 % less, level 19 twenty times for 2 to 12 % less.
constexpr int kZstdLevel = 6;

constexpr std::uint32_t kCodecRaw = 0;
constexpr std::uint32_t kCodecZstd = 1;

template <class Stream, class Entry> void passEntry(Stream& stream, Entry& entry)
{
    stream.fields(entry.type, entry.level, entry.codec, entry.crc, entry.offset, entry.stored, entry.content);
    stream.zeros(8);
}

/// Appends a skippable zstd frame where the content would be more than kMaxRatio times as long.
void padToRatio(Bytes& stored, std::size_t contentBytes)
{
    constexpr std::uint32_t kSkippableMagic = 0x184D2A50;
    constexpr std::size_t kFrameHeader = 8;
    const std::size_t least = (contentBytes + kMaxRatio - 1) / kMaxRatio;
    if (stored.size() >= least) { return; }
    const std::size_t padding = std::max(least - stored.size(), kFrameHeader) - kFrameHeader;
    ByteWriter frame;
    frame.field(kSkippableMagic);
    frame.field(static_cast<std::uint32_t>(padding));
    frame.zeros(padding);
    stored.insert(stored.end(), frame.bytes.begin(), frame.bytes.end());
}

void put(std::ostream& stream, const Bytes& bytes)
{
    const void* data = bytes.data();
    stream.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes.size()));
}

void decompress(const ChunkEntry& entry, const std::uint8_t* stored, std::uint8_t* content)
{
    if (ZSTD_getFrameContentSize(stored, entry.stored) != entry.content) {
        failChunk(entry, "its content's sizes differ");
    }
    const std::size_t size = ZSTD_decompress(content, entry.content, stored, entry.stored);
    if (ZSTD_isError(size) != 0) { failChunk(entry, ZSTD_getErrorName(size)); }
    if (size != entry.content) { failChunk(entry, "its content ends early"); }
}

} // namespace

std::string chunkTypeName(std::uint32_t type)
{
    std::string name;
    for (int shift = 0; shift < 32; shift += 8) {
        const auto c = static_cast<char>(type >> shift & 0xFF);
        name += c >= ' ' && c <= '~' ? c : '?';
    }
    return name;
}

void failChunk(const ChunkEntry& entry, const std::string& fault)
{
    throw AssetError("chunk " + chunkTypeName(entry.type) + " " + std::to_string(entry.level) + ": " + fault);
}

// ---------------------------------------------------------------------------------------------------------------------
// Writing

TlodContainerWriter::TlodContainerWriter()
    : _context(ZSTD_createCCtx())
{
}

void TlodContainerWriter::FreeContext::operator()(ZSTD_CCtx_s* context) const
{
    ZSTD_freeCCtx(context);
}

void TlodContainerWriter::addChunk(std::uint32_t type, std::size_t level, Bytes content)
{
    if (_entries.size() == kMaxChunks) {
        throw AssetError("more than " + std::to_string(kMaxChunks) + " chunks: the asset has too many images");
    }
    ChunkEntry entry{type, static_cast<std::uint32_t>(level), kCodecRaw, 0, 0, 0, content.size()};
    Bytes stored = compress(content);
    if (stored.size() < content.size()) {
        entry.codec = kCodecZstd;
    } else {
        stored = std::move(content);
    }
    stored.shrink_to_fit();
    entry.stored = stored.size();
    entry.crc = crc32c(stored.data(), stored.size());
    _entries.push_back(entry);
    _chunks.push_back(std::move(stored));
}

void TlodContainerWriter::write(std::ostream& stream) const
{
    put(stream, makeHeader());
    for (const Bytes& chunk : _chunks) { put(stream, chunk); }
}

Bytes TlodContainerWriter::compress(const Bytes& content)
{
    if (content.empty()) { return {}; }
    if (!_context) { throw std::bad_alloc(); }
    Bytes stored(ZSTD_compressBound(content.size()));
    const std::size_t size =
        ZSTD_compressCCtx(_context.get(), stored.data(), stored.size(), content.data(), content.size(), kZstdLevel);
    if (ZSTD_isError(size) != 0) { throw AssetError(std::string("compression failed: ") + ZSTD_getErrorName(size)); }
    stored.resize(size);
    padToRatio(stored, content.size());
    return stored;
}

Bytes TlodContainerWriter::makeHeader() const
{
    std::uint64_t offset = kHeaderBytes + kEntryBytes * _entries.size();
    std::uint64_t fileBytes = offset;
    for (const ChunkEntry& entry : _entries) { fileBytes += entry.stored; }

    ByteWriter out;
    out.field(kMagic);
    out.field(kVersion);
    out.field(static_cast<std::uint32_t>(_entries.size()));
    out.field(fileBytes);
    out.zeros(8); // the CRC, not known yet, and the reserved word
    for (ChunkEntry entry : _entries) {
        entry.offset = offset;
        passEntry(out, entry);
        offset += entry.stored;
    }
    ByteWriter crc;
    crc.field(crc32c(out.bytes.data(), out.bytes.size()));
    std::copy(crc.bytes.begin(), crc.bytes.end(), out.bytes.begin() + kHeaderCrcAt);
    return std::move(out.bytes);
}

// ---------------------------------------------------------------------------------------------------------------------
// Reading

std::ifstream openTlodFile(const std::string& path)
{
    std::error_code error;
    const auto status = std::filesystem::status(path, error);
    if (!std::filesystem::exists(status)) { throw AssetError("does not exist or cannot be reached"); }
    if (!std::filesystem::is_regular_file(status)) { throw AssetError("is not a regular file"); }
    std::ifstream stream(path, std::ios::binary);
    if (!stream) { throw AssetError("cannot be opened"); }
    return stream;
}

struct TlodContainerReader::Header {
    std::array<std::uint8_t, 8> magic{};
    std::uint32_t version = 0;
    std::uint32_t chunks = 0;
    std::uint64_t fileBytes = 0;
    std::uint32_t crc = 0;
    std::uint32_t reserved = 0;
};

TlodContainerReader::TlodContainerReader(std::istream& stream)
    : _stream(stream)
{
    const std::istream::pos_type begin = stream.tellg();
    stream.seekg(0, std::ios::end);
    const std::istream::pos_type end = stream.tellg();
    if (!stream || begin < 0 || end < begin) { throw AssetError("cannot be read: its size is unknown"); }
    _begin = begin;
    _fileBytes = static_cast<std::uint64_t>(end - begin);
    readTable();
}

void TlodContainerReader::readBytes(std::uint64_t offset, void* data, std::uint64_t bytes)
{
    _stream.seekg(_begin + static_cast<std::streamoff>(offset));
    _stream.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
    if (!_stream || _stream.gcount() != static_cast<std::streamsize>(bytes)) { throw AssetError("cannot be read"); }
}

void TlodContainerReader::readTable()
{
    if (_fileBytes < kHeaderBytes) {
        throw AssetError("is not a .tlod file or truncated: only " + std::to_string(_fileBytes) + " bytes");
    }
    Bytes bytes(kHeaderBytes);
    readBytes(0, bytes.data(), kHeaderBytes);
    const Header header = parseHeader(bytes);
    bytes.resize(kHeaderBytes + kEntryBytes * header.chunks);
    readBytes(kHeaderBytes, bytes.data() + kHeaderBytes, kEntryBytes * header.chunks);
    std::fill_n(bytes.begin() + kHeaderCrcAt, 4, std::uint8_t{0});
    if (crc32c(bytes.data(), bytes.size()) != header.crc) { throw AssetError("table of contents is damaged"); }
    _checksum = header.crc;
    if (header.reserved != 0) { throw AssetError("reserved bytes are not zero"); }
    parseEntries(bytes);
}

/// Faults are told in the order that helps: what kind of file it is, how much of it is there, what is damaged.
TlodContainerReader::Header TlodContainerReader::parseHeader(const Bytes& bytes) const
{
    Header header;
    ByteReader in(bytes.data(), bytes.size());
    in.fields(header.magic, header.version, header.chunks, header.fileBytes, header.crc, header.reserved);
    if (header.magic != kMagic) {
        const bool begins = std::equal(kMagic.begin(), kMagic.begin() + 5, header.magic.begin());
        throw AssetError(begins ? "line ends were changed: it was transferred as text" : "is not a .tlod file");
    }
    if (header.version != kVersion) {
        throw AssetError("version " + std::to_string(header.version) + " is not supported, only " + std::to_string(kVersion));
    }
    if (header.fileBytes != _fileBytes) {
        throw AssetError(std::string(header.fileBytes > _fileBytes ? "is truncated" : "has trailing bytes") + ": " +
                         std::to_string(_fileBytes) + " bytes, not " + std::to_string(header.fileBytes));
    }
    if (header.chunks > kMaxChunks || kHeaderBytes + kEntryBytes * header.chunks > _fileBytes) {
        throw AssetError("table of contents is too large");
    }
    return header;
}

void TlodContainerReader::parseEntries(const Bytes& bytes)
{
    ByteReader in(bytes.data() + kHeaderBytes, bytes.size() - kHeaderBytes);
    _entries.resize((bytes.size() - kHeaderBytes) / kEntryBytes);
    std::uint64_t next = bytes.size();
    for (ChunkEntry& entry : _entries) {
        passEntry(in, entry);
        if (entry.offset != next) { failChunk(entry, "does not follow the one before"); }
        if (entry.stored > _fileBytes - next) { failChunk(entry, "goes beyond the end of the file"); }
        if (entry.content / kMaxRatio > entry.stored) { failChunk(entry, "claims to expand more than 256 times"); }
        next += entry.stored;
    }
    if (next != _fileBytes) { throw AssetError("has bytes that belong to no chunk"); }
}

bool TlodContainerReader::has(std::uint32_t type, std::uint32_t level) const
{
    return std::any_of(_entries.begin(), _entries.end(),
                       [&](const ChunkEntry& entry) { return entry.type == type && entry.level == level; });
}

ChunkEntry TlodContainerReader::take(std::uint32_t type, std::uint32_t level)
{
    const auto isIt = [&](const ChunkEntry& entry) { return entry.type == type && entry.level == level; };
    const auto found = std::find_if(_entries.begin(), _entries.end(), isIt);
    if (found == _entries.end()) {
        throw AssetError("chunk " + chunkTypeName(type) + " " + std::to_string(level) + " is missing");
    }
    const ChunkEntry entry = *found;
    _entries.erase(found);
    return entry;
}

void TlodContainerReader::readContent(const ChunkEntry& entry, std::uint8_t* content)
{
    if (entry.codec == kCodecRaw) {
        if (entry.stored != entry.content) { failChunk(entry, "its sizes differ"); }
        readStored(entry, content);
    } else if (entry.codec == kCodecZstd) {
        if (entry.stored >= entry.content) { failChunk(entry, "is longer than its content"); }
        const std::unique_ptr<std::uint8_t[]> stored(new std::uint8_t[entry.stored]);
        readStored(entry, stored.get());
        decompress(entry, stored.get(), content);
    } else {
        failChunk(entry, "codec " + std::to_string(entry.codec) + " is not known");
    }
}

void TlodContainerReader::readStored(const ChunkEntry& entry, std::uint8_t* stored)
{
    readBytes(entry.offset, stored, entry.stored);
    if (crc32c(stored, entry.stored) != entry.crc) { failChunk(entry, "is damaged: its checksum is wrong"); }
}

} // namespace osgTessLOD
