// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ChartError.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/SurfaceDistance.h>

#include <tbb/parallel_for.h>

#include <algorithm>

namespace osgTessLOD::bake {

namespace {

/// Source vertices by the patch they map to: those of patch p are vertices[first[p]] … vertices[first[p + 1] − 1].
struct VerticesByPatch {
    std::vector<std::uint32_t> first;
    std::vector<std::uint32_t> vertices;
};

VerticesByPatch sortVertices(const std::vector<std::uint32_t>& patchOf, std::size_t patches)
{
    VerticesByPatch result;
    result.first.assign(patches + 1, 0);
    for (const std::uint32_t p : patchOf) { ++result.first[p + 1]; }
    for (std::size_t p = 0; p + 1 < result.first.size(); ++p) { result.first[p + 1] += result.first[p]; }
    std::vector<std::uint32_t> next(result.first.begin(), result.first.end() - 1);
    result.vertices.resize(patchOf.size());
    for (std::size_t v = 0; v < patchOf.size(); ++v) { result.vertices[next[patchOf[v]]++] = static_cast<std::uint32_t>(v); }
    return result;
}

} // namespace

void measureChartErrors(const SourceMesh& source, const std::vector<std::uint32_t>& patchOf, ChartSet& set,
                        Progress& progress)
{
    progress.begin("chart distance", set.charts.size(), "patches");
    const VerticesByPatch byPatch = sortVertices(patchOf, set.charts.size());
    const SurfaceDistance toSource(source.positions, source.triangles);
    const TessellationPattern pattern(set.factor);
    tbb::parallel_for(std::size_t{0}, set.charts.size(), [&](std::size_t p) {
        PatchChart& chart = set.charts[p];
        const SurfaceDistance toChart(chart.positions, pattern.triangles());
        double largest = 0.0;
        for (std::uint32_t i = byPatch.first[p]; i < byPatch.first[p + 1]; ++i) {
            largest = std::max(largest, toChart.distance(source.positions[byPatch.vertices[i]]));
        }
        for (const auto& t : pattern.triangles()) {
            const Eigen::Vector3d& a = chart.positions[t[0]];
            const Eigen::Vector3d& b = chart.positions[t[1]];
            const Eigen::Vector3d& c = chart.positions[t[2]];
            largest = std::max(largest, toSource.distance((a + b + c) / 3.0));
            // Each inner edge belongs to two triangles; its midpoint is asked for from the one where it ascends.
            if (t[0] < t[1]) { largest = std::max(largest, toSource.distance(0.5 * (a + b))); }
            if (t[1] < t[2]) { largest = std::max(largest, toSource.distance(0.5 * (b + c))); }
            if (t[2] < t[0]) { largest = std::max(largest, toSource.distance(0.5 * (c + a))); }
        }
        chart.chartError = largest;
        progress.step(1);
    });
    progress.end();
}

} // namespace osgTessLOD::bake
