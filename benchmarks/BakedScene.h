// SPDX-License-Identifier: MIT
#pragma once

#include "Scenes.h"

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/Baker.h>

#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// An asset and the .tlod file that it was written to.
struct BakedScene {
    LodAsset asset;
    bake::BakeReport report;
    std::uint64_t fileBytes = 0;
    std::uint64_t normalBytes = 0;         ///< of the file, its normal textures
    std::vector<std::uint64_t> levelBytes; ///< of the file, each level's errors, vertices and parameters
};

/// Throws AssetError for bad input and for a path that cannot be written.
BakedScene bakeToFile(const Scene& scene, const bake::BakeOptions& options, const std::string& path);

/// Path of the scene's .tlod file: its own, or `path`, which it is baked to in a process of its own (runInChild).
std::string bakedFile(const Scene& scene, const bake::BakeOptions& options, const std::string& path);

/// The asset of a .tlod file, or of any other scene baked with the default options but without normals. Throws AssetError.
LodAsset loadOrBake(const Scene& scene);

} // namespace osgTessLOD::benchmarks
