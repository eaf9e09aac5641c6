// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/SurfaceDistance.h>

#include "Scenes.h"

namespace osgTessLOD::benchmarks {

/// How far an asset's finest level lies from what it was baked from, source units: `forward` from the level to the
/// source, `backward` from the source to the level. The source is the cleaned mesh, or for a built-in surface, of
/// which there is none, its map sampled at twice the finest factor.
bake::HausdorffDistance distanceToSource(const LodAsset& asset, const Scene& scene);

} // namespace osgTessLOD::benchmarks
