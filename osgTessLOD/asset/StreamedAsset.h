// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <future>
#include <memory>
#include <mutex>
#include <string>

namespace osgTessLOD {

class TlodAssetReader;
class TlodContainerReader;

/// An asset whose levels and normals are read from its file when they are first asked for, from the coarsest on; or one that is all
/// there. Any thread.
///
/// The file is opened anew each time, so that any number of them can be in use, and is refused if it is another one by then. If
/// something cannot be read, the asset ends there: levelCount() and normalCount() tell, and takeFault() why.
class OSGTESSLOD_EXPORT StreamedAsset {
public:
    /// Levels up to this factor are always there.
    static constexpr unsigned kLeastFactor = 8;

    struct Options {
        bool normals = true;                              ///< false: the asset has none
        std::uint64_t wholeBytes = std::uint64_t{1} << 20; ///< files up to this size are read at once
    };

    /// All there. The asset must be valid; not null.
    explicit StreamedAsset(std::shared_ptr<const LodAsset> asset);
    /// Reads and checks what there is one of per patch, and levels up to kLeastFactor. Throws AssetError as readTlod does.
    explicit StreamedAsset(const std::string& path);
    StreamedAsset(const std::string& path, const Options& options);
    ~StreamedAsset();
    StreamedAsset(const StreamedAsset&) = delete;
    StreamedAsset& operator=(const StreamedAsset&) = delete;

    /// The asset, in which what was not yet read per vertex of a level or per normal is empty: finer ones than kLeastFactor are not to
    /// be looked at before read() was called for them.
    const LodAsset& frame() const { return *_asset; }
    /// Reads what is missing. Throws AssetError if that cannot be.
    std::shared_ptr<const LodAsset> whole() const;

    /// Reads so many levels and resolutions of normals, or as many as can be.
    void read(unsigned levels, unsigned normals) const;
    /// Begins to read them in another thread, one after the other, unless something is being read there already.
    void readAhead(unsigned levels, unsigned normals) const;

    unsigned levelsRead() const { return _levelsRead.load(std::memory_order_acquire); }
    unsigned normalsRead() const { return _normalsRead.load(std::memory_order_acquire); }
    /// Levels and resolutions of normals that the asset has, or those before the first that could not be read.
    unsigned levelCount() const { return _levelCount.load(std::memory_order_relaxed); }
    unsigned normalCount() const { return _normalCount.load(std::memory_order_relaxed); }
    /// Read or not.
    bool hasParameters(std::size_t level) const;

    /// Why something could not be read, the first time that it is asked after that; else empty.
    std::string takeFault() const;

private:
    void readFrom(TlodContainerReader& file, unsigned levels, unsigned normals) const;
    void giveUp(const std::string& fault) const;

    std::shared_ptr<LodAsset> _loaded; ///< what is read goes here; null where all was there
    std::shared_ptr<const LodAsset> _asset;
    std::string _path;
    std::uint32_t _checksum = 0; ///< of the file's table of contents
    std::unique_ptr<const TlodAssetReader> _reader;
    mutable std::atomic<unsigned> _levelsRead;
    mutable std::atomic<unsigned> _normalsRead;
    mutable std::atomic<unsigned> _levelCount;
    mutable std::atomic<unsigned> _normalCount;
    mutable std::mutex _mutex; ///< of reading
    mutable std::string _fault;
    mutable bool _isFaultTaken = true;
    mutable std::mutex _aheadMutex;
    mutable std::future<void> _ahead;
};

} // namespace osgTessLOD
