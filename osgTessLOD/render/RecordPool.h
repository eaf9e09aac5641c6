// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/PatchRecords.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <vector>

namespace osgTessLOD {

/// Memory for records that are made anew every frame: what was released serves again, so that no page of it has to be had from
/// the system. Thread-safe; may die before the records that came from it.
class RecordPool {
public:
    RecordPool();

    /// Room for `count` records, which have no values yet. Returns to the pool with the last reference.
    std::shared_ptr<PatchRecord[]> acquire(std::size_t count);

private:
    struct Buffer {
        std::unique_ptr<PatchRecord[]> records;
        std::size_t capacity = 0;
    };
    struct Store {
        std::mutex mutex;
        std::vector<Buffer> free;
    };

    std::shared_ptr<Store> _store;
};

} // namespace osgTessLOD
