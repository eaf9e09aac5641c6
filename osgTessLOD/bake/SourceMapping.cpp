// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SourceMapping.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/BakeStages.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/ElevationMap.h>
#include <osgTessLOD/bake/ImageFiles.h>
#include <osgTessLOD/bake/NormalMap.h>
#include <osgTessLOD/bake/RefinedPatches.h>
#include <osgTessLOD/bake/SharedUvMap.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/bake/TerrainMap.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace osgTessLOD::bake {

namespace {

constexpr char kBuiltinPrefix[] = "builtin:";

/// With the option `strict`, throws where anything was repaired or missing.
void checkStrict(const std::string& source, const BakeOptions& options, const BakeReport& report)
{
    std::vector<std::string> faults = report.repairs;
    faults.insert(faults.end(), report.warnings.begin(), report.warnings.end());
    if (!options.strict || faults.empty()) { return; }
    throw AssetError(fmt::format("{}: not baked, as it is not sound: {}", source, fmt::join(faults, "; ")));
}

/// In its own space.
void clean(SourceMesh& mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    report.cleaning = inOneStep("clean", "mesh", progress, report, [&] { return cleanMesh(mesh); });
    report.isMesh = true;
    const std::vector<std::string> repairs = repairsOf(report.cleaning);
    report.repairs.insert(report.repairs.end(), repairs.begin(), repairs.end());
    report.warnings = mesh.warnings;
    checkStrict(mesh.name, options, report);
}

/// Refuses texture coordinates or materials in so many pieces that the charts of the patches between their seams would not fit into memory.
void checkSeams(const ControlMesh& mesh, const BakeOptions& options, unsigned factor)
{
    constexpr double kMostBytes = 8e9;
    constexpr double kMostGrowth = 4.0; // beyond it, it is seams that are to blame
    constexpr double kVertexBytes = sizeof(Eigen::Vector3d) + sizeof(Eigen::Vector3f) + sizeof(Eigen::Vector2f);
    if (!mesh.attributes().uvs && !mesh.attributes().materials) { return; }
    const auto triangles = static_cast<double>(mesh.sourceTriangles());
    const double wanted = options.controlMesh.patches != 0 ? static_cast<double>(options.controlMesh.patches)
                                                           : triangles / options.controlMesh.trianglesPerPatch;
    const auto patches = static_cast<double>(mesh.topology().patches.size());
    const double bytes =
        patches * TessellationPattern::vertexCount(kReferenceOversampling * factor) * kVertexBytes;
    if (patches <= kMostGrowth * std::max(wanted, 1.0) || bytes <= kMostBytes) { return; }
    throw AssetError(
        fmt::format("{}: the seams of its texture coordinates and materials leave no fewer than {} patches, whose charts would "
                    "take {:.0f} GB: bake with a smaller largest factor or without texture coordinates, or unwrap "
                    "it into fewer pieces",
                    mesh.name(), mesh.topology().patches.size(), bytes / 1e9));
}

/// Of thousands of pieces of a few triangles each, every one has a patch at least, whose finest levels would show nothing but
/// the same triangles: the largest factor that does not make 32 triangles of one, or some millions of all. Of a scan in one
/// piece, patches at their finest have 4 to 26 triangles for each of the source's.
unsigned finestFactorFor(const PatchMap& mesh)
{
    constexpr std::uint64_t kMostPerTriangle = 32;
    constexpr std::uint64_t kFewTriangles = 4'000'000;
    const std::uint64_t most = std::max<std::uint64_t>(kMostPerTriangle * mesh.sourceTriangles(), kFewTriangles);
    unsigned factor = 64;
    while (factor > 2 && mesh.topology().patches.size() * TessellationPattern::triangleCount(factor) > most) {
        factor /= 2;
    }
    return factor;
}

/// Has a mesh so many parts for its size (legs, horns, holes) that as few patches as its triangles ask for cannot be bisected
/// into near ones? How many to begin with instead: twice or, if it is far off, four times as many, or, where a small mesh is far
/// off even so, all of its triangles; 0: it is near.
std::size_t morePatchesFor(const RefinedPatches& patches, const BakeOptions& options)
{
    constexpr double kStillNear = 1.4; // tolerances
    constexpr double kFarOff = 8.0;    // tolerances
    constexpr std::size_t kFewestTriangles = 8; // per patch
    constexpr std::size_t kSmallMesh = 4096;    // triangles
    const double roughest = patches.roughest() / options.patchTolerance;
    if (options.controlMesh.patches != 0 || !(roughest > kStillNear)) { return 0; }
    const std::size_t present = patches.base().topology().patches.size();
    const std::size_t triangles = patches.sourceTriangles();
    const std::size_t more = (roughest > kFarOff ? 4 : 2) * present;
    if (kFewestTriangles * more <= triangles) { return more; }
    return roughest > kFarOff && triangles <= kSmallMesh && present < triangles ? triangles : 0;
}

/// `mesh` is clean.
MappedSource makeMeshPatches(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    normalizeFrame(mesh);
    auto controlMesh = timed(report, "control mesh", [&] {
        return std::make_unique<ControlMesh>(std::move(mesh), options.controlMesh, progress);
    });
    const unsigned finest = options.ladder.empty() ? std::min(options.maxFactor, finestFactorFor(*controlMesh)) : options.maxFactor;
    checkSeams(*controlMesh, options, finest);
    auto patches = timed(report, "refine patches", [&] {
        return std::make_unique<RefinedPatches>(std::move(controlMesh), finest, options.patchTolerance, progress);
    });
    while (const std::size_t wanted = morePatchesFor(*patches, options)) {
        ControlMeshOptions more = options.controlMesh;
        more.patches = wanted;
        controlMesh = timed(report, "control mesh", [&] {
            return std::make_unique<ControlMesh>(patches->base().source(), more, progress);
        });
        patches = timed(report, "refine patches", [&] {
            return std::make_unique<RefinedPatches>(std::move(controlMesh), finest, options.patchTolerance, progress);
        });
    }
    const SourceMesh& source = patches->base().source();
    const SourceSamples& samples = patches->sourceSamples();
    return {std::move(patches), &source, &samples, finest};
}

/// `mesh` is clean.
MappedSource makeElevations(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    normalizeFrame(mesh);
    auto elevations = timed(report, "elevations", [&] {
        return std::make_unique<ElevationMap>(std::move(mesh), options.controlMesh, progress);
    });
    report.elevationRounds = elevations->rounds();
    report.ownTriangles = elevations->ownTriangles();
    const unsigned finest = options.ladder.empty() ? finestFactorFor(*elevations) : options.maxFactor;
    const SourceMesh& source = elevations->source();
    const SourceSamples& samples = elevations->sourceSamples();
    return {std::move(elevations), &source, &samples, finest};
}

MappedSource makeSharedUvPatches(SourceMesh mesh, const BakeOptions& options, BakeReport& report)
{
    return timed(report, "shared texture coordinates", [&] {
        normalizeFrame(mesh);
        SourceMesh coarse = importMesh(options.base);
        cleanMesh(coarse);
        SharedUvOptions sharing;
        sharing.tolerance = options.uvTolerance;
        sharing.creaseAngleRadians = options.controlMesh.creaseAngleRadians;
        auto shared = std::make_unique<SharedUvMap>(std::move(coarse), std::move(mesh), sharing);
        const SourceMesh& source = shared->source();
        const SourceSamples& samples = shared->sourceSamples();
        return MappedSource{std::move(shared), &source, &samples};
    });
}

MappedSource makeDisplacedPatches(const SourceMesh& mesh, const BakeOptions& options, BakeReport& report)
{
    return timed(report, "displacement", [&] {
        const unsigned channels = options.displaced.kind == DisplacementOptions::Kind::Scalar ? 1 : 3;
        auto map = std::make_unique<DisplacedMap>(mesh, DisplacementImage::read(options.displacement, channels),
                                                  options.displaced);
        const unsigned finest = map->finestFactor();
        return MappedSource{std::move(map), nullptr, nullptr, finest};
    });
}

/// Half of the tolerance is for the seam itself, the rest for the patch beside it.
constexpr double kSeamPart = 0.5;

MappedSource mapTile(const std::string& path, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    HeightTile tile = inOneStep("import", "file", progress, report,
                                [&] { return readHeightTile(path, options.heights, *options.tile); });
    report.tile = options.tile;
    report.filledVoids = tile.filledVoids;
    if (report.filledVoids > 0) {
        report.repairs.push_back(fmt::format("{} samples without data filled", report.filledVoids));
    }
    checkStrict(path, options, report);
    if (const std::uint64_t voids = tile.field.voids(); voids > 0) {
        throw AssetError(fmt::format(
            "{}: tile {},{} of {} x {} has {} samples without data that are not filled, and tiles have no "
            "holes: fill larger voids (--fill-voids)",
            path, options.tile->column, options.tile->row, options.tile->count, options.tile->count, voids));
    }
    auto terrain = timed(report, "terrain", [&] {
        return std::make_unique<TerrainMap>(std::move(tile), options.maxFactor, options.patchTolerance,
                                            kSeamPart * options.tolerance, progress);
    });
    const SourceMesh& source = terrain->source();
    const SourceSamples& samples = terrain->sourceSamples();
    return {std::move(terrain), &source, &samples};
}

/// Terrain without voids keeps the vertical projection as its map; with voids it is a mesh with holes.
MappedSource mapTerrain(const std::string& path, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    HeightField field =
        inOneStep("import", "file", progress, report, [&] { return readHeightField(path, options.heights); });
    report.filledVoids = timed(report, "voids", [&] { return fillVoids(field, options.heights.largestFilledVoid); });
    report.voids = field.voids();
    if (report.filledVoids > 0) { report.repairs.push_back(fmt::format("{} samples without data filled", report.filledVoids)); }
    checkStrict(path, options, report);
    if (report.voids > 0) {
        SourceMesh mesh = triangulate(field);
        clean(mesh, options, progress, report);
        return makeMeshPatches(std::move(mesh), options, progress, report);
    }
    auto terrain = timed(report, "terrain", [&] {
        return std::make_unique<TerrainMap>(std::move(field), options.maxFactor, options.patchTolerance, progress);
    });
    const SourceMesh& source = terrain->source();
    const SourceSamples& samples = terrain->sourceSamples();
    return {std::move(terrain), &source, &samples};
}

bool isBuiltin(const std::string& source)
{
    return source.rfind(kBuiltinPrefix, 0) == 0;
}

/// Throws where a normal map is asked for and `source`, a mesh or not, has none.
void checkNormalMap(const std::string& source, bool isMesh, const BakeOptions& options)
{
    if (options.normalMap == 0) { return; }
    if (isMesh && options.uvs && options.displacement.empty() && !options.controlMesh.elevation) { return; }
    throw AssetError(source + ": only meshes that are baked with their texture coordinates have normal maps over them");
}

/// Throws where options do not go together with the source or each other.
void checkSource(const std::string& source, const BakeOptions& options)
{
    if ((isBuiltin(source) || isHeightFile(source)) &&
        (!options.base.empty() || !options.displacement.empty() || options.smoothingSteps > 0)) {
        throw AssetError(source + ": only meshes have base meshes, displacement maps and smoothing");
    }
    checkNormalMap(source, !isBuiltin(source) && !isHeightFile(source), options);
    if (options.tile && !isHeightFile(source)) { throw AssetError(source + ": only height images have tiles"); }
    if (!options.base.empty() && !options.displacement.empty()) {
        throw AssetError("with a displacement map the source itself is the base mesh");
    }
    if (options.controlMesh.elevation &&
        (isBuiltin(source) || isHeightFile(source) || !options.base.empty() || !options.displacement.empty())) {
        throw AssetError(source + ": elevations are made of meshes without a base mesh or displacement map");
    }
}

/// Of a clean mesh. With a base mesh, whose materials are others, one for all: patches find their surface by texture coordinates alone.
std::vector<StoredNormalMap> bakeNormalMaps(const SourceMesh& mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    std::vector<StoredNormalMap> stored;
    const CornerNormals normals = cornerNormals(mesh, options.controlMesh.creaseAngleRadians);
    makeNormalMaps(mesh, normals, options.normalMap, !options.base.empty(), progress, [&](NormalMap map) {
        const std::string bytes = imageFiles().encode("normals.png", map.image);
        stored.push_back({map.material, {bytes.begin(), bytes.end()}, map.coverage, map.coveredTwice});
        if (map.coveredTwice > 0.0) {
            const std::string name = map.material && *map.material < mesh.materials.size() ? mesh.materials[*map.material].name : "";
            report.warnings.push_back(fmt::format("texture coordinates{} overlap in {:.3f} % of their normal map",
                                                  name.empty() ? name : " of material " + name, 100.0 * map.coveredTwice));
        }
    });
    checkStrict(mesh.name, options, report);
    return stored;
}

MappedSource mapCleanMesh(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    if (!options.displacement.empty()) { return makeDisplacedPatches(mesh, options, report); }
    if (options.controlMesh.elevation) { return makeElevations(std::move(mesh), options, progress, report); }
    return options.base.empty() ? makeMeshPatches(std::move(mesh), options, progress, report)
                                : makeSharedUvPatches(std::move(mesh), options, report);
}

} // namespace

