// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/SurfaceDistance.h>

#include "Scenes.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::benchmarks {

/// An indexed triangle surface, source units.
struct Triangles {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// What a scene is baked from, one surface without duplicate vertices: the cleaned mesh, the samples of a height image, or for a
/// built-in surface, of which there are none, its map sampled as the charts are, on the pattern of twice the finest factor.
/// Throws AssetError for bad input.
Triangles sourceTriangles(const Scene& scene, unsigned finestFactor);

/// An asset's level of this factor. Throws AssetError, with the ladder, if there is none.
Triangles levelTriangles(const LodAsset& asset, unsigned factor);

/// How far a level lies from the source, source units: `forward` from the level to the source, `backward` from the
/// source to the level.
bake::HausdorffDistance distanceBetween(const Triangles& level, const Triangles& source);

/// False for a distance, measured in single precision, that is certainly above the bound. Both in % of the diagonal.
bool keepsBound(double distancePercent, double boundPercent);

} // namespace osgTessLOD::benchmarks
