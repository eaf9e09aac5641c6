// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/StretchMap.h>

#include <osgTessLOD/bake/PlaneTriangle.h>
#include <osgTessLOD/bake/StretchEmbedding.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Vector2d planar(const Vector3d& barycentric)
{
    return {barycentric[1], barycentric[2]};
}

/// Leaves of each patch, in node order.
std::vector<std::vector<std::uint32_t>> leavesByPatch(const BisectionForest& forest, std::size_t patches)
{
    std::vector<std::vector<std::uint32_t>> leaves(patches);
    for (std::uint32_t n = 0; n < forest.nodeCount(); ++n) {
        if (forest.isLeaf(n)) { leaves[forest.patchOf(n)].push_back(n); }
    }
    return leaves;
}

/// A border vertex of the forest with its place along a side of a patch: 0 at the side's first corner.
struct SideVertex {
    double along;
    std::uint32_t vertex;
};

/// The forest's vertices on side `side` of a patch, in order, both corners included.
std::vector<SideVertex> verticesOnSide(const BisectionForest& forest, const std::vector<std::uint32_t>& leaves,
                                       unsigned side)
{
    std::vector<SideVertex> vertices;
    for (const std::uint32_t leaf : leaves) {
        std::array<Vector3d, 3> b;
        for (unsigned k = 0; k < 3; ++k) { b[k] = forest.toPatch({leaf, Vector3d::Unit(k)}).barycentric; }
        for (unsigned k = 0; k < 3; ++k) {
            // Zeros stay exact zeros in a forest's coordinates.
            if (b[k][(side + 2) % 3] != 0.0 || b[(k + 1) % 3][(side + 2) % 3] != 0.0) { continue; }
            for (const unsigned end : {k, (k + 1) % 3}) {
                vertices.push_back({b[end][(side + 1) % 3], forest.corners(leaf)[end]});
            }
        }
    }
    std::sort(vertices.begin(), vertices.end(), [](const auto& a, const auto& b) { return a.along < b.along; });
    vertices.erase(std::unique(vertices.begin(), vertices.end(),
                               [](const auto& a, const auto& b) { return a.vertex == b.vertex; }),
                   vertices.end());
    return vertices;
}

} // namespace

StretchMap::StretchMap(const PatchTopology& topology, BisectionForest forest, const std::vector<char>& isKept,
                       Progress& progress)
    : _forest(std::move(forest))
    , _even(_forest.nodeCount())
    , _alongEdge(_forest.vertices().size(), 0.0)
    , _locators(topology.patches.size())
{
    progress.begin("even parameters", topology.patches.size(), "patches");
    const auto leaves = leavesByPatch(_forest, topology.patches.size());
    tbb::parallel_for(std::size_t{0}, topology.edges.size(),
                      [&](std::size_t e) { spreadBorder(topology.edges[e], leaves[topology.edges[e].patches[0]]); });
    embedPatches(topology, leaves, isKept, progress);
    tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t p) { _locators[p] = makeLocator(leaves[p]); });
    progress.end();
}

/// Parametrizes a border by its length.
void StretchMap::spreadBorder(const PatchTopology::Edge& edge, const Leaves& leaves)
{
    const auto& positions = _forest.vertices();
    const auto side = verticesOnSide(_forest, leaves, edge.sides[0]);
    std::vector<double> length(side.size(), 0.0);
    for (std::size_t i = 1; i < side.size(); ++i) {
        length[i] = length[i - 1] + (positions[side[i].vertex] - positions[side[i - 1].vertex]).norm();
    }
    for (std::size_t i = 1; i + 1 < side.size(); ++i) {
        // Coincident points still need places of their own: a little of the old parameter is kept.
        constexpr double kKept = 1e-3;
        const double share = length.back() > 0.0 ? length[i] / length.back() : side[i].along;
        _alongEdge[side[i].vertex] = (1.0 - kKept) * share + kKept * side[i].along;
    }
}

/// Leaves a border its parameters.
void StretchMap::keepBorder(const PatchTopology::Edge& edge, const Leaves& leaves)
{
    for (const SideVertex& vertex : verticesOnSide(_forest, leaves, edge.sides[0])) {
        _alongEdge[vertex.vertex] = vertex.along;
    }
}

