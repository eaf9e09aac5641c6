// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/StripGraph.h>

#include <functional>

namespace osgTessLOD::bake {

/// Calls `visit(site, k)` for every edge that a strip of a fan of the mesh could take.
inline void forEachEdge(const StripMesh& mesh, const std::function<void(StripMesh::Site, unsigned)>& visit)
{
    for (const CornerFan& fan : cornerFans(mesh.topology())) {
        const StripGraph graph(mesh, fan);
        for (const auto& layer : graph.layers()) {
            for (unsigned i = 0; i < layer.width; ++i) {
                visit({layer.patch, mesh.patch(layer.patch).lattice.point(layer.corner, {layer.row, i})}, layer.corner);
            }
        }
    }
}

} // namespace osgTessLOD::bake
