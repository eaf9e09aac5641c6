// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <support/ScreenCamera.h>

#include <vector>

namespace osgTessLOD::benchmarks {

/// Cameras on a circle about the middle of an asset's box, `diagonals` of its diagonals away: from the side over the top and
/// round below. 1280 × 800 pixels, 30° high, looking at the middle.
std::vector<ScreenCamera> orbitOf(const LodAsset& asset, double diagonals, unsigned views);

} // namespace osgTessLOD::benchmarks