/// Leaves a patch its parameters.
void StretchMap::keepPatch(const Leaves& leaves)
{
    for (const std::uint32_t leaf : leaves) {
        for (unsigned k = 0; k < 3; ++k) {
            _even[leaf][k] = planar(_forest.toPatch({leaf, Vector3d::Unit(k)}).barycentric);
        }
    }
}

void StretchMap::embedPatches(const PatchTopology& topology, const std::vector<Leaves>& leaves,
                              const std::vector<char>& isKept, Progress& progress)
{
    enum class State : char { kWaiting, kEmbedded, kKept };
    std::vector<State> state(leaves.size(), State::kWaiting);
    std::vector<char> toKeep = isKept;
    toKeep.resize(leaves.size(), 0);
    for (bool again = true; again;) {
        // A patch that keeps its parameters keeps its borders', so its neighbours are embedded once more.
        for (std::size_t p = 0; p < leaves.size(); ++p) {
            if (toKeep[p] == 0) { continue; }
            state[p] = State::kKept;
            keepPatch(leaves[p]);
            _keptPatches += isKept.empty() || isKept[p] == 0 ? 1 : 0;
            for (const std::uint32_t e : topology.patchEdges[p]) {
                const PatchTopology::Edge& edge = topology.edges[e];
                keepBorder(edge, leaves[edge.patches[0]]);
                for (const std::uint32_t neighbour : edge.patches) {
                    if (neighbour != kNoPatch && state[neighbour] == State::kEmbedded) { state[neighbour] = State::kWaiting; }
                }
            }
        }
        toKeep.assign(leaves.size(), 0);
        tbb::parallel_for(std::size_t{0}, leaves.size(), [&](std::size_t p) {
            if (state[p] != State::kWaiting) { return; }
            state[p] = State::kEmbedded;
            toKeep[p] = embedPatch(topology, static_cast<std::uint32_t>(p), leaves[p]) ? 0 : 1;
            progress.step(1);
        });
        again = std::find(toKeep.begin(), toKeep.end(), 1) != toKeep.end();
    }
}

bool StretchMap::embedPatch(const PatchTopology& topology, std::uint32_t patch, const Leaves& leaves)
{
    DiscMesh disc;
    std::vector<Vector2d> plane;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> numbering; // forest vertex, its number here
    for (const std::uint32_t leaf : leaves) {
        for (const std::uint32_t v : _forest.corners(leaf)) { numbering.emplace_back(v, 0); }
    }
    std::sort(numbering.begin(), numbering.end());
    numbering.erase(std::unique(numbering.begin(), numbering.end()), numbering.end());
    for (std::uint32_t i = 0; i < numbering.size(); ++i) {
        numbering[i].second = i;
        disc.positions.push_back(_forest.vertices()[numbering[i].first]);
    }
    const auto local = [&](std::uint32_t vertex) {
        return std::lower_bound(numbering.begin(), numbering.end(), std::make_pair(vertex, 0U))->second;
    };
    plane.resize(numbering.size());
    disc.isFixed.assign(numbering.size(), 0);
    for (const std::uint32_t leaf : leaves) {
        std::array<std::uint32_t, 3> triangle{};
        for (unsigned k = 0; k < 3; ++k) {
            triangle[k] = local(_forest.corners(leaf)[k]);
            plane[triangle[k]] = planar(_forest.toPatch({leaf, Vector3d::Unit(k)}).barycentric);
        }
        disc.triangles.push_back(triangle);
    }
    for (unsigned side = 0; side < 3; ++side) {
        const PatchTopology::Edge& edge = topology.edges[topology.patchEdges[patch][side]];
        const bool forward = edge.patches[0] == patch && edge.sides[0] == side;
        const auto vertices = verticesOnSide(_forest, leaves, side);
        for (std::size_t i = 0; i < vertices.size(); ++i) {
            double along = i == 0 ? 0.0 : 1.0;
            if (i != 0 && i + 1 != vertices.size()) {
                along = forward ? _alongEdge[vertices[i].vertex] : 1.0 - _alongEdge[vertices[i].vertex];
            }
            Vector3d b = Vector3d::Zero();
            b[side] = 1.0 - along;
            b[(side + 1) % 3] = along;
            const std::uint32_t v = local(vertices[i].vertex);
            plane[v] = planar(b);
            disc.isFixed[v] = 1;
        }
    }
    if (!embedEvenly(disc, plane)) { return false; }
    for (std::size_t i = 0; i < leaves.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) { _even[leaves[i]][k] = plane[disc.triangles[i][k]]; }
    }
    return true;
}

