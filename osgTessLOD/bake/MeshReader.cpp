// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/MeshReader.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/MeshText.h>

#include <cmath>

namespace osgTessLOD::bake {

namespace {

void addFan(const std::vector<std::uint32_t>& corners, std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    if (corners.size() < 3) {
        triangles.push_back({corners.front(), corners.back(), corners.back()});
        return;
    }
    for (std::size_t i = 2; i < corners.size(); ++i) { triangles.push_back({corners[0], corners[i - 1], corners[i]}); }
}

} // namespace

void RawMesh::addPolygon(const std::vector<std::uint32_t>& corners, const std::vector<std::uint32_t>& uvNumbers)
{
    if (corners.empty()) { return; }
    if (triangles.size() + corners.size() > kMaxElements) { throw AssetError("more than 2^32 triangles"); }
    if (corners.size() == 4) { quads.push_back(static_cast<std::uint32_t>(triangles.size())); }
    constexpr std::array<std::uint32_t, 3> kNone{kNoUv, kNoUv, kNoUv};
    if (!uvNumbers.empty()) {
        uvTriangles.resize(triangles.size(), kNone); // those before it had none
        addFan(uvNumbers, uvTriangles);
    }
    addFan(corners, triangles);
    if (!uvTriangles.empty()) { uvTriangles.resize(triangles.size(), kNone); }
    if (!materials.empty()) { triangleMaterials.resize(triangles.size(), material); }
}

std::uint8_t colorByte(double channel)
{
    return channel > 0.0 ? static_cast<std::uint8_t>(std::lround(255.0 * std::fmin(channel, 1.0))) : std::uint8_t{0};
}

} // namespace osgTessLOD::bake
