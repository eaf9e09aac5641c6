// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PlacementRange.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Polygon = std::vector<Vector2d>;

/// Steps of halving on the way from a valid point to the one that is wanted.
constexpr int kHalvings = 5;
/// Of the way to a neighbour on the border that a border vertex may go at most.
constexpr double kMostOfTheWay = 0.75;

ChartPoint rounded(const Vector2d& p)
{
    return {static_cast<std::int32_t>(std::lround(p.x())), static_cast<std::int32_t>(std::lround(p.y()))};
}

Vector2d exact(ChartPoint p)
{
    return {p.u, p.v};
}

bool take(const CollapseStar& star, ChartPoint candidate, ChartPoint& nearest)
{
    if (!isValid(star, candidate)) { return false; }
    nearest = candidate;
    return true;
}

/// Part of a convex polygon to the left of the line from a to b.
Polygon clipped(const Polygon& polygon, const Vector2d& a, const Vector2d& b)
{
    const Vector2d along = b - a;
    const auto height = [&](const Vector2d& p) { return along.x() * (p.y() - a.y()) - along.y() * (p.x() - a.x()); };
    Polygon result;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Vector2d& p = polygon[i];
        const Vector2d& q = polygon[(i + 1) % polygon.size()];
        const double hp = height(p), hq = height(q);
        if (hp >= 0.0) { result.push_back(p); }
        if ((hp > 0.0 && hq < 0.0) || (hp < 0.0 && hq > 0.0)) { result.push_back(p + hp / (hp - hq) * (q - p)); }
    }
    return result;
}

/// The middle of the star's kernel, the points that see all of its outer edges.
bool kernelMiddle(const CollapseStar& star, ChartPoint& middle)
{
    constexpr double kEnd = ChartPoint::kUnits;
    Polygon kernel{{0.0, 0.0}, {kEnd, 0.0}, {0.0, kEnd}};
    for (const CollapseStar::Triangle& t : star.triangles) {
        if (!t.survives) { continue; }
        kernel = clipped(kernel, exact(star.vertices[t.vertices[1]].parameter),
                         exact(star.vertices[t.vertices[2]].parameter));
        if (kernel.empty()) { return false; }
    }
    Vector2d sum = Vector2d::Zero();
    for (const Vector2d& p : kernel) { sum += p; }
    return take(star, rounded(sum / static_cast<double>(kernel.size())), middle);
}

/// A range along the border.
struct Range {
    double low;
    double high;
};

/// Narrows a range to where the merged vertex leaves each surviving triangle positive: each says so linearly.
Range validRange(const CollapseStar& star, Range range)
{
    for (const CollapseStar::Triangle& t : star.triangles) {
        if (!t.survives) { continue; }
        const auto area = [&](std::int32_t along) {
            const ChartPoint merged = star.inPart(t.part, borderParameter(star.sides[0], along));
            return static_cast<double>(
                orientation(merged, star.vertices[t.vertices[1]].parameter, star.vertices[t.vertices[2]].parameter));
        };
        const double atStart = area(0), slope = (area(ChartPoint::kUnits) - atStart) / ChartPoint::kUnits;
        if (slope == 0.0) { continue; } // parallel to the border, so positive
        const double zero = -atStart / slope;
        (slope > 0.0 ? range.low : range.high) = slope > 0.0 ? std::max(range.low, zero) : std::min(range.high, zero);
    }
    return range;
}

Range allowedRange(const CollapseStar& star)
{
    const double end = alongBorder(star.sides[0], star.ends[0].parameter);
    if (star.kind == CollapseStar::Kind::BorderEdge) {
        const double other = alongBorder(star.sides[0], star.ends[1].parameter);
        return {std::min(end, other), std::max(end, other)};
    }
    return {end - kMostOfTheWay * (end - star.beside[0]), end + kMostOfTheWay * (star.beside[1] - end)};
}

} // namespace

bool nearestInStar(const CollapseStar& star, const Vector2d& wanted, ChartPoint& nearest)
{
    constexpr double kFar = 2.0 * ChartPoint::kUnits;
    const Vector2d within = wanted.cwiseMax(-kFar).cwiseMin(kFar); // so that all products are exact
    if (take(star, rounded(within), nearest)) { return true; }
    const Vector2d a = exact(star.ends[0].parameter), b = exact(star.ends[1].parameter);
    ChartPoint base;
    if (!take(star, rounded(0.5 * (a + b)), base) && !take(star, star.ends[0].parameter, base) &&
        !take(star, star.ends[1].parameter, base) && !kernelMiddle(star, base)) {
        return false;
    }
    nearest = base;
    double part = 0.5;
    for (int i = 0; i < kHalvings; ++i, part *= 0.5) {
        if (take(star, rounded(exact(base) + part * (within - exact(base))), nearest)) { return true; }
    }
    return true;
}

bool nearestOnBorder(const CollapseStar& star, double wanted, ChartPoint& nearest)
{
    const Range allowed = allowedRange(star);
    const Range valid = validRange(star, allowed);
    if (!(valid.low <= valid.high)) { return false; }
    // A little inside where a triangle would be degenerate.
    const double margin = 0.05 * (valid.high - valid.low);
    const double low = valid.low > allowed.low ? valid.low + margin : valid.low;
    const double high = valid.high < allowed.high ? valid.high - margin : valid.high;
    const auto at = [&](double along) {
        return borderParameter(star.sides[0], static_cast<std::int32_t>(std::lround(along)));
    };
    return take(star, at(std::clamp(wanted, low, high)), nearest) || take(star, at(0.5 * (low + high)), nearest);
}

} // namespace osgTessLOD::bake
