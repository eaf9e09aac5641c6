// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PatchChart.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

namespace osgTessLOD::bake {

namespace {

Eigen::Vector3d barycentric(unsigned factor, std::uint32_t vertex)
{
    const auto b = TessellationPattern::barycentric(factor, vertex);
    return Eigen::Vector3d(b[0], b[1], b[2]) / (3.0 * factor);
}

void resize(const SurfaceAttributes& attributes, std::size_t count, PatchChart& chart)
{
    chart.positions.resize(count);
    chart.normals.resize(count);
    if (attributes.uvs) { chart.uvs.resize(count); }
    if (attributes.colors) { chart.colors.resize(count); }
}

void put(PatchChart& chart, std::uint32_t vertex, const SurfacePoint& point)
{
    chart.positions[vertex] = point.position;
    chart.normals[vertex] = point.normal.cast<float>();
    if (!chart.uvs.empty()) { chart.uvs[vertex] = point.uv; }
    if (!chart.colors.empty()) { chart.colors[vertex] = point.color; }
}

/// Are these the two sides of no seam? Both without texture coordinates are.
bool agree(const Eigen::Vector2f& a, const Eigen::Vector2f& b, const SurfaceAttributes& attributes)
{
    const bool none = a.hasNaN();
    if (none || b.hasNaN()) { return none == b.hasNaN(); }
    return ((a - b).cwiseAbs().array() <= attributes.uvTolerance.array()).all();
}

void sampleInterior(const PatchMap& map, std::uint32_t patch, unsigned factor, PatchChart& chart)
{
    const std::uint32_t count = TessellationPattern::vertexCount(factor);
    resize(map.attributes(), count, chart);
    for (std::uint32_t v = TessellationPattern::borderVertexCount(factor); v < count; ++v) {
        put(chart, v, map.evaluate(patch, barycentric(factor, v)));
    }
}

void sampleBorder(const PatchMap& map, const PatchTopology::Edge& edge, ChartSet& set)
{
    for (unsigned step = 1; step < set.factor; ++step) {
        const std::uint32_t own = borderVertex(edge, 0, set.factor, step);
        SurfacePoint point = map.evaluate(edge.patches[0], barycentric(set.factor, own));
        put(set.charts[edge.patches[0]], own, point);
        if (edge.patches[1] == kNoPatch) { continue; }
        const std::uint32_t other = borderVertex(edge, 1, set.factor, step);
        if (map.attributes().uvs) {
            const Eigen::Vector2f across = map.evaluate(edge.patches[1], barycentric(set.factor, other)).uv;
            if (!agree(point.uv, across, map.attributes())) { point.uv = across; }
        }
        put(set.charts[edge.patches[1]], other, point);
    }
}

/// A base vertex as `patch` has it: one of `known`, as patches before it had it, or a new one there, which differs from these
/// in its texture coordinates only.
const SurfacePoint& cornerPoint(const PatchMap& map, std::uint32_t patch, const Eigen::Vector3d& at,
                                std::vector<SurfacePoint>& known)
{
    if (!known.empty() && !map.attributes().uvs) { return known.front(); }
    const SurfacePoint point = map.evaluate(patch, at);
    const auto same = std::find_if(known.begin(), known.end(), [&](const SurfacePoint& other) {
        return agree(point.uv, other.uv, map.attributes());
    });
    if (same != known.end()) { return *same; }
    known.push_back(known.empty() ? point : SurfacePoint(known.front()));
    known.back().uv = point.uv;
    return known.back();
}

void sampleCorners(const PatchMap& map, ChartSet& set)
{
    const PatchTopology& topology = map.topology();
    std::vector<std::vector<SurfacePoint>> points(topology.vertexCount);
    for (std::uint32_t p = 0; p < topology.patches.size(); ++p) {
        for (unsigned k = 0; k < 3; ++k) {
            const std::uint32_t vertex = k * set.factor;
            put(set.charts[p], vertex,
                cornerPoint(map, p, barycentric(set.factor, vertex), points[topology.patches[p][k]]));
        }
    }
}

} // namespace

std::uint32_t borderVertex(const PatchTopology::Edge& edge, unsigned which, unsigned factor, unsigned step)
{
    const unsigned along = which == 0 ? step : factor - step;
    return (edge.sides[which] * factor + along) % TessellationPattern::borderVertexCount(factor);
}

const Eigen::Vector3d& borderPosition(const ChartSet& set, const PatchTopology::Edge& edge, unsigned factor,
                                      unsigned step)
{
    assert(set.factor % factor == 0);
    return set.charts[edge.patches[0]].positions[borderVertex(edge, 0, set.factor, set.factor / factor * step)];
}

ChartSet makeCharts(const PatchMap& map, unsigned factor, Progress& progress)
{
    const PatchTopology& topology = map.topology();
    ChartSet set;
    set.factor = factor;
    set.charts.resize(topology.patches.size());
    progress.begin("charts", topology.patches.size(), "patches");
    tbb::parallel_for(std::size_t{0}, topology.patches.size(), [&](std::size_t p) {
        sampleInterior(map, static_cast<std::uint32_t>(p), factor, set.charts[p]);
        progress.step(1);
    });
    tbb::parallel_for(std::size_t{0}, topology.edges.size(),
                      [&](std::size_t e) { sampleBorder(map, topology.edges[e], set); });
    sampleCorners(map, set);
    progress.end();
    return set;
}

} // namespace osgTessLOD::bake
