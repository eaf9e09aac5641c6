// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <Eigen/Core>
#include <vector>

namespace osgTessLOD::bake {

/// What symmetricHull may leave out sticks out of the hull of what it keeps by at most this part of the longest vector.
constexpr double kSymmetricHullTolerance = 1e-11;

/// The vertices of the convex hull of the vectors and their negatives, one of each pair, as given and in the order
/// given: the difference vectors that decide on E(d) = max |v × d| (Lambert §2.1). Vectors that are all parallel or
/// coplanar, equal or zero are fine; of zero vectors only, the hull is empty. Components must be finite, squares of
/// their ratios to the largest one may vanish. Now and then more vectors than needed are kept, never fewer.
OSGTESSLOD_EXPORT std::vector<Eigen::Vector3d> symmetricHull(const std::vector<Eigen::Vector3d>& vectors);

} // namespace osgTessLOD::bake
