// SPDX-License-Identifier: MIT
// What the rays of elevations meet.
#pragma once

#include <osgTessLOD/bake/ElevationMap.h>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// How many of these source triangles, whichever way they face, a ray of a patch meets within its reach. One that passes within rounding
/// of an edge may meet both of its triangles or neither: these count as one.
inline std::size_t rayHits(const ElevationMap& map, std::uint32_t patch, const std::vector<std::uint32_t>& triangles,
                           const Eigen::Vector3d& barycentric)
{
    constexpr double kNearEdge = 1e-9;
    const Eigen::Vector3d start = map.prism(patch).pointAt(barycentric);
    const Eigen::Vector3d ray = map.prism(patch).rayAt(barycentric);
    std::size_t inside = 0;
    std::size_t nearEdge = 0;
    for (const std::uint32_t t : triangles) {
        std::array<Eigen::Vector3d, 3> at;
        for (std::size_t k = 0; k < 3; ++k) { at[k] = map.source().positions[map.source().triangles[t][k]] - start; }
        const Eigen::Vector3d volumes(ray.dot(at[1].cross(at[2])), ray.dot(at[2].cross(at[0])),
                                      ray.dot(at[0].cross(at[1])));
        const Eigen::Vector3d weights = volumes / volumes.sum();
        const double height =
            (weights[0] * at[0] + weights[1] * at[1] + weights[2] * at[2]).dot(ray) / ray.squaredNorm();
        if (height < map.reach(patch)[0] - kNearEdge || height > map.reach(patch)[1] + kNearEdge) { continue; }
        const double least = weights.minCoeff();
        if (std::fabs(least) < kNearEdge) {
            ++nearEdge;
        } else if (least > 0.0) {
            ++inside;
        }
    }
    return inside + (nearEdge > 0 ? 1 : 0);
}

} // namespace osgTessLOD::bake
