// SPDX-License-Identifier: MIT
// Tables: "slicing by 8", Kounavis and Berry, "A systematic approach to building high performance software-based CRC
// generators", 2005.
#include <osgTessLOD/asset/Crc32c.h>

#include <array>
#include <cstring>

#if defined(__x86_64__)
#include <nmmintrin.h>
#endif

namespace osgTessLOD {

namespace {

constexpr std::uint32_t kPolynomial = 0x82F63B78U;

using Tables = std::array<std::array<std::uint32_t, 256>, 8>;

/// tables[k][b]: the remainder of byte b followed by k zero bytes.
constexpr Tables makeTables()
{
    Tables tables{};
    for (std::uint32_t b = 0; b < 256; ++b) {
        std::uint32_t crc = b;
        for (int bit = 0; bit < 8; ++bit) { crc = (crc & 1U) != 0 ? crc >> 1 ^ kPolynomial : crc >> 1; }
        tables[0][b] = crc;
    }
    for (std::size_t k = 1; k < 8; ++k) {
        for (std::size_t b = 0; b < 256; ++b) {
            const std::uint32_t shorter = tables[k - 1][b];
            tables[k][b] = shorter >> 8 ^ tables[0][shorter & 0xFFU];
        }
    }
    return tables;
}

constexpr Tables kTables = makeTables();

#if defined(__x86_64__)

__attribute__((target("sse4.2"))) std::uint32_t crc32cByInstruction(const unsigned char* at, std::size_t bytes,
                                                                     std::uint32_t previous)
{
    std::uint64_t crc = ~previous;
    for (; bytes >= 8; bytes -= 8, at += 8) {
        std::uint64_t word = 0;
        std::memcpy(&word, at, 8);
        crc = _mm_crc32_u64(crc, word);
    }
    auto last = static_cast<std::uint32_t>(crc);
    for (; bytes > 0; --bytes, ++at) { last = _mm_crc32_u8(last, *at); }
    return ~last;
}

#endif

} // namespace

std::uint32_t crc32cByTable(const void* data, std::size_t bytes, std::uint32_t previous)
{
    const auto* at = static_cast<const unsigned char*>(data);
    std::uint32_t crc = ~previous;
    for (; bytes >= 8; bytes -= 8, at += 8) {
        crc = kTables[7][(crc ^ at[0]) & 0xFFU] ^ kTables[6][(crc >> 8 ^ at[1]) & 0xFFU] ^
              kTables[5][(crc >> 16 ^ at[2]) & 0xFFU] ^ kTables[4][crc >> 24 ^ at[3]] ^ kTables[3][at[4]] ^
              kTables[2][at[5]] ^ kTables[1][at[6]] ^ kTables[0][at[7]];
    }
    for (; bytes > 0; --bytes, ++at) { crc = crc >> 8 ^ kTables[0][(crc ^ *at) & 0xFFU]; }
    return ~crc;
}

bool crc32cUsesInstruction()
{
#if defined(__x86_64__)
    static const bool supported = __builtin_cpu_supports("sse4.2") != 0;
    return supported;
#else
    return false;
#endif
}

std::uint32_t crc32c(const void* data, std::size_t bytes, std::uint32_t previous)
{
#if defined(__x86_64__)
    if (crc32cUsesInstruction()) {
        return crc32cByInstruction(static_cast<const unsigned char*>(data), bytes, previous);
    }
#endif
    return crc32cByTable(data, bytes, previous);
}

} // namespace osgTessLOD
