// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/ElevationGuide.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// A face that is left after the collapses.
struct RemainingFace {
    std::array<std::uint32_t, 3> vertices;  ///< source vertices, counter-clockwise
    std::uint32_t number;                   ///< in the history
    std::uint8_t corner;                    ///< corner of that number's own order which is vertices[0]
};

/// Collapses half-edges of `source` in the order of quadric error until options.patches faces are left or none may go,
/// recording every collapse in `history`. With a guide (nullable) boundary vertices stay, and a collapse is refused after which source
/// triangles carried by the faces whose corners or normals change would turn away from these faces' interpolated normals, which are the
/// collapsed mesh's vertexNormals().
std::vector<RemainingFace> collapseSurface(const SourceMesh& source, const ControlMeshOptions& options,
                                           CollapseHistory& history, Progress& progress,
                                           const ElevationGuide* guide = nullptr);

} // namespace osgTessLOD::bake
