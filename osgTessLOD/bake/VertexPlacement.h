// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/CollapseStar.h>

#include <Eigen/Core>

namespace osgTessLOD::bake {

/// How the place of a merged vertex is chosen.
enum class PlacementMethod {
    VolumeUv,     ///< volumes in the spaces (u, v, x), (u, v, y) and (u, v, z) (Lambert §4.5)
    Quadric,      ///< distances from the star's planes, on the contracted edge (Garland & Heckbert 1997), memoryless
    LindstromTurk ///< volumes in space (Lindstrom & Turk 1998); parameters by Shepard interpolation
};

/// Where the ends of an edge merge.
struct Placement {
    bool isValid = false; ///< false: nowhere in the chart without turning a triangle over
    Eigen::Vector3d position;
    ChartPoint parameter; ///< of part 0
    /// What the method minimizes, at the place found, without regularization: comparable between edges. For VolumeUv
    /// the objective f of eq. 4.3 for parameters from 0 to 1 and positions as they are.
    double residual = 0.0;
};

/// The best place on the lattice of chart points that turns no triangle over: the method's optimum where that is one,
/// else the nearest to it on the way from a place that is.
OSGTESSLOD_EXPORT Placement placeVertex(const CollapseStar& star, PlacementMethod method);

/// The volume objective f of eq. 4.3 with the ends merged at a place.
OSGTESSLOD_EXPORT double volumeUvObjective(const CollapseStar& star, const Eigen::Vector3d& position,
                                           ChartPoint parameter);

} // namespace osgTessLOD::bake
