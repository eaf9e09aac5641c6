// SPDX-License-Identifier: MIT
#include "SyntheticAsset.h"

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/Crc32c.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>
#include <zstd.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <new>
#include <random>
#include <sstream>

// Counts what the test program holds from operator new. What zstd allocates, about 160 KB to decompress, is not seen.
namespace {

std::atomic<std::size_t> liveBytes{0};
std::atomic<std::size_t> peakBytes{0};
constexpr std::size_t kSizeField = 16; // in front of each block; keeps the alignment of malloc

void* allocate(std::size_t bytes)
{
    void* block = bytes > SIZE_MAX - kSizeField ? nullptr : std::malloc(bytes + kSizeField);
    if (block == nullptr) { throw std::bad_alloc(); }
    std::memcpy(block, &bytes, sizeof bytes);
    const std::size_t live = liveBytes += bytes;
    std::size_t peak = peakBytes;
    while (live > peak && !peakBytes.compare_exchange_weak(peak, live)) {}
    return static_cast<char*>(block) + kSizeField;
}

void release(void* memory) noexcept
{
    if (memory == nullptr) { return; }
    void* block = static_cast<char*>(memory) - kSizeField;
    std::size_t bytes = 0;
    std::memcpy(&bytes, block, sizeof bytes);
    liveBytes -= bytes;
    std::free(block);
}

} // namespace

void* operator new(std::size_t bytes)
{
    return allocate(bytes);
}
void* operator new[](std::size_t bytes)
{
    return allocate(bytes);
}
void operator delete(void* memory) noexcept
{
    release(memory);
}
void operator delete[](void* memory) noexcept
{
    release(memory);
}
void operator delete(void* memory, std::size_t) noexcept
{
    release(memory);
}
void operator delete[](void* memory, std::size_t) noexcept
{
    release(memory);
}

