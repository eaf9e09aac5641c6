// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace osgTessLOD {

/// A point of a patch's parameter triangle on an integer lattice: corner weights over kUnits, the first corner's being
/// what is left. Every vertex of every pattern up to factor 128 lies on the lattice, so that orientation and crossing
/// predicates between levels and charts are exact in 64-bit integers, and a point is stored in 2 × 16 bits unchanged.
struct ChartPoint {
    static constexpr std::int32_t kUnits = 3 * 128 * 128;  ///< 49,152

    std::int32_t u = 0;  ///< weight of corner 1
    std::int32_t v = 0;  ///< weight of corner 2

    bool operator==(const ChartPoint& o) const { return u == o.u && v == o.v; }
    bool operator!=(const ChartPoint& o) const { return !(*this == o); }
};

/// Twice the signed area of a, b, c in lattice units², exact: positive if counter-clockwise as the corners 0, 1, 2 are.
inline std::int64_t orientation(ChartPoint a, ChartPoint b, ChartPoint c)
{
    return static_cast<std::int64_t>(b.u - a.u) * (c.v - a.v) - static_cast<std::int64_t>(b.v - a.v) * (c.u - a.u);
}

} // namespace osgTessLOD
