// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ImageFiles.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <osgTessLOD/bake/SourceSurface.h>

#include <cstdint>
#include <optional>
#include <vector>

namespace osgTessLOD::bake {

/// The normals of what has one material as an image over its texture coordinates: three channels, (n + 1) / 2 of the unit normal n
/// along the source's axes. Texels that no triangle covers are filled with what is next to them, so that neither bilinear filtering nor
/// mip-maps take in anything else.
struct NormalMap {
    std::uint16_t material = 0;
    ImageData image;
    double coverage = 0.0;      ///< share of the image that triangles cover
    double coveredTwice = 0.0;  ///< share of that which more than one covers
};

/// Normals for each material that triangles have, `size` × `size` texels (a power of two, at most kMaxNormalMap), each the mean of the normals at 4 × 4
/// points in it. Beyond 0 … 1 the image repeats. Every triangle must have texture coordinates, and no more than kMostCoveredTwice of
/// what a material's cover may be covered twice (seams that overlap by a hair; charts that only touch do not). Throws AssetError naming the
/// mesh and what is wrong.
OSGTESSLOD_EXPORT std::vector<NormalMap> makeNormalMaps(const SourceMesh& mesh, const CornerNormals& normals,
                                                        std::uint32_t size, Progress& progress);

constexpr std::uint32_t kMaxNormalMap = 8192;
constexpr double kMostCoveredTwice = 0.001;

} // namespace osgTessLOD::bake
