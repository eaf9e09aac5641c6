// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/VertexPlacement.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// How strips are chosen and contracted. The defaults are Lambert's full method.
struct StripOptions {
    enum class Strips {
        Straight, ///< those that the tessellator's own fractional transition contracts
        Optimal   ///< the cheapest of all
    };
    enum class Cost {
        Residual, ///< what the placement minimizes
        ViewError ///< C_edge (§4.6) first, the residual where that is equal
    };
    PlacementMethod placement = PlacementMethod::VolumeUv;
    Strips strips = Strips::Optimal;
    Cost cost = Cost::ViewError;
    bool refit = true; ///< fit positions to the charts at every stored level (§4.7)
};

/// What a simplification did.
struct StripReport {
    std::uint64_t contractions = 0;
    std::uint64_t relayouts = 0; ///< patches whose vertices had to be laid out anew in their chart
    /// Seconds of work, all threads together, by the parts of the thesis's table 4.1.
    double placementSeconds = 0.0; ///< of vertices (VolUV)
    double fitSeconds = 0.0;       ///< of E's quadratics before strips are chosen (Ẽ), and of where chart vertices lie
    double costSeconds = 0.0;      ///< C_edge
    double overlaySeconds = 0.0;   ///< edge–edge intersections, of refits
    double refitSeconds = 0.0;     ///< of stored levels, without those
};

/// The `strips` technique: levels made from the finest down by contracting strips of edges (Lambert §4, Algorithm 3), each
/// level's vertices placed where they serve its shape best. `ladder` holds rising factors, 1 or even; the charts are on the
/// pattern of twice the last one, a power of two. The result does not depend on the number of threads.
OSGTESSLOD_EXPORT LevelHierarchy makeStripLevels(const PatchTopology& topology, const ChartSet& charts,
                                                 const std::vector<std::uint16_t>& ladder, const StripOptions& options,
                                                 Progress& progress, StripReport* report = nullptr);

} // namespace osgTessLOD::bake
