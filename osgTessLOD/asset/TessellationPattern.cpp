// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §3.1 (Algorithm 2, derived anew: the printed one
// mixes up its offsets). The triangles and the fractional transition were read off a driver's tessellator, and tests
// compare all of them.
//
// Between ring m (outer, o0 … o2m on one side) and ring m − 1 (inner, i0 … i2m−2), mirrored about the middle:
//
//     o0 ── o1 ── o2 ──  om  ── … ── o2m
//       \   | \   | \     |     / |   /
//         \ |   \ |   \   |   /   | /
//          i0 ── i1 ──  im−1 ── … i2m−2
#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace osgTessLOD {

namespace {

using Pattern = TessellationPattern;

/// Vertices of all rings outside ring `ring`: the index of its corner 0.
std::uint32_t ringOffset(unsigned half, unsigned ring)
{
    return 3 * (half * (half + 1) - ring * (ring + 1));
}

/// Largest m with 3·m(m + 1) ≤ value, by floating point and correction.
unsigned ringContaining(std::uint32_t value)
{
    auto m = static_cast<unsigned>((std::sqrt(1.0 + 4.0 * (static_cast<double>(value) / 3.0)) - 1.0) / 2.0);
    while (3 * m * (m + 1) > value) { --m; }
    while (3 * (m + 1) * (m + 2) <= value) { ++m; }
    return m;
}

/// Position along a border of 2·half segments after one fractional transition to 2·(half − 1), as Direct3D 11 defines it:
/// on each half, the position after the split point moves back by one.
unsigned mergedStep(unsigned half, unsigned step)
{
    if (step > half) { return 2 * (half - 1) - mergedStep(half, 2 * half - step); }
    unsigned highBit = 1;
    while (highBit * 2 <= half - 1) { highBit *= 2; }
    const unsigned split = 2 * ((half - 1) - highBit) + 1;
    return step > split ? step - 1 : step;
}

void addTriangle(std::vector<Pattern::Triangle>& triangles, std::uint32_t a, std::uint32_t b, std::uint32_t c)
{
    triangles.push_back({a, b, c});
}

/// Triangles between side `side` of ring `ring` and of the ring inside it.
void addBand(std::vector<Pattern::Triangle>& triangles, unsigned factor, unsigned ring, unsigned side)
{
    const auto outer = [&](unsigned step) { return Pattern::index(factor, Pattern::Place{ring, side, step}); };
    const auto inner = [&](unsigned step) {
        return Pattern::index(factor, Pattern::Place{ring - 1, ring == 1 ? 0 : side, step});
    };
    const unsigned segments = 2 * ring;
    addTriangle(triangles, outer(0), outer(1), inner(0));
    for (unsigned k = 0; k + 1 < ring; ++k) {
        addTriangle(triangles, inner(k), outer(k + 1), inner(k + 1));
        addTriangle(triangles, outer(k + 1), outer(k + 2), inner(k + 1));
    }
    for (unsigned k = ring - 1; k + 2 < segments; ++k) {
        addTriangle(triangles, outer(k + 1), outer(k + 2), inner(k));
        addTriangle(triangles, inner(k), outer(k + 2), inner(k + 1));
    }
    addTriangle(triangles, outer(segments - 1), outer(segments), inner(segments - 2));
}

} // namespace

bool TessellationPattern::isValidFactor(unsigned factor)
{
    return factor == 1 || (factor >= 2 && factor % 2 == 0 && factor <= kMaxFactor);
}

std::uint32_t TessellationPattern::vertexCount(unsigned factor)
{
    const unsigned half = factor / 2;
    return factor == 1 ? 3 : 1 + 3 * half * (half + 1);
}

std::uint32_t TessellationPattern::triangleCount(unsigned factor)
{
    return factor == 1 ? 1 : 3 * factor * factor / 2;
}

