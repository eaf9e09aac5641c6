// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/Crc32c.h>

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace osgTessLOD {
namespace {

using Function = std::uint32_t (*)(const void*, std::size_t, std::uint32_t);

TEST(Crc32c, givesThePublishedValues)
{
    std::string rising;
    for (char c = 0; c < 32; ++c) { rising += c; }
    for (const Function crc : {&crc32c, &crc32cByTable}) {
        EXPECT_EQ(crc("123456789", 9, 0), 0xE3069283U); // the check value of every catalogue of CRCs
        EXPECT_EQ(crc("", 0, 0), 0U);
        // RFC 3720 B.4
        EXPECT_EQ(crc(std::string(32, '\0').data(), 32, 0), 0x8A9136AAU);
        EXPECT_EQ(crc(std::string(32, '\xFF').data(), 32, 0), 0x62A8AB43U);
        EXPECT_EQ(crc(rising.data(), 32, 0), 0x46DD794EU);
    }
}

TEST(Crc32c, instructionAndTableAgreeAtEveryLengthAndAlignment)
{
    if (!crc32cUsesInstruction()) { GTEST_SKIP() << "no instruction on this machine"; }
    std::mt19937 random(1);
    std::vector<unsigned char> data(300);
    for (auto& byte : data) { byte = static_cast<unsigned char>(random()); }
    for (std::size_t start = 0; start < 9; ++start) {
        for (std::size_t bytes = 0; start + bytes <= data.size(); ++bytes) {
            ASSERT_EQ(crc32c(data.data() + start, bytes), crc32cByTable(data.data() + start, bytes)) << start << " " << bytes;
        }
    }
}

TEST(Crc32c, piecesGiveTheWhole)
{
    const std::string text = "a text that is long enough to be cut at any place";
    for (const Function crc : {&crc32c, &crc32cByTable}) {
        for (std::size_t cut = 0; cut <= text.size(); ++cut) {
            const std::uint32_t first = crc(text.data(), cut, 0);
            ASSERT_EQ(crc(text.data() + cut, text.size() - cut, first), crc(text.data(), text.size(), 0)) << cut;
        }
    }
}

} // namespace
} // namespace osgTessLOD
