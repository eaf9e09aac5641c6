// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/StarFlattening.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
/// Slivers' angles and lengths are taken for no less, so that each sector has area (relative to the sum, to the longest).
constexpr double kSmallestAngle = 0.02;
constexpr double kSmallestLength = 0.02;
/// Smallest ratio of a triangle's area to the mean that is good enough to keep the geodesic shape.
constexpr double kGoodQuality = 0.05;

double angleBetween(const Vector3d& a, const Vector3d& b)
{
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// The star in polar coordinates around its centre: sector i lies between ring vertices i and i + 1.
class PolarStar {
public:
    explicit PolarStar(const Star& star)
        : _star(star)
    {
        const unsigned n = star.ringSize;
        if (star.gap == 0) {
            _fans[_fanCount++] = {1, n, kPi, kPi};
        } else if (star.gap == n - 1) {
            _fans[_fanCount++] = {0, n - 1, 0.0, kPi};
        } else if (star.crease != 0) {
            _fans[_fanCount++] = {0, star.crease, 0.0, kPi};
            _fans[_fanCount++] = {star.crease, n, kPi, kPi};
        } else {
            _fans[_fanCount++] = {0, n, 0.0, 2.0 * kPi};
        }
        double longest = 0.0;
        for (unsigned i = 0; i < n; ++i) {
            _length[i] = (star.ring[i] - star.center).norm();
            longest = std::max(longest, _length[i]);
            _angle[i] = i == star.gap
                            ? 0.0
                            : angleBetween(star.ring[i] - star.center, star.ring[(i + 1) % n] - star.center);
        }
        for (unsigned i = 0; i < n; ++i) {
            _length[i] = longest > 0.0 ? std::max(_length[i] / longest, kSmallestLength) : 1.0;
        }
        normalizeAngles();
    }

    /// Puts the ring into the plane; `roundness` 0 keeps the lengths, 1 makes them all equal; `evenness` likewise the
    /// angles.
    void layOut(double roundness, double evenness, CollapseHistory::Step& step) const
    {
        const unsigned n = _star.ringSize;
        step.ringSize = n;
        step.gap = _star.gap;
        step.center = Vector2f::Zero();
        for (unsigned f = 0; f < _fanCount; ++f) {
            const Fan& fan = _fans[f];
            double angle = fan.start;
            for (unsigned i = fan.first; i <= fan.last; ++i) {
                const unsigned at = i % n;
                const double length = std::pow(_length[at], 1.0 - roundness);
                // What lies on the line through v must lie on it exactly.
                const bool onLine = fan.total < 1.5 * kPi && (i == fan.first || i == fan.last);
                const double x = onLine ? (std::cos(angle) > 0.0 ? 1.0 : -1.0) : std::cos(angle);
                const double y = onLine ? 0.0 : std::sin(angle);
                step.ring[at] = Vector2f(static_cast<float>(length * x), static_cast<float>(length * y));
                angle += (1.0 - evenness) * _angle[at] + evenness * fan.total / (fan.last - fan.first);
            }
        }
    }

private:
    /// Sectors first … last − 1, which fill the angle `total` from `start` on.
    struct Fan {
        unsigned first;
        unsigned last;
        double start;
        double total;
    };

    void normalizeAngles()
    {
        for (unsigned f = 0; f < _fanCount; ++f) {
            const Fan& fan = _fans[f];
            double sum = 0.0;
            for (unsigned i = fan.first; i < fan.last; ++i) { sum += _angle[i]; }
            double floored = 0.0;
            for (unsigned i = fan.first; i < fan.last; ++i) {
                floored += _angle[i] = std::max(_angle[i], std::max(kSmallestAngle * sum, 1e-12));
            }
            for (unsigned i = fan.first; i < fan.last; ++i) { _angle[i] *= fan.total / floored; }
        }
    }

    const Star& _star;
    std::array<Fan, 2> _fans{};
    unsigned _fanCount = 0;
    std::array<double, CollapseHistory::kMaxRing> _angle{};
    std::array<double, CollapseHistory::kMaxRing> _length{};
};

} // namespace

void flattenStar(const Star& star, CollapseHistory::Step& step)
{
    struct Shape {
        double roundness;
        double evenness;
    };
    static constexpr std::array<Shape, 7> kShapes{
        {{0.0, 0.0}, {0.25, 0.0}, {0.5, 0.0}, {0.75, 0.25}, {1.0, 0.25}, {1.0, 0.5}, {1.0, 1.0}}};
    const PolarStar polar(star);
    double best = -1.0;
    Shape chosen = kShapes.back();
    for (const Shape& shape : kShapes) {
        polar.layOut(shape.roundness, shape.evenness, step);
        const double quality = step.quality();
        if (quality > best) {
            best = quality;
            chosen = shape;
        }
        if (quality >= kGoodQuality) { return; }
    }
    polar.layOut(chosen.roundness, chosen.evenness, step);
}

} // namespace osgTessLOD::bake