unsigned StretchMap::cell(const Locator& locator, double coordinate)
{
    const double scaled = std::clamp(coordinate, 0.0, 1.0) * locator.resolution;
    return std::min(locator.resolution - 1, static_cast<unsigned>(scaled));
}

StretchMap::Locator StretchMap::makeLocator(const Leaves& leaves) const
{
    Locator locator;
    locator.resolution = std::max(1U, static_cast<unsigned>(std::sqrt(static_cast<double>(leaves.size()))));
    const unsigned n = locator.resolution;
    const auto forEachCell = [&](std::uint32_t leaf, auto&& visit) {
        const auto& c = _even[leaf];
        const Vector2d low = c[0].cwiseMin(c[1]).cwiseMin(c[2]);
        const Vector2d high = c[0].cwiseMax(c[1]).cwiseMax(c[2]);
        for (unsigned y = cell(locator, low.y()); y <= cell(locator, high.y()); ++y) {
            for (unsigned x = cell(locator, low.x()); x <= cell(locator, high.x()); ++x) { visit(y * n + x); }
        }
    };
    locator.firstInCell.assign(std::size_t{n} * n + 1, 0);
    for (const std::uint32_t leaf : leaves) {
        forEachCell(leaf, [&](unsigned at) { ++locator.firstInCell[at + 1]; });
    }
    for (std::size_t i = 1; i < locator.firstInCell.size(); ++i) {
        locator.firstInCell[i] += locator.firstInCell[i - 1];
    }
    std::vector<std::uint32_t> next(locator.firstInCell.begin(), locator.firstInCell.end() - 1);
    locator.leaves.resize(locator.firstInCell.back());
    for (const std::uint32_t leaf : leaves) {
        forEachCell(leaf, [&](unsigned at) { locator.leaves[next[at]++] = leaf; });
    }
    return locator;
}

FacePoint StretchMap::toEven(const FacePoint& point) const
{
    const FacePoint inLeaf = _forest.toLeaf(point);
    const auto& corners = _even[inLeaf.face];
    const Vector2d p =
        inLeaf.barycentric[0] * corners[0] + inLeaf.barycentric[1] * corners[1] + inLeaf.barycentric[2] * corners[2];
    return {point.face, Vector3d(std::max(0.0, 1.0 - p.x() - p.y()), p.x(), p.y())};
}

FacePoint StretchMap::fromEven(const FacePoint& point) const
{
    const Locator& locator = _locators[point.face];
    const Vector2d p = planar(point.barycentric);
    const unsigned at = cell(locator, p.y()) * locator.resolution + cell(locator, p.x());
    double inside = -std::numeric_limits<double>::infinity();
    FacePoint best{};
    for (std::uint32_t i = locator.firstInCell[at]; i < locator.firstInCell[at + 1]; ++i) {
        const auto& c = _even[locator.leaves[i]];
        const Vector3d w = weightsOf(p, c[0], c[1], c[2]);
        if (w.minCoeff() > inside) {
            inside = w.minCoeff();
            best = {locator.leaves[i], w};
        }
    }
    best.barycentric = best.barycentric.cwiseMax(0.0);
    best.barycentric /= best.barycentric.sum();
    return _forest.toPatch(best);
}

void StretchMap::validate() const
{
    std::vector<double> area(_locators.size(), 0.0);
    for (std::uint32_t n = 0; n < _forest.nodeCount(); ++n) {
        if (!_forest.isLeaf(n)) { continue; }
        const double own = twiceArea(_even[n][0], _even[n][1], _even[n][2]);
        if (!(own > 0.0)) { throw std::logic_error("leaf " + std::to_string(n) + " is turned over"); }
        area[_forest.patchOf(n)] += own;
    }
    for (std::size_t p = 0; p < area.size(); ++p) {
        // Thousands of roundings of parts of 1.
        if (std::fabs(area[p] - 1.0) > 1e-10) {
            throw std::logic_error("the leaves of patch " + std::to_string(p) + " cover " + std::to_string(area[p]));
        }
    }
}

} // namespace osgTessLOD::bake
