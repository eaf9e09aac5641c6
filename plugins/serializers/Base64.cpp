// SPDX-License-Identifier: MIT
#include "Base64.h"

#include <array>
#include <cstdint>
#include <stdexcept>

namespace osgTessLOD {

namespace {

constexpr char kAlphabet[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t kNone = 0xFF;

std::array<std::uint8_t, 256> makeValues()
{
    std::array<std::uint8_t, 256> values{};
    values.fill(kNone);
    for (std::uint8_t v = 0; v < 64; ++v) { values[static_cast<unsigned char>(kAlphabet[v])] = v; }
    return values;
}

} // namespace

std::string toBase64(const std::string& bytes)
{
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            word = word << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0U);
        }
        for (std::size_t k = 0; k < 4; ++k) { text += k <= count ? kAlphabet[word >> (18 - 6 * k) & 63U] : '='; }
    }
    return text;
}

std::string fromBase64(const std::string& text)
{
    static const std::array<std::uint8_t, 256> values = makeValues();
    if (text.size() % 4 != 0) { throw std::runtime_error("its length is not that of Base64"); }
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    for (std::size_t i = 0; i < text.size(); i += 4) {
        const bool last = i + 4 == text.size();
        const std::size_t padding = last ? (text[i + 3] == '=') + (text[i + 2] == '=' && text[i + 3] == '=') : 0;
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            const std::uint8_t value = k < 4 - padding ? values[static_cast<unsigned char>(text[i + k])] : 0;
            if (value == kNone) { throw std::runtime_error("it has a character that is not Base64's"); }
            word = word << 6 | value;
        }
        for (std::size_t k = 0; k < 3 - padding; ++k) { bytes += static_cast<char>(word >> (16 - 8 * k) & 0xFFU); }
    }
    return bytes;
}

} // namespace osgTessLOD
