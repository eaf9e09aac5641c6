// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Connectivity of one patch on the way from the pattern of factor f to that of f − 2 (Lambert §4.3).
///
/// The pattern is a hexagon of the triangular lattice: its corners are the patch corners C and the border middles M in
/// turn, ring m is the hexagon of side m about the centre. Strip k, which belongs to patch corner k, shortens the two
/// opposite hexagon sides M(k)–C(k+1) and M(k−1)–C(k−1), one edge of each lattice line between them; they are `length(k)`
/// edges long. All of the connectivity follows from the three lengths; factor f is the one with all three equal to f / 2.
///
///               M1 ─── C1                     y
///              ╱         ╲                      ╲      direction(0) = (1, 1)
///            C2    ·      M0                      ── x     direction(1) = (−1, 0)
///              ╲         ╱                    lattice axes at 120°, direction(2) = (0, −1)
///               M2 ─── C0                     drawn without regard to turning
///
/// Points have integer coordinates (x, y) with C0 at (0, 0), side 0 starting along x; each unit cell is cut along (1, 1).
class OSGTESSLOD_EXPORT StripLattice {
public:
    struct Point {
        int x = 0;
        int y = 0;
        bool operator==(const Point& o) const { return x == o.x && y == o.y; }
        bool operator!=(const Point& o) const { return !(*this == o); }
        Point operator+(Point o) const { return {x + o.x, y + o.y}; }
        Point operator-(Point o) const { return {x - o.x, y - o.y}; }
        Point operator*(int n) const { return {x * n, y * n}; }
    };
    /// A point, or the edge from it in direction(k), by line and place on it: how strip k sees the patch.
    struct Place {
        unsigned row;   ///< 0 on side k … rows(k) − 1 on side k − 1
        unsigned index; ///< counted from the end of the line that is nearer to corner k
    };
    /// The neighbours of a point, counter-clockwise; with the next one each makes a triangle.
    static constexpr std::array<Point, 6> kNeighbours{{{1, 0}, {1, 1}, {0, 1}, {-1, 0}, {-1, -1}, {0, -1}}};

    /// The pattern of an even factor ≥ 2.
    explicit StripLattice(unsigned factor);

    unsigned length(unsigned k) const { return _lengths[k]; }
    /// The factor whose pattern this is, 0 between patterns.
    unsigned factor() const { return _lengths[0] == _lengths[1] && _lengths[1] == _lengths[2] ? 2 * _lengths[0] : 0; }

    /// Number of point indices, some of which belong to no point; stays the same when strips are contracted.
    std::uint32_t indexCount() const { return static_cast<std::uint32_t>(_stride * _stride); }
    std::uint32_t index(Point p) const { return static_cast<std::uint32_t>(p.y * _stride + p.x); }
    Point point(std::uint32_t index) const
    {
        return {static_cast<int>(index) % _stride, static_cast<int>(index) / _stride};
    }
    bool contains(Point p) const
    {
        return p.x >= 0 && p.y >= 0 && p.x <= _most.x && p.y <= _most.y && p.x - p.y <= static_cast<int>(_lengths[1]) &&
               p.y - p.x <= static_cast<int>(_lengths[2]);
    }

    /// Triangle `turn` of the six around a point: (p, p + kNeighbours[turn], p + kNeighbours[turn + 1]), whose index is
    /// the same from each of its three corners.
    std::uint32_t triangle(Point p, unsigned turn) const
    {
        const Point cell = p + kCells[turn];
        return 2 * index(cell) + turn % 2;
    }
    std::uint32_t triangleIndexCount() const { return 2 * indexCount(); }
    /// Corners, counter-clockwise as the patch's, of a triangle index.
    std::array<Point, 3> corners(std::uint32_t triangle) const
    {
        const Point p = point(triangle / 2);
        const Point diagonal{p.x + 1, p.y + 1};
        return triangle % 2 == 0 ? std::array<Point, 3>{p, Point{p.x + 1, p.y}, diagonal}
                                 : std::array<Point, 3>{p, diagonal, Point{p.x, p.y + 1}};
    }
    bool hasTriangle(std::uint32_t triangle) const
    {
        const auto c = corners(triangle);
        return contains(c[0]) && contains(c[1]) && contains(c[2]);
    }
    /// The triangle across the edge from corner `side` to the next; may not exist.
    std::uint32_t across(std::uint32_t triangle, unsigned side) const;

    /// Direction in which strip k's lines run, and its edges point.
    static Point direction(unsigned k) { return kDirections[k]; }
    Point corner(unsigned k) const;
    Point middle(unsigned side) const;
    unsigned sideLength(unsigned side) const { return _lengths[(side + 1) % 3] + _lengths[side]; }
    /// Point `step` ≤ sideLength edges along a side from corner `side`.
    Point border(unsigned side, unsigned step) const;
    /// The side that p, no corner, lies within, 3 if none; `step` along it.
    unsigned sideOf(Point p, unsigned& step) const;
    bool isCorner(Point p) const { return p == corner(0) || p == corner(1) || p == corner(2); }

    unsigned rows(unsigned k) const { return _lengths[(k + 1) % 3] + _lengths[(k + 2) % 3] + 1; }
    /// Edges on a line.
    unsigned width(unsigned k, unsigned row) const;
    /// The edges that strip k may take on line row + 1 after edge i on line `row` are i + shift and i + shift + 1, as far
    /// as there are such.
    int shift(unsigned k, unsigned row) const { return row < _lengths[(k + 1) % 3] ? 0 : -1; }
    Point point(unsigned k, Place place) const;
    Place place(unsigned k, Point p) const;

    /// The pattern's vertex at a point and back; factor() ≠ 0.
    std::uint32_t patternVertex(Point p) const;
    Point patternPoint(std::uint32_t vertex) const;

    /// Contracts edge `strip[row]` of every line of strip k, whose edges must follow one another. Returns for every point
    /// index its index afterwards (its own value means nothing where there is no point).
    std::vector<std::uint32_t> contract(unsigned k, const std::vector<unsigned>& strip);
    /// True if each edge of `strip` exists and may follow the one before.
    bool isStrip(unsigned k, const std::vector<unsigned>& strip) const;

private:
    static constexpr std::array<Point, 3> kDirections{{{1, 1}, {-1, 0}, {0, -1}}};
    static constexpr std::array<Point, 6> kCells{{{0, 0}, {0, 0}, {-1, 0}, {-1, -1}, {-1, -1}, {0, -1}}};

    void setLength(unsigned k, unsigned length);

    int _stride;
    std::array<unsigned, 3> _lengths{};
    Point _most; ///< largest coordinates
};

} // namespace osgTessLOD::bake
