// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TlodFile.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/asset/Crc32c.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/VertexCodec.h>

#include <zstd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <new>

namespace osgTessLOD {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'T', 'L', 'O', 'D', '\r', '\n', '\n'};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kHeaderCrcAt = 24;
constexpr std::size_t kEntryBytes = 48;
constexpr std::uint32_t kMaxChunks = 1024;
constexpr std::uint64_t kMaxRatio = 256;          // content bytes per stored byte
constexpr std::uint64_t kMaxMetaBytes = 1U << 20; // the only chunk whose size nothing else tells
// Measured on smooth and noisy synthetic surfaces, 10 MB each: against 6, level 3 takes two thirds of the time and up to
// 11 % more space, level 12 three times as long for 1 to 4 % less, level 19 twenty times for 2 to 12 % less.
constexpr int kZstdLevel = 6;

constexpr std::size_t kBaseBytes = 12;
constexpr std::size_t kEdgeBytes = 20;
constexpr std::size_t kPatchBytes = 76;
constexpr std::size_t kErrorBytes = 28;
constexpr std::size_t kVertexBytes = sizeof(LodVertex);
constexpr std::size_t kTexelBytes = 4;

constexpr std::uint32_t kCodecRaw = 0;
constexpr std::uint32_t kCodecZstd = 1;

constexpr std::uint32_t tag(const char (&name)[5])
{
    std::uint32_t value = 0;
    for (std::size_t k = 4; k > 0; --k) { value = value << 8 | static_cast<std::uint8_t>(name[k - 1]); }
    return value;
}

constexpr std::uint32_t kMeta = tag("META");
constexpr std::uint32_t kBase = tag("BASE");
constexpr std::uint32_t kEdge = tag("EDGE");
constexpr std::uint32_t kPatch = tag("PTCH");
constexpr std::uint32_t kErrors = tag("LVLE");
constexpr std::uint32_t kVertices = tag("LVLV");
constexpr std::uint32_t kNormals = tag("NRML");

struct Entry {
    std::uint32_t type;
    std::uint32_t level;
    std::uint32_t codec;
    std::uint32_t crc;
    std::uint64_t offset;
    std::uint64_t stored;
    std::uint64_t content;
};

std::string typeName(std::uint32_t type)
{
    std::string name;
    for (int shift = 0; shift < 32; shift += 8) {
        const auto c = static_cast<char>(type >> shift & 0xFF);
        name += c >= ' ' && c <= '~' ? c : '?';
    }
    return name;
}

// ---------------------------------------------------------------------------------------------------------------------
// Numbers to bytes and back

class ByteWriter {
public:
    template <class Number>
    void add(Number value)
    {
        if constexpr (std::is_same_v<Number, float>) {
            std::uint32_t bits = 0;
            std::memcpy(&bits, &value, 4);
            add(bits);
        } else if constexpr (std::is_same_v<Number, double>) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &value, 8);
            add(bits);
        } else {
            const auto bits = static_cast<std::make_unsigned_t<Number>>(value);
            for (std::size_t k = 0; k < sizeof(Number); ++k) { bytes.push_back(static_cast<std::uint8_t>(bits >> 8 * k)); }
        }
    }
    template <class Number, std::size_t n>
    void add(const std::array<Number, n>& values)
    {
        for (const Number value : values) { add(value); }
    }
    void add(const std::string& text)
    {
        add(static_cast<std::uint32_t>(text.size()));
        bytes.insert(bytes.end(), text.begin(), text.end());
    }
    void addZeros(std::size_t count) { bytes.resize(bytes.size() + count); }

    Bytes bytes;
};

/// Throws AssetError when the bytes run out.
class ByteReader {
public:
    ByteReader(const std::uint8_t* data, std::size_t bytes)
        : _at(data)
        , _left(bytes)
    {
    }

