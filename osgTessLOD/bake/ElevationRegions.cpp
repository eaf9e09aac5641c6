// SPDX-License-Identifier: MIT
// Yotam Livny, Gilad Bauman, Jihad El-Sana, "Displacement patches for view-dependent rendering", The Visual Computer, 2012,
// §3.2, §3.3. There, cones of normals around vertices are compared when edges collapse; here, triangles and the very rays that meet them.
#include <osgTessLOD/bake/ElevationRegions.h>

#include <Eigen/Geometry>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

/// Weights, and shares of an edge, that are 0 up to rounding.
constexpr double kOnBorder = 1e-9;
/// How far the ends of different walks to a point, or different solutions for it, may be apart.
constexpr double kSamePlace = 1e-7;
/// More patches than this along one edge, or while looking for a vertex, mean that there is no end.
constexpr unsigned kMostSteps = 4096;
constexpr unsigned kNoSide = 3;
/// Least RayPrism::opening.
constexpr double kLeastOpening = 0.01;

ElevationRegions::Overlap boxOf(std::uint32_t triangle, const PrismPoint& point)
{
    return {triangle, point.barycentric, point.barycentric, point.height, point.height};
}

} // namespace

ElevationRegions::ElevationRegions(const SourceMesh& source, const ElevationBase& base)
    : _source(source)
    , _base(base)
    , _sourceTopology(PatchTopology::build(static_cast<std::uint32_t>(source.positions.size()), source.triangles))
    , _patchesAround(base.vertices.size())
    , _baseOf(source.positions.size(), ElevationBase::kNone)
    , _isOwn(source.triangles.size(), 0)
    , _overlaps(base.prisms.size())
    , _fails(base.prisms.size(), 0)
{
    for (std::uint32_t v = 0; v < base.vertices.size(); ++v) { _baseOf[base.vertices[v]] = v; }
    for (std::uint32_t p = 0; p < base.prisms.size(); ++p) {
        for (unsigned k = 0; k < 3; ++k) { _patchesAround[base.topology.patches[p][k]].emplace_back(p, k); }
        if (base.ownTriangle[p] != ElevationBase::kNone) { _isOwn[base.ownTriangle[p]] = 1; }
    }
    locateVertices();
    _pieces.resize(_sourceTopology.edges.size());
    _isWalked.resize(_pieces.size());
    tbb::parallel_for(std::size_t{0}, _pieces.size(), [&](std::size_t e) {
        const auto& ends = _sourceTopology.edges[e].vertices;
        _isWalked[e] = walk(ends[0], ends[1], _pieces[e]) && endsAt(_pieces[e].back().last, ends[1]) ? 1 : 0;
    });
    gatherTriangles();
    countHits();
    for (std::size_t p = 0; p < _fails.size(); ++p) {
        if (base.ownTriangle[p] != ElevationBase::kNone) { _fails[p] = 0; }
    }
}

bool ElevationRegions::isElevation() const
{
    return std::find(_fails.begin(), _fails.end(), 1) == _fails.end();
}

/// The same ray, of side `side` of the patch at `at`, as the patch across has it; not found across a boundary.
ElevationRegions::Location ElevationRegions::cross(const Location& at, unsigned side, double share, double height) const
{
    const PatchTopology::Edge& edge = _base.topology.edges[_base.topology.patchEdges[at.patch][side]];
    const std::size_t other = edge.patches[0] == at.patch && edge.sides[0] == side ? 1 : 0;
    if (edge.patches[other] == kNoPatch) { return {}; }
    Location across{edge.patches[other], {Vector3d::Zero(), height}};
    const unsigned first = edge.sides[other];
    across.point.barycentric[first] = share;
    across.point.barycentric[(first + 1) % 3] = 1.0 - share;
    return across;
}

ElevationRegions::Location ElevationRegions::locate(const Vector3d& point, const Location& near) const
{
    constexpr unsigned kMostPatches = 64;
    Location at = near;
    for (unsigned step = 0; step < kMostPatches && at.patch != ElevationBase::kNone; ++step) {
        const std::optional<PrismPoint> found = _base.prisms[at.patch].locate(point, at.point);
        if (!found) { return {}; }
        at.point = *found;
        unsigned corner = 0;
        if (at.point.barycentric.minCoeff(&corner) >= -kOnBorder) { return at; }
        const unsigned side = (corner + 1) % 3;
        const double along = at.point.barycentric[side] + at.point.barycentric[(side + 1) % 3];
        const double share = std::clamp(at.point.barycentric[(side + 1) % 3] / along, 0.0, 1.0);
        at = cross(at, side, share, at.point.height);
    }
    return {};
}

