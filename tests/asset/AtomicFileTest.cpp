// SPDX-License-Identifier: MIT

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <functional>
#include <sstream>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace osgTessLOD {
namespace {

std::string contentOf(const std::string& path)
{
    std::ifstream stream(path, std::ios::binary);
    std::ostringstream all;
    all << stream.rdbuf();
    return all.str();
}

void writeFile(const std::string& path, const std::string& content)
{
    AtomicFile file(path);
    file.stream() << content;
    file.commit();
}

std::string faultOf(const std::function<void()>& action)
{
    try {
        action();
    } catch (const AssetError& error) {
        return error.what();
    }
    return "no error";
}

/// While it lives, no file of this process grows beyond `bytes`: as good as a full disk.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes)
    {
        getrlimit(RLIMIT_FSIZE, &_before);
        _handler = std::signal(SIGXFSZ, SIG_IGN);
        const rlimit limit{bytes, _before.rlim_max};
        setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit()
    {
        setrlimit(RLIMIT_FSIZE, &_before);
        std::signal(SIGXFSZ, _handler);
    }
    FileSizeLimit(const FileSizeLimit&) = delete;
    FileSizeLimit& operator=(const FileSizeLimit&) = delete;

private:
    rlimit _before{};
    void (*_handler)(int);
};

TEST(AtomicFile, appearsOnCommitAndReplaces)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a");
    {
        AtomicFile file(path);
        file.stream() << "first";
        file.stream().flush();
        EXPECT_FALSE(std::filesystem::exists(path));
        file.commit();
        EXPECT_EQ(contentOf(path), "first");
    }
    EXPECT_EQ(contentOf(path), "first");
    writeFile(path, "second");
    EXPECT_EQ(contentOf(path), "second");
    EXPECT_EQ(directory.entryCount(), 1U);
}

TEST(AtomicFile, withoutCommitLeavesTheOldFileAndNothingElse)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a");
    writeFile(path, "old");
    {
        AtomicFile file(path);
        file.stream() << "new";
        file.stream().flush();
        EXPECT_EQ(directory.entryCount(), 2U);
    }
    EXPECT_EQ(contentOf(path), "old");
    EXPECT_EQ(directory.entryCount(), 1U);
}

TEST(AtomicFile, twoWritersAtOnceDoNotMix)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a");
    AtomicFile one(path);
    AtomicFile two(path);
    one.stream() << "one";
    two.stream() << "two";
    one.commit();
    EXPECT_EQ(contentOf(path), "one");
    two.commit();
    EXPECT_EQ(contentOf(path), "two");
}

TEST(AtomicFile, aFailedWriteSaysWhyAndLeavesTheOldFile)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a");
    writeFile(path, "old");
    for (const std::size_t bytes : {std::size_t{5000}, std::size_t{1000000}}) { // at the last flush, and before it
        const FileSizeLimit limit(1000);
        const std::string fault = faultOf([&] { writeFile(path, std::string(bytes, 'x')); });
        EXPECT_EQ(fault, path + ": cannot be written: File too large");
    }
    EXPECT_EQ(contentOf(path), "old");
    EXPECT_EQ(directory.entryCount(), 1U);
}

TEST(AtomicFile, aPathThatCannotBeAFileIsAnError)
{
    const TemporaryDirectory directory;
    writeFile(directory.file("file"), "x");
    for (const std::string& path : {directory.file("missing/a"), directory.file("file/a")}) {
        EXPECT_EQ(faultOf([&] { AtomicFile file(path); }).find(path + ": cannot be written: "), 0U) << path;
    }
    EXPECT_EQ(faultOf([&] { AtomicFile file(directory.file(".")); }),
              directory.file(".") + ": cannot be written: not a regular file");
    EXPECT_EQ(faultOf([] { AtomicFile file("/dev/null"); }), "/dev/null: cannot be written: not a regular file");
    EXPECT_EQ(directory.entryCount(), 1U);
}

TEST(AtomicFile, aReadOnlyFolderIsAnError)
{
    if (geteuid() == 0) { GTEST_SKIP() << "root may write anywhere"; }
    const TemporaryDirectory directory;
    writeFile(directory.file("a"), "old");
    const std::filesystem::path folder = directory.file(".");
    std::filesystem::permissions(folder, std::filesystem::perms::owner_write, std::filesystem::perm_options::remove);
    EXPECT_EQ(faultOf([&] { writeFile(directory.file("a"), "new"); }),
              directory.file("a") + ": cannot be written: Permission denied");
    std::filesystem::permissions(folder, std::filesystem::perms::owner_write, std::filesystem::perm_options::add);
    EXPECT_EQ(contentOf(directory.file("a")), "old");
}

TEST(AtomicFile, aKilledProcessLeavesTheOldFileAndItsTemporary)
{
    const TemporaryDirectory directory;
    const std::string path = directory.file("a");
    writeFile(path, "old");
    const pid_t child = fork();
    if (child == 0) {
        AtomicFile file(path);
        file.stream() << "half of";
        file.stream().flush();
        std::raise(SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(contentOf(path), "old");
    const std::string begin = ".a." + std::to_string(child) + "-";
    std::size_t leftovers = 0;
    for (const auto& entry : std::filesystem::directory_iterator(directory.file("."))) {
        const std::string name = entry.path().filename().string();
        leftovers += name.compare(0, begin.size(), begin) == 0 && entry.path().extension() == ".tmp" ? 1 : 0;
    }
    EXPECT_EQ(leftovers, 1U);
    writeFile(path, "new");
    EXPECT_EQ(contentOf(path), "new");
    EXPECT_EQ(directory.entryCount(), 2U);
}

TEST(AtomicFile, followsASymbolicLink)
{
    const TemporaryDirectory directory;
    writeFile(directory.file("target"), "old");
    std::filesystem::create_symlink("target", directory.file("link"));
    writeFile(directory.file("link"), "new");
    EXPECT_TRUE(std::filesystem::is_symlink(directory.file("link")));
    EXPECT_EQ(contentOf(directory.file("target")), "new");
}

} // namespace
} // namespace osgTessLOD
