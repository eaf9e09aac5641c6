// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/VertexPlacement.h>

namespace osgTessLOD::bake {

// Placements that do not look at the parametrization, for comparison (Lambert §4.8.3). Stars must not be of Kind::Corner.

/// Least squared distance from the star's planes, weighted by area, on the contracted edge; a border's end stays.
Placement placeByQuadric(const CollapseStar& star);
/// What it minimizes, per star.
double quadricObjective(const CollapseStar& star, const Eigen::Vector3d& position);

/// Least squared volumes between the star and the merged vertex, keeping the volume; on open borders on the edge.
Placement placeByVolume(const CollapseStar& star);
/// What it minimizes, per star.
double volumeObjective(const CollapseStar& star, const Eigen::Vector3d& position);

} // namespace osgTessLOD::bake