    template <class Number>
    void get(Number& value)
    {
        std::uint64_t bits = 0;
        const std::uint8_t* from = take(sizeof(Number));
        for (std::size_t k = 0; k < sizeof(Number); ++k) { bits |= std::uint64_t{from[k]} << (8 * k); }
        if constexpr (std::is_same_v<Number, float>) {
            const auto word = static_cast<std::uint32_t>(bits);
            std::memcpy(&value, &word, 4);
        } else if constexpr (std::is_same_v<Number, double>) {
            std::memcpy(&value, &bits, 8);
        } else {
            value = static_cast<Number>(bits);
        }
    }
    template <class Number, std::size_t n>
    void get(std::array<Number, n>& values)
    {
        for (Number& value : values) { get(value); }
    }
    void get(std::string& text)
    {
        std::uint32_t size = 0;
        get(size);
        const std::uint8_t* from = take(size);
        text.assign(from, from + size);
    }
    void expectZeros(std::size_t count)
    {
        const std::uint8_t* from = take(count);
        if (std::any_of(from, from + count, [](std::uint8_t b) { return b != 0; })) {
            throw AssetError("reserved bytes are not zero");
        }
    }
    void expectEnd() const
    {
        if (_left != 0) { throw AssetError("content goes on after its end"); }
    }

private:
    const std::uint8_t* take(std::size_t bytes)
    {
        if (bytes > _left) { throw AssetError("content ends early"); }
        const std::uint8_t* from = _at;
        _at += bytes;
        _left -= bytes;
        return from;
    }

    const std::uint8_t* _at;
    std::size_t _left;
};

// ---------------------------------------------------------------------------------------------------------------------
// Content of the chunks. Each pair of functions names the same fields in the same order.

void addPatch(ByteWriter& out, const LodPatch& patch)
{
    out.add(patch.baseVertices);
    out.add(patch.edges);
    out.add(patch.latticeOrigin);
    out.add(patch.boundCenter);
    out.add(patch.boundRadius);
    out.add(patch.coneAxis);
    out.add(patch.coneCosine);
    out.add(patch.chartError);
    out.add(patch.finestLevel);
    out.addZeros(3);
}

void getPatch(ByteReader& in, LodPatch& patch)
{
    in.get(patch.baseVertices);
    in.get(patch.edges);
    in.get(patch.latticeOrigin);
    in.get(patch.boundCenter);
    in.get(patch.boundRadius);
    in.get(patch.coneAxis);
    in.get(patch.coneCosine);
    in.get(patch.chartError);
    in.get(patch.finestLevel);
    in.expectZeros(3);
}

void addEdge(ByteWriter& out, const LodEdge& edge)
{
    out.add(edge.baseVertices);
    out.add(edge.patches);
    out.add(edge.finestLevel);
    out.addZeros(3);
}

void getEdge(ByteReader& in, LodEdge& edge)
{
    in.get(edge.baseVertices);
    in.get(edge.patches);
    in.get(edge.finestLevel);
    in.expectZeros(3);
}

void addError(ByteWriter& out, const LevelError& error)
{
    out.add(error.quadratic.q);
    out.add(error.isotropic);
}

void getError(ByteReader& in, LevelError& error)
{
    in.get(error.quadratic.q);
    in.get(error.isotropic);
}

void addPoint(ByteWriter& out, const std::array<std::int32_t, 3>& point)
{
    out.add(point);
}

void getPoint(ByteReader& in, std::array<std::int32_t, 3>& point)
{
    in.get(point);
}

/// What META tells of the other chunks.
struct Counts {
    std::uint32_t baseVertices = 0;
    std::uint32_t edges = 0;
    std::uint32_t patches = 0;
    std::uint32_t normalResolution = 0;
    std::vector<std::uint32_t> levelPatches; ///< patches that reach each level
};

