// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace osgTessLOD::bake {

// Triangles of a plane, private to the bake room.

/// Positive where a, b, c run counter-clockwise.
inline double twiceArea(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c)
{
    return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Weights of a, b, c that give p; not finite where the triangle has no area.
inline Eigen::Vector3d weightsOf(const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                 const Eigen::Vector2d& c)
{
    const double total = twiceArea(a, b, c);
    return {twiceArea(p, b, c) / total, twiceArea(a, p, c) / total, twiceArea(a, b, p) / total};
}

} // namespace osgTessLOD::bake
