// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/PatchMap.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// Names of the procedural surfaces: asteroid, bricks, seashell, glacier. They stand in for the four scenes of Lambert
/// fig. 4.6 with the same numbers of patches (20, 32, 60, 32) and reference triangles (24,576 each).
OSGTESSLOD_EXPORT const std::vector<std::string>& builtinSurfaceNames();

/// The named surface. `triangles` ≠ 0 asks for about so many reference triangles, by splitting every patch into s²
/// until none needs more than 24,576. Throws AssetError for an unknown name (listing the known ones).
OSGTESSLOD_EXPORT std::unique_ptr<PatchMap> makeBuiltinSurface(const std::string& name, std::uint64_t triangles = 0);

} // namespace osgTessLOD::bake