Bytes makeMeta(const LodAsset& asset)
{
    ByteWriter out;
    out.add(static_cast<std::uint32_t>(asset.baseVertices.size()));
    out.add(static_cast<std::uint32_t>(asset.edges.size()));
    out.add(static_cast<std::uint32_t>(asset.patches.size()));
    out.add(asset.normals.resolution);
    out.add(static_cast<std::uint32_t>(asset.ladder.size()));
    for (std::size_t level = 0; level < asset.ladder.size(); ++level) {
        out.add(std::uint32_t{asset.ladder[level]});
        out.add(static_cast<std::uint32_t>(asset.levels[level].errors.size()));
    }
    out.add(asset.sourceTriangles);
    out.add(asset.lattice.origin);
    out.add(asset.lattice.step);
    out.add(asset.boundsMin);
    out.add(asset.boundsMax);
    out.add(asset.technique);
    out.add(asset.source);
    if (out.bytes.size() > kMaxMetaBytes) { throw AssetError("technique and source are longer than 1 MiB"); }
    return std::move(out.bytes);
}

/// The counts of a sound asset keep each other in bounds: no chunk can be much larger than what the patches ask for.
void checkCounts(const Counts& counts)
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

Counts getMeta(ByteReader& in, LodAsset& asset)
{
    Counts counts;
    in.get(counts.baseVertices);
    in.get(counts.edges);
    in.get(counts.patches);
    in.get(counts.normalResolution);
    std::uint32_t levels = 0;
    in.get(levels);
    if (levels == 0 || levels > LodAsset::kMaxLevels) { throw AssetError("number of levels out of range"); }
    for (std::uint32_t level = 0; level < levels; ++level) {
        std::uint32_t factor = 0;
        std::uint32_t reached = 0;
        in.get(factor);
        in.get(reached);
        if (!TessellationPattern::isValidFactor(factor)) { throw AssetError("ladder has an invalid factor"); }
        asset.ladder.push_back(static_cast<std::uint16_t>(factor));
        counts.levelPatches.push_back(reached);
    }
    in.get(asset.sourceTriangles);
    in.get(asset.lattice.origin);
    in.get(asset.lattice.step);
    in.get(asset.boundsMin);
    in.get(asset.boundsMax);
    in.get(asset.technique);
    in.get(asset.source);
    in.expectEnd();
    checkCounts(counts);
    return counts;
}

// ---------------------------------------------------------------------------------------------------------------------
// Writing

/// Appends a skippable zstd frame where the content would be more than kMaxRatio times as long.
void padToRatio(Bytes& stored, std::size_t contentBytes)
{
    constexpr std::uint32_t kSkippableMagic = 0x184D2A50;
    constexpr std::size_t kFrameHeader = 8;
    const std::size_t least = (contentBytes + kMaxRatio - 1) / kMaxRatio;
    if (stored.size() >= least) { return; }
    const std::size_t padding = std::max(least - stored.size(), kFrameHeader) - kFrameHeader;
    ByteWriter frame;
    frame.add(kSkippableMagic);
    frame.add(static_cast<std::uint32_t>(padding));
    frame.addZeros(padding);
    stored.insert(stored.end(), frame.bytes.begin(), frame.bytes.end());
}

