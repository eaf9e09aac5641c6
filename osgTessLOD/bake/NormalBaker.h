// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Progress.h>

#include <Eigen/Core>
#include <cstdint>

namespace osgTessLOD::bake {

/// A unit vector as two signed normalized 16-bit octahedral coordinates, x in the low half (Cigolle et al., A Survey of
/// Efficient Representations for Independent Unit Vectors, JCGT 2014), and back.
OSGTESSLOD_EXPORT std::uint32_t encodeOctahedral(const Eigen::Vector3d& normal);
OSGTESSLOD_EXPORT Eigen::Vector3d decodeOctahedral(std::uint32_t code);

/// The charts' normals on the grid of `resolution` (a power of two) and its halvings, each a filtered version of the one
/// before; what two patches share has the same bits in both.
OSGTESSLOD_EXPORT NormalTexture bakeNormals(const PatchTopology& topology, const ChartSet& charts,
                                            std::uint32_t resolution, Progress& progress);

} // namespace osgTessLOD::bake
