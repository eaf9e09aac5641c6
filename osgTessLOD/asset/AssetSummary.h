// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD {

struct LodAsset;

/// What an asset stores, in numbers. Errors are isotropic and in object units.
struct AssetSummary {
    struct Level {
        unsigned factor = 0;
        std::uint64_t patches = 0;       ///< that reach the level
        std::uint64_t finestPatches = 0; ///< of these, that end with it
        std::uint64_t vertices = 0;
        std::uint64_t triangles = 0;
        double largestError = 0.0; ///< over patches, 0 without any
        double meanError = 0.0;
        double largestUvError = 0.0; ///< LodLevel::uvErrors
    };
    std::vector<Level> levels;
    // Of all patches, each at its finest level.
    std::uint64_t finestVertices = 0;
    std::uint64_t finestTriangles = 0;
    double largestFinestError = 0.0;
};

/// Of a valid asset.
OSGTESSLOD_EXPORT AssetSummary summarize(const LodAsset& asset);

} // namespace osgTessLOD
