// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/LevelHierarchy.h>

#include <osgTessLOD/asset/TessellationPattern.h>

namespace osgTessLOD::bake {

std::vector<std::uint32_t> parentsInTriangle(const PatchTopology& topology, std::uint32_t patch,
                                             const std::vector<Eigen::Vector3d>& factorTwo)
{
    std::vector<std::uint32_t> parents(TessellationPattern::vertexCount(2), 0);
    for (unsigned side = 0; side < 3; ++side) {
        parents[2 * side] = side;
        const PatchTopology::Edge& edge = topology.edges[topology.patchEdges[patch][side]];
        const bool forward = edge.patches[0] == patch && edge.sides[0] == side;
        parents[2 * side + 1] = forward ? side : (side + 1) % 3;
    }
    const Eigen::Vector3d& center = factorTwo[6];
    const auto distance = [&](std::uint32_t corner) { return (factorTwo[2 * corner] - center).squaredNorm(); };
    std::uint32_t nearest = 0;
    for (std::uint32_t corner = 1; corner < 3; ++corner) {
        if (distance(corner) < distance(nearest)) { nearest = corner; }
    }
    parents[6] = nearest;
    return parents;
}

} // namespace osgTessLOD::bake
