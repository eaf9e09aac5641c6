// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/StreamedAsset.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TlodAssetReader.h>
#include <osgTessLOD/asset/TlodContainer.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <new>
#include <system_error>
#include <utility>

namespace osgTessLOD {

StreamedAsset::StreamedAsset(std::shared_ptr<const LodAsset> asset)
    : _asset(std::move(asset))
    , _levelsRead(static_cast<unsigned>(_asset->levels.size()))
    , _normalsRead(static_cast<unsigned>(_asset->normals.levels.size()))
    , _levelCount(_levelsRead.load())
    , _normalCount(_normalsRead.load())
{
}

StreamedAsset::StreamedAsset(const std::string& path)
    : StreamedAsset(path, Options())
{
}

StreamedAsset::StreamedAsset(const std::string& path, const Options& options)
    : _path(path)
    , _levelsRead(1)
    , _normalsRead(0)
    , _levelCount(0)
    , _normalCount(0)
{
    try {
        std::ifstream stream = openTlodFile(path);
        TlodContainerReader file(stream);
        _checksum = file.checksum();
        auto reader = std::make_unique<TlodAssetReader>(file);
        _loaded = std::make_shared<LodAsset>(std::move(reader->frame()));
        _reader = std::move(reader);
        if (!options.normals) { _loaded->normals = NormalTexture(); }
        _loaded->validateFrame();
        _loaded->validateLevel(0);
        _asset = _loaded;
        _levelCount = static_cast<unsigned>(_loaded->levels.size());
        _normalCount = static_cast<unsigned>(_loaded->normals.levels.size());
        const bool isSmall = file.fileBytes() <= options.wholeBytes;
        readFrom(file, isSmall ? _levelCount.load() : _loaded->levelsUpTo(kLeastFactor), isSmall ? _normalCount.load() : 0);
    } catch (const AssetError& error) {
        throw AssetError(path + ": " + error.what());
    } catch (const std::bad_alloc&) {
        throw AssetError(path + ": not enough memory");
    }
}

StreamedAsset::~StreamedAsset() = default;

bool StreamedAsset::hasParameters(std::size_t level) const
{
    return _reader != nullptr ? _reader->hasParameters(level) : !_asset->levels[level].parameters.empty();
}

std::shared_ptr<const LodAsset> StreamedAsset::whole() const
{
    const auto levels = static_cast<unsigned>(_asset->levels.size());
    const auto normals = static_cast<unsigned>(_asset->normals.levels.size());
    read(levels, normals);
    if (levelsRead() < levels || normalsRead() < normals) {
        const std::lock_guard<std::mutex> lock(_mutex);
        throw AssetError(_fault);
    }
    return _asset;
}

void StreamedAsset::read(unsigned levels, unsigned normals) const
{
    if (levelsRead() >= levels && normalsRead() >= normals) { return; }
    const std::lock_guard<std::mutex> lock(_mutex);
    if (_levelsRead >= std::min<unsigned>(levels, _levelCount) && _normalsRead >= std::min<unsigned>(normals, _normalCount)) {
        return;
    }
    try {
        std::ifstream stream = openTlodFile(_path);
        TlodContainerReader file(stream);
        if (file.checksum() != _checksum) { throw AssetError("has changed since it was opened"); }
        readFrom(file, levels, normals);
    } catch (const AssetError& error) {
        giveUp(error.what());
    } catch (const std::bad_alloc&) {
        giveUp("not enough memory");
    }
}

void StreamedAsset::readFrom(TlodContainerReader& file, unsigned levels, unsigned normals) const
{
    for (unsigned level = _levelsRead; level < std::min<unsigned>(levels, _levelCount); ++level) {
        _reader->readLevel(file, level, *_loaded);
        _loaded->validateLevel(level);
        _levelsRead.store(level + 1, std::memory_order_release);
    }
    for (unsigned level = _normalsRead; level < std::min<unsigned>(normals, _normalCount); ++level) {
        _reader->readNormals(file, level, *_loaded);
        _loaded->validateNormals(level);
        _normalsRead.store(level + 1, std::memory_order_release);
    }
}

/// The asset ends where reading did.
void StreamedAsset::giveUp(const std::string& fault) const
{
    _fault = _path + ": " + fault;
    _isFaultTaken = false;
    _levelCount = _levelsRead.load();
    _normalCount = _normalsRead.load();
}

void StreamedAsset::readAhead(unsigned levels, unsigned normals) const
{
    if (levelsRead() >= std::min(levels, levelCount()) && normalsRead() >= std::min(normals, normalCount())) { return; }
    const std::lock_guard<std::mutex> lock(_aheadMutex);
    if (_ahead.valid() && _ahead.wait_for(std::chrono::seconds(0)) != std::future_status::ready) { return; }
    const unsigned nextLevels = std::min(levels, levelsRead() + 1);
    const unsigned nextNormals = std::min(normals, normalsRead() + 1);
    try {
        _ahead = std::async(std::launch::async, [this, nextLevels, nextNormals] { read(nextLevels, nextNormals); });
    } catch (const std::system_error&) { // no thread to be had
        read(nextLevels, nextNormals);
    }
}

std::string StreamedAsset::takeFault() const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    return std::exchange(_isFaultTaken, true) ? std::string() : _fault;
}

} // namespace osgTessLOD
