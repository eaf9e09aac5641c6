// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <memory>
#include <string>

namespace osgTessLOD::bake {

// The first part of a bake: a source of any kind as a surface in patches. Private to the bake room.

/// The reference samples each patch at twice its finest factor (Lambert fig. 4.6).
constexpr unsigned kReferenceOversampling = 2;

/// A surface in patches, and what it is made of.
struct MappedSource {
    std::unique_ptr<PatchMap> map;
    const SourceMesh* source = nullptr; ///< the map's own, to measure charts against; null: charts are the reference
    const SourceSamples* samples = nullptr; ///< the map's own
    unsigned finestFactor = 64;             ///< a larger one shows nothing more
    std::vector<StoredNormalMap> normalMaps{};
};

/// Reads the source of this name, repairs it, and makes patches of it. Throws AssetError as bakeSource() does.
MappedSource mapSource(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report);

/// The same of a mesh in memory.
MappedSource mapMesh(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report);

} // namespace osgTessLOD::bake
