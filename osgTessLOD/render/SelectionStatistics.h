// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// What one selection chose.
struct OSGTESSLOD_EXPORT SelectionStatistics {
    std::uint64_t patches = 0; ///< drawn
    std::uint64_t culledPatches = 0;
    std::uint64_t saturatedPatches = 0;        ///< drawn at their finest level, not enough for the error asked
    std::uint64_t triangles = 0;               ///< that the tessellator emits
    std::vector<std::uint64_t> patchesByLevel; ///< drawn patches per ladder entry
    /// Selected by the control shader, which does not tell: patches are all of them, each at the finest level that it may be
    /// drawn with, triangles those of these; none counts as culled or saturated.
    bool isUpperBound = false;

    void add(const SelectionStatistics& other);
};

} // namespace osgTessLOD
