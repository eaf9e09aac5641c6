// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Progress.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The `uniform` technique, the baseline: what plain hardware tessellation of a mip-mapped displacement map draws. The
/// finest level takes the chart's positions at the pattern's vertices; each coarser one the next finer one's
/// displacements from the flat patch, filtered over the neighbouring vertices (along the border only for border
/// vertices, so that both sides agree). Vertices merge as the tessellator's own fractional transition has them.
/// `ladder` holds rising powers of two from 1.
OSGTESSLOD_EXPORT LevelHierarchy makeUniformLevels(const PatchTopology& topology, const ChartSet& charts,
                                                   const std::vector<std::uint16_t>& ladder, Progress& progress);

} // namespace osgTessLOD::bake
