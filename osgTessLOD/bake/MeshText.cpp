// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshText.h>

#include <osgTessLOD/asset/AssetError.h>

#include <charconv>
#include <limits>

namespace osgTessLOD::bake {

std::string lowerCase(std::string_view text)
{
    std::string lower(text);
    for (char& c : lower) {
        if (c >= 'A' && c <= 'Z') { c = static_cast<char>(c - 'A' + 'a'); }
    }
    return lower;
}

std::string quoted(std::string_view text)
{
    std::string out = "'";
    for (const char c : text.substr(0, 24)) { out += c >= ' ' && c <= '~' ? c : '?'; }
    return out + (text.size() > 24 ? "…'" : "'");
}

bool parseNumber(std::string_view token, double& value)
{
    if (!token.empty() && token.front() == '+') { token.remove_prefix(1); }
    const char* end = token.data() + token.size();
    const auto result = std::from_chars(token.data(), end, value);
    if (result.ec == std::errc::result_out_of_range) {
        const bool tiny = token.find("e-") != token.npos || token.find("E-") != token.npos;
        value = tiny ? 0.0 : std::numeric_limits<double>::infinity();
        return result.ptr == end;
    }
    return result.ec == std::errc() && result.ptr == end;
}

bool parseInteger(std::string_view token, std::int64_t& value)
{
    if (!token.empty() && token.front() == '+') { token.remove_prefix(1); }
    const char* end = token.data() + token.size();
    const auto result = std::from_chars(token.data(), end, value);
    return result.ec == std::errc() && result.ptr == end;
}

bool parsePosition(Cursor& words, Eigen::Vector3d& position)
{
    return parseNumber(words.token(), position[0]) && parseNumber(words.token(), position[1]) &&
           parseNumber(words.token(), position[2]);
}

std::uint32_t checkedIndex(std::int64_t index, std::uint64_t vertexCount, std::uint64_t face)
{
    if (index < 0 || static_cast<std::uint64_t>(index) >= vertexCount) {
        throw AssetError("face " + std::to_string(face) + " refers to vertex " + std::to_string(index) +
                         ", but there are only " + std::to_string(vertexCount) + " (counted from 0)");
    }
    return static_cast<std::uint32_t>(index);
}

void requireCountFits(const std::string& what, std::uint64_t count, std::uint64_t bytesEach, std::uint64_t bytesLeft)
{
    if (count > kMaxElements) { throw AssetError("declares " + std::to_string(count) + " " + what + ": too many"); }
    if (bytesEach != 0 && count > bytesLeft / bytesEach) {
        throw AssetError("truncated: declares " + std::to_string(count) + " " + what + ", more than the file can hold");
    }
}

} // namespace osgTessLOD::bake
