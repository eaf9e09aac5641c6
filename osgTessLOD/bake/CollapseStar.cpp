// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/CollapseStar.h>

#include <algorithm>

namespace osgTessLOD::bake {

namespace {

using Point = StripLattice::Point;

/// Adds to a star the triangles around points of one patch.
class PartCollector {
public:
    PartCollector(const StripMesh& mesh, std::uint32_t patch, std::uint8_t part, CollapseStar& star)
        : _patch(mesh.patch(patch))
        , _part(part)
        , _star(star)
        , _first(star.vertices.size())
    {
        star.patches[part] = patch;
    }

    CollapseStar::Vertex vertex(Point p) const
    {
        const std::uint32_t index = _patch.lattice.index(p);
        return {_patch.positions[index], _patch.parameters[index]};
    }

    /// The triangles around `center`, without those at `done`; those at `end` too do not survive.
    void addAround(Point center, Point end, Point done)
    {
        const StripLattice& lattice = _patch.lattice;
        for (unsigned turn = 0; turn < 6; ++turn) {
            const Point p = center + StripLattice::kNeighbours[turn];
            const Point q = center + StripLattice::kNeighbours[(turn + 1) % 6];
            if (p == done || q == done || !lattice.contains(p) || !lattice.contains(q)) { continue; }
            const std::uint8_t a = number(center), b = number(p), c = number(q);
            if (a == b || b == c || c == a) { continue; } // collapsed before
            _star.triangles.push_back({{a, b, c}, p != end && q != end, _part, lattice.triangle(center, turn)});
        }
    }

private:
    /// The vertex at p in the star's list. Points that have merged are one vertex: they have the same parameter.
    std::uint8_t number(Point p)
    {
        const CollapseStar::Vertex own = vertex(p);
        for (std::size_t v = _first; v < _star.vertices.size(); ++v) {
            if (_star.vertices[v].parameter == own.parameter) { return static_cast<std::uint8_t>(v); }
        }
        _star.vertices.push_back(own);
        return static_cast<std::uint8_t>(_star.vertices.size() - 1);
    }

