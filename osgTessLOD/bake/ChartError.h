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

/// Source vertices by the patch they map to.
class SourceVerticesByPatch {
public:
    SourceVerticesByPatch(const std::vector<std::uint32_t>& patchOfVertex, std::size_t patches);

    struct Range {
        const std::uint32_t* first;
        const std::uint32_t* last;
        const std::uint32_t* begin() const { return first; }
        const std::uint32_t* end() const { return last; }
    };
    Range of(std::size_t patch) const { return {&_vertices[0] + _first[patch], &_vertices[0] + _first[patch + 1]}; }

private:
    std::vector<std::uint32_t> _first;
    std::vector<std::uint32_t> _vertices;
};

/// Distances between a source and the pieces that stand for it (Embree).
class PatchDistance {
public:
    /// Keeps a reference to `source`.
    explicit PatchDistance(const SourceMesh& source);

    /// Two-sided distance between a patch, which has `positions` at the pattern's vertices, on the source, and the
    /// source: from the patch's edge midpoints and centroids to the source, and from the source vertices that map to the
    /// patch to the patch. Working frame. Thread safe.
    double twoSided(const std::vector<Eigen::Vector3d>& positions, const TessellationPattern& pattern,
                    const SourceVerticesByPatch::Range& sourceVertices) const;

private:
    const SourceMesh& _source;
    SurfaceDistance _toSource;
};

/// Sets the chartError of every chart: its two-sided distance to the source, of which vertex v maps to patch
/// patchOfVertex[v].
OSGTESSLOD_EXPORT void measureChartErrors(const SourceMesh& source, const std::vector<std::uint32_t>& patchOfVertex,
                                          ChartSet& set, Progress& progress);

} // namespace osgTessLOD::bake
