// SPDX-License-Identifier: MIT
#include <fuzz/Targets.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/Crc32c.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgtesslodbake/AssetInfo.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>

namespace osgTessLOD::fuzz {

namespace {

constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kEntryBytes = 48;

std::uint64_t number(const std::string& file, std::size_t at, unsigned bytes)
{
    std::uint64_t value = 0;
    for (unsigned k = bytes; k > 0; --k) { value = value << 8 | static_cast<unsigned char>(file[at + k - 1]); }
    return value;
}

void setNumber(std::string& file, std::size_t at, unsigned bytes, std::uint64_t value)
{
    for (unsigned k = 0; k < bytes; ++k) { file[at + k] = static_cast<char>(value >> 8 * k & 0xFF); }
}

/// Entry `at` of the table becomes that of the chunk at `offset`, of which no more than `left` bytes are there. Returns how many.
std::uint64_t sealEntry(std::string& file, std::size_t at, std::uint64_t offset, std::uint64_t left)
{
    const std::uint64_t stored = std::min(number(file, at + 24, 8), left);
    setNumber(file, at + 12, 4, crc32c(file.data() + offset, stored));
    setNumber(file, at + 16, 8, offset);
    setNumber(file, at + 24, 8, stored);
    if (number(file, at + 8, 4) == 0) { setNumber(file, at + 32, 8, stored); } // not compressed
    setNumber(file, at + 40, 8, 0);
    return stored;
}

/// The file with a header and a table that are right for it: TlodFile.h.
std::string sealed(std::string file)
{
    if (file.size() < kHeaderBytes) { return file; }
    const std::uint64_t chunks =
        std::min<std::uint64_t>(number(file, 12, 4), (file.size() - kHeaderBytes) / kEntryBytes);
    const std::size_t tableEnd = kHeaderBytes + kEntryBytes * chunks;
    std::uint64_t offset = tableEnd;
    for (std::size_t at = kHeaderBytes; at < tableEnd; at += kEntryBytes) {
        offset += sealEntry(file, at, offset, file.size() - offset);
    }
    file.resize(offset);
    file.replace(0, 8, "\x89TLOD\r\n\n");
    setNumber(file, 8, 4, 2);
    setNumber(file, 12, 4, chunks);
    setNumber(file, 16, 8, file.size());
    setNumber(file, 24, 8, 0);
    setNumber(file, 24, 4, crc32c(file.data(), tableEnd));
    return file;
}

std::string written(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

LodAsset read(const std::string& bytes)
{
    std::istringstream stream(bytes);
    return readTlod(stream, "fuzz.tlod");
}

/// Nothing if it is refused.
std::optional<LodAsset> tryToRead(const std::string& bytes)
{
    try {
        return read(bytes);
    } catch (const AssetError&) {
        return std::nullopt;
    }
}

void examineSurface(const LodAsset& asset)
{
    const SurfaceMesh mesh = extractSurface(asset, asset.ladder.back());
    for (const auto& triangle : mesh.triangles) {
        for (const std::uint32_t vertex : triangle) {
            if (vertex >= mesh.positions.size()) { throw Finding("a surface has a triangle without a vertex"); }
        }
    }
    for (const auto& [x, y, z] : mesh.positions) {
        if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) { throw Finding("a vertex is nowhere"); }
    }
}

void examineFile(const std::string& bytes)
{
    const std::optional<LodAsset> asset = tryToRead(bytes);
    if (!asset) { return; }
    examineSurface(*asset);
    const std::string again = written(*asset);
    if (written(read(again)) != again) { throw Finding("what is written is not what is read"); }
    static const TemporaryDirectory folder;
    writeBytes(folder.file("a.tlod"), bytes);
    if (describeTlod(folder.file("a.tlod")).empty()) { throw Finding("nothing is told of a file"); }
}

} // namespace

void examineTlod(const std::uint8_t* data, std::size_t size)
{
    const std::string bytes(data, data + size);
    examineFile(bytes);
    examineFile(sealed(bytes));
}

} // namespace osgTessLOD::fuzz