TessellationPattern::Place TessellationPattern::place(unsigned factor, std::uint32_t vertex)
{
    assert(isValidFactor(factor) && vertex < vertexCount(factor));
    if (factor == 1) { return {1, vertex, 0}; }
    const unsigned half = factor / 2;
    if (vertex + 1 == vertexCount(factor)) { return {0, 0, 0}; }
    // Counted from the last ring vertex outwards, rings 1 … m hold 3m(m + 1) vertices.
    const unsigned ring = ringContaining(3 * half * (half + 1) - 1 - vertex) + 1;
    const std::uint32_t onRing = vertex - ringOffset(half, ring);
    return {ring, onRing / (2 * ring), onRing % (2 * ring)};
}

std::uint32_t TessellationPattern::index(unsigned factor, const Place& place)
{
    if (factor == 1) { return (place.side + place.step) % 3; }
    if (place.ring == 0) { return vertexCount(factor) - 1; }
    return ringOffset(factor / 2, place.ring) + (place.side * 2 * place.ring + place.step) % (6 * place.ring);
}

TessellationPattern::Barycentric TessellationPattern::barycentric(unsigned factor, std::uint32_t vertex)
{
    Barycentric result{};
    if (factor == 1) {
        result[vertex] = 3;
        return result;
    }
    const Place at = place(factor, vertex);
    const unsigned smallest = factor - 2 * at.ring; // 2(n − m), the distance from each edge of the ring's corners
    result[at.side] = smallest + 3 * (2 * at.ring - at.step);
    result[(at.side + 1) % 3] = smallest + 3 * at.step;
    result[(at.side + 2) % 3] = smallest;
    return result;
}

ChartPoint TessellationPattern::chartPoint(unsigned factor, std::uint32_t vertex)
{
    const Barycentric b = barycentric(factor, vertex);
    // Never halfway between two numbers (weight · 2¹⁵ / factor is even where it is whole): both sides of a border round alike.
    const auto scaled = [&](unsigned weight) {
        return static_cast<std::int32_t>((2U * weight * ChartPoint::kUnits + 3 * factor) / (6 * factor));
    };
    const std::int32_t u = scaled(b[1]);
    return {u, b[0] == 0 ? ChartPoint::kUnits - u : scaled(b[2])};
}

std::uint32_t TessellationPattern::index(unsigned factor, const Barycentric& b)
{
    assert(b[0] + b[1] + b[2] == 3 * factor);
    if (factor == 1) { return b[0] == 3 ? 0 : b[1] == 3 ? 1 : 2; }
    const unsigned opposite = b[0] <= b[1] ? (b[0] <= b[2] ? 0 : 2) : (b[1] <= b[2] ? 1 : 2);
    const unsigned smallest = b[opposite];
    const unsigned side = (opposite + 1) % 3;
    return index(factor, Place{(factor - smallest) / 2, side, (b[(side + 1) % 3] - smallest) / 3});
}

std::uint32_t TessellationPattern::index(unsigned factor, const std::array<float, 3>& c)
{
    if (factor == 1) { return c[0] > 0.5F ? 0 : c[1] > 0.5F ? 1 : 2; }
    const unsigned opposite = c[0] <= c[1] ? (c[0] <= c[2] ? 0 : 2) : (c[1] <= c[2] ? 1 : 2);
    const unsigned side = (opposite + 1) % 3;
    const float smallest = c[opposite];
    const auto f = static_cast<float>(factor);
    const auto ring = static_cast<unsigned>(std::floor((1.0F - 3.0F * smallest) * 0.5F * f + 0.5F));
    const auto step = static_cast<unsigned>(std::floor((c[(side + 1) % 3] - smallest) * f + 0.5F));
    return index(factor, Place{ring, side, step});
}

std::uint32_t TessellationPattern::tessellatorParent(unsigned factor, std::uint32_t vertex)
{
    assert(factor >= 4 && isValidFactor(factor));
    const unsigned half = factor / 2;
    const Place at = place(factor, vertex);
    const unsigned inset = half - at.ring; // rings merge by the same rule as border positions
    const unsigned step = mergedStep(half, inset + at.step);
    const unsigned mergedInset = mergedStep(half, inset);
    return index(factor - 2, Place{half - 1 - mergedInset, at.side, step - mergedInset});
}

