// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/PatchTopology.h>
#include <osgTessLOD/bake/Progress.h>

namespace osgTessLOD::bake {

/// Gives the vertices of `asset`, as assembleAsset made it of the same charts and levels, the texture coordinates and colours
/// that the charts have where the vertices lie, linear on the charts' triangles, and measures how far the texture coordinates
/// of each level, as stored, are from the charts'. On a border that is no seam both patches get the same. Without effect for
/// charts that have neither. Parallel over patches; the result does not depend on the number of threads.
OSGTESSLOD_EXPORT void addAttributes(const PatchTopology& topology, const ChartSet& charts, const LevelHierarchy& hierarchy,
                                     LodAsset& asset, Progress& progress);

} // namespace osgTessLOD::bake
