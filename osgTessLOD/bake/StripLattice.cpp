// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.3 and fig. 4.2. That the unfolded patch is a
// lattice hexagon is the observation that makes the thesis' half-edge walks unnecessary: a strip is one edge index per
// lattice line, and contracting it moves the far part of every line by one.
#include <osgTessLOD/bake/StripLattice.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cassert>

namespace osgTessLOD::bake {

StripLattice::StripLattice(unsigned factor)
    : _stride(static_cast<int>(factor) + 1)
{
    assert(factor >= 2 && factor % 2 == 0);
    for (unsigned k = 0; k < 3; ++k) { setLength(k, factor / 2); }
}

void StripLattice::setLength(unsigned k, unsigned length)
{
    _lengths[k] = length;
    _most = {static_cast<int>(_lengths[0] + _lengths[1]), static_cast<int>(_lengths[0] + _lengths[2])};
}

std::uint32_t StripLattice::across(std::uint32_t triangle, unsigned side) const
{
    // Even triangles are (0,0) (1,0) (1,1) of their cell, odd ones (0,0) (1,1) (0,1).
    static constexpr std::array<std::array<Point, 3>, 2> kAcross{
        {{{{0, -1}, {1, 0}, {0, 0}}}, {{{0, 0}, {0, 1}, {-1, 0}}}}};
    const Point cell = point(triangle / 2) + kAcross[triangle % 2][side];
    if (cell.x < 0 || cell.y < 0 || cell.x >= _stride || cell.y >= _stride) { return triangleIndexCount(); }
    return 2 * index(cell) + (1 - triangle % 2);
}

StripLattice::Point StripLattice::corner(unsigned k) const
{
    const int a = static_cast<int>(_lengths[0]), b = static_cast<int>(_lengths[1]), c = static_cast<int>(_lengths[2]);
    return k == 0 ? Point{0, 0} : k == 1 ? Point{a + b, a} : Point{a, a + c};
}

StripLattice::Point StripLattice::middle(unsigned side) const
{
    return border(side, _lengths[(side + 1) % 3]);
}

StripLattice::Point StripLattice::border(unsigned side, unsigned step) const
{
    const unsigned next = (side + 1) % 3;
    const unsigned first = std::min(step, _lengths[next]);
    return corner(side) - direction(next) * static_cast<int>(first) + direction(side) * static_cast<int>(step - first);
}

unsigned StripLattice::sideOf(Point p, unsigned& step) const
{
    if (isCorner(p)) { return 3; }
    const int b = static_cast<int>(_lengths[1]), c = static_cast<int>(_lengths[2]);
    const auto along = [&](unsigned side, int distance) {
        step = static_cast<unsigned>(distance);
        return side;
    };
    if (p.y == 0) { return along(0, p.x); }
    if (p.x - p.y == b) { return along(0, b + p.y); }
    if (p.x == _most.x) { return along(1, p.y - static_cast<int>(_lengths[0])); }
    if (p.y == _most.y) { return along(1, c + _most.x - p.x); }
    if (p.y - p.x == c) { return along(2, static_cast<int>(_lengths[0]) - p.x); }
    if (p.x == 0) { return along(2, static_cast<int>(_lengths[0]) + c - p.y); }
    return 3;
}

unsigned StripLattice::width(unsigned k, unsigned row) const
{
    const unsigned near = _lengths[(k + 1) % 3], far = _lengths[(k + 2) % 3];
    return _lengths[k] + std::min(row, far) - (row > near ? row - near : 0);
}

StripLattice::Point StripLattice::point(unsigned k, Place place) const
{
    const unsigned next = (k + 1) % 3, near = _lengths[next];
    const int before = static_cast<int>(std::min(place.row, near));
    const int after = static_cast<int>(place.row) - before;
    return middle(k) + direction(next) * before - direction((k + 2) % 3) * after +
           direction(k) * static_cast<int>(place.index);
}

StripLattice::Place StripLattice::place(unsigned k, Point p) const
{
    const auto line = [&](Point q) { return k == 0 ? q.y - q.x : k == 1 ? -q.y : q.x; };
    const auto row = static_cast<unsigned>(line(p) - line(middle(k)));
    const Point from = p - point(k, {row, 0});
    const int index = k == 0 ? from.x : k == 1 ? -from.x : -from.y;
    return {row, static_cast<unsigned>(index)};
}

std::uint32_t StripLattice::patternVertex(Point p) const
{
    assert(factor() != 0);
    const int half = static_cast<int>(_lengths[0]);
    const Point d{p.x - half, p.y - half};
    const int ring = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.x - d.y)});
    if (ring == 0) { return TessellationPattern::vertexCount(factor()) - 1; }
    StripLattice hexagon(static_cast<unsigned>(2 * ring));
    const Point q{d.x + ring, d.y + ring};
    unsigned step = 0, side = hexagon.sideOf(q, step);
    for (unsigned k = 0; side == 3; ++k) {
        assert(k < 3);
        if (q == hexagon.corner(k)) { side = k; }
    }
    return TessellationPattern::index(factor(), TessellationPattern::Place{static_cast<unsigned>(ring), side, step});
}

StripLattice::Point StripLattice::patternPoint(std::uint32_t vertex) const
{
    assert(factor() != 0);
    const int half = static_cast<int>(_lengths[0]);
    const TessellationPattern::Place at = TessellationPattern::place(factor(), vertex);
    if (at.ring == 0) { return {half, half}; }
    const int inset = half - static_cast<int>(at.ring);
    return StripLattice(2 * at.ring).border(at.side, at.step) + Point{inset, inset};
}

bool StripLattice::isStrip(unsigned k, const std::vector<unsigned>& strip) const
{
    if (strip.size() != rows(k)) { return false; }
    for (unsigned row = 0; row < strip.size(); ++row) {
        if (strip[row] >= width(k, row)) { return false; }
        if (row == 0) { continue; }
        const int step = static_cast<int>(strip[row]) - static_cast<int>(strip[row - 1]) - shift(k, row - 1);
        if (step != 0 && step != 1) { return false; }
    }
    return true;
}

std::vector<std::uint32_t> StripLattice::contract(unsigned k, const std::vector<unsigned>& strip)
{
    assert(_lengths[k] >= 2 && isStrip(k, strip));
    StripLattice contracted = *this;
    contracted.setLength(k, _lengths[k] - 1);
    std::vector<std::uint32_t> after(indexCount(), 0);
    for (unsigned row = 0; row < rows(k); ++row) {
        const Point from = point(k, {row, 0}), to = contracted.point(k, {row, 0});
        for (unsigned i = 0; i <= width(k, row); ++i) {
            const int moved = static_cast<int>(i > strip[row] ? i - 1 : i);
            after[index(from + direction(k) * static_cast<int>(i))] = index(to + direction(k) * moved);
        }
    }
    *this = contracted;
    return after;
}

} // namespace osgTessLOD::bake
