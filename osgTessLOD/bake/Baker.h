// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/AssetSummary.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/DisplacedMap.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/HeightTile.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/NormalMap.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <osgTessLOD/bake/StripSimplifier.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// What to bake and how.
struct BakeOptions {
    /// Factor of the finest level, a power of two up to 64. Smaller where a displacement map, or a mesh of thousands of pieces of
    /// a few triangles each, has nothing more to show.
    unsigned maxFactor = 64;
    ControlMeshOptions controlMesh;         ///< for mesh sources
    /// For a mesh source: file of a coarse mesh with the same texture coordinates, whose triangles become the patches
    /// (SharedUvMap). Empty: patches are made of the source.
    std::string base;
    double uvTolerance = 0.02;              ///< with `base`: SharedUvOptions::tolerance
    /// Displacement map (image file) of a mesh source, which is then a base mesh with texture coordinates: every triangle
    /// a patch, of a finest factor no larger than the map's texels need (DisplacedMap). Empty: none.
    std::string displacement;
    DisplacementOptions displaced;          ///< what the map's numbers mean
    unsigned smoothingSteps = 0;            ///< Catmull–Clark steps of a mesh source, before anything else
    HeightOptions heights;                  ///< for a height image as source (isHeightFile)
    /// Of a height image, bake this tile alone: it meets those next to it, baked apart with the same options, without cracks.
    std::optional<TileChoice> tile;
    /// Patches of a mesh are bisected until their finest level is estimated to be this near, in units of the model's size.
    double patchTolerance = 0.0007;
    /// No finer level of a patch is stored once its distance from the reference is at most this, in units of the model's
    /// size; 0: all levels are. A seventh of patchTolerance, and a tenth of a pixel where the whole model is 1000 across.
    double tolerance = 0.0001;
    std::uint64_t builtinTriangles = 0;     ///< for builtin sources; 0: their own size
    std::string technique = "strips";       ///< how levels are made: one of techniqueNames()
    StripOptions strips;                    ///< for technique "strips"
    /// Rising factors of the levels, 1 and even ones, the last one maxFactor; empty: powers of two. `strips` only.
    std::vector<std::uint16_t> ladder;
    bool strict = false;                    ///< refuse sources that have to be repaired or that refer to what is not there
    bool normals = true;
    /// Normals along a side of each patch, a power of two; 0: as many as the reference has, twice the factor of the finest level,
    /// which is also the most.
    unsigned normalResolution = 0;
    /// Of a mesh: bake its normals as an image of so many texels a side, a power of two from 64 to 8,192, over its texture coordinates
    /// instead (makeNormalMaps): one for each material, or one for all of a mesh that has a base mesh; 0: per patch.
    unsigned normalMap = 0;
    bool uvs = true;                        ///< bake a mesh's texture coordinates, whose seams become borders of patches
    /// Called with the map and the factor of its finest level once both are known, before levels are made; may throw. Empty: nothing is.
    std::function<void(const PatchMap& map, unsigned finestFactor)> useMap;
    unsigned threads = 0;                   ///< 0: all processors; the result does not depend on it
};

/// The techniques by which levels can be made.
OSGTESSLOD_EXPORT const std::vector<std::string>& techniqueNames();

/// What the texture coordinates of a material make of its normal map.
struct NormalMapReport {
    std::string image;         ///< LodImage::name
    std::uint64_t bytes = 0;   ///< of the image
    double coverage = 0.0;     ///< NormalMap's
    double coveredTwice = 0.0;
};

/// A NormalMap whose image is encoded.
struct StoredNormalMap {
    std::optional<std::uint16_t> material;
    std::vector<std::uint8_t> png;
    double coverage = 0.0;
    double coveredTwice = 0.0;
};

/// What a bake did and took.
struct BakeReport {
    struct Stage {
        std::string name;
        double seconds = 0.0;
    };
    std::string source;
    std::optional<TileChoice> tile; ///< of the source
    std::uint64_t sourceTriangles = 0;
    bool isMesh = false;                    ///< made of a mesh, so that `cleaning` means something
    CleaningReport cleaning;
    std::vector<std::string> repairs;       ///< of the source, as words for people: repairsOf(cleaning) and filled voids
    std::vector<std::string> warnings;      ///< SourceMesh::warnings
    std::uint64_t filledVoids = 0;          ///< samples of a height field without data, filled
    std::uint64_t voids = 0;                ///< and those left open
    unsigned elevationRounds = 0;           ///< ElevationMap::rounds(); 0: patches need not be elevations
    std::uint64_t ownTriangles = 0;         ///< of patches that are elevations, those that are triangles of the source
    std::uint64_t patches = 0;
    double diagonal = 0.0;                  ///< of the source's bounding box, source units
    double largestChartError = 0.0;         ///< source units; 0 where the charts are the reference
    std::vector<NormalMapReport> normalMaps;
    bool hasUvs = false;
    double uvStep = 0.0;                    ///< between texture coordinates that can be stored
    AssetSummary stored;
    std::vector<Stage> stages;
    StripReport strips;                     ///< for technique "strips": what the stage "levels" spent its time on
    double seconds = 0.0;
    std::uint64_t peakBytes = 0;            ///< resident set of the whole process at its largest

    OSGTESSLOD_EXPORT std::string toJson() const;
};

/// A surface in patches, with the reference and the levels of each: all that an asset is put together from.
struct PatchedSurface {
    std::unique_ptr<PatchMap> map;
    ChartSet charts;
    LevelHierarchy hierarchy;
    std::vector<StoredNormalMap> normalMaps; ///< BakeOptions::normalMap
};

/// The first part of bakeSource: all but errors, lattice and normals. Adds to the report what it did.
OSGTESSLOD_EXPORT PatchedSurface makeLevels(const std::string& source, const BakeOptions& options, Progress& progress,
                                            BakeReport& report);

/// The first part of makeLevels, which useMap is all there is to: the source as a map.
OSGTESSLOD_EXPORT void makeMap(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report);

/// Bakes `source`: a mesh file's path, or "builtin:NAME". Throws AssetError for bad input, Interrupted as `progress` asks.
OSGTESSLOD_EXPORT LodAsset bakeSource(const std::string& source, const BakeOptions& options, Progress& progress,
                                      BakeReport& report);

/// The same for a mesh in memory, as importMesh() gives it: it is cleaned like one from a file; mesh.name stands for the
/// path. Throws AssetError also for a mesh without a triangle, or a position that is not finite.
OSGTESSLOD_EXPORT LodAsset bakeMesh(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report);

} // namespace osgTessLOD::bake
