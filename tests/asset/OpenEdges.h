// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <utility>
#include <vector>

namespace osgTessLOD {

/// Directed edges that no triangle runs the other way, counted with multiplicity: 0 for a closed, consistently oriented
/// surface.
inline std::size_t openEdges(const std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, long> balance;
    for (const auto& t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
            balance[{a, b}] += a == t[k] ? 1 : -1;
        }
    }
    std::size_t open = 0;
    for (const auto& [edge, sum] : balance) { open += static_cast<std::size_t>(std::labs(sum)); }
    return open;
}

} // namespace osgTessLOD