class TlodWriter {
public:
    void addChunk(std::uint32_t type, std::size_t level, Bytes content)
    {
        Entry entry{type, static_cast<std::uint32_t>(level), kCodecRaw, 0, 0, 0, content.size()};
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

    void write(std::ostream& stream) const
    {
        put(stream, makeHeader());
        for (const Bytes& chunk : _chunks) { put(stream, chunk); }
    }

private:
    static void put(std::ostream& stream, const Bytes& bytes)
    {
        const void* data = bytes.data();
        stream.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes.size()));
    }

    Bytes compress(const Bytes& content)
    {
        if (content.empty()) { return {}; }
        if (!_context) { throw std::bad_alloc(); }
        Bytes stored(ZSTD_compressBound(content.size()));
        const std::size_t size = ZSTD_compressCCtx(_context.get(), stored.data(), stored.size(), content.data(),
                                                   content.size(), kZstdLevel);
        if (ZSTD_isError(size) != 0) { throw AssetError(std::string("compression failed: ") + ZSTD_getErrorName(size)); }
        stored.resize(size);
        padToRatio(stored, content.size());
        return stored;
    }

    Bytes makeHeader() const
    {
        std::uint64_t offset = kHeaderBytes + kEntryBytes * _entries.size();
        std::uint64_t fileBytes = offset;
        for (const Entry& entry : _entries) { fileBytes += entry.stored; }

        ByteWriter out;
        out.add(kMagic);
        out.add(kVersion);
        out.add(static_cast<std::uint32_t>(_entries.size()));
        out.add(fileBytes);
        out.addZeros(8); // the CRC, not known yet, and the reserved word
        for (const Entry& entry : _entries) {
            out.add(entry.type);
            out.add(entry.level);
            out.add(entry.codec);
            out.add(entry.crc);
            out.add(offset);
            out.add(entry.stored);
            out.add(entry.content);
            out.addZeros(8);
            offset += entry.stored;
        }
        ByteWriter crc;
        crc.add(crc32c(out.bytes.data(), out.bytes.size()));
        std::copy(crc.bytes.begin(), crc.bytes.end(), out.bytes.begin() + kHeaderCrcAt);
        return std::move(out.bytes);
    }

    struct FreeContext {
        void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
    };
    std::unique_ptr<ZSTD_CCtx, FreeContext> _context{ZSTD_createCCtx()};
    std::vector<Entry> _entries;
    std::vector<Bytes> _chunks;
};

template <class Item, class Add>
Bytes makeItems(const std::vector<Item>& items, std::size_t itemBytes, const Add& addItem)
{
    ByteWriter out;
    out.bytes.reserve(items.size() * itemBytes);
    for (const Item& item : items) { addItem(out, item); }
    return std::move(out.bytes);
}

TlodWriter makeFile(const LodAsset& asset)
{
    asset.validate();
    TlodWriter file;
    file.addChunk(kMeta, 0, makeMeta(asset));
    file.addChunk(kBase, 0, makeItems(asset.baseVertices, kBaseBytes, addPoint));
    file.addChunk(kEdge, 0, makeItems(asset.edges, kEdgeBytes, addEdge));
    file.addChunk(kPatch, 0, makeItems(asset.patches, kPatchBytes, addPatch));
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        const LodLevel& level = asset.levels[l];
        file.addChunk(kErrors, l, makeItems(level.errors, kErrorBytes, addError));
        Bytes content(level.vertices.size() * kVertexBytes);
        encodeVertices(asset.ladder[l], level.vertices, content.data());
        file.addChunk(kVertices, l, std::move(content));
    }
    for (std::size_t l = 0; l < asset.normals.levels.size(); ++l) {
        const auto& normals = asset.normals.levels[l];
        Bytes content(normals.size() * kTexelBytes);
        encodeNormals(1U << l, normals, content.data());
        file.addChunk(kNormals, l, std::move(content));
    }
    return file;
}

// ---------------------------------------------------------------------------------------------------------------------
// Reading. Faults are thrown without the file's name, which the public functions put in front.

class TlodReader {
public:
    /// Reads and checks header and table.
    explicit TlodReader(std::istream& stream)
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

    const std::vector<Entry>& entries() const { return _entries; }

    LodAsset readAsset()
    {
        LodAsset asset;
        const Counts counts = readMeta(asset);
        readItems(kBase, 0, counts.baseVertices, kBaseBytes, asset.baseVertices, getPoint);
        readItems(kEdge, 0, counts.edges, kEdgeBytes, asset.edges, getEdge);
        readItems(kPatch, 0, counts.patches, kPatchBytes, asset.patches, getPatch);
        asset.levels.resize(asset.ladder.size());
        for (std::uint32_t l = 0; l < asset.levels.size(); ++l) {
            LodLevel& level = asset.levels[l];
            const std::uint64_t reached = counts.levelPatches[l];
            readItems(kErrors, l, reached, kErrorBytes, level.errors, getError);
            readInPlace(kVertices, l, reached * TessellationPattern::vertexCount(asset.ladder[l]), level.vertices);
            decodeVertices(asset.ladder[l], level.vertices);
        }
        asset.normals.resolution = counts.normalResolution;
        for (std::uint32_t l = 0; counts.normalResolution >> l != 0; ++l) {
            auto& normals = asset.normals.levels.emplace_back();
            readInPlace(kNormals, l, std::uint64_t{counts.patches} * NormalTexture::texelCount(1U << l), normals);
            decodeNormals(1U << l, normals);
        }
        checkNothingLeft();
        asset.validate();
        return asset;
    }

private:
    void readBytes(std::uint64_t offset, void* data, std::uint64_t bytes)
    {
        _stream.seekg(_begin + static_cast<std::streamoff>(offset));
        _stream.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
        if (!_stream || _stream.gcount() != static_cast<std::streamsize>(bytes)) { throw AssetError("cannot be read"); }
    }