MappedSource mapMesh(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    checkNormalMap(mesh.name, true, options);
    clean(mesh, options, progress, report);
    if (!options.uvs && options.displacement.empty()) { mesh.uvs.clear(); }
    std::vector<StoredNormalMap> normalMaps; // first of all: what cannot be is refused before the long work
    if (options.normalMap != 0) {
        normalMaps = timed(report, "normal map", [&] { return bakeNormalMaps(mesh, options, progress, report); });
    }
    MappedSource mapped = mapCleanMesh(std::move(mesh), options, progress, report);
    mapped.normalMaps = std::move(normalMaps);
    return mapped;
}

MappedSource mapSource(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    checkSource(source, options);
    if (isBuiltin(source)) {
        return {makeBuiltinSurface(source.substr(sizeof kBuiltinPrefix - 1), options.builtinTriangles)};
    }
    if (options.tile) { return mapTile(source, options, progress, report); }
    if (isHeightFile(source)) { return mapTerrain(source, options, progress, report); }
    SourceMesh mesh = inOneStep("import", "file", progress, report, [&] {
        return options.smoothingSteps > 0 ? importSmoothedMesh(source, options.smoothingSteps) : importMesh(source);
    });
    return mapMesh(std::move(mesh), options, progress, report);
}

} // namespace osgTessLOD::bake
