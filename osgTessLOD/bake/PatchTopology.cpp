// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PatchTopology.h>

#include <algorithm>
#include <stdexcept>
#include <string>

namespace osgTessLOD::bake {

namespace {

using Patches = std::vector<std::array<std::uint32_t, 3>>;

/// One side of one patch, keyed by the edge it lies on.
struct Side {
    std::uint64_t edgeKey;  ///< smaller vertex in the high half, larger in the low half
    std::uint32_t number;   ///< 3 · patch + side
};

std::string describe(const Side& side)
{
    return "edge " + std::to_string(side.edgeKey >> 32) + "-" + std::to_string(side.edgeKey & 0xFFFFFFFFU);
}

void checkVertices(std::uint32_t vertexCount, const Patches& patches)
{
    if (patches.size() > 0xFFFFFFFFU / 3) { throw std::invalid_argument("more patches than can be numbered"); }
    for (std::size_t p = 0; p < patches.size(); ++p) {
        const auto& v = patches[p];
        if (std::max({v[0], v[1], v[2]}) >= vertexCount) {
            throw std::invalid_argument("patch " + std::to_string(p) + " refers to a vertex that does not exist");
        }
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) {
            throw std::invalid_argument("patch " + std::to_string(p) + " has two equal corners");
        }
    }
}

/// All sides, those of one edge together and in patch order.
std::vector<Side> sidesByEdge(const Patches& patches)
{
    std::vector<Side> sides;
    sides.reserve(3 * patches.size());
    for (std::uint32_t p = 0; p < patches.size(); ++p) {
        for (std::uint32_t s = 0; s < 3; ++s) {
            const std::uint64_t a = patches[p][s], b = patches[p][(s + 1) % 3];
            sides.push_back({std::min(a, b) << 32 | std::max(a, b), 3 * p + s});
        }
    }
    std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
        return a.edgeKey != b.edgeKey ? a.edgeKey < b.edgeKey : a.number < b.number;
    });
    return sides;
}

/// For every side the side across it, kNoPatch on an open border.
std::vector<std::uint32_t> oppositeSides(const Patches& patches)
{
    const std::vector<Side> sides = sidesByEdge(patches);
    std::vector<std::uint32_t> opposite(sides.size(), kNoPatch);
    const auto start = [&](const Side& side) { return patches[side.number / 3][side.number % 3]; };
    for (std::size_t i = 0; i < sides.size();) {
        std::size_t end = i + 1;
        while (end < sides.size() && sides[end].edgeKey == sides[i].edgeKey) { ++end; }
        if (end - i > 2) { throw std::invalid_argument(describe(sides[i]) + " has more than two patches"); }
        if (end - i == 2) {
            if (start(sides[i]) == start(sides[i + 1])) {
                throw std::invalid_argument(describe(sides[i]) + " is run along in the same direction by two patches");
            }
            opposite[sides[i].number] = sides[i + 1].number;
            opposite[sides[i + 1].number] = sides[i].number;
        }
        i = end;
    }
    return opposite;
}

} // namespace

PatchTopology PatchTopology::build(std::uint32_t vertexCount, std::vector<std::array<std::uint32_t, 3>> patches)
{
    checkVertices(vertexCount, patches);
    const std::vector<std::uint32_t> opposite = oppositeSides(patches);

    PatchTopology topology;
    topology.vertexCount = vertexCount;
    topology.patches = std::move(patches);
    topology.patchEdges.resize(topology.patches.size());
    for (std::uint32_t number = 0; number < opposite.size(); ++number) {
        const std::uint32_t p = number / 3, s = number % 3, other = opposite[number];
        if (other < number) { // numbered when its other side came by
            topology.patchEdges[p][s] = topology.patchEdges[other / 3][other % 3];
            continue;
        }
        Edge edge;
        edge.vertices = {topology.patches[p][s], topology.patches[p][(s + 1) % 3]};
        edge.patches[0] = p;
        edge.sides[0] = static_cast<std::uint8_t>(s);
        if (other != kNoPatch) {
            edge.patches[1] = other / 3;
            edge.sides[1] = static_cast<std::uint8_t>(other % 3);
        }
        topology.patchEdges[p][s] = static_cast<std::uint32_t>(topology.edges.size());
        topology.edges.push_back(edge);
    }
    return topology;
}

} // namespace osgTessLOD::bake
