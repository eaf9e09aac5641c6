// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>

namespace osgTessLOD::bake {

/// Puts the levels on the lattice, chooses which of them to store (chooseFinestLevels, with a tolerance in units of the
/// working frame), measures each one's error against its chart as it was stored (quantization included) plus chartError,
/// copies the parameters, and fills in topology, bounds and normal cones. Normals and names are the caller's.
OSGTESSLOD_EXPORT LodAsset assembleAsset(const PatchMap& map, const ChartSet& charts, const LevelHierarchy& hierarchy,
                                         double tolerance, Progress& progress);

} // namespace osgTessLOD::bake
