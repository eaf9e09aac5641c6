// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD {

struct LodAsset;

/// An indexed triangle mesh in the source's space.
struct SurfaceMesh {
    std::vector<std::array<double, 3>> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles; ///< counter-clockwise, as the patches are
    /// Texture coordinates u, v of each triangle's corners, NaN where there are none; empty: the asset has none.
    std::vector<std::array<std::array<float, 2>, 3>> uvs;
    std::vector<std::array<std::uint8_t, 4>> colors;     ///< of the positions: red, green, blue, alpha; empty: there are none
};

/// The surface of a valid asset with every patch at `factor`, or at its finest where that is coarser. Watertight: what
/// neighbours share is one vertex, and where their finest levels differ the finer patch's border lags to the edge's
/// finest level by its vertices' parents. Triangles of which two vertices became one by that are left out.
/// Throws AssetError, with the ladder, if `factor` is not one of it.
OSGTESSLOD_EXPORT SurfaceMesh extractSurface(const LodAsset& asset, unsigned factor);

/// Writes a binary little-endian PLY, complete or not at all (AtomicFile); texture coordinates as a list `texcoord` of each
/// face, so that vertices on seams stay one. Coordinates are `float`, which every viewer
/// reads, if that loses nothing, as for any asset whose lattice origin is zero; else `double`.
/// Throws AssetError naming the path.
OSGTESSLOD_EXPORT void writePly(const std::string& path, const SurfaceMesh& mesh);

} // namespace osgTessLOD