namespace osgTessLOD {
namespace {

constexpr std::size_t kMemoryConstant = std::size_t{2} << 20; // the documented one

// ---------------------------------------------------------------------------------------------------------------------
// The container of the file, written here a second time, so that the format is what its comment says

struct Chunk {
    std::string type;
    std::uint32_t level = 0;
    std::uint32_t codec = 0;
    std::string stored;
    std::uint64_t contentBytes = 0;
};

template <class Number> void put(std::string& bytes, std::size_t at, Number value)
{
    for (std::size_t k = 0; k < sizeof(Number); ++k) { bytes[at + k] = static_cast<char>(value >> (8 * k) & 0xFF); }
}

template <class Number> Number get(const std::string& bytes, std::size_t at)
{
    Number value = 0;
    for (std::size_t k = sizeof(Number); k > 0; --k) {
        value = static_cast<Number>(value << 8 | static_cast<unsigned char>(bytes[at + k - 1]));
    }
    return value;
}

constexpr std::size_t kTableAt = 32;
constexpr std::size_t kEntryBytes = 48;

void sealHeader(std::string& file)
{
    put(file, 24, std::uint32_t{0});
    put(file, 24, crc32c(file.data(), kTableAt + kEntryBytes * get<std::uint32_t>(file, 12)));
}

std::string assemble(const std::vector<Chunk>& chunks)
{
    std::string file(kTableAt + kEntryBytes * chunks.size(), '\0');
    file.replace(0, 8, "\x89TLOD\r\n\n");
    put(file, 8, std::uint32_t{2});
    put(file, 12, static_cast<std::uint32_t>(chunks.size()));
    for (std::size_t c = 0; c < chunks.size(); ++c) {
        const std::size_t at = kTableAt + kEntryBytes * c;
        file.replace(at, 4, chunks[c].type);
        put(file, at + 4, chunks[c].level);
        put(file, at + 8, chunks[c].codec);
        put(file, at + 12, crc32c(chunks[c].stored.data(), chunks[c].stored.size()));
        put(file, at + 16, std::uint64_t{file.size()});
        put(file, at + 24, std::uint64_t{chunks[c].stored.size()});
        put(file, at + 32, chunks[c].contentBytes);
        file += chunks[c].stored;
    }
    put(file, 16, std::uint64_t{file.size()});
    sealHeader(file);
    return file;
}

std::vector<Chunk> disassemble(const std::string& file)
{
    std::vector<Chunk> chunks;
    for (std::uint32_t c = 0; c < get<std::uint32_t>(file, 12); ++c) {
        const std::size_t at = kTableAt + kEntryBytes * c;
        chunks.push_back({file.substr(at, 4), get<std::uint32_t>(file, at + 4), get<std::uint32_t>(file, at + 8),
                          file.substr(get<std::uint64_t>(file, at + 16), get<std::uint64_t>(file, at + 24)),
                          get<std::uint64_t>(file, at + 32)});
    }
    return chunks;
}

std::string contentOf(const Chunk& chunk)
{
    if (chunk.codec == 0) { return chunk.stored; }
    std::string content(chunk.contentBytes, '\0');
    EXPECT_EQ(ZSTD_decompress(content.data(), content.size(), chunk.stored.data(), chunk.stored.size()),
              content.size());
    return content;
}

Chunk rawChunk(const Chunk& chunk, const std::string& content)
{
    return {chunk.type, chunk.level, 0, content, content.size()};
}

Chunk& find(std::vector<Chunk>& chunks, const std::string& type, std::uint32_t level = 0)
{
    for (Chunk& chunk : chunks) {
        if (chunk.type == type && chunk.level == level) { return chunk; }
    }
    throw std::logic_error("no chunk " + type);
}

// ---------------------------------------------------------------------------------------------------------------------

std::string toBytes(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

LodAsset fromBytes(const std::string& bytes)
{
    std::istringstream stream(bytes);
    return readTlod(stream, "some.tlod");
}

std::string faultOf(const std::string& bytes)
{
    try {
        fromBytes(bytes);
    } catch (const AssetError& error) {
        return error.what();
    }
    return "no error";
}

void expectFault(const std::string& bytes, const std::string& part)
{
    const std::string fault = faultOf(bytes);
    EXPECT_EQ(fault.find("some.tlod: "), 0U) << fault;
    EXPECT_NE(fault.find(part), std::string::npos) << '"' << fault << "\" does not say \"" << part << '"';
}

bool samePatch(const LodPatch& a, const LodPatch& b)
{
    return a.baseVertices == b.baseVertices && a.edges == b.edges && a.latticeOrigin == b.latticeOrigin &&
           a.boundCenter == b.boundCenter && a.boundRadius == b.boundRadius && a.coneAxis == b.coneAxis &&
           a.chartError == b.chartError && a.finestLevel == b.finestLevel;
}

bool sameEdge(const LodEdge& a, const LodEdge& b)
{
    return a.baseVertices == b.baseVertices && a.patches == b.patches && a.finestLevel == b.finestLevel &&
           a.coarsestLevel == b.coarsestLevel;
}

bool sameLevel(const LodLevel& a, const LodLevel& b)
{
    return a.vertices == b.vertices && a.parameters == b.parameters && a.uvs == b.uvs && a.uvErrors == b.uvErrors &&
           a.colors == b.colors &&
           std::equal(a.errors.begin(), a.errors.end(), b.errors.begin(), b.errors.end(),
                      [](const LevelError& x, const LevelError& y) {
                          return x.quadratic == y.quadratic && x.isotropic == y.isotropic && x.coneCosine == y.coneCosine;
                      });
}

template <class Item, class Same>
bool sameItems(const std::vector<Item>& a, const std::vector<Item>& b, const Same& same)
{
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), same);
}

void expectSame(const LodAsset& a, const LodAsset& b)
{
    EXPECT_EQ(a.technique, b.technique);
    EXPECT_EQ(a.source, b.source);
    EXPECT_EQ(a.sourceTriangles, b.sourceTriangles);
    EXPECT_EQ(a.ladder, b.ladder);
    EXPECT_EQ(a.lattice.origin, b.lattice.origin);
    EXPECT_EQ(a.lattice.step, b.lattice.step);
    EXPECT_EQ(a.baseVertices, b.baseVertices);
    EXPECT_TRUE(sameItems(a.edges, b.edges, sameEdge));
    EXPECT_TRUE(sameItems(a.patches, b.patches, samePatch));
    EXPECT_TRUE(sameItems(a.levels, b.levels, sameLevel));
    EXPECT_EQ(a.uvLattice.origin, b.uvLattice.origin);
    EXPECT_EQ(a.uvLattice.step, b.uvLattice.step);
    EXPECT_EQ(a.materials, b.materials);
    EXPECT_EQ(a.patchMaterials, b.patchMaterials);
    EXPECT_EQ(a.images, b.images);
    EXPECT_EQ(a.normals.resolution, b.normals.resolution);
    EXPECT_EQ(a.normals.levels, b.normals.levels);
    EXPECT_EQ(a.boundsMin, b.boundsMin);
    EXPECT_EQ(a.boundsMax, b.boundsMax);
}

/// An asset of which no two fields have the same value, so that exchanged ones show.
LodAsset makeDistinctAsset()
{
    LodAsset asset = makeSyntheticMixedAsset(8, true);
    asset.technique = "strips";
    asset.source = "größer.ply";
    asset.sourceTriangles = 0x123456789AULL;
    asset.lattice.origin = {1e9, -2.5, 1e-300};
    float value = 0.001F;
    for (LodPatch& patch : asset.patches) { patch.chartError = value += 0.001F; }
    for (LodLevel& level : asset.levels) {
        for (LevelError& error : level.errors) {
            for (float& q : error.quadratic.q) { q = value += 0.001F; }
            error.isotropic = value += 0.001F;
        }
    }
    return asset;
}

/// Small, so that ten thousand are quickly read; with chunks of all types.
LodAsset smallAsset()
{
    LodAsset asset = withAttributes(makeSyntheticDisplacedAsset(4));
    LodMaterial painted;
    painted.name = "painted";
    painted.hasReflectance = true;
    painted.reflectance.diffuse = {0.25F, 0.5F, 0.75F, 1.0F};
    painted.reflectance.shininess = 20.0F;
    painted.textures = {{LodTexture::Role::Color, "map_Kd", "groß.jpg"}, {LodTexture::Role::Normal, "norm", "n.png"}};
    asset.materials = {painted, {}};
    for (std::size_t p = 0; p < asset.patches.size(); ++p) { asset.patchMaterials.push_back(p % 2); }
    asset.images = {{"groß.jpg", {1, 2, 3}}};
    return asset;
}

const std::string& smallFile()
{
    static const std::string bytes = toBytes(smallAsset());
    return bytes;
}

std::uint64_t declaredBytes(const std::string& file)
{
    std::uint64_t sum = 0;
    for (const Chunk& chunk : disassemble(file)) { sum += chunk.contentBytes; }
    return sum;
}

/// Reads, expecting an AssetError or a valid asset, within the documented memory.
void expectSurvived(const std::string& file, std::uint64_t declared)
{
    std::istringstream stream(file);
    const std::size_t before = liveBytes;
    peakBytes = before;
    try {
        readTlod(stream, "some.tlod").validate();
    } catch (const AssetError&) {
        // as it should be
    }
    EXPECT_LE(peakBytes - before, 2 * declared + kMemoryConstant);
}

TEST(TlodFile, everythingComesBack)
{
    for (const LodAsset& asset :
         {makeDistinctAsset(), makeSyntheticAsset(16), makeSyntheticAsset(1, false), makeSyntheticSheet(8),
          makeSyntheticMixedAsset(64), makeSyntheticDisplacedAsset(32), withAttributes(makeSyntheticMixedAsset(64))}) {
        ASSERT_NO_THROW(asset.validate());
        expectSame(fromBytes(toBytes(asset)), asset);
    }
    LodAsset nameless = makeSyntheticAsset(2);
    nameless.technique.clear();
    nameless.source.clear();
    expectSame(fromBytes(toBytes(nameless)), nameless);
}

TEST(TlodFile, theSameAssetGivesTheSameBytes)
{
    const TemporaryDirectory directory;
    const LodAsset asset = makeDistinctAsset();
    const std::string bytes = toBytes(asset);
    EXPECT_EQ(toBytes(fromBytes(bytes)), bytes);
    writeTlod(directory.file("a.tlod"), asset);
    std::ifstream stream(directory.file("a.tlod"), std::ios::binary);
    std::ostringstream all;
    all << stream.rdbuf();
    EXPECT_EQ(all.str(), bytes);
    expectSame(readTlod(directory.file("a.tlod")), asset);
}

TEST(TlodFile, hasTheDocumentedLayout)
{
    const std::string& file = smallFile();
    const auto chunks = disassemble(file);
    EXPECT_EQ(assemble(chunks), file);
    std::string types;
    for (const Chunk& c : chunks) { types += c.type + std::to_string(c.level) + ' '; }
    EXPECT_EQ(types, "META0 BASE0 EDGE0 PTCH0 UVGR0 MATL0 PMAT0 LVLE0 LVLV0 LVLT0 LVLU0 LVLC0 LVLE1 LVLV1 LVLP1 LVLT1 LVLU1 LVLC1 "
                     "LVLE2 LVLV2 LVLT2 LVLU2 LVLC2 IMAG0 NRML0 NRML1 NRML2 ");
    EXPECT_EQ(chunks[1].contentBytes, 6U * 12);
    EXPECT_EQ(chunks[2].contentBytes, 12U * 20);
    EXPECT_EQ(chunks[3].contentBytes, 8U * 72);
    EXPECT_EQ(chunks[4].contentBytes, 16U);
    // Number of materials; of the first one name, reflectance and two textures; of the second no name, reflectance, no texture.
    EXPECT_EQ(chunks[5].contentBytes, 4U + (4 + 7 + 1 + 68 + 4) + (1 + 4 + 6 + 4 + 9) + (1 + 4 + 4 + 4 + 5) + (4 + 1 + 68 + 4));
    EXPECT_EQ(chunks[6].contentBytes, 8U * 2);
    EXPECT_EQ(chunks[14].contentBytes, 8U * 7 * 4);
    EXPECT_EQ(chunks[15].contentBytes, 8U * 4);
    EXPECT_EQ(chunks[16].contentBytes, 8U * 7 * 4);
    EXPECT_EQ(chunks[17].contentBytes, 8U * 7 * 4);
    EXPECT_EQ(chunks[18].contentBytes, 8U * 32);
    EXPECT_EQ(chunks[19].contentBytes, 8U * 19 * 8);
    EXPECT_EQ(contentOf(chunks[23]), std::string("\x9\0\0\0groß.jpg\1\2\3", 16));
    EXPECT_EQ(chunks[26].contentBytes, 8U * 15 * 4);
}

TEST(TlodFile, tableOfContentsIsReadAlone)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a.tlod");
    writeTlod(path, smallAsset());
    const auto chunks = disassemble(smallFile());
    const auto contents = readTlodContents(path);
    ASSERT_EQ(contents.size(), chunks.size());
    for (std::size_t c = 0; c < chunks.size(); ++c) {
        EXPECT_EQ(contents[c].type, chunks[c].type);
        EXPECT_EQ(contents[c].level, chunks[c].level);
        EXPECT_EQ(contents[c].storedBytes, chunks[c].stored.size());
        EXPECT_EQ(contents[c].contentBytes, chunks[c].contentBytes);
        EXPECT_EQ(smallFile().substr(contents[c].offset, contents[c].storedBytes), chunks[c].stored);
    }
}

