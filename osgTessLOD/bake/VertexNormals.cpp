// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/VertexNormals.h>

#include <Eigen/Geometry>

#include <cmath>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

Vector3d angleWeightedNormal(const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
    const Vector3d ab = b - a;
    const Vector3d ac = c - a;
    const Vector3d normal = ab.cross(ac);
    const double twiceArea = normal.norm();
    if (!(twiceArea > 0.0)) { return Vector3d::Zero(); }
    return std::atan2(twiceArea, ab.dot(ac)) / twiceArea * normal;
}

std::vector<Vector3d> vertexNormals(const std::vector<Vector3d>& positions,
                                    const std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    std::vector<Vector3d> normals(positions.size(), Vector3d::Zero());
    for (const auto& t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            normals[t[k]] += angleWeightedNormal(positions[t[k]], positions[t[(k + 1) % 3]], positions[t[(k + 2) % 3]]);
        }
    }
    for (Vector3d& normal : normals) {
        const double length = normal.norm();
        if (length > 0.0) { normal /= length; }
    }
    return normals;
}

} // namespace osgTessLOD::bake
