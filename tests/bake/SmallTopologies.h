// SPDX-License-Identifier: MIT
// Control meshes small enough to think through by hand.
#pragma once

#include <osgTessLOD/bake/PatchTopology.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

/// `valence` patches around vertex 0, closed; their outer sides are open.
inline PatchTopology closedFan(unsigned valence)
{
    std::vector<std::array<std::uint32_t, 3>> patches;
    for (unsigned k = 0; k < valence; ++k) {
        std::array<std::uint32_t, 3> patch{0, 1 + k, 1 + (k + 1) % valence};
        std::rotate(patch.begin(), patch.begin() + k % 3, patch.end()); // vertex 0 is each corner in turn
        patches.push_back(patch);
    }
    return PatchTopology::build(valence + 1, patches);
}

inline PatchTopology tetrahedron()
{
    return PatchTopology::build(4, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}});
}

/// A 3 × 3 grid of quads, each two patches, joined to a torus: every valence is 6.
inline PatchTopology torusOfPatches()
{
    std::vector<std::array<std::uint32_t, 3>> patches;
    for (std::uint32_t i = 0; i < 3; ++i) {
        for (std::uint32_t j = 0; j < 3; ++j) {
            const auto at = [](std::uint32_t a, std::uint32_t b) { return a % 3 * 3 + b % 3; };
            patches.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
            patches.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
        }
    }
    return PatchTopology::build(9, patches);
}

/// All of them, with names.
inline std::vector<std::pair<std::string, PatchTopology>> smallTopologies()
{
    std::vector<std::pair<std::string, PatchTopology>> all{
        {"triangle", PatchTopology::build(3, {{0, 1, 2}})},
        {"two triangles", PatchTopology::build(4, {{0, 1, 2}, {2, 1, 3}})},
        {"sphere of two triangles", PatchTopology::build(3, {{0, 1, 2}, {0, 2, 1}})},
        {"pillow of three", PatchTopology::build(4, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}})},
        {"bow tie", PatchTopology::build(5, {{0, 1, 2}, {0, 3, 4}})},
        {"tetrahedron", tetrahedron()},
        {"torus", torusOfPatches()},
    };
    for (unsigned valence = 3; valence <= 12; ++valence) {
        all.emplace_back("fan of " + std::to_string(valence), closedFan(valence));
    }
    return all;
}

} // namespace osgTessLOD::bake
