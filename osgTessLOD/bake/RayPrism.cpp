// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/RayPrism.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

/// Of what lines and sides are multiplied to: the line runs along the rays of the side.
constexpr double kParallel = 1e-11;
/// Crossings this far beyond a side's ends still count: the neighbour over the corner has them, too.
constexpr double kRounding = 1e-9;

/// Real roots of c[0] + c[1] x + c[2] x², without cancellation; a root is there twice where it is double. None where no
/// coefficient is larger than `noise`.
std::vector<double> realRoots(const Vector3d& c, double noise)
{
    const double scale = c.cwiseAbs().maxCoeff();
    if (!(scale > noise)) { return {}; }
    if (std::fabs(c[2]) < 1e-14 * scale) {
        return c[1] != 0.0 ? std::vector<double>{-c[0] / c[1]} : std::vector<double>{};
    }
    const double discriminant = c[1] * c[1] - 4.0 * c[0] * c[2];
    if (discriminant < 0.0) { return {}; }
    const double q = -0.5 * (c[1] + std::copysign(std::sqrt(discriminant), c[1]));
    if (q == 0.0) { return {0.0, 0.0}; }
    return {q / c[2], c[0] / q};
}

/// The quadratic polynomial with these values at 0, 1/2 and 1.
Vector3d quadraticThrough(double first, double middle, double last)
{
    return {first, 4.0 * middle - 3.0 * first - last, 2.0 * (first + last) - 4.0 * middle};
}

struct Meeting {
    double along;
    double height;
};

/// Where two lines that have a common point have it: origin + along · direction = start + height · ray.
std::optional<Meeting> meetingOf(const Vector3d& origin, const Vector3d& direction, const Vector3d& start,
                                 const Vector3d& ray)
{
    const Vector3d across = direction.cross(ray);
    const double square = across.squaredNorm();
    if (!(square > 1e-24 * direction.squaredNorm() * ray.squaredNorm())) { return std::nullopt; }
    const Vector3d offset = start - origin;
    return Meeting{offset.cross(ray).dot(across) / square, offset.cross(direction).dot(across) / square};
}

} // namespace

Vector3d RayPrism::pointAt(const Vector3d& b) const
{
    return b[0] * positions[0] + b[1] * positions[1] + b[2] * positions[2];
}

Vector3d RayPrism::rayAt(const Vector3d& b) const
{
    return b[0] * normals[0] + b[1] * normals[1] + b[2] * normals[2];
}

double RayPrism::opening(double low, double high) const
{
    const Vector3d e1 = positions[1] - positions[0];
    const Vector3d e2 = positions[2] - positions[0];
    const Vector3d m1 = normals[1] - normals[0];
    const Vector3d m2 = normals[2] - normals[0];
    const double area = e1.cross(e2).norm();
    double least = std::numeric_limits<double>::infinity();
    for (const Vector3d& normal : normals) { // linear in the weights: least at a corner
        const Vector3d c(e1.cross(e2).dot(normal), (e1.cross(m2) + m1.cross(e2)).dot(normal), m1.cross(m2).dot(normal));
        const auto offer = [&](double h) { least = std::min(least, c[0] + h * (c[1] + h * c[2])); };
        offer(low);
        offer(high);
        if (c[2] != 0.0) { offer(std::clamp(-0.5 * c[1] / c[2], low, high)); }
    }
    return area > 0.0 ? least / area : -1.0;
}

PrismPoint RayPrism::derivative(const PrismPoint& at, const Vector3d& direction) const
{
    Matrix3d jacobian;
    for (unsigned k = 0; k < 2; ++k) {
        jacobian.col(k) = positions[k + 1] - positions[0] + at.height * (normals[k + 1] - normals[0]);
    }
    jacobian.col(2) = rayAt(at.barycentric);
    const Vector3d change = jacobian.inverse() * direction;
    return {{-change[0] - change[1], change[0], change[1]}, change[2]};
}

std::optional<PrismPoint> RayPrism::locate(const Vector3d& point, const PrismPoint& guess) const
{
    constexpr unsigned kMostSteps = 30;
    constexpr double kClose = 1e-15;
    const double size = std::max((positions[1] - positions[0]).norm(), (positions[2] - positions[0]).norm());
    PrismPoint found = guess;
    double last = std::numeric_limits<double>::infinity();
    for (unsigned step = 0; step < kMostSteps; ++step) {
        const Vector3d residual = point - at(found);
        const double distance = residual.norm();
        // As near as rounding lets it come: halving no more.
        if (distance <= kClose * (1.0 + point.norm()) ||
            (step > 3 && distance < 1e-9 * size && distance > 0.5 * last)) {
            return found;
        }
        last = distance;
        const PrismPoint change = derivative(found, residual);
        found.barycentric += change.barycentric;
        found.height += change.height;
        if (!found.barycentric.allFinite() || found.barycentric.cwiseAbs().maxCoeff() > 1e3) { return std::nullopt; }
    }
    return std::nullopt;
}

void RayPrism::crossings(unsigned side, const Vector3d& origin, const Vector3d& direction,
                         std::vector<Crossing>& found) const
{
    const unsigned next = (side + 1) % 3;
    const Vector3d edge = positions[next] - positions[side];
    const Vector3d turn = normals[next] - normals[side];
    // The line and the ray at share s lie in one plane: det(start(s) − origin, ray(s), direction) = 0.
    const Vector3d offset = positions[side] - origin;
    const Vector3d cross0 = normals[side].cross(direction);
    const Vector3d cross1 = turn.cross(direction);
    const Vector3d polynomial(offset.dot(cross0), edge.dot(cross0) + offset.dot(cross1), edge.dot(cross1));
    for (const double share : realRoots(polynomial, kParallel * direction.norm() * edge.norm())) {
        if (!(share >= -kRounding && share <= 1.0 + kRounding)) { continue; }
        const auto meeting = meetingOf(origin, direction, positions[side] + share * edge, normals[side] + share * turn);
        if (meeting) { found.push_back({meeting->along, share, meeting->height}); }
    }
}

bool RayPrism::meets(const Vector3d& first, const Vector3d& last, const Vector3d& origin, const Vector3d& direction,
                     double from, double to) const
{
    const auto between = [&](double u) { return Vector3d((1.0 - u) * first + u * last); };
    const auto value = [&](double u) {
        const Vector3d b = between(u);
        return (pointAt(b) - origin).dot(rayAt(b).cross(direction));
    };
    for (const double u : realRoots(quadraticThrough(value(0.0), value(0.5), value(1.0)), 0.0)) {
        if (!(u >= 0.0 && u <= 1.0)) { continue; }
        const Vector3d b = between(u);
        const auto meeting = meetingOf(origin, direction, pointAt(b), rayAt(b));
        if (meeting && meeting->along >= from && meeting->along <= to) { return true; }
    }
    return false;
}

} // namespace osgTessLOD::bake
