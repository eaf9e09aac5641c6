// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

#include <algorithm>
#include <array>

namespace osgTessLOD::bake {

namespace {

/// The next line that holds more than blanks and a comment.
std::string_view offLine(Cursor& lines)
{
    while (!lines.atEnd()) {
        std::string_view line = lines.line();
        line = line.substr(0, line.find('#'));
        if (std::any_of(line.begin(), line.end(), [](char c) { return !isSpace(c); })) { return line; }
    }
    throw AssetError("truncated");
}

/// Reads the keyword and the counts of vertices and faces (the number of edges may be left out).
std::array<std::uint64_t, 2> parseOffHeader(Cursor& lines)
{
    std::string_view line = offLine(lines);
    Cursor words(line);
    std::string_view token = words.token();
    std::int64_t ignored = 0;
    if (!parseInteger(token, ignored)) { // the keyword, which the format lets one leave out
        if (token.size() < 3 || token.substr(token.size() - 3) != "OFF") { throw AssetError("not an OFF file"); }
        if (token.find('4') != token.npos || token.find('n') != token.npos) {
            throw AssetError("OFF with other than three dimensions (" + std::string(token.substr(0, 8)) +
                             ") is not supported");
        }
        token = words.token();
        if (lowerCase(token) == "binary") { throw AssetError("binary OFF is not supported"); }
        if (token.empty()) {
            words = Cursor(offLine(lines));
            token = words.token();
        }
    }
    std::array<std::uint64_t, 2> counts{};
    for (std::uint64_t& count : counts) {
        std::int64_t value = 0;
        if (!parseInteger(token, value) || value < 0) { throw AssetError("OFF header: bad count " + quoted(token)); }
        count = static_cast<std::uint64_t>(value);
        token = words.token();
    }
    return counts;
}

} // namespace

RawMesh parseOff(const std::string& content)
{
    Cursor lines(content);
    const auto [vertexCount, faceCount] = parseOffHeader(lines);
    requireCountFits("vertices", vertexCount, 6, lines.remaining() + 1); // "0 0 0\n"
    RawMesh mesh;
    mesh.positions.resize(vertexCount);
    for (std::size_t v = 0; v < vertexCount; ++v) {
        Cursor words(offLine(lines));
        if (!parsePosition(words, mesh.positions[v])) {
            throw AssetError("vertex " + std::to_string(v) + " has not three coordinates");
        }
    }
    requireCountFits("faces", faceCount, 2, lines.remaining() + 1); // "0\n"
    mesh.triangles.reserve(faceCount);
    std::vector<std::uint32_t> corners;
    for (std::uint64_t face = 0; face < faceCount; ++face) {
        const std::string_view line = offLine(lines);
        Cursor words(line);
        std::int64_t cornerCount = 0;
        if (!parseInteger(words.token(), cornerCount) || cornerCount < 0 ||
            static_cast<std::uint64_t>(cornerCount) > line.size()) {
            throw AssetError("face " + std::to_string(face) + " has a bad number of corners");
        }
        corners.clear();
        for (std::int64_t i = 0; i < cornerCount; ++i) {
            std::int64_t index = 0;
            if (!parseInteger(words.token(), index)) {
                throw AssetError("face " + std::to_string(face) + " is incomplete");
            }
            corners.push_back(checkedIndex(index, vertexCount, face));
        }
        mesh.addPolygon(corners);
    }
    return mesh;
}

} // namespace osgTessLOD::bake
