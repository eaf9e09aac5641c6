// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Vec3f>

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

namespace osgTessLOD {

/// Edges of these triangles (three corners each; equal corners are one vertex) that are not run along exactly once each way:
/// none for a closed surface. Triangles with two equal corners, which morphing leaves behind, do not count.
inline std::size_t unmatchedEdges(const std::vector<osg::Vec3f>& corners)
{
    std::map<std::pair<osg::Vec3f, osg::Vec3f>, int> runs;
    for (std::size_t k = 0; k < corners.size(); k += 3) {
        const osg::Vec3f* t = &corners[k];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) { continue; }
        for (std::size_t c = 0; c < 3; ++c) { ++runs[{t[c], t[(c + 1) % 3]}]; }
    }
    std::size_t unmatched = 0;
    for (const auto& [edge, count] : runs) {
        const auto back = runs.find({edge.second, edge.first});
        unmatched += count != 1 || back == runs.end() || back->second != 1 ? 1 : 0;
    }
    return unmatched;
}

} // namespace osgTessLOD