/// From the base vertices on, each vertex where an edge from one that is found leads to.
void ElevationRegions::locateVertices()
{
    std::vector<std::vector<std::uint32_t>> neighbours(_source.positions.size());
    for (const PatchTopology::Edge& edge : _sourceTopology.edges) {
        for (const std::size_t k : {0U, 1U}) { neighbours[edge.vertices[k]].push_back(edge.vertices[1 - k]); }
    }
    _vertices.resize(_source.positions.size());
    std::vector<std::uint32_t> found = _base.vertices;
    for (const std::uint32_t v : found) {
        const auto& [patch, corner] = _patchesAround[_baseOf[v]].front();
        _vertices[v] = {patch, {Vector3d::Unit(corner), 0.0}};
    }
    Pieces pieces;
    for (std::size_t i = 0; i < found.size(); ++i) {
        for (const std::uint32_t next : neighbours[found[i]]) {
            if (_vertices[next].patch != ElevationBase::kNone) { continue; }
            pieces.clear();
            if (!walk(found[i], next, pieces)) { continue; }
            Location& at = _vertices[next];
            at = pieces.back().last;
            // What is beyond a border by rounding is on it.
            at.point.barycentric = at.point.barycentric.cwiseMax(0.0);
            at.point.barycentric /= at.point.barycentric.sum();
            found.push_back(next);
        }
    }
}

/// A vertex as the patch has it that a line in this direction from there runs in.
ElevationRegions::Location ElevationRegions::startOf(std::uint32_t vertex, const Vector3d& direction) const
{
    Location start = _vertices[vertex];
    if (start.patch == ElevationBase::kNone) { return start; }
    if (_baseOf[vertex] != ElevationBase::kNone) {
        double best = -std::numeric_limits<double>::infinity();
        for (const auto& [patch, corner] : _patchesAround[_baseOf[vertex]]) {
            const PrismPoint there{Vector3d::Unit(corner), 0.0};
            const Vector3d change = _base.prisms[patch].derivative(there, direction).barycentric;
            const double inside = std::min(change[(corner + 1) % 3], change[(corner + 2) % 3]) / change.norm();
            if (inside > best) {
                best = inside;
                start = {patch, there};
            }
        }
        return start;
    }
    unsigned corner = 0;
    if (start.point.barycentric.minCoeff(&corner) > kOnBorder) { return start; }
    const Vector3d change = _base.prisms[start.patch].derivative(start.point, direction).barycentric;
    if (change[corner] >= -kOnBorder * change.norm()) { return start; }
    const unsigned side = (corner + 1) % 3;
    return cross(start, side, start.point.barycentric[(side + 1) % 3], start.point.height);
}

/// Is this where the vertex was found?
bool ElevationRegions::endsAt(const Location& last, std::uint32_t vertex) const
{
    const Location& own = _vertices[vertex];
    if (own.patch == ElevationBase::kNone) { return false; }
    const auto near = [](const PrismPoint& a, const PrismPoint& b) {
        return (a.barycentric - b.barycentric).norm() < kSamePlace && std::fabs(a.height - b.height) < kSamePlace;
    };
    if (_baseOf[vertex] != ElevationBase::kNone) {
        const auto& around = _patchesAround[_baseOf[vertex]];
        return std::any_of(around.begin(), around.end(), [&](const auto& corner) {
            return corner.first == last.patch && near(last.point, {Vector3d::Unit(corner.second), 0.0});
        });
    }
    if (own.patch == last.patch) { return near(own.point, last.point); }
    for (unsigned side = 0; side < 3; ++side) { // on a border, it may be the other patch's
        if (std::fabs(own.point.barycentric[(side + 2) % 3]) > kSamePlace) { continue; }
        const Location other = cross(own, side, own.point.barycentric[(side + 1) % 3], own.point.height);
        if (other.patch == last.patch && near(other.point, last.point)) { return true; }
    }
    return false;
}

/// Where a line that is in a patch since piece.from first leaves it, before its end: the crossing that continues it, as a side's
/// rays may be met again far away.
bool ElevationRegions::findExit(const Piece& piece, unsigned entered, const Vector3d& origin, const Vector3d& direction,
                                unsigned& side, RayPrism::Crossing& exit) const
{
    const RayPrism& prism = _base.prisms[piece.first.patch];
    struct Candidate {
        RayPrism::Crossing crossing;
        unsigned side;
    };
    std::vector<Candidate> candidates;
    std::vector<RayPrism::Crossing> crossings;
    for (unsigned k = 0; k < 3; ++k) {
        crossings.clear();
        prism.crossings(k, origin, direction, crossings);
        for (const RayPrism::Crossing& c : crossings) {
            const double least = k == entered ? piece.from + kOnBorder : piece.from - kOnBorder;
            if (c.along > std::max(least, kOnBorder) && c.along < 1.0 - kOnBorder) { candidates.push_back({c, k}); }
        }
    }
    std::sort(candidates.begin(), candidates.end(),
              [](const Candidate& a, const Candidate& b) { return a.crossing.along < b.crossing.along; });
    for (const Candidate& candidate : candidates) {
        const auto there = prism.locate(origin + candidate.crossing.along * direction, piece.first.point);
        if (!there || std::fabs(there->height - candidate.crossing.height) > kSamePlace ||
            std::fabs(there->barycentric[(candidate.side + 2) % 3]) > kSamePlace) {
            continue;
        }
        side = candidate.side;
        exit = candidate.crossing;
        return true;
    }
    return false;
}

