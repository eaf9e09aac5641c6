// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Triangles over numbered vertices with what is needed to walk through them, whatever the vertices' places. Any set of
/// triangles that are three different vertices each and of which at most two share an edge; vertices may be unused.
class OSGTESSLOD_EXPORT Triangulation {
public:
    using Triangle = std::array<std::uint32_t, 3>;
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    struct Edge {
        std::array<std::uint32_t, 2> vertices;
        std::array<std::uint32_t, 2> triangles; ///< the first runs from vertices[0] to vertices[1]; kNone: no second
        std::uint32_t corner;                   ///< of vertices[0] in the first triangle
    };
    /// A view of consecutive numbers.
    struct Range {
        const std::uint32_t* first;
        const std::uint32_t* last;
        const std::uint32_t* begin() const { return first; }
        const std::uint32_t* end() const { return last; }
        bool empty() const { return first == last; }
    };

    Triangulation(std::uint32_t vertexCount, std::vector<Triangle> triangles);
    /// Of the pattern of a tessellation factor.
    static Triangulation ofPattern(unsigned factor);

    std::uint32_t vertexCount() const { return static_cast<std::uint32_t>(_trianglesStart.size() - 1); }
    const std::vector<Triangle>& triangles() const { return _triangles; }
    /// Each once, in the order of the triangles.
    const std::vector<Edge>& edges() const { return _edges; }
    /// The triangle across the edge from corner k to corner k + 1, or kNone.
    std::uint32_t neighbour(std::uint32_t triangle, unsigned k) const { return _neighbours[triangle][k]; }
    Range trianglesAround(std::uint32_t vertex) const;
    /// The vertices joined to one by an edge.
    Range verticesAround(std::uint32_t vertex) const;

private:
    std::vector<Triangle> _triangles;
    std::vector<Triangle> _neighbours;
    std::vector<Edge> _edges;
    std::vector<std::uint32_t> _trianglesStart;
    std::vector<std::uint32_t> _trianglesAround;
    std::vector<std::uint32_t> _verticesStart;
    std::vector<std::uint32_t> _verticesAround;
};

/// Where a pattern has its vertices; exactly for factors that are powers of two, up to half a unit for others.
OSGTESSLOD_EXPORT std::vector<ChartPoint> patternPoints(unsigned factor);

} // namespace osgTessLOD::bake
