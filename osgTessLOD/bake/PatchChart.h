// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The reference surface restricted to one patch, sampled at the vertices of a tessellation pattern in index order and
/// linear on its triangles. What two patches share is bit-identical in both, but for texture coordinates where these have a
/// seam.
struct PatchChart {
    std::vector<Eigen::Vector3d> positions;  ///< working frame
    std::vector<Eigen::Vector3f> normals;    ///< unit
    /// Texture coordinates on this patch's side of seams, NaN where there are none; empty: the map has none.
    std::vector<Eigen::Vector2f> uvs;
    std::vector<Eigen::Vector4f> colors;     ///< 0 … 1; empty: the map has none
    double chartError = 0.0;                 ///< two-sided distance to the source, working frame
};

/// The charts of all patches, on the pattern of one factor.
struct ChartSet {
    unsigned factor = 0;
    std::vector<PatchChart> charts;
};

/// Samples `map` on the pattern of `factor`: each base vertex and each border once, in the first patch that has it, and
/// texture coordinates from each side, to see where there is a seam.
/// Parallel over patches; the result does not depend on the number of threads.
OSGTESSLOD_EXPORT ChartSet makeCharts(const PatchMap& map, unsigned factor, Progress& progress);

/// Where the charts have the vertex of a border `step` steps along it, of a pattern whose factor divides theirs.
OSGTESSLOD_EXPORT const Eigen::Vector3d& borderPosition(const ChartSet& set, const PatchTopology::Edge& edge,
                                                        unsigned factor, unsigned step);

/// Index in the pattern of `factor` of the border vertex `step` steps along `edge`, counted in the direction of
/// edge.patches[0], as patch edge.patches[which] numbers it.
OSGTESSLOD_EXPORT std::uint32_t borderVertex(const PatchTopology::Edge& edge, unsigned which, unsigned factor, unsigned step);

} // namespace osgTessLOD::bake
