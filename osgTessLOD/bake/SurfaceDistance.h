// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

/// Distances from points to a triangle surface (Embree).
class OSGTESSLOD_EXPORT SurfaceDistance {
public:
    /// Positions are kept in single precision relative to their bounding box's centre: distances are good to about 1e-7
    /// of the surface's size.
    SurfaceDistance(const std::vector<Eigen::Vector3d>& positions,
                    const std::vector<std::array<std::uint32_t, 3>>& triangles);
    ~SurfaceDistance();
    SurfaceDistance(SurfaceDistance&&) noexcept;
    SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

    /// Distance from `point` to the nearest point of the surface. Thread safe.
    double distance(const Eigen::Vector3d& point) const;

    /// The same where it is more than `enough`, else any number from the distance to `enough`; `most` is no less than the
    /// distance. The search ends at the first triangle that is near enough. Thread safe.
    double distanceBeyond(const Eigen::Vector3d& point, double enough, double most) const;
    /// The same for points in a row. `triangle` is tried first: that of the former point, 0 for the first; becomes that of this one. The
    /// surface is not empty.
    double distanceBeyond(const Eigen::Vector3d& point, double enough, double most, std::uint32_t& triangle) const;

    /// A point of the surface.
    struct Nearest {
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        double distance =
            0.0; ///< from where it was looked for; infinite, and the rest means nothing, without triangles
        std::uint32_t triangle = 0; ///< that it lies on
    };
    /// The point of the surface that is nearest to `point`. Thread safe.
    Nearest nearest(const Eigen::Vector3d& point) const;

private:
    struct Scene;
    std::unique_ptr<Scene> _scene;
};

/// Sampled two-sided Hausdorff distance between two surfaces.
struct HausdorffDistance {
    double forward = 0.0;  ///< largest distance from a sample of the first to the second
    double backward = 0.0; ///< from a sample of the second to the first
    double symmetric() const { return forward > backward ? forward : backward; }
};

/// A triangle surface by reference.
struct SurfaceView {
    const std::vector<Eigen::Vector3d>& positions;
    const std::vector<std::array<std::uint32_t, 3>>& triangles;
};

/// Samples both surfaces at their vertices, edge midpoints and face centroids. Parallel (TBB), deterministic.
OSGTESSLOD_EXPORT HausdorffDistance hausdorffDistance(const SurfaceView& first, const SurfaceView& second);

} // namespace osgTessLOD::bake