TEST(TlodFile, isReadFromTheMiddleOfAStream)
{
    std::istringstream stream("prefix" + smallFile());
    stream.seekg(6);
    expectSame(readTlod(stream, "x"), smallAsset());
}

TEST(TlodFile, takesLittleSpace)
{
    // 17 bits an axis of a patch about 1 across, vertices 1/64 apart: without prediction 11 bits an axis and the parent.
    const LodAsset asset = makeSyntheticAsset(64, false);
    std::size_t stored = 0;
    for (const Chunk& chunk : disassemble(toBytes(asset))) { stored += chunk.type == "LVLV" ? chunk.stored.size() : 0; }
    EXPECT_LT(static_cast<double>(stored) / static_cast<double>(asset.levels.back().vertices.size()), 4.0);
}

TEST(TlodFile, whatCompressesTooWellIsPaddedAndRead)
{
    auto shape = synthetic::wavySheet(20);
    shape.surface = [](const synthetic::Point& p) { return p; };
    shape.size = 1.024; // 1 is a whole number of steps: all patches are alike
    const LodAsset asset = synthetic::build(shape, synthetic::powersOfTwo(32), true);
    const std::string file = toBytes(asset);
    bool padded = false;
    for (const Chunk& chunk : disassemble(file)) {
        EXPECT_GE(chunk.stored.size() * 256, chunk.contentBytes);
        if (chunk.codec == 0) { continue; }
        const std::size_t frame = ZSTD_findFrameCompressedSize(chunk.stored.data(), chunk.stored.size());
        padded = padded || frame < chunk.stored.size();
    }
    EXPECT_TRUE(padded);
    expectSame(fromBytes(file), asset);
}

