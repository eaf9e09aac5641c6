// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/PatchTopology.h>

#include <Eigen/Core>
#include <vector>

namespace osgTessLOD::bake {

/// How a level is refitted.
struct RefitOptions {
    bool moveCorners = false;   ///< the patches' corners, too: for the finest level only, as all levels share them
    double leastWeight = 0.02;  ///< γ of eq. 4.8
    double largestExponent = 32.0; ///< of a vector's relative length in its weight, at least 1, which is eq. 4.8
    unsigned mostPasses = 20;   ///< of re-weighting; it ends by itself before
    double tolerance = 1e-9;    ///< of the linear solver's residual, relative
};

/// What a refit came to.
struct RefitResult {
    unsigned passes = 0;        ///< that were kept; 0: nothing was better than what was given
    double errorBefore = 0.0;   ///< E(d), mean over directions and patches
    double errorAfter = 0.0;
    double seconds = 0.0;        ///< of work, all threads together
    double overlaySeconds = 0.0; ///< of those, for edge–edge intersections
};

/// Moves the vertices of one level of all patches to where the mean of E over all directions is smaller: iteratively
/// re-weighted least squares of the difference vectors at all samples of the overlays (Lambert §4.7, Algorithm 4). E is of the
/// longest vectors alone, so weights are powers of eq. 4.8's ratio whose exponent doubles from pass to pass, and passes go
/// ever smaller parts of the way lest they overshoot: p-norms of growing p (Burrus, Barreto and Selesnick, "Iterative
/// reweighted least-squares design of FIR filters", 1994). Vertices that patches share are one unknown, and bit-identical
/// afterwards. Those of seams stay. Each vector's weight is relative to the longest of its
/// own patch, not of the mesh: every patch is selected by its own error, and where the whole patch is good, the mesh's
/// longest vector elsewhere would make all weights equal.
///
/// `parameters`: one entry per patch, where its vertices are in the chart, equal from both sides of a border; an empty
/// entry: where the pattern of `factor` has them. `positions`: one entry per patch, in and out. Parallel over patches;
/// the result does not depend on the number of threads.
OSGTESSLOD_EXPORT RefitResult refit(const PatchTopology& topology, const ChartSet& charts, unsigned factor,
                                    const std::vector<std::vector<ChartPoint>>& parameters, const RefitOptions& options,
                                    std::vector<std::vector<Eigen::Vector3d>>& positions);

} // namespace osgTessLOD::bake