/// Follows an edge from where one vertex was found; false if that leads nowhere.
bool ElevationRegions::walk(std::uint32_t from, std::uint32_t to, Pieces& pieces) const
{
    const Vector3d origin = _source.positions[from];
    const Vector3d direction = _source.positions[to] - origin;
    Location at = startOf(from, direction);
    double along = 0.0;
    unsigned entered = kNoSide;
    for (unsigned step = 0; step < kMostSteps && at.patch != ElevationBase::kNone; ++step) {
        Piece piece{at, at, along, 1.0};
        unsigned side = 0;
        RayPrism::Crossing exit{};
        if (!findExit(piece, entered, origin, direction, side, exit)) {
            const auto last = _base.prisms[at.patch].locate(origin + direction, at.point);
            if (!last || last->barycentric.minCoeff() < -kSamePlace) { return false; }
            piece.last.point = *last;
            pieces.push_back(piece);
            return true;
        }
        piece.to = exit.along;
        piece.last.point = {Vector3d::Zero(), exit.height};
        piece.last.point.barycentric[side] = 1.0 - exit.share;
        piece.last.point.barycentric[(side + 1) % 3] = exit.share;
        pieces.push_back(piece);
        const PatchTopology::Edge& edge = _base.topology.edges[_base.topology.patchEdges[at.patch][side]];
        at = cross(at, side, exit.share, exit.height);
        entered = edge.patches[0] == at.patch ? edge.sides[0] : edge.sides[1];
        along = exit.along;
    }
    return false;
}

/// A triangle fails in a patch: so do those with several triangles that it may belong to.
void ElevationRegions::failAround(std::uint32_t triangle, std::uint32_t patch, std::vector<std::uint32_t>& failed) const
{
    failed.push_back(patch);
    for (const std::uint32_t v : _source.triangles[triangle]) {
        failed.push_back(_base.guesses[v].face);
        if (_vertices[v].patch != ElevationBase::kNone) { failed.push_back(_vertices[v].patch); }
        if (_baseOf[v] == ElevationBase::kNone || _base.ownTriangle[patch] == ElevationBase::kNone) { continue; }
        for (const auto& around : _patchesAround[_baseOf[v]]) { failed.push_back(around.first); }
    }
}

/// Condition 2 for a triangle in one of its patches.
bool ElevationRegions::facesRays(std::uint32_t triangle, std::uint32_t patch) const
{
    const auto& t = _source.triangles[triangle];
    const Vector3d& a = _source.positions[t[0]];
    const Vector3d normal = (_source.positions[t[1]] - a).cross(_source.positions[t[2]] - a).normalized();
    const RayPrism& prism = _base.prisms[patch];
    Vector3d cosine; // above the least, at the patch's corners: linear in between
    for (unsigned k = 0; k < 3; ++k) { cosine[k] = prism.normals[k].dot(normal) - kLeastCosine; }
    if (cosine.minCoeff() >= 0.0) { return true; }
    std::vector<Vector3d> ends; // of the straight line where it is zero
    for (unsigned k = 0; k < 3; ++k) {
        const unsigned next = (k + 1) % 3;
        if ((cosine[k] < 0.0) == (cosine[next] < 0.0)) { continue; }
        Vector3d end = Vector3d::Zero();
        end[k] = cosine[next] / (cosine[next] - cosine[k]);
        end[next] = 1.0 - end[k];
        ends.push_back(end);
    }
    if (ends.size() != 2) { return false; }
    for (const std::uint32_t e : _sourceTopology.patchEdges[triangle]) {
        const auto& vertices = _sourceTopology.edges[e].vertices;
        const Vector3d& origin = _source.positions[vertices[0]];
        const Vector3d direction = _source.positions[vertices[1]] - origin;
        for (const Piece& piece : _pieces[e]) {
            if (piece.first.patch != patch) { continue; }
            if (cosine.dot(piece.first.point.barycentric) < 0.0 || cosine.dot(piece.last.point.barycentric) < 0.0 ||
                prism.meets(ends[0], ends[1], origin, direction, piece.from, piece.to)) {
                return false;
            }
        }
    }
    return true;
}