TEST(TlodFile, anInvalidAssetIsNotWritten)
{
    const TemporaryDirectory directory;
    LodAsset asset = makeSyntheticAsset(4);
    asset.levels[1].vertices.pop_back();
    try {
        writeTlod(directory.file("a.tlod"), asset);
        FAIL();
    } catch (const AssetError& error) {
        EXPECT_EQ(std::string(error.what()).find(directory.file("a.tlod") + ": level 1"), 0U) << error.what();
    }
    EXPECT_EQ(directory.entryCount(), 0U);
    asset = makeSyntheticAsset(4);
    asset.source = std::string(2U << 20, 'x');
    EXPECT_THROW(toBytes(asset), AssetError);
}

TEST(TlodFile, aFailedWriteLeavesTheOldFile)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a.tlod");
    const LodAsset old = makeSyntheticAsset(2);
    writeTlod(path, old);
    LodAsset broken = old;
    broken.ladder.clear();
    EXPECT_THROW(writeTlod(path, broken), AssetError);
    expectSame(readTlod(path), old);
    EXPECT_EQ(directory.entryCount(), 1U);
    EXPECT_THROW(writeTlod(directory.file("missing/a.tlod"), old), AssetError);

    std::ostringstream stream;
    stream.setstate(std::ios::badbit);
    EXPECT_THROW(writeTlod(stream, old), AssetError);
}

TEST(TlodFile, pathsThatAreNoFileAreErrors)
{
    const TemporaryDirectory directory;
    std::ofstream(directory.file("empty")).flush();
    for (const auto& [path, fault] :
         std::vector<std::pair<std::string, std::string>>{{directory.file("missing.tlod"), "does not exist"},
                                                          {directory.file("."), "is not a regular file"},
                                                          {"/dev/zero", "is not a regular file"},
                                                          {directory.file("empty"), "only 0 bytes"}}) {
        for (const bool whole : {true, false}) {
            try {
                if (whole) {
                    readTlod(path);
                } else {
                    readTlodContents(path);
                }
                ADD_FAILURE() << path;
            } catch (const AssetError& error) {
                EXPECT_EQ(std::string(error.what()).find(path + ": "), 0U) << error.what();
                EXPECT_NE(std::string(error.what()).find(fault), std::string::npos) << error.what();
            }
        }
    }
}

TEST(TlodFile, everyTruncationIsAnError)
{
    const std::string& file = smallFile();
    for (std::size_t bytes = 0; bytes < kTableAt + 1; ++bytes) {
        EXPECT_THROW(fromBytes(file.substr(0, bytes)), AssetError);
    }
    std::size_t border = kTableAt + kEntryBytes * disassemble(file).size();
    for (const Chunk& chunk : disassemble(file)) {
        EXPECT_THROW(fromBytes(file.substr(0, border)), AssetError);
        border += chunk.stored.size();
    }
    ASSERT_EQ(border, file.size());
    std::mt19937 random(9);
    for (int k = 0; k < 1000; ++k) { EXPECT_THROW(fromBytes(file.substr(0, random() % file.size())), AssetError); }
    expectFault(file.substr(0, file.size() - 1), "is truncated");
    expectFault(file + "x", "has trailing bytes");
}

