// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/Triangulation.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cassert>
#include <utility>

namespace osgTessLOD::bake {

namespace {

/// Lists of numbers, one per vertex, from pairs of a vertex and a number; within a list in the order of the pairs.
void gather(std::uint32_t vertexCount, const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs,
            std::vector<std::uint32_t>& start, std::vector<std::uint32_t>& lists)
{
    start.assign(vertexCount + 1, 0);
    for (const auto& [vertex, value] : pairs) { ++start[vertex + 1]; }
    for (std::uint32_t v = 0; v < vertexCount; ++v) { start[v + 1] += start[v]; }
    lists.resize(pairs.size());
    std::vector<std::uint32_t> next(start.begin(), start.end() - 1);
    for (const auto& [vertex, value] : pairs) { lists[next[vertex]++] = value; }
}

} // namespace

Triangulation::Triangulation(std::uint32_t vertexCount, std::vector<Triangle> triangles)
    : _triangles(std::move(triangles))
    , _neighbours(_triangles.size(), Triangle{kNone, kNone, kNone})
{
    std::vector<std::pair<std::uint32_t, std::uint32_t>> corners;
    for (std::uint32_t t = 0; t < _triangles.size(); ++t) {
        for (const std::uint32_t vertex : _triangles[t]) { corners.emplace_back(vertex, t); }
    }
    gather(vertexCount, corners, _trianglesStart, _trianglesAround);

    std::vector<std::pair<std::uint32_t, std::uint32_t>> joined;
    for (std::uint32_t t = 0; t < _triangles.size(); ++t) {
        for (unsigned k = 0; k < 3; ++k) {
            const std::uint32_t from = _triangles[t][k];
            const std::uint32_t to = _triangles[t][(k + 1) % 3];
            for (const std::uint32_t other : trianglesAround(from)) {
                if (other == t) { continue; }
                for (unsigned j = 0; j < 3; ++j) {
                    const auto& o = _triangles[other];
                    if (o[j] == to && o[(j + 1) % 3] == from) { _neighbours[t][k] = other; }
                }
            }
            const std::uint32_t across = _neighbours[t][k];
            if (across != kNone && across < t) { continue; }
            _edges.push_back({{from, to}, {t, across}, k});
            joined.emplace_back(from, to);
            joined.emplace_back(to, from);
        }
    }
    gather(vertexCount, joined, _verticesStart, _verticesAround);
}

Triangulation Triangulation::ofPattern(unsigned factor)
{
    return Triangulation(TessellationPattern::vertexCount(factor), TessellationPattern(factor).triangles());
}

Triangulation::Range Triangulation::trianglesAround(std::uint32_t vertex) const
{
    const std::uint32_t* data = _trianglesAround.data();
    return {data + _trianglesStart[vertex], data + _trianglesStart[vertex + 1]};
}

Triangulation::Range Triangulation::verticesAround(std::uint32_t vertex) const
{
    const std::uint32_t* data = _verticesAround.data();
    return {data + _verticesStart[vertex], data + _verticesStart[vertex + 1]};
}

std::vector<ChartPoint> patternPoints(unsigned factor)
{
    std::vector<ChartPoint> points;
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
        points.push_back(TessellationPattern::chartPoint(factor, v));
    }
    return points;
}

} // namespace osgTessLOD::bake
