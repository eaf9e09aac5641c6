// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseStar.h>

namespace osgTessLOD::bake {

/// Chart points at which the ends of a star may merge, as near as can be to one that is wanted.
/// Each function returns false if there is no such point; else `nearest` is one, exactly checked.

/// Within the star: Interior stars.
bool nearestInStar(const CollapseStar& star, const Eigen::Vector2d& wanted, ChartPoint& nearest);

/// On the border between the vertices `beside` the ends, or for BorderEdge on the contracted edge: the border kinds.
/// `wanted` is measured along side 0 in units.
bool nearestOnBorder(const CollapseStar& star, double wanted, ChartPoint& nearest);

} // namespace osgTessLOD::bake
