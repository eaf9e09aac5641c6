// SPDX-License-Identifier: MIT
#include "CameraPaths.h"

#include <Eigen/Geometry>
#include <osg/Math>
#include <osg/Quat>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

using Eigen::Vector3d;

constexpr double kFovDegrees = 30.0; ///< from bottom to top
constexpr double kOrbitDiagonals = 2.0;
constexpr double kFarthestDiagonals = 1000.0;
constexpr double kNearestDiagonals = 0.02;
constexpr double kGrazingDiagonals = 0.005;
constexpr double kWalkDiagonals = 0.01;

/// The surface and what of it paths are laid out by.
struct Ground {
    const Triangles& surface;
    bake::SurfaceDistance distance;
    Eigen::AlignedBox3d box;
    double diagonal = 0.0;

    explicit Ground(const Triangles& triangles)
        : surface(triangles)
        , distance(triangles.positions, triangles.triangles)
    {
        for (const Vector3d& p : surface.positions) { box.extend(p); }
        diagonal = box.diagonal().norm();
    }
    bool isFlat() const { return 2.0 * box.sizes().z() < std::min(box.sizes().x(), box.sizes().y()); }
};

osg::Vec3d toOsg(const Vector3d& p)
{
    return {p.x(), p.y(), p.z()};
}

/// Looks from `eye` at `target`. `nearest`: distance from the eye to what is nearest, `farthest`: to the end of what may be seen.
ScreenCamera cameraAt(const Vector3d& eye, const Vector3d& target, const Vector3d& up, double nearest, double farthest,
                      const PathOptions& options)
{
    constexpr double kNear = 0.5; // corners of the near plane are farther than its middle
    ScreenCamera camera;
    camera.width = options.width;
    camera.height = options.height;
    camera.localToEye = osg::Matrixd::lookAt(toOsg(eye), toOsg(target), toOsg(up));
    camera.projection.makePerspective(kFovDegrees, camera.width / camera.height, kNear * nearest, farthest);
    return camera;
}

ScreenCamera cameraAt(const Vector3d& eye, const Vector3d& target, const Vector3d& up, const Ground& ground,
                      const PathOptions& options)
{
    return cameraAt(eye, target, up, ground.distance.distance(eye), eye.norm() + ground.diagonal, options);
}

std::vector<ScreenCamera> orbit(const Ground& ground, const PathOptions& options)
{
    const Vector3d side(0.6, -0.8, 0.0);
    const Vector3d top(0.4, 0.3, std::sqrt(0.75)); // 60° above
    std::vector<ScreenCamera> cameras;
    for (unsigned k = 0; k < options.frames; ++k) {
        const double turn = 2.0 * osg::PI * (k + 0.25) / options.frames;
        const Vector3d eye = kOrbitDiagonals * ground.diagonal * (side * std::cos(turn) + top * std::sin(turn));
        cameras.push_back(cameraAt(eye, Vector3d::Zero(), side.cross(top), ground, options));
    }
    return cameras;
}

/// The point of the surface that goes farthest in a direction, of those about its middle as seen from there.
Vector3d topTowards(const Ground& ground, const Vector3d& direction)
{
    constexpr double kAboutMiddle = 0.05; // of the diagonal
    const auto height = [&](const Vector3d& p) {
        const bool isAbout = (p - direction * direction.dot(p)).norm() < kAboutMiddle * ground.diagonal;
        return direction.dot(p) - (isAbout ? 0.0 : ground.diagonal);
    };
    const auto& positions = ground.surface.positions;
    return *std::max_element(positions.begin(), positions.end(),
                             [&](const Vector3d& p, const Vector3d& q) { return height(p) < height(q); });
}

std::vector<ScreenCamera> flyIn(const Ground& ground, const PathOptions& options)
{
    const Vector3d direction = Vector3d(0.3, -0.5, 0.8).normalized();
    const Vector3d target = topTowards(ground, direction);
    const Vector3d across = direction.cross(Vector3d::UnitZ()).normalized();
    std::vector<ScreenCamera> cameras;
    const unsigned steps = std::max(options.frames, 2U) - 1;
    for (unsigned k = 0; k < steps; ++k) {
        const double progress = steps == 1 ? 0.0 : static_cast<double>(k) / (steps - 1);
        const double distance = kFarthestDiagonals * std::pow(kNearestDiagonals / kFarthestDiagonals, progress);
        cameras.push_back(cameraAt(target + distance * ground.diagonal * direction, target, across, ground, options));
    }
    const Vector3d eye = target + kGrazingDiagonals * ground.diagonal * direction;
    cameras.push_back(cameraAt(eye, eye + across, direction, ground, options));
    return cameras;
}

