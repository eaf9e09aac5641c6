// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Progress.h>

namespace osgTessLOD::bake {

/// Measures each chart's chartError: the larger of the distances from the source vertices that map to the patch to its
/// chart, and from the chart's triangles (sampled at their centroids and edge midpoints) to the source. The first
/// is an upper bound, as only the patch's own chart is searched.
OSGTESSLOD_EXPORT void measureChartErrors(const ControlMesh& mesh, ChartSet& set, Progress& progress);

} // namespace osgTessLOD::bake
