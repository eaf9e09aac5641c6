// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/AssetError.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace osgTessLOD {

// Numbers to little-endian bytes and back, private to the asset room. ByteWriter and ByteReader have the same functions, so
// that one template names the fields of a record, in their order, for both ways.

using Bytes = std::vector<std::uint8_t>;

/// Appends to `bytes`.
class ByteWriter {
public:
    template <class Number> void field(Number value)
    {
        if constexpr (std::is_same_v<Number, float>) {
            std::uint32_t bits = 0;
            std::memcpy(&bits, &value, 4);
            field(bits);
        } else if constexpr (std::is_same_v<Number, double>) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &value, 8);
            field(bits);
        } else {
            const auto bits = static_cast<std::make_unsigned_t<Number>>(value);
            for (std::size_t k = 0; k < sizeof(Number); ++k) {
                bytes.push_back(static_cast<std::uint8_t>(bits >> 8 * k));
            }
        }
    }
    template <class Number, std::size_t n> void field(const std::array<Number, n>& values)
    {
        for (const Number value : values) { field(value); }
    }
    /// Its length as a 32 bit number, then its bytes.
    void field(const std::string& text)
    {
        field(static_cast<std::uint32_t>(text.size()));
        bytes.insert(bytes.end(), text.begin(), text.end());
    }
    template <class... Values> void fields(const Values&... values) { (field(values), ...); }
    void zeros(std::size_t count) { bytes.resize(bytes.size() + count); }

    Bytes bytes;
};

/// Takes bytes off the front of a block that is not its own. Throws AssetError when they run out.
class ByteReader {
public:
    ByteReader(const std::uint8_t* data, std::size_t bytes)
        : _at(data)
        , _left(bytes)
    {
    }

    template <class Number> void field(Number& value)
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
    template <class Number, std::size_t n> void field(std::array<Number, n>& values)
    {
        for (Number& value : values) { field(value); }
    }
    void field(std::string& text)
    {
        std::uint32_t size = 0;
        field(size);
        const std::uint8_t* from = take(size);
        text.assign(from, from + size);
    }
    template <class... Values> void fields(Values&... values) { (field(values), ...); }
    /// Throws AssetError if they are anything else.
    void zeros(std::size_t count)
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

} // namespace osgTessLOD
