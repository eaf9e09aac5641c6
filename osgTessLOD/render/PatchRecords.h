// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace osgTessLOD {

/// One visible patch as the vertex shader receives it: 16 bytes.
struct PatchRecord {
    std::uint32_t patch;
    std::array<float, 3> edgeLevels; ///< continuous level of sides 0, 1, 2; the patch's own is their largest
};

/// Records that do not change any more; copies share them.
class PatchRecords {
public:
    PatchRecords() = default;
    /// The first `size` of them.
    PatchRecords(std::shared_ptr<const PatchRecord[]> records, std::size_t size)
        : _records(std::move(records))
        , _size(size)
    {
    }
    PatchRecords(std::vector<PatchRecord> records) // NOLINT: as good as a vector of them
        : _size(records.size())
    {
        const auto kept = std::make_shared<const std::vector<PatchRecord>>(std::move(records));
        _records = std::shared_ptr<const PatchRecord[]>(kept, kept->data());
    }

    std::size_t size() const { return _size; }
    bool empty() const { return _size == 0; }
    const PatchRecord* data() const { return _records.get(); }
    const PatchRecord* begin() const { return _records.get(); }
    const PatchRecord* end() const { return _records.get() + _size; }
    const PatchRecord& operator[](std::size_t k) const { return _records[k]; }
    const PatchRecord& front() const { return _records[0]; }
    const PatchRecord& back() const { return _records[_size - 1]; }
    /// A copy to change.
    std::vector<PatchRecord> vector() const { return {begin(), end()}; }

private:
    std::shared_ptr<const PatchRecord[]> _records;
    std::size_t _size = 0;
};

} // namespace osgTessLOD
