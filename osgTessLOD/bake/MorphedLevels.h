// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/bake/LevelHierarchy.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// A patch as it is drawn: the pattern of one level with its vertices on their way to their parents.
struct MorphedPatch {
    std::vector<Eigen::Vector3d> positions;
    std::vector<ChartPoint> points; ///< where the vertices are in the chart: on the way between the two places, too
};

/// What render/MorphedSurface and shaders/tesslod_surface.glsl draw of a patch at these continuous levels, in double
/// precision: the pattern of level ⌈patchLevel⌉ with the borders of sides 0, 1, 2 at `borderLevels` ≤ patchLevel. `places`
/// has the pattern's vertices for levels without parameters of their own.
OSGTESSLOD_EXPORT MorphedPatch morphPatch(const PatchLevels& levels, const std::vector<std::uint16_t>& ladder,
                                          const std::vector<std::vector<ChartPoint>>& places, double patchLevel,
                                          const std::array<double, 3>& borderLevels);

} // namespace osgTessLOD::bake
