// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <unistd.h>

namespace osgTessLOD {

/// A directory of its own for temporary files, removed with everything in it.
class TemporaryDirectory {
public:
    TemporaryDirectory()
    {
        std::string name = (std::filesystem::temp_directory_path() / "osgTessLOD-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) { throw std::runtime_error(name + ": no temporary directory"); }
        _path = name;
    }
    ~TemporaryDirectory()
    {
        std::error_code ignored;
        std::filesystem::remove_all(_path, ignored);
    }
    TemporaryDirectory(const TemporaryDirectory&) = delete;
    TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

    std::string file(const std::string& name) const { return (_path / name).string(); }
    std::size_t entryCount() const
    {
        std::size_t count = 0;
        for (const auto& entry : std::filesystem::directory_iterator(_path)) { count += entry.exists() ? 1 : 0; }
        return count;
    }

private:
    std::filesystem::path _path;
};

} // namespace osgTessLOD