/// The patches of a triangle, and those that fail for it.
void ElevationRegions::gather(std::uint32_t triangle, std::vector<std::pair<std::uint32_t, Overlap>>& overlaps,
                              std::vector<std::uint32_t>& failed) const
{
    for (const std::uint32_t e : _sourceTopology.patchEdges[triangle]) {
        if (_isWalked[e] == 0) {
            failAround(triangle, _base.guesses[_sourceTopology.edges[e].vertices[0]].face, failed);
        }
        for (const Piece& piece : _pieces[e]) {
            const auto same = std::find_if(overlaps.begin(), overlaps.end(),
                                           [&](const auto& o) { return o.first == piece.first.patch; });
            Overlap& box = same != overlaps.end()
                               ? same->second
                               : overlaps.emplace_back(piece.first.patch, boxOf(triangle, piece.first.point)).second;
            for (const PrismPoint& end : {piece.first.point, piece.last.point}) {
                box.low = box.low.cwiseMin(end.barycentric);
                box.high = box.high.cwiseMax(end.barycentric);
                box.lowest = std::min(box.lowest, end.height);
                box.highest = std::max(box.highest, end.height);
            }
        }
    }
    for (const auto& [patch, box] : overlaps) {
        // A triangle of the source that is a patch shares no more than its outline with others.
        const bool isFull = _base.ownTriangle[patch] != ElevationBase::kNone;
        if (isFull ? box.high.minCoeff() > kSamePlace : !facesRays(triangle, patch)) {
            failAround(triangle, patch, failed);
        }
    }
}

void ElevationRegions::gatherTriangles()
{
    const std::size_t triangles = _source.triangles.size();
    std::vector<std::vector<std::pair<std::uint32_t, Overlap>>> overlaps(triangles);
    std::vector<std::vector<std::uint32_t>> failed(triangles);
    tbb::parallel_for(std::size_t{0}, triangles, [&](std::size_t t) {
        if (_isOwn[t] == 0) { gather(static_cast<std::uint32_t>(t), overlaps[t], failed[t]); }
    });
    for (std::size_t t = 0; t < triangles; ++t) {
        for (const auto& [patch, overlap] : overlaps[t]) { _overlaps[patch].push_back(overlap); }
        for (const std::uint32_t patch : failed[t]) { _fails[patch] = 1; }
    }
}

std::array<double, 2> ElevationRegions::reach(std::uint32_t patch) const
{
    constexpr double kFarther = 0.25;
    double low = 0.0;
    double high = 0.0;
    for (const Overlap& overlap : _overlaps[patch]) {
        low = std::min(low, overlap.lowest);
        high = std::max(high, overlap.highest);
    }
    const double margin = kFarther * (high - low);
    return {low - margin, high + margin};
}

/// Condition 3.
bool ElevationRegions::isOpen(std::uint32_t patch) const
{
    const auto [low, high] = reach(patch);
    return _base.prisms[patch].opening(low, high) >= kLeastOpening;
}

/// Conditions 3 and 4. A ray through an edge may count for both of its triangles or none: then another one is asked.
void ElevationRegions::countHits()
{
    const std::array<Vector3d, 3> middles{
        {Vector3d::Constant(1.0 / 3.0), Vector3d(0.31, 0.37, 0.32), Vector3d(0.41, 0.27, 0.32)}};
    tbb::parallel_for(std::size_t{0}, _overlaps.size(), [&](std::size_t p) {
        const RayPrism& prism = _base.prisms[p];
        const auto hits = [&](const Vector3d& b) {
            const Vector3d start = prism.pointAt(b);
            const Vector3d ray = prism.rayAt(b);
            return std::count_if(_overlaps[p].begin(), _overlaps[p].end(), [&](const Overlap& overlap) {
                return rayWeights(_source, overlap.triangle, start, ray).minCoeff() >= 0.0;
            });
        };
        if (!isOpen(static_cast<std::uint32_t>(p))) { _fails[p] = 1; }
        if (std::none_of(middles.begin(), middles.end(), [&](const Vector3d& b) { return hits(b) == 1; })) {
            _fails[p] = 1;
        }
    });
}

Vector3d rayWeights(const SourceMesh& source, std::uint32_t triangle, const Vector3d& start, const Vector3d& ray)
{
    const auto& t = source.triangles[triangle];
    const Vector3d a = source.positions[t[0]] - start;
    const Vector3d b = source.positions[t[1]] - start;
    const Vector3d c = source.positions[t[2]] - start;
    const Vector3d volumes(ray.dot(b.cross(c)), ray.dot(c.cross(a)), ray.dot(a.cross(b)));
    const double sum = volumes.sum();
    if (!(sum > 0.0)) { return Vector3d::Constant(-std::numeric_limits<double>::infinity()); }
    return volumes / sum;
}

} // namespace osgTessLOD::bake
