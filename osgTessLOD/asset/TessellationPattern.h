// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// The vertices and triangles that the hardware tessellator emits for a triangle patch with equal inner and outer
/// integer factors (Lambert §3.1): factor 1, or any even factor.
///
/// With n = factor / 2 the vertices form concentric rings m = n (the patch border) … 1, of 6m vertices each, and the
/// centre (m = 0). A ring has three sides of 2m segments; side s runs from corner s to corner s + 1 (mod 3).
/// Vertices are numbered from the border inwards, along each ring from its corner 0:
///
///     corner 0 ──► side 0 ──► corner 1 ──► side 1 ──► corner 2 ──► side 2 ──► corner 0      (indices 0 … 6n − 1)
///
/// so that border vertex t of side s has index s·factor + t. Ring n − k lies at barycentric distance (2/3)k/factor from
/// each edge. Barycentric coordinates are exact integers over the common denominator 3·factor.
///
/// Factor 1 is the single triangle 0, 1, 2.
class OSGTESSLOD_EXPORT TessellationPattern {
public:
    static constexpr unsigned kMaxFactor = 128;

    /// Where a vertex lies. The centre is ring 0, side 0, step 0.
    struct Place {
        unsigned ring; ///< 0 (centre) … factor / 2 (border); 1 for factor 1
        unsigned side; ///< 0 … 2
        unsigned step; ///< 0 … 2·ring − 1 from the side's first corner (0 for factor 1)
        bool operator==(const Place& o) const { return ring == o.ring && side == o.side && step == o.step; }
    };

    /// Corner weights as integers over 3·factor.
    using Barycentric = std::array<unsigned, 3>;
    using Triangle = std::array<std::uint32_t, 3>;

    /// True for 1 and for even factors up to kMaxFactor.
    static bool isValidFactor(unsigned factor);
    /// Vertices of the pattern: 3 for factor 1, else 1 + 3(factor/2)(factor/2 + 1).
    static std::uint32_t vertexCount(unsigned factor);
    /// Triangles of the pattern: 1 for factor 1, else 1.5 factor².
    static std::uint32_t triangleCount(unsigned factor);
    /// Vertices on the border: 3·factor; they come first.
    static std::uint32_t borderVertexCount(unsigned factor) { return 3 * factor; }

    static Place place(unsigned factor, std::uint32_t vertex);
    /// Inverse of place(); `step` may also be 2·ring, the next side's first corner.
    static std::uint32_t index(unsigned factor, const Place& place);

    static Barycentric barycentric(unsigned factor, std::uint32_t vertex);
    /// The same on the lattice of ChartPoint, to the nearest point; vertices of a side are exactly on it.
    static ChartPoint chartPoint(unsigned factor, std::uint32_t vertex);
    /// Index of the vertex with these (exact) coordinates, whose sum is 3·factor. Where no vertex has them, that of some
    /// vertex of the pattern: barycentric() of it tells.
    static std::uint32_t index(unsigned factor, const Barycentric& barycentric);
    /// Index of the vertex nearest to floating point tessellation coordinates (Lambert Alg. 2); the GLSL function
    /// tessLodPatternIndex computes the same.
    static std::uint32_t index(unsigned factor, const std::array<float, 3>& tessCoord);

    /// The vertex of pattern `factor` − 2 that `vertex` merges with when the tessellator's own fractional transition from
    /// `factor` to `factor` − 2 ends; factor ≥ 4 (the single triangle of factor 1 is no part of that transition).
    static std::uint32_t tessellatorParent(unsigned factor, std::uint32_t vertex);
    /// tessellatorParent applied until factor `coarse` (even, ≥ 2) is reached. For coarse = factor / 2, both powers of
    /// two, position p along a half side goes to ⌈p/2⌉.
    static std::uint32_t tessellatorAncestor(unsigned factor, std::uint32_t vertex, unsigned coarse);

    explicit TessellationPattern(unsigned factor);

    unsigned factor() const { return _factor; }
    std::uint32_t vertexCount() const { return vertexCount(_factor); }
    /// Triangles, counter-clockwise as the corners 0, 1, 2 are.
    const std::vector<Triangle>& triangles() const { return _triangles; }

    /// A triangle of the pattern and weights of its three vertices (≥ 0, sum 1).
    struct Location {
        std::uint32_t triangle;
        std::array<double, 3> weights;
    };
    /// A triangle whose closed area holds the point with these corner weights, up to rounding.
    Location locate(const std::array<double, 3>& barycentric) const;

private:
    unsigned _factor;
    std::vector<Triangle> _triangles;
};

} // namespace osgTessLOD
