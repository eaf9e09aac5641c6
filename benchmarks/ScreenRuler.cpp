// SPDX-License-Identifier: MIT
#include "ScreenRuler.h"

#include <osg/Vec4d>

#include <algorithm>
#include <array>
#include <cmath>

namespace osgTessLOD::benchmarks {

namespace {

/// Points that are looked for beside the nearest in space. Each step goes at most as far along the line of sight as the last
/// point was away from it, so few are needed and none leads far away.
constexpr int kSteps = 6;
/// Where it begins, along the line of sight from where the nearest point in space is, in units of how far that is: errors that cannot be
/// seen, since they lie along it, may be several times those that can.
constexpr std::array<double, 7> kStarts{0.0, -1.0, 1.0, -2.0, 2.0, -4.0, 4.0};

osg::Vec3d toOsg(const Eigen::Vector3d& p)
{
    return {p.x(), p.y(), p.z()};
}

Eigen::Vector3d toEigen(const osg::Vec3d& p)
{
    return {p.x(), p.y(), p.z()};
}

/// The distance along the axis that perspective divides by.
double depthOf(const osg::Vec4d& clip)
{
    return clip.w();
}

} // namespace

void Deviations::add(const Deviations& other)
{
    largest = std::max(largest, other.largest);
    largestInSpace = std::max(largestInSpace, other.largestInSpace);
    largestPromised = std::max(largestPromised, other.largestPromised);
    sumOfSquares += other.sumOfSquares;
    points += other.points;
    promised += other.promised;
}

double Deviations::rms() const
{
    return points == 0 ? 0.0 : std::sqrt(sumOfSquares / static_cast<double>(points));
}

ScreenRuler::ScreenRuler(const ScreenCamera& camera)
    : _localToClip(camera.localToClip())
    , _eye(osg::Vec3d() * osg::Matrixd::inverse(camera.localToEye))
    , _width(camera.width)
    , _height(camera.height)
    , _pixelScale(0.5 * camera.height * camera.projection(1, 1))
{
}

std::optional<Eigen::Vector2d> ScreenRuler::onScreen(const Eigen::Vector3d& point) const
{
    const osg::Vec4d clip = osg::Vec4d(toOsg(point), 1.0) * _localToClip;
    if (!(depthOf(clip) > 0.0)) { return std::nullopt; }
    return Eigen::Vector2d(0.5 * _width * clip.x() / clip.w(), 0.5 * _height * clip.y() / clip.w());
}

bool ScreenRuler::isInView(const Eigen::Vector3d& point) const
{
    const osg::Vec4d clip = osg::Vec4d(toOsg(point), 1.0) * _localToClip;
    const double depth = depthOf(clip);
    return depth > 0.0 && std::fabs(clip.x()) <= depth && std::fabs(clip.y()) <= depth && std::fabs(clip.z()) <= depth;
}

double ScreenRuler::diagonal() const
{
    return std::hypot(_width, _height);
}

/// What is behind the eye counts as the picture's diagonal away, as does what is farther than that.
double ScreenRuler::pixelsBetween(const Eigen::Vector3d& inView, const Eigen::Vector3d& other) const
{
    const std::optional<Eigen::Vector2d> from = onScreen(inView);
    const std::optional<Eigen::Vector2d> to = onScreen(other);
    return from && to ? std::min((*to - *from).norm(), diagonal()) : diagonal();
}

std::optional<ScreenRuler::Deviation> ScreenRuler::measure(const Eigen::Vector3d& point,
                                                           const bake::SurfaceDistance& surface) const
{
    if (!isInView(point)) { return std::nullopt; }
    const bake::SurfaceDistance::Nearest nearest = surface.nearest(point);
    if (!std::isfinite(nearest.distance)) { return Deviation{diagonal(), diagonal(), nearest}; }
    const double depth = depthOf(osg::Vec4d(toOsg(point), 1.0) * _localToClip);
    return Deviation{pixelsBetween(point, nearest.point), std::min(nearest.distance * _pixelScale / depth, diagonal()),
                     nearest};
}

double ScreenRuler::leastPixels(const Eigen::Vector3d& point, const Deviation& first,
                                const bake::SurfaceDistance& surface, double enough) const
{
    double least = first.pixels;
    if (!std::isfinite(first.nearest.distance)) { return least; }
    const Eigen::Vector3d eye = toEigen(_eye);
    const Eigen::Vector3d sight = (point - eye).normalized();
    const double along = sight.dot(first.nearest.point - eye);
    for (const double multiple : kStarts) {
        double distance = along + multiple * first.nearest.distance;
        for (int step = 0; step < kSteps && least > enough; ++step) {
            const Eigen::Vector3d at = surface.nearest(eye + sight * distance).point;
            least = std::min(least, pixelsBetween(point, at));
            distance = sight.dot(at - eye);
        }
    }
    return least;
}

} // namespace osgTessLOD::benchmarks