    const StripMesh::Patch& _patch;
    std::uint8_t _part;
    CollapseStar& _star;
    std::size_t _first; ///< first vertex of this part
};

constexpr Point kNone{-9, -9};

/// Next to a border's middle M, contracting (z, w) flattens triangle (w, M, y) onto the border. It is gone once the strip has
/// contracted (M, y) too, which it must: no other edge on that line follows (z, w).
///
///     z ─── M ─── y      border
///       ╲  ╱ ╲  ╱
///         w
void leaveOutFlattened(CollapseStar& star)
{
    const auto isOnBorder = [&](std::uint8_t v) {
        const ChartPoint p = star.vertices[v].parameter;
        return borderParameter(star.sides[0], alongBorder(star.sides[0], p)) == p;
    };
    for (std::size_t t = 0; t < star.triangles.size(); ++t) {
        CollapseStar::Triangle& triangle = star.triangles[t];
        if (triangle.part == 0 && isOnBorder(triangle.vertices[1]) && isOnBorder(triangle.vertices[2])) {
            triangle.survives = false;
        }
    }
}

/// The border kinds: what lies across the border, and beside the ends on it.
void addBorder(const StripMesh& mesh, const PartCollector& own, Point other, unsigned side, unsigned step,
               CollapseStar& star)
{
    const bool isEdge = star.kind == CollapseStar::Kind::BorderEdge;
    const std::uint32_t patch = star.patches[0];
    const StripLattice& lattice = mesh.patch(patch).lattice;
    unsigned otherStep = step;
    if (isEdge) { lattice.sideOf(other, otherStep); }
    const auto along = [&](unsigned s) { return alongBorder(side, own.vertex(lattice.border(side, s)).parameter); };
    star.beside = {along(std::min(step, otherStep) - 1), along(std::max(step, otherStep) + 1)};
    star.sides[0] = side;
    if (!isEdge) { leaveOutFlattened(star); }

    const StripMesh::Site twin = mesh.twin(patch, side, step);
    star.isOpen = twin.patch == kNoPatch;
    if (star.isOpen) { return; }
    unsigned twinStep = 0;
    star.sides[1] = mesh.patch(twin.patch).lattice.sideOf(twin.point, twinStep);
    PartCollector across(mesh, twin.patch, 1, star);
    const Point twinOther = isEdge ? mesh.twin(patch, side, otherStep).point : kNone;
    across.addAround(twin.point, twinOther, kNone);
    if (isEdge) { across.addAround(twinOther, kNone, twin.point); }
}

/// The other end moves onto the corner: only its own triangles change.
void addAtCorner(const StripMesh& mesh, PartCollector& own, Point corner, Point other, CollapseStar& star)
{
    own.addAround(other, corner, kNone);
    unsigned step = 0;
    const std::uint32_t patch = star.patches[0];
    const StripLattice& lattice = mesh.patch(patch).lattice;
    const unsigned side = lattice.sideOf(other, step);
    if (side == 3) { return; }
    star.sides[0] = side;
    const StripMesh::Site twin = mesh.twin(patch, side, step);
    star.isOpen = twin.patch == kNoPatch;
    if (star.isOpen) { return; }
    const unsigned cornerStep = corner == lattice.corner(side) ? 0 : lattice.sideLength(side);
    unsigned twinStep = 0;
    star.sides[1] = mesh.patch(twin.patch).lattice.sideOf(twin.point, twinStep);
    PartCollector(mesh, twin.patch, 1, star).addAround(twin.point, mesh.twin(patch, side, cornerStep).point, kNone);
}

} // namespace

CollapseStar collapseStar(const StripMesh& mesh, StripMesh::Site from, unsigned k)
{
    const StripLattice& lattice = mesh.patch(from.patch).lattice;
    Point end = from.point, other = from.point + StripLattice::direction(k);
    unsigned step = 0, otherStep = 0;
    unsigned side = lattice.sideOf(end, step);
    unsigned otherSide = lattice.sideOf(other, otherStep);
    const bool otherFirst = lattice.isCorner(other) || (otherSide != 3 && side == 3 && !lattice.isCorner(end));
    if (otherFirst) {
        std::swap(end, other);
        std::swap(side, otherSide);
        std::swap(step, otherStep);
    }
    CollapseStar star;
    PartCollector own(mesh, from.patch, 0, star);
    star.ends = {own.vertex(end), own.vertex(other)};
    if (lattice.isCorner(end)) {
        star.kind = CollapseStar::Kind::Corner;
        addAtCorner(mesh, own, end, other, star);
        return star;
    }
    own.addAround(end, other, kNone);
    own.addAround(other, kNone, end);
    if (side == 3) { return star; }
    star.kind = otherSide == side ? CollapseStar::Kind::BorderEdge : CollapseStar::Kind::BorderEnd;
    addBorder(mesh, own, other, side, step, star);
    return star;
}

bool isValid(const CollapseStar& star, ChartPoint parameter)
{
    const std::array<ChartPoint, 2> merged{parameter,
                                           star.patches[1] == kNoPatch ? parameter : star.inPart(1, parameter)};
    return std::all_of(star.triangles.begin(), star.triangles.end(), [&](const CollapseStar::Triangle& t) {
        return !t.survives || orientation(merged[t.part], star.vertices[t.vertices[1]].parameter,
                                          star.vertices[t.vertices[2]].parameter) > 0;
    });
}

bool isPositive(const CollapseStar& star)
{
    return std::all_of(star.triangles.begin(), star.triangles.end(), [&](const CollapseStar::Triangle& t) {
        return orientation(star.vertices[t.vertices[0]].parameter, star.vertices[t.vertices[1]].parameter,
                           star.vertices[t.vertices[2]].parameter) > 0;
    });
}

} // namespace osgTessLOD::bake
