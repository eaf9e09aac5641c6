// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseHistory.h>

#include <Eigen/Core>
#include <array>

namespace osgTessLOD::bake {

/// The faces around a vertex v that is to collapse into ring[0], in three dimensions.
struct Star {
    unsigned ringSize = 0;
    unsigned gap = CollapseHistory::Step::kNoGap;       ///< sector without a face (v on a boundary)
    unsigned crease = 0;                                ///< ring index of the other end of a crease through v and ring[0]; 0: none
    Eigen::Vector3d center;
    std::array<Eigen::Vector3d, CollapseHistory::kMaxRing> ring;
};

/// Lays the star into the plane (fills ring, center, ringSize and gap of `step`) so that its faces and those of the
/// star after the collapse are all positively oriented: geodesic polar coordinates where they are good enough, else
/// moved towards a convex polygon until they are, which always succeeds. A boundary or crease through v becomes a
/// straight line through it, so that it maps onto the edge it collapses to.
void flattenStar(const Star& star, CollapseHistory::Step& step);

} // namespace osgTessLOD::bake
