// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Connectivity of a control mesh: triangular patches, counter-clockwise seen from outside, and the borders between them.
struct OSGTESSLOD_EXPORT PatchTopology {
    struct Edge {
        std::array<std::uint32_t, 2> vertices;                 ///< in the direction patches[0] runs along it
        std::array<std::uint32_t, 2> patches{kNoPatch, kNoPatch};
        std::array<std::uint8_t, 2> sides{};                   ///< which side of each patch it is
        /// Of a seam, an open border along which another surface is to meet this one: the factor that it is drawn with at any
        /// distance, a power of two. Its vertices are then where the charts have them, evenly spaced. 0: no seam.
        std::uint16_t seamFactor = 0;
    };

    std::uint32_t vertexCount = 0;
    std::vector<std::array<std::uint32_t, 3>> patches;         ///< base vertices
    std::vector<std::array<std::uint32_t, 3>> patchEdges;      ///< patchEdges[p][s] joins corner s to corner s + 1 (mod 3)
    std::vector<Edge> edges;

    /// Finds the edges of an oriented 2-manifold, possibly with boundary. Two patches may share two or three of their
    /// vertices (as in a sphere of two triangles) as long as every directed edge occurs once.
    /// Throws std::invalid_argument for an edge with three patches or two of the same direction.
    static PatchTopology build(std::uint32_t vertexCount, std::vector<std::array<std::uint32_t, 3>> patches);
};

} // namespace osgTessLOD::bake
