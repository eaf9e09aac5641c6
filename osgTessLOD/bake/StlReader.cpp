// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

#include <array>
#include <cstring>

namespace osgTessLOD::bake {

namespace {

constexpr std::size_t kStlHeaderBytes = 84;
constexpr std::size_t kStlFacetBytes = 50;

std::uint32_t littleEndian32(const char* bytes)
{
    std::uint32_t value = 0;
    for (int i = 3; i >= 0; --i) { value = value << 8 | static_cast<unsigned char>(bytes[i]); }
    return value;
}

void addStlTriangle(RawMesh& mesh)
{
    if (mesh.positions.size() > kMaxElements) { throw AssetError("more than 2^32 vertices"); }
    const auto first = static_cast<std::uint32_t>(mesh.positions.size() - 3);
    mesh.triangles.push_back({first, first + 1, first + 2});
}

RawMesh parseBinaryStl(const std::string& content)
{
    const std::uint64_t count = littleEndian32(content.data() + 80);
    requireCountFits("facets", count, kStlFacetBytes, content.size() - kStlHeaderBytes);
    RawMesh mesh;
    mesh.positions.reserve(3 * count);
    mesh.triangles.reserve(count);
    for (std::uint64_t facet = 0; facet < count; ++facet) {
        const char* at = content.data() + kStlHeaderBytes + facet * kStlFacetBytes + 12; // behind the normal
        for (int corner = 0; corner < 3; ++corner) {
            std::array<float, 3> xyz{};
            for (float& value : xyz) {
                const std::uint32_t bits = littleEndian32(at);
                std::memcpy(&value, &bits, sizeof value);
                at += 4;
            }
            mesh.positions.emplace_back(xyz[0], xyz[1], xyz[2]);
        }
        addStlTriangle(mesh);
    }
    return mesh;
}

RawMesh parseTextStl(const std::string& content)
{
    RawMesh mesh;
    Cursor words(content);
    bool inSolid = false;
    while (true) {
        const std::string word = lowerCase(words.token());
        if (word.empty()) { break; }
        if (word == "solid") {
            words.line(); // its name, which may be any words
            inSolid = true;
        } else if (word == "endsolid") {
            if (!words.atEnd()) { words.line(); }
            inSolid = false;
        } else if (word == "vertex") {
            Eigen::Vector3d position;
            if (!parsePosition(words, position)) {
                throw AssetError("vertex " + std::to_string(mesh.positions.size()) + " has not three coordinates");
            }
            mesh.positions.push_back(position);
        } else if (word == "endloop") {
            if (mesh.positions.size() != 3 * (mesh.triangles.size() + 1)) {
                throw AssetError("facet " + std::to_string(mesh.triangles.size()) + " has not three vertices");
            }
            addStlTriangle(mesh);
        }
    }
    if (inSolid || mesh.positions.size() != 3 * mesh.triangles.size()) { throw AssetError("truncated: no endsolid"); }
    return mesh;
}

} // namespace

RawMesh parseStl(const std::string& content)
{
    // Many binary files begin with "solid" too: the size tells, and the first facet.
    const bool fits =
        content.size() >= kStlHeaderBytes &&
        content.size() == kStlHeaderBytes + std::uint64_t{kStlFacetBytes} * littleEndian32(content.data() + 80);
    if (!fits) {
        Cursor words(content);
        const bool solid = lowerCase(words.token()) == "solid";
        const std::string start = lowerCase(std::string_view(content).substr(0, 1024));
        if (solid && (start.find("facet") != start.npos || start.find("endsolid") != start.npos)) {
            return parseTextStl(content);
        }
        if (content.size() < kStlHeaderBytes) { throw AssetError("not an STL file, or truncated"); }
    }
    return parseBinaryStl(content);
}

} // namespace osgTessLOD::bake
