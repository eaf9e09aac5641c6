// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

// Normals of a coarse mesh's vertices, along which scalar displacement goes. Private to the bake room.

/// What a triangle a, b, c adds to the normal of its corner a: its unit normal times its angle there; zero without an area.
Eigen::Vector3d angleWeightedNormal(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);

/// Angle-weighted means of the faces around each vertex, unit; zero where they cancel out or there are none.
std::vector<Eigen::Vector3d> vertexNormals(const std::vector<Eigen::Vector3d>& positions,
                                           const std::vector<std::array<std::uint32_t, 3>>& triangles);

} // namespace osgTessLOD::bake