TEST(TlodFile, everyFlippedByteIsAnError)
{
    std::string file = smallFile();
    std::mt19937 random(10);
    for (int k = 0; k < 10000; ++k) {
        const std::size_t at = random() % file.size();
        const auto flip = static_cast<char>(1 + random() % 255);
        file[at] = static_cast<char>(file[at] ^ flip);
        EXPECT_THROW(fromBytes(file), AssetError) << "byte " << at; // a CRC notices every error within 32 bits
        file[at] = static_cast<char>(file[at] ^ flip);
    }
    expectSame(fromBytes(file), smallAsset());
}

/// A file that another program changes: before the read number `turn`.
class ChangingFile : public std::stringbuf {
public:
    ChangingFile(const std::string& before, const std::string& after, int turn)
        : std::stringbuf(before, std::ios::in)
        , _after(after)
        , _turn(turn)
    {
    }
    bool wasChanged() const { return _turn < 0; }

protected:
    std::streamsize xsgetn(char* data, std::streamsize count) override
    {
        if (_turn-- == 0) {
            const std::streamoff at = std::stringbuf::seekoff(0, std::ios::cur, std::ios::in);
            str(_after);
            std::stringbuf::seekpos(std::min<std::streamoff>(at, static_cast<std::streamoff>(_after.size())),
                                    std::ios::in);
        }
        return std::stringbuf::xsgetn(data, count);
    }

private:
    std::string _after;
    int _turn;
};

TEST(TlodFile, aFileThatChangesWhileItIsReadIsAnError)
{
    const std::string& file = smallFile();
    std::string damaged = file;
    for (std::size_t k = kTableAt; k < damaged.size(); k += 16) { damaged[k] = static_cast<char>(damaged[k] ^ 1); }
    for (const std::string& after : {file.substr(0, file.size() - 1), file.substr(0, 100), std::string(), damaged}) {
        int turn = 1; // the header has been read
        for (bool changes = true; changes; ++turn) {
            ChangingFile buffer(file, after, turn);
            std::istream stream(&buffer);
            std::string fault;
            try {
                readTlod(stream, "some.tlod");
            } catch (const AssetError& error) {
                fault = error.what();
            }
            changes = buffer.wasChanged();
            const bool isTailAlone =
                after.size() + 1 == file.size(); // then only the read that reaches the last byte can tell
            if (changes && !isTailAlone) {
                EXPECT_EQ(fault.find("some.tlod: "), 0U) << "before read " << turn << ' ' << fault;
            }
            if (!changes) { EXPECT_EQ(fault, ""); }
        }
        EXPECT_GT(turn, 10);
    }
}

TEST(TlodFile, survivesDamageBehindCorrectChecksums)
{
    const auto chunks = disassemble(toBytes(makeSyntheticDisplacedAsset(2)));
    std::mt19937 random(11);
    int accepted = 0;
    for (int k = 0; k < 6000; ++k) {
        auto damaged = chunks;
        Chunk& chunk = damaged[random() % damaged.size()];
        if (random() % 2 == 0) { chunk = rawChunk(chunk, contentOf(chunk)); }
        for (auto flips = 1 + random() % 3; flips > 0; --flips) {
            char& byte = chunk.stored[random() % chunk.stored.size()];
            byte = random() % 3 == 0 ? static_cast<char>(0xFF) : static_cast<char>(byte ^ 1 << random() % 8);
        }
        const std::string file = assemble(damaged);
        expectSurvived(file, declaredBytes(file));
        accepted += faultOf(file) == "no error" ? 1 : 0;
    }
    EXPECT_GT(accepted, 0);    // as in a bounding sphere that became another one,
    EXPECT_LT(accepted, 4000); // but most of it is noticed
}

TEST(TlodFile, survivesDamagedAttributesBehindCorrectChecksums)
{
    const auto chunks = disassemble(toBytes(withAttributes(makeSyntheticDisplacedAsset(2))));
    std::mt19937 random(14);
    for (int k = 0; k < 3000; ++k) {
        auto damaged = chunks;
        Chunk* chunk = nullptr;
        do { chunk = &damaged[random() % damaged.size()]; } while (chunk->type.find_first_of("UTC", 1) == std::string::npos);
        if (random() % 2 == 0) { *chunk = rawChunk(*chunk, contentOf(*chunk)); }
        for (auto flips = 1 + random() % 3; flips > 0; --flips) {
            char& byte = chunk->stored[random() % chunk->stored.size()];
            byte = random() % 3 == 0 ? static_cast<char>(0xFF) : static_cast<char>(byte ^ 1 << random() % 8);
        }
        const std::string file = assemble(damaged);
        expectSurvived(file, declaredBytes(file));
    }
}

TEST(TlodFile, survivesDamagedTablesBehindACorrectChecksum)
{
    std::mt19937 random(12);
    for (int k = 0; k < 6000; ++k) {
        std::string file = smallFile();
        const std::size_t table = kTableAt + kEntryBytes * disassemble(file).size();
        for (auto flips = 1 + random() % 3; flips > 0; --flips) {
            const std::size_t at = 8 + random() % (table - 8);
            file[at] = static_cast<char>(random() % 2 == 0 ? random() : file[at] ^ 1U << random() % 8);
        }
        const auto chunks = static_cast<std::uint32_t>(disassemble(smallFile()).size());
        if (get<std::uint32_t>(file, 12) > chunks) { put(file, 12, chunks); }
        sealHeader(file);
        expectSurvived(file, 256 * file.size()); // what it declares is now anything, but never more than this
    }
}

