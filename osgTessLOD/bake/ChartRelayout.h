// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/StripMesh.h>

#include <cstdint>

namespace osgTessLOD::bake {

/// Point of a chart at a parameter.
OSGTESSLOD_EXPORT Eigen::Vector3d chartPosition(const TessellationPattern& pattern, const PatchChart& chart,
                                                ChartPoint parameter);

/// Are all of a patch's triangles positive in the chart?
OSGTESSLOD_EXPORT bool isLaidOut(const StripMesh& mesh, std::uint32_t patch);

/// Lays out the interior vertices of a patch anew so that all of its triangles are positive in the chart, and moves them by
/// as much as the chart's surface does under them: for a patch some of whose triangles are turned over, which may be between
/// patterns but must not have collapsed triangles. Border vertices stay; they must lie in order on their borders.
/// Where the layout was sound it hardly changes: there vertices keep their mean value weights, elsewhere all neighbours
/// weigh the same. Throws std::runtime_error if that is too fine for the lattice of chart points.
OSGTESSLOD_EXPORT void relayout(StripMesh& mesh, std::uint32_t patch, const TessellationPattern& chartPattern,
                                const PatchChart& chart);

} // namespace osgTessLOD::bake
