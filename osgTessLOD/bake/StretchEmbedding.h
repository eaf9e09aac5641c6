// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// A piece of surface with the topology of a disc that is to be laid into the plane.
struct DiscMesh {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise
    std::vector<char> isFixed;                            ///< border vertices
};

/// Moves the free vertices of a planar embedding so that the map from plane to surface stretches evenly: mean value
/// coordinates (Floater 2003), whose weights are then divided by the stretch at each neighbour, again and again, while
/// that lowers the stretch energy (Yoshizawa, Belyaev, Seidel 2004). Curved parts count as larger than they are. All weights are positive and the border is convex,
/// so every triangle stays positively oriented (Tutte 1963); a result of which rounding made that untrue is not taken.
/// `plane` holds the fixed vertices' positions, and receives the others'. False, with `plane` as it was, if rounding spoilt every result.
bool embedEvenly(const DiscMesh& mesh, std::vector<Eigen::Vector2d>& plane);

} // namespace osgTessLOD::bake