TEST(TlodFile, memoryStaysBelowTwiceTheContent)
{
    // Assets whose largest chunk is, in turn, the finest vertices, the normals, the patches. Large against the constant.
    // Normals that do not compress are the worst case: stored bytes as many as content.
    LodAsset normals = makeSyntheticSheet(1, 4, false);
    std::mt19937 random(13);
    normals.normals.resolution = 256;
    for (std::uint32_t r = 1; r <= 256; r *= 2) {
        auto& texels = normals.normals.levels.emplace_back(normals.patches.size() * NormalTexture::texelCount(r));
        for (auto& texel : texels) { texel = static_cast<std::uint32_t>(random()); }
    }
    const LodAsset displaced = synthetic::build(synthetic::wavySheet(10), {1, 64}, false, {}, true);
    for (const LodAsset& asset : {makeSyntheticSheet(64, 10), makeSyntheticSheet(1, 200, false), normals, displaced}) {
        const std::string file = toBytes(asset);
        const std::uint64_t declared = declaredBytes(file);
        ASSERT_GT(declared, 2 * kMemoryConstant);
        std::istringstream stream(file);
        const std::size_t before = liveBytes;
        peakBytes = before;
        const LodAsset read = readTlod(stream, "x");
        EXPECT_LE(peakBytes - before, 2 * declared + kMemoryConstant);
        EXPECT_LE(liveBytes - before, declared + kMemoryConstant);
    }
}

TEST(TlodFile, unknownChunksAreSkipped)
{
    auto chunks = disassemble(smallFile());
    chunks.insert(chunks.begin() + 3, {"XTRA", 77, 99, "whatever", 1000});
    chunks.insert(chunks.begin(), {"XTRA", 77, 99, "again", 0});
    chunks.push_back({"\1\2\3\4", 0, 0, "", 0});
    std::string file = assemble(chunks);
    file[file.find("whatever")] = 'W'; // not even its checksum matters
    expectSame(fromBytes(file), smallAsset());
}

TEST(TlodFile, parametersAreAChunkOfTheirOwn)
{
    // Readers that do not know it, and files without it, have the same asset but for the parameters.
    auto chunks = disassemble(smallFile());
    find(chunks, "LVLP", 1).type = "XTRA";
    LodAsset asset = smallAsset();
    asset.levels[1].parameters.clear();
    expectSame(fromBytes(assemble(chunks)), asset);

    chunks = disassemble(smallFile());
    Chunk& parameters = find(chunks, "LVLP", 1);
    const std::string content = contentOf(parameters);
    parameters = rawChunk(parameters, content.substr(4));
    expectFault(assemble(chunks), "LVLP 1: has 220 bytes of content, not 224");
    parameters = rawChunk(parameters, content);
    parameters.contentBytes = std::uint64_t{1} << 40;
    expectFault(assemble(chunks), "LVLP 1: claims to expand more than 256 times");
    parameters = rawChunk(parameters, std::string(content.size(), '\0'));
    expectSame(fromBytes(assemble(chunks)), [&] { // all at the pattern's places
        for (std::uint32_t v = 0; v < 8 * 7; ++v) {
            asset.levels[1].parameters.push_back(TessellationPattern::chartPoint(2, v % 7).bits());
        }
        return asset;
    }());
    parameters = rawChunk(parameters, std::string(content.size(), '\1'));
    expectFault(assemble(chunks), "some.tlod: patch 0, level 1, vertex 0: parameters are outside the patch");
    chunks = disassemble(smallFile());
    chunks.push_back({"LVLP", 3, 0, "", 0});
    expectFault(assemble(chunks), "LVLP 3: is there twice or belongs to no level");
}