std::uint32_t TessellationPattern::tessellatorAncestor(unsigned factor, std::uint32_t vertex, unsigned coarse)
{
    assert(coarse >= 2 && coarse <= factor);
    for (; factor > coarse; factor -= 2) { vertex = tessellatorParent(factor, vertex); }
    return vertex;
}

TessellationPattern::TessellationPattern(unsigned factor)
    : _factor(factor)
{
    assert(isValidFactor(factor));
    if (factor == 1) {
        addTriangle(_triangles, 0, 1, 2);
        return;
    }
    _triangles.reserve(triangleCount(factor));
    for (unsigned ring = factor / 2; ring > 0; --ring) {
        for (unsigned side = 0; side < 3; ++side) { addBand(_triangles, factor, ring, side); }
    }
}

TessellationPattern::Location TessellationPattern::locate(const std::array<double, 3>& b) const
{
    if (_factor == 1) { return {0, b}; }
    const unsigned half = _factor / 2;
    const unsigned opposite = b[0] <= b[1] ? (b[0] <= b[2] ? 0 : 2) : (b[1] <= b[2] ? 1 : 2);
    const unsigned side = (opposite + 1) % 3;
    // Band: depth 0 at the border … n at the centre, in rings. Along: −m … m of the outer ring about the middle.
    const double depth = std::clamp(b[opposite] * 3.0 * half, 0.0, static_cast<double>(half));
    const auto ringsIn = std::min(half - 1, static_cast<unsigned>(depth));
    const unsigned ring = half - ringsIn;
    const double across = depth - ringsIn; // 0 on the outer ring, 1 on the inner
    const double along = (b[(side + 1) % 3] - b[side]) * half; // in segments, 0 at the middle
    const bool secondHalf = along > 0.0;
    // Distance from the side's (nearer) corner line in segments; the inner ring's corner stands at 1.
    const double fromCorner = std::max(0.0, static_cast<double>(ring) - std::fabs(along));

    const auto cell = std::min(ring - 1, static_cast<unsigned>(fromCorner)); // between outer cell and cell + 1
    const double within = fromCorner - cell;
    // First half, before mirroring: upper triangle (o cell, o cell+1, i cell), lower (i cell−1, o cell, i cell).
    const bool lower = cell > 0 && across > within;
    const std::uint32_t triangleInHalf = cell == 0 ? 0 : 2 * cell - (lower ? 1 : 0);
    const std::uint32_t perSide = 4 * ring - 2;
    const std::uint32_t bandStart = 6 * (half * half - ring * ring);
    const std::uint32_t triangle =
        bandStart + side * perSide + (secondHalf ? perSide - 1 - triangleInHalf : triangleInHalf);

    // Weights by the triangle's own corners: exact lattice coordinates, then areas.
    const double scale = 3.0 * _factor;
    std::array<std::array<double, 2>, 3> corner{};
    for (std::size_t k = 0; k < 3; ++k) {
        const Barycentric c = barycentric(_factor, _triangles[triangle][k]);
        corner[k] = {static_cast<double>(c[1]), static_cast<double>(c[2])};
    }
    const std::array<double, 2> p{b[1] * scale, b[2] * scale};
    const auto area = [](const std::array<double, 2>& a, const std::array<double, 2>& c, const std::array<double, 2>& d) {
        return (c[0] - a[0]) * (d[1] - a[1]) - (c[1] - a[1]) * (d[0] - a[0]);
    };
    const double total = area(corner[0], corner[1], corner[2]);
    const double w1 = std::clamp(area(corner[0], p, corner[2]) / total, 0.0, 1.0);
    const double w2 = std::clamp(area(corner[0], corner[1], p) / total, 0.0, 1.0 - w1);
    return {triangle, {1.0 - w1 - w2, w1, w2}};
}

} // namespace osgTessLOD
