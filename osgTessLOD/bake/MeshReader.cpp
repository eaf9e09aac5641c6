// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

namespace osgTessLOD::bake {

void RawMesh::addPolygon(const std::vector<std::uint32_t>& corners)
{
    if (corners.empty()) { return; }
    if (triangles.size() + corners.size() > kMaxElements) { throw AssetError("more than 2^32 triangles"); }
    if (corners.size() < 3) {
        triangles.push_back({corners.front(), corners.back(), corners.back()});
        return;
    }
    if (corners.size() == 4) { quads.push_back(static_cast<std::uint32_t>(triangles.size())); }
    for (std::size_t i = 2; i < corners.size(); ++i) { triangles.push_back({corners[0], corners[i - 1], corners[i]}); }
}

} // namespace osgTessLOD::bake
