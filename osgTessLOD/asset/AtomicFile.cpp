// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AtomicFile.h>

#include <osgTessLOD/asset/AssetError.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace osgTessLOD {

namespace {

namespace fs = std::filesystem;

/// "<path>: cannot be written: <what errno `cause` means>"; 0 if nobody said why.
[[noreturn]] void failToWrite(const std::string& path, int cause)
{
    const std::string reason = cause == 0 ? "output failed" : std::generic_category().message(cause);
    throw AssetError(path + ": cannot be written: " + reason);
}

std::string resolveTarget(const std::string& path)
{
    std::error_code error;
    const fs::file_status status = fs::status(path, error);
    if (!fs::exists(status)) { return path; }
    if (!fs::is_regular_file(status)) { throw AssetError(path + ": cannot be written: not a regular file"); }
    if (!fs::is_symlink(fs::symlink_status(path, error))) { return path; }
    const fs::path resolved = fs::canonical(path, error);
    return error ? path : resolved.string();
}

/// Makes the rename itself durable. Not all file systems can; the content is on disk either way.
void flushDirectory(const std::string& directory)
{
    const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) { return; }
    static_cast<void>(::fsync(descriptor));
    ::close(descriptor);
}

std::string directoryOf(const std::string& path)
{
    const std::string parent = fs::path(path).parent_path().string();
    return parent.empty() ? "." : parent;
}

} // namespace

AtomicFile::AtomicFile(const std::string& path)
    : _path(path)
    , _target(resolveTarget(path))
{
    static std::atomic<unsigned> number{0};
    const std::string stem = (fs::path(directoryOf(_target)) / ("." + fs::path(_target).filename().string())).string();
    constexpr int kAttempts = 100; // a name can be taken only by what a killed process with our number left
    for (int attempt = 0; attempt < kAttempts && _descriptor < 0; ++attempt) {
        _temporary = stem + "." + std::to_string(::getpid()) + "-" + std::to_string(number++) + ".tmp";
        _descriptor = ::open(_temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (_descriptor < 0 && errno != EEXIST) { break; }
    }
    if (_descriptor < 0) { failToWrite(_path, errno); }
    errno = 0;
    _stream.open(_temporary, std::ios::binary | std::ios::trunc);
    if (!_stream) {
        const int cause = errno;
        ::close(_descriptor);
        ::unlink(_temporary.c_str());
        failToWrite(_path, cause);
    }
    errno = 0;
}

AtomicFile::~AtomicFile()
{
    _stream.close();
    if (_descriptor < 0) { return; }
    ::close(_descriptor);
    ::unlink(_temporary.c_str());
}

void AtomicFile::commit()
{
    if (!_stream) { failToWrite(_path, errno); } // after the failure nothing more was tried that could fail
    errno = 0;
    _stream.close();
    if (!_stream) { failToWrite(_path, errno); }
    if (::fsync(_descriptor) != 0 && errno != EINVAL && errno != ENOTSUP) { failToWrite(_path, errno); }
    if (::rename(_temporary.c_str(), _target.c_str()) != 0) { failToWrite(_path, errno); }
    ::close(_descriptor);
    _descriptor = -1;
    flushDirectory(directoryOf(_target));
}

} // namespace osgTessLOD
