// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/RecordPool.h>

#include <algorithm>
#include <utility>

namespace osgTessLOD {

namespace {

/// More than are in use at once by a frame's cameras while the last frame is still drawn, mostly.
constexpr std::size_t kMostKept = 16;

} // namespace

RecordPool::RecordPool()
    : _store(std::make_shared<Store>())
{
}

std::shared_ptr<PatchRecord[]> RecordPool::acquire(std::size_t count)
{
    Buffer buffer;
    {
        const std::lock_guard<std::mutex> lock(_store->mutex);
        const auto found = std::find_if(_store->free.begin(), _store->free.end(),
                                        [&](const Buffer& b) { return b.capacity >= count; });
        if (found != _store->free.end()) {
            buffer = std::move(*found);
            _store->free.erase(found);
        } else if (!_store->free.empty()) {
            _store->free.pop_back(); // too small: the larger one that is made takes its place
        }
    }
    if (buffer.records == nullptr) {
        buffer.capacity = count + count / 4; // the next one may need a little more
        buffer.records.reset(new PatchRecord[buffer.capacity]);
    }
    PatchRecord* const records = buffer.records.release();
    const std::size_t capacity = buffer.capacity;
    return {records, [store = _store, capacity](PatchRecord* released) {
                Buffer back{std::unique_ptr<PatchRecord[]>(released), capacity};
                const std::lock_guard<std::mutex> lock(store->mutex);
                if (store->free.size() < kMostKept) { store->free.push_back(std::move(back)); }
            }};
}

} // namespace osgTessLOD