TEST(TlodFile, attributesAreChunksOfTheirOwn)
{
    // Readers that do not know them, and files without, have the same asset but for these.
    auto chunks = disassemble(smallFile());
    LodAsset asset = smallAsset();
    for (Chunk& chunk : chunks) {
        if (chunk.type == "UVGR" || chunk.type == "LVLT" || chunk.type == "LVLU") { chunk.type = "XTRA"; }
    }
    for (LodLevel& level : asset.levels) {
        level.uvs.clear();
        level.uvErrors.clear();
    }
    asset.uvLattice = UvLattice();
    expectSame(fromBytes(assemble(chunks)), asset);
    for (Chunk& chunk : chunks) {
        if (chunk.type == "LVLC" || chunk.type == "MATL" || chunk.type == "PMAT" || chunk.type == "IMAG") { chunk.type = "XTRA"; }
    }
    for (LodLevel& level : asset.levels) { level.colors.clear(); }
    asset.materials.clear();
    asset.patchMaterials.clear();
    asset.images.clear();
    expectSame(fromBytes(assemble(chunks)), asset);

    const auto with = [](const std::string& type, std::uint32_t level, const auto& change) {
        auto damaged = disassemble(smallFile());
        change(find(damaged, type, level));
        return assemble(damaged);
    };
    const auto hide = [](Chunk& chunk) { chunk.type = "XTRA"; };
    expectFault(with("LVLU", 2, hide), "level 2: 0 texture coordinates, not 152");
    expectFault(with("LVLT", 1, hide), "level 1: 0 errors of texture coordinates, not 8");
    expectFault(with("LVLC", 1, hide), "level 1: 0 colours, not 56");
    expectFault(with("LVLU", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, contentOf(chunk).substr(4)); }),
                "LVLU 0: has 92 bytes of content, not 96");
    expectFault(with("LVLC", 2, [](Chunk& chunk) { chunk = rawChunk(chunk, contentOf(chunk) + "1234"); }),
                "LVLC 2: has 612 bytes of content, not 608");
    expectFault(with("MATL", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, contentOf(chunk).substr(0, 40)); }),
                "MATL 0: content ends early");
    expectFault(with("MATL", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, contentOf(chunk) + "x"); }),
                "MATL 0: content goes on after its end");
    expectFault(with("MATL", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, std::string("\xFF\xFF\xFF\xFF", 4)); }),
                "MATL 0: content ends early");
    expectFault(with("PMAT", 0, hide), "0 patches have one of 2 materials");
    expectFault(with("PMAT", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, std::string(16, '\2')); }),
                "patch 0: material out of range");
    expectFault(with("IMAG", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, std::string("\5\0\0\0a", 5)); }),
                "IMAG 0: content ends early");
    expectFault(with("IMAG", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, std::string("\1\0\0\0a", 5)); }),
                "image 0 is empty");
    LodAsset crowded = smallAsset();
    crowded.images.assign(1024, crowded.images.front());
    EXPECT_THROW(toBytes(crowded), AssetError) << "a reader would not take so many chunks";
    expectFault(with("UVGR", 0, [](Chunk& chunk) { chunk = rawChunk(chunk, std::string(16, '\xFF')); }),
                "the grid of texture coordinates is not finite");
}

TEST(TlodFile, chunksMayComeInAnyOrder)
{
    auto chunks = disassemble(smallFile());
    std::reverse(chunks.begin(), chunks.end());
    expectSame(fromBytes(assemble(chunks)), smallAsset());
}

TEST(TlodFile, rejectsHostileHeaders)
{
    const auto with = [](std::size_t at, auto value) {
        std::string file = smallFile();
        put(file, at, value);
        if (at != 12) { sealHeader(file); }
        return file;
    };
    expectFault(std::string(100, 'x'), "is not a .tlod file");
    std::string asText = smallFile();
    asText.erase(5, 1);
    expectFault(asText, "transferred as text");
    expectFault(with(8, std::uint32_t{1}), "version 1 is not supported");
    expectFault(with(12, std::uint32_t{0xFFFFFFFF}), "table of contents is too large");
    expectFault(with(12, std::uint32_t{1024}), "table of contents is too large");
    expectFault(with(12, std::uint32_t{5}), "table of contents is damaged");
    expectFault(with(16, ~std::uint64_t{0}), "is truncated");
    expectFault(with(28, std::uint32_t{1}), "reserved bytes");

    constexpr std::size_t kEntry = kTableAt + 2 * kEntryBytes; // EDGE
    expectFault(with(kEntry + 16, ~std::uint64_t{0} - 10), "EDGE 0: does not follow the one before");
    expectFault(with(kEntry + 16, std::uint64_t{0}), "EDGE 0: does not follow the one before");
    expectFault(with(kEntry + 24, ~std::uint64_t{0}), "EDGE 0: goes beyond the end of the file");
    expectFault(with(kEntry + 24, std::uint64_t{1}), "PTCH 0: does not follow the one before");
    expectFault(with(kEntry + 32, ~std::uint64_t{0}), "EDGE 0: claims to expand more than 256 times");
    expectFault(with(kEntry + 32, std::uint64_t{260}), "EDGE 0: has 260 bytes of content, not 240");
    expectFault(with(kEntry + 40, std::uint64_t{1}), "reserved bytes");
    expectFault(with(kEntry + 8, std::uint32_t{7}), "EDGE 0: codec 7 is not known");
    expectFault(with(kEntry + 8, std::uint32_t{0}), "EDGE 0: its sizes differ");
    expectFault(with(kEntry + 4, std::uint32_t{9}), "EDGE 0 is missing");
    expectFault(with(kEntry + 12, std::uint32_t{9}), "EDGE 0: is damaged: its checksum is wrong");
}