/// How far the surface goes in the direction `up` about the line of points that differ from `base` along it alone.
double heightAt(const Ground& ground, const Vector3d& base, const Vector3d& up)
{
    constexpr double kAbout = 0.01; // of the diagonal
    double highest = -ground.diagonal;
    for (const Vector3d& p : ground.surface.positions) {
        const Vector3d q = p - base;
        const double height = up.dot(q);
        if (height > highest && (q - up * height).norm() < kAbout * ground.diagonal) { highest = height; }
    }
    return highest;
}

std::vector<ScreenCamera> walk(const Ground& ground, const PathOptions& options)
{
    std::vector<ScreenCamera> cameras;
    for (unsigned k = 0; k < options.frames; ++k) {
        const double progress = (k + 0.5) / options.frames;
        Vector3d base = Vector3d::Zero();
        Vector3d up = Vector3d::UnitZ();
        Vector3d ahead = Vector3d(0.8, 0.6, 0.0);
        if (ground.isFlat()) {
            const Vector3d half = 0.5 * ground.box.sizes();
            base = (0.9 * progress - 0.45) * Vector3d(2.0 * half.x(), half.y(), 0.0);
        } else {
            const double turn = 2.0 * osg::PI * progress;
            up = Vector3d(std::cos(turn), 0.3 * std::sin(turn), std::sin(turn)).normalized();
            ahead = Vector3d(-std::sin(turn), 0.3 * std::cos(turn), std::cos(turn));
            ahead = (ahead - up * up.dot(ahead)).normalized();
        }
        const Vector3d eye = base + (heightAt(ground, base, up) + kWalkDiagonals * ground.diagonal) * up;
        cameras.push_back(cameraAt(eye, eye + ahead - 0.15 * up, up, ground, options));
    }
    return cameras;
}

/// A diagonal apart, each turned about its middle, any orientation alike.
std::vector<osg::Matrixd> fieldOf(double diagonal, unsigned side)
{
    std::mt19937 random(1);
    std::normal_distribution<double> normal;
    std::vector<osg::Matrixd> placements;
    for (unsigned k = 0; k < side * side; ++k) {
        osg::Quat turn;
        for (int axis = 0; axis < 4; ++axis) { turn[axis] = normal(random); }
        const osg::Vec3d place(k % side - 0.5 * (side - 1), k / side - 0.5 * (side - 1), 0.0);
        placements.push_back(osg::Matrixd::rotate(turn / turn.length()) * osg::Matrixd::translate(place * diagonal));
    }
    return placements;
}

/// From beside a corner of the square over its middle, nearer from frame to frame; a part of it is out of view.
std::vector<ScreenCamera> overField(double diagonal, const PathOptions& options)
{
    const double corner = (0.5 * options.side + 1.0) * diagonal;
    std::vector<ScreenCamera> cameras;
    for (unsigned k = 0; k < options.frames; ++k) {
        const double distance = corner * (1.0 - 0.5 * k / options.frames);
        const Vector3d eye(-distance, -distance, 5.0 * diagonal);
        cameras.push_back(cameraAt(eye, Vector3d::Zero(), Vector3d::UnitZ(), diagonal, 6.0 * corner, options));
    }
    return cameras;
}

} // namespace

const std::vector<std::string>& pathNames()
{
    static const std::vector<std::string> names{"orbit", "fly-in", "walk", "field"};
    return names;
}

CameraPath makePath(const std::string& name, const Triangles& surface, const PathOptions& options)
{
    const Ground ground(surface);
    const std::vector<osg::Matrixd> once{osg::Matrixd()};
    if (name == "orbit") { return {name, once, orbit(ground, options)}; }
    if (name == "fly-in") { return {name, once, flyIn(ground, options)}; }
    if (name == "walk") { return {name, once, walk(ground, options)}; }
    if (name == "field") { return {name, fieldOf(ground.diagonal, options.side), overField(ground.diagonal, options)}; }
    throw std::invalid_argument(name + ": no such path");
}

} // namespace osgTessLOD::benchmarks
