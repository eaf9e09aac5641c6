// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ChartError.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

SamplesByPatch::SamplesByPatch(const SourceSamples& samples, std::size_t patches)
    : _samples(samples)
    , _first(patches + 1, 0)
    , _order(samples.patches.size())
{
    for (const std::uint32_t p : samples.patches) { ++_first[p + 1]; }
    for (std::size_t p = 0; p < patches; ++p) { _first[p + 1] += _first[p]; }
    std::vector<std::uint32_t> next(_first.begin(), _first.end() - 1);
    for (std::size_t i = 0; i < _order.size(); ++i) {
        _order[next[samples.patches[i]]++] = static_cast<std::uint32_t>(i);
    }
}

PatchDistance::PatchDistance(const SourceMesh& source)
    : _toSource(source.positions, source.triangles)
{
}

double PatchDistance::twoSided(const std::vector<Vector3d>& positions, const TessellationPattern& pattern,
                               const SamplesByPatch& samples, std::size_t patch, double enough) const
{
    double largest = enough;
    const SurfaceDistance toPatch(positions, pattern.triangles());
    samples.forEach(patch, [&](const Vector3d& sample) {
        largest = std::max(largest, toPatch.distanceBeyond(sample, largest, std::numeric_limits<double>::infinity()));
    });
    // A sample is no farther from the source than from its triangle's vertices, which lie on it: most need no query.
    std::uint32_t triangle = 0; // where source triangles are large, that of the sample before mostly is the nearest
    const auto visit = [&](const Vector3d& sample, const Vector3d& onSource) {
        const double most = (sample - onSource).norm();
        if (most > largest) { largest = std::max(largest, _toSource.distanceBeyond(sample, largest, most, triangle)); }
    };
    for (const auto& t : pattern.triangles()) {
        const Vector3d& a = positions[t[0]];
        const Vector3d& b = positions[t[1]];
        const Vector3d& c = positions[t[2]];
        visit((a + b + c) / 3.0, a);
        // Each inner edge belongs to two triangles; its midpoint is asked for from the one where it ascends.
        if (t[0] < t[1]) { visit(0.5 * (a + b), a); }
        if (t[1] < t[2]) { visit(0.5 * (b + c), b); }
        if (t[2] < t[0]) { visit(0.5 * (c + a), c); }
    }
    return largest;
}

void measureChartErrors(const SourceMesh& source, const SourceSamples& samples, ChartSet& set, Progress& progress)
{
    constexpr double kAccuracy =
        1e-7; // of SurfaceDistance, relative to the source's size, which is 1 in the working frame
    progress.begin("chart distance", set.charts.size(), "patches");
    const SamplesByPatch byPatch(samples, set.charts.size());
    const PatchDistance distance(source);
    const TessellationPattern pattern(set.factor);
    tbb::parallel_for(std::size_t{0}, set.charts.size(), [&](std::size_t p) {
        set.charts[p].chartError = distance.twoSided(set.charts[p].positions, pattern, byPatch, p, kAccuracy);
        progress.step(1);
    });
    progress.end();
}

} // namespace osgTessLOD::bake
