// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/SurfaceDistance.h>
#include <support/ScreenCamera.h>

#include <Eigen/Core>
#include <osg/Vec3d>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace osgTessLOD::benchmarks {

/// How far points of one surface are from another one, pixels.
struct Deviations {
    double largest = 0.0;         ///< on screen
    double largestPromised = 0.0; ///< on screen, of points that something is promised of
    double largestInSpace = 0.0; ///< distance in space, as large as it would be on screen if it were seen from the side
    double sumOfSquares = 0.0;   ///< of the distances on screen to the points that are nearest in space
    std::uint64_t points = 0;    ///< in view
    std::uint64_t promised = 0;  ///< of them

    void add(const Deviations& other);
    double rms() const;
};

/// Measures how far surfaces that should be the same are apart as a camera sees them.
///
/// A point p that is in view is compared with points q of the other surface: with the one nearest in space, and with those
/// that are found, from there and from up to four times as far before and behind it along the line of sight through p, by turns as the nearest to
/// that line and the nearest to that one again. What
/// counts is the least distance of p and any q on screen. Every q is a point of the surface, so p is never nearer to what it
/// is compared with than this says, and all are found near p, not wherever the surface passes behind or before it.
class ScreenRuler {
public:
    /// `camera`: a perspective one that sees the surfaces' space.
    explicit ScreenRuler(const ScreenCamera& camera);

    /// Of a point and the surface's point that is nearest in space.
    struct Deviation {
        double pixels = 0.0;
        double pixelsInSpace = 0.0;
        bake::SurfaceDistance::Nearest nearest;
    };
    /// Nothing where the point is not in view.
    std::optional<Deviation> measure(const Eigen::Vector3d& point, const bake::SurfaceDistance& surface) const;
    /// The least distance on screen of the point and any that it is compared with, or one that is at most `enough`; `first`: what
    /// measure() found.
    double leastPixels(const Eigen::Vector3d& point, const Deviation& first, const bake::SurfaceDistance& surface,
                       double enough) const;

    bool isInView(const Eigen::Vector3d& point) const;

private:
    osg::Matrixd _localToClip;
    osg::Vec3d _eye;
    double _width;
    double _height;
    double _pixelScale; ///< of a length at right angles to the axis, at depth 1

    std::optional<Eigen::Vector2d> onScreen(const Eigen::Vector3d& point) const;
    double pixelsBetween(const Eigen::Vector3d& inView, const Eigen::Vector3d& other) const;
    double diagonal() const;
};

} // namespace osgTessLOD::benchmarks
