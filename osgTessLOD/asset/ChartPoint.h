// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace osgTessLOD {

/// A point of a patch's parameter triangle on an integer lattice: corner weights over kUnits, the first corner's being
/// what is left. Orientation and crossing predicates between points are exact in 64-bit integers, and a point is stored in
/// 2 × 16 bits unchanged.
///
/// Vertices of patterns whose factor divides 128 lie on the lattice. Those of other factors are rounded to it
/// (TessellationPattern::chartPoint), by half a unit at most, alike from both sides of a border: predicates are then exact
/// for a triangulation whose vertices lie up to 10⁻⁵ of a patch's side from the pattern's.
struct ChartPoint {
    static constexpr std::int32_t kUnits = 3 * 128 * 128;  ///< 49,152

    std::int32_t u = 0;  ///< weight of corner 1
    std::int32_t v = 0;  ///< weight of corner 2

    bool operator==(const ChartPoint& o) const { return u == o.u && v == o.v; }
    bool operator!=(const ChartPoint& o) const { return !(*this == o); }

    /// u in the low, v in the high 16 bits. Not every number is a point of the triangle: see isInside().
    static ChartPoint fromBits(std::uint32_t bits)
    {
        return {static_cast<std::int32_t>(bits & 0xFFFFU), static_cast<std::int32_t>(bits >> 16)};
    }
    std::uint32_t bits() const { return static_cast<std::uint32_t>(u) | static_cast<std::uint32_t>(v) << 16; }
    bool isInside() const { return u >= 0 && v >= 0 && u + v <= kUnits; }
};

/// Point `along` units (of ChartPoint::kUnits) along a side of the parameter triangle from corner `side`, and back.
inline ChartPoint borderParameter(unsigned side, std::int32_t along)
{
    const std::int32_t rest = ChartPoint::kUnits - along;
    return side == 0 ? ChartPoint{along, 0} : side == 1 ? ChartPoint{rest, along} : ChartPoint{0, rest};
}
inline std::int32_t alongBorder(unsigned side, ChartPoint p)
{
    return side == 0 ? p.u : side == 1 ? p.v : ChartPoint::kUnits - p.v;
}

/// Twice the signed area of a, b, c in lattice units², exact: positive if counter-clockwise as the corners 0, 1, 2 are.
inline std::int64_t orientation(ChartPoint a, ChartPoint b, ChartPoint c)
{
    return static_cast<std::int64_t>(b.u - a.u) * (c.v - a.v) - static_cast<std::int64_t>(b.v - a.v) * (c.u - a.u);
}

} // namespace osgTessLOD
