// SPDX-License-Identifier: MIT
// The targets of libFuzzer without it: over their seeds, and over some thousand random changes of them.
#include <fuzz/Mutator.h>

#include <fuzz/Targets.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <support/FileBytes.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <ostream>

namespace osgTessLOD {

namespace fuzz {

/// For names of tests, which are otherwise addresses.
void PrintTo(const Target& target, std::ostream* stream)
{
    *stream << target.name;
}

} // namespace fuzz

namespace {

using fuzz::Target;

/// A few seconds' worth. OpenImageIO takes milliseconds for each image.
unsigned changesOf(const Target& target)
{
    return target.examine == fuzz::examineImage ? 2000 : 20000;
}

void examine(const Target& target, const std::string& bytes)
{
    const void* data = bytes.data();
    target.examine(static_cast<const std::uint8_t*>(data), bytes.size());
}

/// What the target finds in the bytes; empty: nothing.
std::string findingOf(const Target& target, const std::string& bytes)
{
    try {
        examine(target, bytes);
        return {};
    } catch (const std::exception& error) {
        return error.what();
    }
}

/// The contents of the target's seeds, by name.
std::vector<std::string> seedsOf(const Target& target)
{
    std::vector<std::string> paths;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::string(OSGTESSLOD_FUZZ_SEEDS) + "/" + target.name)) {
        paths.push_back(entry.path().string());
    }
    std::sort(paths.begin(), paths.end());
    std::vector<std::string> seeds;
    for (const std::string& path : paths) { seeds.push_back(readBytes(path)); }
    return seeds;
}

class FuzzTargets : public testing::TestWithParam<Target> {};

TEST_P(FuzzTargets, FindNothingInTheirSeeds)
{
    const std::vector<std::string> seeds = seedsOf(GetParam());
    EXPECT_FALSE(seeds.empty());
    for (const std::string& seed : seeds) { EXPECT_EQ(findingOf(GetParam(), seed), ""); }
    EXPECT_EQ(findingOf(GetParam(), ""), "");
}

TEST_P(FuzzTargets, FindNothingInChangesOfTheirSeeds)
{
    Mutator mutator(seedsOf(GetParam()), 1);
    for (unsigned k = 0; k < changesOf(GetParam()); ++k) {
        const std::string bytes = mutator.next();
        const std::string finding = findingOf(GetParam(), bytes);
        if (finding.empty()) { continue; }
        const std::string path = testing::TempDir() + "/finding_" + GetParam().name;
        writeBytes(path, bytes);
        FAIL() << "change " << k << ", kept as " << path << ": " << finding;
    }
}

INSTANTIATE_TEST_SUITE_P(All, FuzzTargets, testing::ValuesIn(fuzz::kTargets),
                         [](const auto& instance) { return std::string(instance.param.name); });

} // namespace
} // namespace osgTessLOD