    struct Header {
        std::array<std::uint8_t, 8> magic{};
        std::uint32_t version = 0;
        std::uint32_t chunks = 0;
        std::uint64_t fileBytes = 0;
        std::uint32_t crc = 0;
        std::uint32_t reserved = 0;
    };

    void readTable()
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
        if (header.reserved != 0) { throw AssetError("reserved bytes are not zero"); }
        parseEntries(bytes);
    }

    /// Faults are told in the order that helps: what kind of file it is, how much of it is there, what is damaged.
    Header parseHeader(const Bytes& bytes) const
    {
        Header header;
        ByteReader in(bytes.data(), bytes.size());
        in.get(header.magic);
        in.get(header.version);
        in.get(header.chunks);
        in.get(header.fileBytes);
        in.get(header.crc);
        in.get(header.reserved);
        if (header.magic != kMagic) {
            const bool begins = std::equal(kMagic.begin(), kMagic.begin() + 5, header.magic.begin());
            throw AssetError(begins ? "line ends were changed: it was transferred as text" : "is not a .tlod file");
        }
        if (header.version != kVersion) {
            throw AssetError("version " + std::to_string(header.version) + " is not supported, only 1");
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

    void parseEntries(const Bytes& bytes)
    {
        ByteReader in(bytes.data() + kHeaderBytes, bytes.size() - kHeaderBytes);
        _entries.resize((bytes.size() - kHeaderBytes) / kEntryBytes);
        std::uint64_t next = bytes.size();
        for (Entry& entry : _entries) {
            in.get(entry.type);
            in.get(entry.level);
            in.get(entry.codec);
            in.get(entry.crc);
            in.get(entry.offset);
            in.get(entry.stored);
            in.get(entry.content);
            in.expectZeros(8);
            if (entry.offset != next) { fail(entry, "does not follow the one before"); }
            if (entry.stored > _fileBytes - next) { fail(entry, "goes beyond the end of the file"); }
            if (entry.content / kMaxRatio > entry.stored) { fail(entry, "claims to expand more than 256 times"); }
            next += entry.stored;
        }
        if (next != _fileBytes) { throw AssetError("has bytes that belong to no chunk"); }
    }

    [[noreturn]] static void fail(const Entry& entry, const std::string& fault)
    {
        throw AssetError("chunk " + typeName(entry.type) + " " + std::to_string(entry.level) + ": " + fault);
    }

    /// The chunk of this type and level, which is taken off the list of those not yet found.
    Entry take(std::uint32_t type, std::uint32_t level)
    {
        const auto isIt = [&](const Entry& entry) { return entry.type == type && entry.level == level; };
        const auto found = std::find_if(_entries.begin(), _entries.end(), isIt);
        if (found == _entries.end()) {
            throw AssetError("chunk " + typeName(type) + " " + std::to_string(level) + " is missing");
        }
        const Entry entry = *found;
        _entries.erase(found);
        return entry;
    }

    void checkNothingLeft() const
    {
        for (const Entry& entry : _entries) {
            for (const std::uint32_t known : {kMeta, kBase, kEdge, kPatch, kErrors, kVertices, kNormals}) {
                if (entry.type == known) { fail(entry, "is there twice or belongs to no level"); }
            }
        }
    }

    /// Fills `content` with the entry's content, `entry.content` bytes.
    void readContent(const Entry& entry, std::uint8_t* content)
    {
        if (entry.codec == kCodecRaw) {
            if (entry.stored != entry.content) { fail(entry, "its sizes differ"); }
            readStored(entry, content);
        } else if (entry.codec == kCodecZstd) {
            if (entry.stored >= entry.content) { fail(entry, "is longer than its content"); }
            const std::unique_ptr<std::uint8_t[]> stored(new std::uint8_t[entry.stored]);
            readStored(entry, stored.get());
            decompress(entry, stored.get(), content);
        } else {
            fail(entry, "codec " + std::to_string(entry.codec) + " is not known");
        }
    }

    void readStored(const Entry& entry, std::uint8_t* stored)
    {
        readBytes(entry.offset, stored, entry.stored);
        if (crc32c(stored, entry.stored) != entry.crc) { fail(entry, "is damaged: its checksum is wrong"); }
    }

    static void decompress(const Entry& entry, const std::uint8_t* stored, std::uint8_t* content)
    {
        if (ZSTD_getFrameContentSize(stored, entry.stored) != entry.content) { fail(entry, "its content's sizes differ"); }
        const std::size_t size = ZSTD_decompress(content, entry.content, stored, entry.stored);
        if (ZSTD_isError(size) != 0) { fail(entry, ZSTD_getErrorName(size)); }
        if (size != entry.content) { fail(entry, "its content ends early"); }
    }

    void checkSize(const Entry& entry, std::uint64_t count, std::size_t itemBytes) const
    {
        if (entry.content != count * itemBytes) {
            fail(entry, "has " + std::to_string(entry.content) + " bytes of content, not " +
                            std::to_string(count * itemBytes));
        }
    }

    Counts readMeta(LodAsset& asset)
    {
        const Entry entry = take(kMeta, 0);
        if (entry.content > kMaxMetaBytes) { fail(entry, "is too large"); }
        Bytes content(entry.content);
        readContent(entry, content.data());
        try {
            ByteReader in(content.data(), content.size());
            return getMeta(in, asset);
        } catch (const AssetError& error) {
            fail(entry, error.what());
        }
    }

    template <class Item, class Get>
    void readItems(std::uint32_t type, std::uint32_t level, std::uint64_t count, std::size_t itemBytes,
                   std::vector<Item>& items, const Get& getItem)
    {
        const Entry entry = take(type, level);
        checkSize(entry, count, itemBytes);
        const std::unique_ptr<std::uint8_t[]> content(new std::uint8_t[entry.content]);
        readContent(entry, content.get());
        items.resize(count);
        ByteReader in(content.get(), entry.content);
        try {
            for (Item& item : items) { getItem(in, item); }
        } catch (const AssetError& error) {
            fail(entry, error.what());
        }
    }

    /// Reads the content into the values' own memory, to be decoded there.
    template <class Value>
    void readInPlace(std::uint32_t type, std::uint32_t level, std::uint64_t count, std::vector<Value>& values)
    {
        static_assert(std::is_trivially_copyable_v<Value>);
        const Entry entry = take(type, level);
        checkSize(entry, count, sizeof(Value));
        values.resize(count);
        void* memory = values.data();
        if (count > 0) { readContent(entry, static_cast<std::uint8_t*>(memory)); }
    }

    std::istream& _stream;
    std::istream::pos_type _begin;
    std::uint64_t _fileBytes = 0;
    std::vector<Entry> _entries;
};

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
        return TlodReader(stream).readAsset();
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
        const TlodReader reader(stream);
        for (const Entry& e : reader.entries()) {
            chunks.push_back({typeName(e.type), e.level, e.stored, e.content, e.offset});
        }
        return chunks;
    } catch (const AssetError& error) {
        failWithName(path, error.what());
    }
}

} // namespace osgTessLOD
