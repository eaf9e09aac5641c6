// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/PatchChart.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <tbb/parallel_for.h>

namespace osgTessLOD::bake {

namespace {

Eigen::Vector3d barycentric(unsigned factor, std::uint32_t vertex)
{
    const auto b = TessellationPattern::barycentric(factor, vertex);
    return Eigen::Vector3d(b[0], b[1], b[2]) / (3.0 * factor);
}

void put(PatchChart& chart, std::uint32_t vertex, const SurfacePoint& point)
{
    chart.positions[vertex] = point.position;
    chart.normals[vertex] = point.normal.cast<float>();
}

void sampleInterior(const PatchMap& map, std::uint32_t patch, unsigned factor, PatchChart& chart)
{
    const std::uint32_t count = TessellationPattern::vertexCount(factor);
    chart.positions.resize(count);
    chart.normals.resize(count);
    for (std::uint32_t v = TessellationPattern::borderVertexCount(factor); v < count; ++v) {
        put(chart, v, map.evaluate(patch, barycentric(factor, v)));
    }
}

void sampleBorder(const PatchMap& map, const PatchTopology::Edge& edge, ChartSet& set)
{
    for (unsigned step = 1; step < set.factor; ++step) {
        const std::uint32_t own = borderVertex(edge, 0, set.factor, step);
        const SurfacePoint point = map.evaluate(edge.patches[0], barycentric(set.factor, own));
        put(set.charts[edge.patches[0]], own, point);
        if (edge.patches[1] != kNoPatch) {
            put(set.charts[edge.patches[1]], borderVertex(edge, 1, set.factor, step), point);
        }
    }
}

void sampleCorners(const PatchMap& map, ChartSet& set)
{
    const PatchTopology& topology = map.topology();
    std::vector<SurfacePoint> points(topology.vertexCount);
    std::vector<char> known(topology.vertexCount, 0);
    for (std::uint32_t p = 0; p < topology.patches.size(); ++p) {
        for (unsigned k = 0; k < 3; ++k) {
            const std::uint32_t base = topology.patches[p][k];
            const std::uint32_t vertex = k * set.factor;
            if (known[base] == 0) {
                points[base] = map.evaluate(p, barycentric(set.factor, vertex));
                known[base] = 1;
            }
            put(set.charts[p], vertex, points[base]);
        }
    }
}

} // namespace

std::uint32_t borderVertex(const PatchTopology::Edge& edge, unsigned which, unsigned factor, unsigned step)
{
    const unsigned along = which == 0 ? step : factor - step;
    return (edge.sides[which] * factor + along) % TessellationPattern::borderVertexCount(factor);
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
