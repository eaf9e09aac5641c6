// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/LevelHierarchy.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Directions within an angle of an axis.
struct NormalCone {
    Eigen::Vector3d axis = Eigen::Vector3d::UnitZ(); ///< unit
    double cosine = -1.0;                            ///< of the angle; −1: all directions
};

/// Contains the normal of every triangle that is ever drawn of a patch: of its levels, of its morphs, and with borders
/// that stay behind, at whatever levels. Larger than need be where borders stay far behind. All directions if more than a
/// half space is needed.
OSGTESSLOD_EXPORT NormalCone coneOfDrawnNormals(const PatchLevels& levels, const std::vector<std::uint16_t>& ladder,
                                                const FinestLevels& finest);

} // namespace osgTessLOD::bake
