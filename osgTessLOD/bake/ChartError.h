// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <osgTessLOD/bake/SurfaceDistance.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Points of a source and the patches they map to.
struct SourceSamples {
    std::vector<Eigen::Vector3d> positions; ///< working frame
    std::vector<std::uint32_t> patches;     ///< of each
};

/// The same sorted by patch.
class SamplesByPatch {
public:
    /// Keeps a reference to `samples`.
    SamplesByPatch(const SourceSamples& samples, std::size_t patches);

    template <typename Visit> void forEach(std::size_t patch, Visit&& visit) const
    {
        for (std::size_t i = _first[patch]; i < _first[patch + 1]; ++i) { visit(_samples.positions[_order[i]]); }
    }

private:
    const SourceSamples& _samples;
    std::vector<std::uint32_t> _first;
    std::vector<std::uint32_t> _order;
};

/// Distances between a source and the pieces that stand for it (Embree).
class PatchDistance {
public:
    explicit PatchDistance(const SourceMesh& source);

    /// Two-sided distance between patch `patch`, which has `positions` at the pattern's vertices, on the source, and the
    /// source: from the patch's edge midpoints and centroids to the source, and from the source's samples that map to the
    /// patch to the patch; `enough` where it is less, which takes the less time the larger that is. Working frame. Thread safe.
    double twoSided(const std::vector<Eigen::Vector3d>& positions, const TessellationPattern& pattern,
                    const SamplesByPatch& samples, std::size_t patch, double enough) const;

private:
    SurfaceDistance _toSource;
};

/// Sets the chartError of every chart: its two-sided distance to the source, of which `samples` are points, but no less than what
/// distances are good to.
OSGTESSLOD_EXPORT void measureChartErrors(const SourceMesh& source, const SourceSamples& samples, ChartSet& set,
                                          Progress& progress);

} // namespace osgTessLOD::bake