TEST(TlodFile, rejectsHostileChunkLists)
{
    const auto chunks = disassemble(smallFile());
    const auto after = [&](const std::function<void(std::vector<Chunk>&)>& change) {
        auto changed = chunks;
        change(changed);
        return assemble(changed);
    };
    for (const Chunk& chunk : chunks) {
        expectFault(after([&](auto& c) { c.push_back(chunk); }), "is there twice or belongs to no level");
        const std::vector<std::string> optional{"LVLP", "LVLT", "LVLU", "LVLC", "MATL", "PMAT", "IMAG"};
        if (std::find(optional.begin(), optional.end(), chunk.type) != optional.end()) { continue; }
        expectFault(after([&](auto& c) {
                        const auto same = [&](const Chunk& x) {
                            return x.type == chunk.type && x.level == chunk.level;
                        };
                        c.erase(std::find_if(c.begin(), c.end(), same));
                    }),
                    chunk.type + ' ' + std::to_string(chunk.level) + " is missing");
    }
    expectFault(after([](auto& c) {
                    c.push_back({"LVLV", 3, 0, "", 0});
                }),
                "LVLV 3: is there twice or belongs to no level");
    expectFault(after([](auto& c) { c.push_back({"NRML", 40, 0, "", 0}); }), "belongs to no level");

    // A frame that tells less than the table, one that tells nothing, one that ends early, one that holds more.
    const auto frame = [](const std::string& content, bool tellSize) {
        ZSTD_CCtx* context = ZSTD_createCCtx();
        ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, tellSize ? 1 : 0);
        std::string stored(ZSTD_compressBound(content.size()), '\0');
        stored.resize(ZSTD_compress2(context, stored.data(), stored.size(), content.data(), content.size()));
        ZSTD_freeCCtx(context);
        return stored;
    };
    const auto withEdge = [&](const std::string& stored) {
        return after([&](auto& c) {
            find(c, "EDGE").codec = 1;
            find(c, "EDGE").stored = stored;
        });
    };
    expectFault(withEdge(frame(std::string(239, 'x'), true)), "EDGE 0: its content's sizes differ");
    expectFault(withEdge(frame(std::string(1000000, 'x'), true)), "EDGE 0: its content's sizes differ");
    expectFault(withEdge(frame(std::string(240, 'x'), false)), "EDGE 0: its content's sizes differ");
    const std::string whole = chunks[2].stored;
    expectFault(withEdge(whole.substr(0, whole.size() - 1)), "EDGE 0: ");
    expectFault(withEdge(whole + frame("more", true)), "EDGE 0: ");
    expectFault(withEdge(std::string(500, 'x')), "EDGE 0: is longer than its content");
}

TEST(TlodFile, rejectsHostileCounts)
{
    const auto chunks = disassemble(smallFile());
    const auto withMeta = [&](std::size_t at, std::uint32_t value) {
        auto changed = chunks;
        Chunk& meta = find(changed, "META");
        std::string content = contentOf(meta);
        put(content, at, value);
        meta = rawChunk(meta, content);
        return assemble(changed);
    };
    // base vertices, edges, patches, normal resolution, levels, then factor and patches of each level
    constexpr std::uint32_t kHuge = 0xFFFFFFFF;
    expectFault(withMeta(0, kHuge), "META 0: number of base vertices");
    expectFault(withMeta(0, 24), "BASE 0: has 72 bytes of content, not 288");
    expectFault(withMeta(4, kHuge), "META 0: number of edges");
    expectFault(withMeta(4, 11), "META 0: number of edges");
    expectFault(withMeta(4, 24), "EDGE 0: has 240 bytes of content, not 480");
    expectFault(withMeta(8, kHuge), "META 0: number of patches");
    expectFault(withMeta(8, 0), "META 0: number of patches");
    expectFault(withMeta(12, 3), "META 0: normal resolution");
    expectFault(withMeta(12, 2048), "META 0: normal resolution");
    expectFault(withMeta(12, 8), "NRML 3 is missing");
    expectFault(withMeta(12, 2), "NRML 2: is there twice or belongs to no level");
    expectFault(withMeta(16, kHuge), "META 0: number of levels");
    expectFault(withMeta(16, 0), "META 0: number of levels");
    expectFault(withMeta(20, 3), "META 0: ladder has an invalid factor");
    expectFault(withMeta(20 + 8, 64), "LVLV 1: has 448 bytes of content, not 202816");
    expectFault(withMeta(24, 7), "META 0: more patches reach a level");
    expectFault(withMeta(24 + 8, 9), "META 0: more patches reach a level");
    expectFault(withMeta(24 + 16, 7), "LVLE 2: has 256 bytes of content, not 224");

    auto changed = chunks;
    Chunk& meta = find(changed, "META");
    meta = rawChunk(meta, contentOf(meta) + "x");
    expectFault(assemble(changed), "META 0: content goes on after its end");
    meta.stored.resize(60);
    meta.contentBytes = 60;
    expectFault(assemble(changed), "META 0: content ends early");
    meta.stored.assign(2U << 20, 'x');
    meta.contentBytes = meta.stored.size();
    expectFault(assemble(changed), "META 0: is too large");
}

TEST(TlodFile, validatesWhatItRead)
{
    auto chunks = disassemble(smallFile());
    Chunk& patches = find(chunks, "PTCH");
    std::string content = contentOf(patches);
    put(content, 2 * 72 + 12, std::uint32_t{12}); // patch 2's first edge
    patches = rawChunk(patches, content);
    expectFault(assemble(chunks), "some.tlod: patch 2: edge out of range");
    content[71] = 1;
    patches = rawChunk(patches, content);
    expectFault(assemble(chunks), "PTCH 0: reserved bytes are not zero");
}

} // namespace
} // namespace osgTessLOD
