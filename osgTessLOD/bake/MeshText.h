// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace osgTessLOD::bake {

// What the readers of the mesh formats share: tokens, numbers, and checks of what a file declares. Private to the bake room.

/// Elements of a kind that 32-bit indices can number.
constexpr std::uint64_t kMaxElements = 0xFFFFFFFEU;

inline bool isBlank(char c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}
inline bool isSpace(char c)
{
    return isBlank(c) || c == '\n';
}

std::string lowerCase(std::string_view text);

/// At most a few printable characters of the file, for messages.
std::string quoted(std::string_view text);

/// Takes tokens off the front of a text.
class Cursor {
public:
    explicit Cursor(std::string_view text)
        : _text(text)
    {
    }

    /// The next token separated by white space, line ends included; empty at the end.
    std::string_view token()
    {
        while (_at < _text.size() && isSpace(_text[_at])) { ++_at; }
        return rest([](char c) { return isSpace(c); });
    }
    /// The next line without its end (\n, \r\n or \r); call only while !atEnd().
    std::string_view line()
    {
        const std::string_view result = rest([](char c) { return c == '\n' || c == '\r'; });
        if (_at < _text.size() && _text[_at++] == '\r' && _at < _text.size() && _text[_at] == '\n') { ++_at; }
        return result;
    }
    bool atEnd() const { return _at >= _text.size(); }
    std::size_t position() const { return _at; }
    std::size_t remaining() const { return _text.size() - _at; }

private:
    template <typename Ends> std::string_view rest(Ends ends)
    {
        const std::size_t begin = _at;
        while (_at < _text.size() && !ends(_text[_at])) { ++_at; }
        return _text.substr(begin, _at - begin);
    }

    std::string_view _text;
    std::size_t _at = 0;
};

/// Parses all of `token`; out of double's range gives infinity or zero. "nan" and "inf" are numbers here.
bool parseNumber(std::string_view token, double& value);
bool parseInteger(std::string_view token, std::int64_t& value);

/// The three numbers of a vertex, further ones (weight, colour) left alone. False when they are not there.
bool parsePosition(Cursor& words, Eigen::Vector3d& position);

/// A vertex reference of face `face` in a file of `vertexCount` vertices, counted from 0. Throws AssetError where there is
/// no such vertex.
std::uint32_t checkedIndex(std::int64_t index, std::uint64_t vertexCount, std::uint64_t face);

/// Throws AssetError where `count` items of at least `bytesEach` bytes cannot be what `bytesLeft` bytes hold.
void requireCountFits(const std::string& what, std::uint64_t count, std::uint64_t bytesEach, std::uint64_t bytesLeft);

} // namespace osgTessLOD::bake
