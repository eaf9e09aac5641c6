// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <fstream>
#include <string>

namespace osgTessLOD {

/// A file that appears at its path complete or not at all. What is written to stream() goes to a new temporary file in the
/// same directory, `.<name>.<process>-<number>.tmp`; commit() flushes it to the disk and renames it over the path.
/// Without commit(), as when an exception passes, the temporary is removed and what was at the path stays. A process that is
/// killed leaves its temporary file behind.
/// A path that is a symbolic link is followed: the file it points at is replaced.
class OSGTESSLOD_EXPORT AtomicFile {
public:
    /// Throws AssetError naming the path if it is something other than a file, or no file can be made beside it.
    explicit AtomicFile(const std::string& path);
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Binary. Failed writes need no checking: commit() does.
    std::ostream& stream() { return _stream; }

    /// Throws AssetError naming the path if anything could not be written.
    void commit();

private:
    std::string _path;      ///< as the caller named it, for messages
    std::string _target;    ///< links followed
    std::string _temporary;
    std::ofstream _stream;
    int _descriptor = -1;   ///< of the temporary, to flush it
};

} // namespace osgTessLOD
