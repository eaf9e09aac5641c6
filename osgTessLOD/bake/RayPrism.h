// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace osgTessLOD::bake {

/// A point by the ray that it is on: of the triangle's point with these weights (sum 1, negative beyond its sides), so many
/// times the ray's direction up.
struct PrismPoint {
    Eigen::Vector3d barycentric;
    double height = 0.0;
};

/// A triangle with normals at its corners, and the rays from its points along the linear interpolation of these: the surface
/// point of a ray is pointAt(b) + height · rayAt(b). Side k joins corners k and k + 1 (mod 3); the rays of a side make up a ruled surface, which
/// depends on the side's two corners alone, so two triangles that share them meet there.
struct OSGTESSLOD_EXPORT RayPrism {
    std::array<Eigen::Vector3d, 3> positions;
    std::array<Eigen::Vector3d, 3> normals;

    /// Where a straight line crosses the rays of a side.
    struct Crossing {
        double along; ///< the line: 0 at its origin, 1 at origin + direction
        double share; ///< of the side: 0 at corner k
        double height;
    };

    Eigen::Vector3d pointAt(const Eigen::Vector3d& barycentric) const;
    /// Of no particular length.
    Eigen::Vector3d rayAt(const Eigen::Vector3d& barycentric) const;
    Eigen::Vector3d at(const PrismPoint& point) const
    {
        return pointAt(point.barycentric) + point.height * rayAt(point.barycentric);
    }

    /// The least, over all rays and heights from `low` to `high`, by which the triangle of the points of one height faces the ray,
    /// times its area over the area at height 0: positive where rays neither meet each other nor run along the triangle.
    double opening(double low, double high) const;

    /// The ray through `point` that continues `guess`, by Newton's method; none where it does not converge.
    std::optional<PrismPoint> locate(const Eigen::Vector3d& point, const PrismPoint& guess) const;

    /// How weights and height change along `direction` at a point.
    PrismPoint derivative(const PrismPoint& at, const Eigen::Vector3d& direction) const;

    /// Appends all crossings of a line with side `side`, whose share is in 0 … 1 up to rounding.
    void crossings(unsigned side, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                   std::vector<Crossing>& found) const;

    /// Does any ray of the straight segment from `first` to `last` (weights) meet origin + t · direction with t in
    /// `from` … `to`?
    bool meets(const Eigen::Vector3d& first, const Eigen::Vector3d& last, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& direction, double from, double to) const;
};

} // namespace osgTessLOD::bake
