// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/bake/PatchTopology.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The levels of one patch: what every technique makes of its charts. Index 0 is the coarsest.
struct PatchLevels {
    /// Positions of the pattern's vertices in index order, working frame; bit-identical where patches meet.
    std::vector<std::vector<Eigen::Vector3d>> positions;
    /// Each vertex's parent in the level below; empty for level 0.
    std::vector<std::vector<std::uint32_t>> parents;
    /// Where each vertex lies in the chart; a level's is empty when its vertices lie where the pattern has them.
    std::vector<std::vector<ChartPoint>> parameters;

    bool hasParameters(std::size_t level) const { return level < parameters.size() && !parameters[level].empty(); }
};

/// The levels of all patches.
struct LevelHierarchy {
    std::vector<std::uint16_t> ladder; ///< factors, rising
    std::vector<PatchLevels> patches;
};

/// How fine a patch and its borders, side 0, 1, 2, are ever drawn: indices into the ladder. A border that its other patch
/// ends before this one stays behind, at that patch's finest level.
struct FinestLevels {
    std::uint8_t patch = 0;
    std::array<std::uint8_t, 3> borders{};

    /// Nothing ends before `level`.
    static FinestLevels all(std::size_t level)
    {
        const auto finest = static_cast<std::uint8_t>(level);
        return {finest, {finest, finest, finest}};
    }
};

/// Parents of factor 2, whose positions are `factorTwo`, in the single triangle: a border's middle goes to the first base
/// vertex of its edge, the centre to the nearest corner.
OSGTESSLOD_EXPORT std::vector<std::uint32_t> parentsInTriangle(const PatchTopology& topology, std::uint32_t patch,
                                                               const std::vector<Eigen::Vector3d>& factorTwo);

} // namespace osgTessLOD::bake
