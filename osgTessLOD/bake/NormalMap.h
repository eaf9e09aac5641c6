// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ImageFiles.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <osgTessLOD/bake/SourceSurface.h>

#include <cstdint>
#include <functional>
#include <optional>

namespace osgTessLOD::bake {

constexpr std::uint32_t kMinNormalMap = 64;
constexpr std::uint32_t kMaxNormalMap = 8192;
constexpr double kMostCoveredTwice = 0.001;

/// The normals of what has one material as an image over its texture coordinates: three channels, (n + 1) / 2 of the unit normal n
/// along the source's axes, to 10 bits. A texel is the mean of the normals at those of 4 × 4 points in it that triangles cover. Texels
/// without any are filled from the nearest charts, so that neither bilinear filtering nor mip-maps take in anything else.
struct NormalMap {
    std::optional<std::uint16_t> material; ///< of the source; empty: all
    ImageData image;
    double coverage = 0.0;     ///< share of the image that triangles cover
    double coveredTwice = 0.0; ///< share of the texels that triangles cover, by more than half, which more than one covers likewise
};

/// Calls `use` with the normal map of each material that triangles have, or of all triangles `together`: `size` × `size` texels, a power
/// of two from kMinNormalMap to kMaxNormalMap, which repeats beyond 0 … 1. Every triangle must have texture coordinates, and they must
/// not overlap: kMostCoveredTwice is for what a chart folds over itself here and there. This is counted at the points above. A point on an
/// edge is of one of the triangles beside it, by integers, so that charts that touch do not overlap; half a texel of two seams is not
/// counted, either. Throws AssetError naming the mesh, the material and what is wrong. Takes some 17 bytes a texel. Deterministic.
OSGTESSLOD_EXPORT void makeNormalMaps(const SourceMesh& mesh, const CornerNormals& normals, std::uint32_t size, bool together,
                                      Progress& progress, const std::function<void(NormalMap map)>& use);

} // namespace osgTessLOD::bake
