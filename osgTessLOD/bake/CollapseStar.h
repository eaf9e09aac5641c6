// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/StripMesh.h>

#include <Eigen/Core>
#include <array>
#include <cassert>
#include <cstdint>

namespace osgTessLOD::bake {

/// At most N values, in place.
template <typename T, std::size_t N> class FixedList {
public:
    void push_back(const T& value)
    {
        assert(_size < N);
        _values[_size++] = value;
    }
    std::size_t size() const { return _size; }
    T& operator[](std::size_t i) { return _values[i]; }
    const T& operator[](std::size_t i) const { return _values[i]; }
    const T* begin() const { return _values.data(); }
    const T* end() const { return _values.data() + _size; }

private:
    std::array<T, N> _values{};
    std::size_t _size = 0;
};

/// An edge about to be contracted and the triangles around it that change, in the one or two patches that have them.
/// Triangles already collapsed, by edges of the same strip, are left out.
struct CollapseStar {
    /// Where the merged vertex may go.
    enum class Kind {
        Interior,   ///< both ends inside the patch: anywhere
        BorderEdge, ///< both ends on a border: on the edge
        BorderEnd,  ///< one end on a border: on either border edge at it
        Corner      ///< one end a patch corner: there
    };
    struct Vertex {
        Eigen::Vector3d position;
        ChartPoint parameter; ///< in the patch of its part
    };
    struct Triangle {
        std::array<std::uint8_t, 3> vertices; ///< counter-clockwise; the first is one of the two ends
        bool survives;                        ///< the other two stay
        std::uint8_t part;
        std::uint32_t index; ///< in the patch's lattice
    };
    static constexpr std::size_t kMostVertices = 24;
    static constexpr std::size_t kMostTriangles = 20;

    Kind kind = Kind::Interior;
    std::array<Vertex, 2> ends; ///< as part 0 sees them; a border's or corner's end first
    std::array<std::uint32_t, 2> patches{kNoPatch, kNoPatch};
    std::array<unsigned, 2> sides{}; ///< of the patches, the border; for the border kinds
    std::array<std::int32_t, 2>
        beside{};        ///< Border kinds: where, along side 0, the vertices before and after the ends lie
    bool isOpen = false; ///< the border is one of the surface
    FixedList<Vertex, kMostVertices> vertices;
    FixedList<Triangle, kMostTriangles> triangles;

    bool onBorder() const { return kind == Kind::BorderEdge || kind == Kind::BorderEnd; }
    /// A parameter of part 0, on the border if the kind says so, as `part` sees it.
    ChartPoint inPart(unsigned part, ChartPoint parameter) const
    {
        return part == 0 ? parameter : borderParameter(sides[1], ChartPoint::kUnits - alongBorder(sides[0], parameter));
    }
};

/// The star of the edge from `from` to the next point in direction(k).
OSGTESSLOD_EXPORT CollapseStar collapseStar(const StripMesh& mesh, StripMesh::Site from, unsigned k);

/// True if no triangle that survives is turned over or degenerate in the chart once the ends have merged at
/// `parameter` (of part 0).
OSGTESSLOD_EXPORT bool isValid(const CollapseStar& star, ChartPoint parameter);

/// True if the star's own triangles all are positive.
OSGTESSLOD_EXPORT bool isPositive(const CollapseStar& star);

} // namespace osgTessLOD::bake
