// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/StripMesh.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <string>

namespace osgTessLOD::bake {

namespace {

using Point = StripLattice::Point;

[[noreturn]] void fail(std::uint32_t patch, const std::string& what)
{
    throw std::logic_error("strip mesh, patch " + std::to_string(patch) + ": " + what);
}

ChartPoint patternParameter(unsigned factor, std::uint32_t vertex)
{
    const auto b = TessellationPattern::barycentric(factor, vertex);
    const auto unit = static_cast<std::int64_t>(ChartPoint::kUnits);
    // Exact for factors that divide 128; rounded alike from both ends of a border for the others.
    const auto scaled = [&](std::size_t k) {
        const std::int64_t numerator = 2 * unit * b[k] + 3 * factor;
        return static_cast<std::int32_t>(numerator / (6 * factor));
    };
    return {scaled(1), scaled(2)};
}

StripMesh::Patch patternPatch(unsigned factor)
{
    StripMesh::Patch patch{StripLattice(factor), {}, {}, {}};
    patch.positions.resize(patch.lattice.indexCount(), Eigen::Vector3d::Zero());
    patch.parameters.resize(patch.lattice.indexCount());
    const std::uint32_t border = TessellationPattern::borderVertexCount(factor);
    for (std::uint32_t v = border; v < TessellationPattern::vertexCount(factor); ++v) {
        patch.parameters[patch.lattice.index(patch.lattice.patternPoint(v))] = patternParameter(factor, v);
    }
    for (unsigned side = 0; side < 3; ++side) {
        for (unsigned step = 0; step < factor; ++step) {
            // Counted from the nearer end, so that both patches of the border round alike.
            const unsigned near = std::min(step, factor - step);
            const std::int32_t units =
                (2 * ChartPoint::kUnits * static_cast<std::int32_t>(near) + static_cast<std::int32_t>(factor)) /
                (2 * static_cast<std::int32_t>(factor));
            patch.parameters[patch.lattice.index(patch.lattice.border(side, step))] =
                borderParameter(side, near == step ? units : ChartPoint::kUnits - units);
        }
    }
    return patch;
}

} // namespace

StripMesh::StripMesh(const PatchTopology& topology, unsigned factor)
    : _topology(&topology)
    , _patches(topology.patches.size(), patternPatch(factor))
{
    for (std::uint32_t p = 0; p < _patches.size(); ++p) { mark(p); }
}

StripMesh::Site StripMesh::twin(std::uint32_t patch, unsigned side, unsigned step) const
{
    const PatchTopology::Edge& edge = _topology->edges[_topology->patchEdges[patch][side]];
    const unsigned own = edge.patches[0] == patch && edge.sides[0] == side ? 0 : 1;
    Site result;
    result.patch = edge.patches[1 - own];
    if (result.patch == kNoPatch) { return result; }
    const StripLattice& lattice = _patches[result.patch].lattice;
    const unsigned otherSide = edge.sides[1 - own];
    result.point = lattice.border(otherSide, lattice.sideLength(otherSide) - step);
    return result;
}

void StripMesh::placeAlone(Site vertex, const Eigen::Vector3d& position, ChartPoint parameter)
{
    Patch& patch = _patches[vertex.patch];
    const std::uint32_t index = patch.lattice.index(vertex.point);
    patch.positions[index] = position;
    patch.parameters[index] = parameter;
}

void StripMesh::place(Site vertex, const Eigen::Vector3d& position, ChartPoint parameter)
{
    placeAlone(vertex, position, parameter);
    unsigned step = 0;
    const unsigned side = _patches[vertex.patch].lattice.sideOf(vertex.point, step);
    if (side == 3) { return; }
    const std::int32_t along = alongBorder(side, parameter);
    assert(borderParameter(side, along) == parameter);
    const Site other = twin(vertex.patch, side, step);
    if (other.patch == kNoPatch) { return; }
    unsigned otherStep = 0;
    const unsigned otherSide = _patches[other.patch].lattice.sideOf(other.point, otherStep);
    placeAlone(other, position, borderParameter(otherSide, ChartPoint::kUnits - along));
}

std::vector<std::uint32_t> StripMesh::contract(std::uint32_t p, unsigned k, const std::vector<unsigned>& strip)
{
    Patch& patch = _patches[p];
    const StripLattice before = patch.lattice;
    std::vector<std::uint32_t> after = patch.lattice.contract(k, strip);
    std::vector<Eigen::Vector3d> positions(patch.positions.size());
    std::vector<ChartPoint> parameters(patch.parameters.size());
    const auto keep = [&](std::uint32_t i) {
        positions[after[i]] = patch.positions[i];
        parameters[after[i]] = patch.parameters[i];
    };
    for (std::uint32_t i = 0; i < after.size(); ++i) {
        if (before.contains(before.point(i))) { keep(i); }
    }
    // Of two ends the border's counts: where patches share several borders, it may have moved again since they merged.
    for (unsigned side = 0; side < 3; ++side) {
        for (unsigned step = 0; step < before.sideLength(side); ++step) {
            keep(before.index(before.border(side, step)));
        }
    }
    patch.positions.swap(positions);
    patch.parameters.swap(parameters);
    for (std::uint32_t& image : patch.images) { image = after[image]; }
    return after;
}

void StripMesh::mark(std::uint32_t p)
{
    Patch& patch = _patches[p];
    patch.images.resize(TessellationPattern::vertexCount(patch.lattice.factor()));
    for (std::uint32_t v = 0; v < patch.images.size(); ++v) {
        patch.images[v] = patch.lattice.index(patch.lattice.patternPoint(v));
    }
}

std::vector<Eigen::Vector3d> StripMesh::patternPositions(std::uint32_t p) const
{
    const Patch& patch = _patches[p];
    std::vector<Eigen::Vector3d> result(TessellationPattern::vertexCount(patch.lattice.factor()));
    for (std::uint32_t v = 0; v < result.size(); ++v) {
        result[v] = patch.positions[patch.lattice.index(patch.lattice.patternPoint(v))];
    }
    return result;
}

std::vector<ChartPoint> StripMesh::patternParameters(std::uint32_t p) const
{
    const Patch& patch = _patches[p];
    std::vector<ChartPoint> result(TessellationPattern::vertexCount(patch.lattice.factor()));
    for (std::uint32_t v = 0; v < result.size(); ++v) {
        result[v] = patch.parameters[patch.lattice.index(patch.lattice.patternPoint(v))];
    }
    return result;
}

std::vector<std::uint32_t> StripMesh::patternImages(std::uint32_t p) const
{
    const Patch& patch = _patches[p];
    std::vector<std::uint32_t> result(patch.images.size());
    for (std::uint32_t v = 0; v < result.size(); ++v) {
        result[v] = patch.lattice.patternVertex(patch.lattice.point(patch.images[v]));
    }
    return result;
}

void StripMesh::checkPatch(std::uint32_t p) const
{
    const Patch& patch = _patches[p];
    const StripLattice& lattice = patch.lattice;
    const auto parameterOf = [&](Point at) { return patch.parameters[lattice.index(at)]; };
    for (std::uint32_t t = 0; t < lattice.triangleIndexCount(); ++t) {
        if (!lattice.hasTriangle(t)) { continue; }
        const auto c = lattice.corners(t);
        if (orientation(parameterOf(c[0]), parameterOf(c[1]), parameterOf(c[2])) <= 0) {
            fail(p, "triangle " + std::to_string(t) + " is turned over in the chart");
        }
    }
}

void StripMesh::checkSide(std::uint32_t p, unsigned side) const
{
    const StripLattice& lattice = _patches[p].lattice;
    const PatchTopology::Edge& edge = _topology->edges[_topology->patchEdges[p][side]];
    const unsigned own = edge.patches[0] == p && edge.sides[0] == side ? 0 : 1;
    for (unsigned step = 0; step < lattice.sideLength(side); ++step) {
        const Site vertex{p, lattice.border(side, step)};
        const std::int32_t along = alongBorder(side, parameter(vertex));
        if (borderParameter(side, along) != parameter(vertex)) { fail(p, "a border vertex lies off its border"); }
        if ((step == 0) != (along == 0)) { fail(p, "a border vertex lies on a corner, or a corner elsewhere"); }
        const Site other = twin(p, side, step);
        if (other.patch == kNoPatch) { continue; }
        if (position(vertex) != position(other)) { fail(p, "a border position differs from the neighbour's"); }
        if (parameter(other) != borderParameter(edge.sides[1 - own], ChartPoint::kUnits - along)) {
            fail(p, "a border parameter differs from the neighbour's");
        }
    }
}

void StripMesh::check() const
{
    for (std::uint32_t p = 0; p < _patches.size(); ++p) {
        if (_patches[p].lattice.factor() == 0) { fail(p, "is between patterns"); }
        if (_patches[p].lattice.factor() != _patches[0].lattice.factor()) {
            fail(p, "is at another factor than patch 0");
        }
        checkPatch(p);
        for (unsigned side = 0; side < 3; ++side) { checkSide(p, side); }
    }
}

} // namespace osgTessLOD::bake
