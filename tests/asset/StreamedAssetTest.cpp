// SPDX-License-Identifier: MIT
#include "SyntheticAsset.h"

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

namespace osgTessLOD {
namespace {

std::string bytesOf(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

class StreamedAssets : public testing::Test {
protected:
    StreamedAssets() { writeTlod(path, made); }

    /// However small the file is.
    StreamedAsset open(bool normals = true) const { return StreamedAsset(path, {normals, 0}); }
    /// The first byte of a chunk, turned over.
    void damage(const std::string& type, std::uint32_t level) const
    {
        for (const TlodChunk& chunk : readTlodContents(path)) {
            if (chunk.type != type || chunk.level != level) { continue; }
            std::fstream file(path, std::ios::binary | std::ios::in | std::ios::out);
            file.seekg(static_cast<std::streamoff>(chunk.offset));
            const auto byte = static_cast<char>(file.get() ^ 0xFF);
            file.seekp(static_cast<std::streamoff>(chunk.offset));
            file.put(byte);
            return;
        }
        FAIL() << "no chunk " << type << " " << level;
    }

    const LodAsset made = makeSyntheticAsset(64, true);
    const TemporaryDirectory folder;
    const std::string path = folder.file("streamed.tlod");
};

TEST_F(StreamedAssets, haveWhatWasAskedForAndNoMore)
{
    const StreamedAsset asset = open();
    EXPECT_EQ(asset.levelCount(), made.levels.size());
    EXPECT_EQ(asset.normalCount(), made.normals.levels.size());
    EXPECT_EQ(asset.levelsRead(), 4U) << "1, 2, 4 and 8";
    EXPECT_EQ(asset.normalsRead(), 0U);
    EXPECT_EQ(asset.frame().levels[3].vertices, made.levels[3].vertices);
    EXPECT_TRUE(asset.frame().levels[4].vertices.empty());
    EXPECT_EQ(asset.frame().levels.back().errors.size(), made.levels.back().errors.size()) << "selection needs them";

    asset.read(5, 2);
    EXPECT_EQ(asset.levelsRead(), 5U);
    EXPECT_EQ(asset.normalsRead(), 2U);
    EXPECT_EQ(asset.frame().levels[4].vertices, made.levels[4].vertices);
    EXPECT_TRUE(asset.frame().levels[5].vertices.empty());
    EXPECT_EQ(asset.frame().normals.levels[1], made.normals.levels[1]);
    EXPECT_TRUE(asset.frame().normals.levels[2].empty());

    asset.read(2, 1);
    EXPECT_EQ(asset.levelsRead(), 5U);
    EXPECT_EQ(bytesOf(*asset.whole()), bytesOf(made));
    EXPECT_EQ(asset.whole().get(), &asset.frame());
}

TEST_F(StreamedAssets, knowWhereParametersAreBeforeTheyAreRead)
{
    LodAsset moved = makeSyntheticDisplacedAsset(32);
    moved.levels[1].parameters.clear();
    writeTlod(path, moved);
    const StreamedAsset asset = open();
    const StreamedAsset whole(std::make_shared<const LodAsset>(moved));
    bool some = false;
    for (std::size_t level = 0; level < moved.levels.size(); ++level) {
        const bool expected = !moved.levels[level].parameters.empty();
        some = some || expected;
        EXPECT_EQ(asset.hasParameters(level), expected) << level;
        EXPECT_EQ(whole.hasParameters(level), expected) << level;
        if (level > 3) { EXPECT_TRUE(asset.frame().levels[level].parameters.empty()); }
    }
    EXPECT_TRUE(some);
    EXPECT_EQ(bytesOf(*asset.whole()), bytesOf(moved));
}

TEST_F(StreamedAssets, ofSmallFilesAreReadAtOnce)
{
    const StreamedAsset asset(path, {true, std::uint64_t{1} << 30});
    EXPECT_EQ(asset.levelsRead(), made.levels.size());
    EXPECT_EQ(asset.normalsRead(), made.normals.levels.size());
}

TEST_F(StreamedAssets, leaveNormalsOutIfAskedTo)
{
    const StreamedAsset asset = open(false);
    LodAsset plain = made;
    plain.normals = NormalTexture();
    EXPECT_EQ(asset.normalCount(), 0U);
    EXPECT_EQ(bytesOf(*asset.whole()), bytesOf(plain));
}

TEST_F(StreamedAssets, readAheadInAnotherThreadALevelAtATime)
{
    const StreamedAsset asset = open();
    unsigned steps = 0;
    for (unsigned before = asset.levelsRead(); before < 7; ++steps) {
        asset.readAhead(7, 2);
        asset.read(before + 1, 0); // waits for it
        EXPECT_LE(asset.levelsRead(), before + 2);
        before = asset.levelsRead();
    }
    EXPECT_GT(steps, 0U);
    asset.read(7, 2);
    asset.readAhead(7, 2); // nothing to do
    EXPECT_EQ(asset.levelsRead(), 7U);
    EXPECT_EQ(asset.normalsRead(), 2U);
}

TEST_F(StreamedAssets, areReadByManyThreads)
{
    const StreamedAsset asset = open();
    std::atomic<unsigned> faults{0};
    std::vector<std::thread> threads;
    for (unsigned t = 0; t < 4; ++t) {
        threads.emplace_back([&, t] {
            for (unsigned level = 0; level < made.levels.size(); ++level) {
                if (t == 3) { asset.readAhead(level + 1, level + 1); }
                asset.read(level + 1, level + 1);
                if (!(asset.frame().levels[level].vertices == made.levels[level].vertices)) { ++faults; }
            }
        });
    }
    for (std::thread& thread : threads) { thread.join(); }
    EXPECT_EQ(faults, 0U);
    EXPECT_EQ(bytesOf(*asset.whole()), bytesOf(made));
}

TEST_F(StreamedAssets, endWhereTheFileIsDamaged)
{
    damage("LVLV", 5);
    const StreamedAsset asset = open();
    asset.read(5, 0);
    EXPECT_EQ(asset.takeFault(), "");
    asset.read(7, 2);
    EXPECT_EQ(asset.levelsRead(), 5U);
    EXPECT_EQ(asset.levelCount(), 5U);
    EXPECT_EQ(asset.normalCount(), asset.normalsRead());
    EXPECT_EQ(asset.takeFault(), path + ": chunk LVLV 5: is damaged: its checksum is wrong");
    EXPECT_EQ(asset.takeFault(), "") << "it is told once";
    asset.read(7, 2); // and not tried again
    EXPECT_EQ(asset.takeFault(), "");
    EXPECT_THROW(asset.whole(), AssetError);
    EXPECT_EQ(asset.frame().levels[4].vertices, made.levels[4].vertices);
}

TEST_F(StreamedAssets, refuseAnotherFileInTheirsPlace)
{
    const StreamedAsset asset = open();
    asset.read(5, 0);
    LodAsset other = made;
    other.levels[3].errors[0].isotropic *= 2.0F;
    writeTlod(path, other);
    asset.read(7, 0);
    EXPECT_EQ(asset.levelCount(), 5U);
    EXPECT_EQ(asset.takeFault(), path + ": has changed since it was opened");

    const StreamedAsset again = open();
    std::filesystem::remove(path);
    again.read(5, 0);
    EXPECT_EQ(again.levelCount(), 4U);
    EXPECT_EQ(again.takeFault(), path + ": does not exist or cannot be reached");
    EXPECT_EQ(bytesOf(*StreamedAsset(std::make_shared<const LodAsset>(made)).whole()), bytesOf(made));
}

TEST_F(StreamedAssets, thatCannotBeginAreErrors)
{
    const auto fault = [&] {
        try {
            open();
        } catch (const AssetError& error) {
            return std::string(error.what());
        }
        return std::string("none");
    };
    damage("LVLV", 3);
    EXPECT_EQ(fault(), path + ": chunk LVLV 3: is damaged: its checksum is wrong");
    writeTlod(path, made);
    damage("LVLE", 5);
    EXPECT_EQ(fault(), path + ": chunk LVLE 5: is damaged: its checksum is wrong");
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
    EXPECT_NE(fault().find(": is truncated: "), std::string::npos);
    std::filesystem::remove(path);
    EXPECT_EQ(fault(), path + ": does not exist or cannot be reached");
}

} // namespace
} // namespace osgTessLOD
