// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Measures each chart's chartError: the larger of the distances from the source vertices that map to the patch to its
/// chart, and from the chart's triangles (sampled at their centroids and edge midpoints) to the source. The first
/// is an upper bound, as only the patch's own chart is searched.
/// `patchOf` tells the patch of each source vertex.
OSGTESSLOD_EXPORT void measureChartErrors(const SourceMesh& source, const std::vector<std::uint32_t>& patchOf,
                                          ChartSet& set, Progress& progress);

} // namespace osgTessLOD::bake
