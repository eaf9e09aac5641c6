// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/Baker.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/AttributeLevels.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/ElevationMap.h>
#include <osgTessLOD/bake/ImageFiles.h>
#include <osgTessLOD/bake/NormalBaker.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/RefinedPatches.h>
#include <osgTessLOD/bake/SharedUvMap.h>
#include <osgTessLOD/bake/TerrainMap.h>
#include <osgTessLOD/bake/UniformLevels.h>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <utility>

namespace osgTessLOD::bake {

namespace {

constexpr char kBuiltinPrefix[] = "builtin:";
/// The reference samples each patch at twice its finest factor (Lambert fig. 4.6).
constexpr unsigned kReferenceOversampling = 2;

/// Adds the seconds that `work` takes to the report.
template <typename Work> auto timed(BakeReport& report, const std::string& name, Work&& work)
{
    struct Timer {
        BakeReport& report;
        const std::string& name;
        std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
        ~Timer()
        {
            const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
            report.stages.push_back({name, elapsed.count()});
        }
    } timer{report, name};
    return work();
}

std::uint64_t peakResidentBytes()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

std::vector<std::uint16_t> powerOfTwoLadder(unsigned maxFactor)
{
    if (maxFactor < 1 || maxFactor > 64 || (maxFactor & (maxFactor - 1)) != 0) {
        throw AssetError("the largest factor must be a power of two up to 64, not " + std::to_string(maxFactor));
    }
    std::vector<std::uint16_t> ladder;
    for (unsigned factor = 1; factor <= maxFactor; factor *= 2) {
        ladder.push_back(static_cast<std::uint16_t>(factor));
    }
    return ladder;
}

std::vector<std::uint16_t> ladderOf(const BakeOptions& options)
{
    std::vector<std::uint16_t> powersOfTwo = powerOfTwoLadder(options.maxFactor);
    const auto& ladder = options.ladder;
    if (ladder.empty()) { return powersOfTwo; }
    const auto isBad = [](std::uint16_t factor) { return factor != 1 && (factor == 0 || factor % 2 != 0); };
    if (ladder.front() != 1 || std::any_of(ladder.begin(), ladder.end(), isBad) ||
        ladder.size() > LodAsset::kMaxLevels ||
        std::adjacent_find(ladder.begin(), ladder.end(), std::greater_equal<>()) != ladder.end()) {
        throw AssetError("the factors of levels must be 1 and even ones, rising, and at most " +
                         std::to_string(LodAsset::kMaxLevels));
    }
    if (ladder.back() != options.maxFactor) { throw AssetError("the last level's factor must be the largest factor"); }
    if (options.technique == "uniform" && ladder != powersOfTwo) {
        throw AssetError("levels of the technique uniform are the powers of two");
    }
    if (options.tile && ladder != powersOfTwo) { throw AssetError("levels of tiles are the powers of two"); }
    return ladder;
}

/// Throws for levels and normals that cannot be made: before anything is read.
void checkLevels(const BakeOptions& options)
{
    if ((options.normalResolution & (options.normalResolution - 1)) != 0) {
        throw AssetError("the resolution of normals must be a power of two, not " + std::to_string(options.normalResolution));
    }
    const unsigned map = options.normalMap;
    if (map != 0 && ((map & (map - 1)) != 0 || map > kMaxNormalMap)) {
        throw AssetError(fmt::format("the size of a normal map must be a power of two up to {}, not {}", kMaxNormalMap, map));
    }
    ladderOf(options);
    const auto& names = techniqueNames();
    if (std::find(names.begin(), names.end(), options.technique) == names.end()) {
        throw AssetError("there is no technique " + options.technique);
    }
}

/// `work` as a stage of one step.
template <typename Work>
auto inOneStep(const std::string& stage, const std::string& unit, Progress& progress, BakeReport& report, Work&& work)
{
    progress.begin(stage, 1, unit);
    auto result = timed(report, stage, work);
    progress.step(1);
    progress.end();
    return result;
}

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

/// A surface in patches, and what it is made of.
struct MappedSource {
    std::unique_ptr<PatchMap> map;
    const SourceMesh* source = nullptr; ///< the map's own, to measure charts against; null: charts are the reference
    const SourceSamples* samples = nullptr; ///< the map's own
    unsigned finestFactor = 64;             ///< a larger one shows nothing more
};

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

MappedSource mapMesh(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    clean(mesh, options, progress, report);
    if (!options.uvs && options.displacement.empty()) { mesh.uvs.clear(); }
    if (!options.displacement.empty()) { return makeDisplacedPatches(mesh, options, report); }
    if (options.controlMesh.elevation) { return makeElevations(std::move(mesh), options, progress, report); }
    return options.base.empty() ? makeMeshPatches(std::move(mesh), options, progress, report)
                                : makeSharedUvPatches(std::move(mesh), options, report);
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

/// Throws where options do not go together with the source or each other.
void checkSource(const std::string& source, const BakeOptions& options)
{
    if ((isBuiltin(source) || isHeightFile(source)) &&
        (!options.base.empty() || !options.displacement.empty() || options.smoothingSteps > 0)) {
        throw AssetError(source + ": only meshes have base meshes, displacement maps and smoothing");
    }
    if (options.normalMap != 0 && (isBuiltin(source) || isHeightFile(source) || !options.displacement.empty() ||
                                   options.controlMesh.elevation || !options.uvs)) {
        throw AssetError(source + ": only meshes that are baked with their texture coordinates have normal maps over them");
    }
    if (options.tile && !isHeightFile(source)) { throw AssetError(source + ": only height images have tiles"); }
    if (!options.base.empty() && !options.displacement.empty()) {
        throw AssetError("with a displacement map the source itself is the base mesh");
    }
    if (options.controlMesh.elevation &&
        (isBuiltin(source) || isHeightFile(source) || !options.base.empty() || !options.displacement.empty())) {
        throw AssetError(source + ": elevations are made of meshes without a base mesh or displacement map");
    }
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

void checkTolerance(const BakeOptions& options)
{
    if (!(options.tolerance >= 0.0) || !std::isfinite(options.tolerance)) {
        throw AssetError(
            fmt::format("the tolerance must be a part of the diagonal, 0 or more, not {}", options.tolerance));
    }
}

double largestChartError(const LodAsset& asset)
{
    float largest = 0.0F;
    for (const LodPatch& patch : asset.patches) { largest = std::max(largest, patch.chartError); }
    return static_cast<double>(largest);
}

/// The options with no larger a factor than the surface has use for; shows the map to who wants to see it.
BakeOptions adaptedTo(const MappedSource& mapped, const BakeOptions& options)
{
    BakeOptions adapted = options;
    if (options.ladder.empty()) { adapted.maxFactor = std::min(options.maxFactor, mapped.finestFactor); }
    if (options.useMap) { options.useMap(*mapped.map, adapted.maxFactor); }
    return adapted;
}

/// Refuses what the asset's lattice, which is in single precision, cannot hold.
void checkSize(const PatchMap& map)
{
    constexpr double kLargest = 1e36;
    const double size = map.frame().scale;
    if (size <= kLargest && size >= 1.0 / kLargest) { return; }
    throw AssetError(fmt::format("{}: its size, {:.3g}, is beyond {:.0e} or below {:.0e}", map.name(), size, kLargest, 1.0 / kLargest));
}

/// Charts and levels of a surface.
PatchedSurface levelsOf(MappedSource mapped, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    checkSize(*mapped.map);
    const BakeOptions adapted = adaptedTo(mapped, options);
    const std::vector<std::uint16_t> ladder = ladderOf(adapted);
    PatchedSurface surface;
    surface.map = std::move(mapped.map);
    if (options.normalMap != 0) {
        surface.normalMaps = timed(report, "normal map", [&] {
            const CornerNormals normals = cornerNormals(*mapped.source, options.controlMesh.creaseAngleRadians);
            return makeNormalMaps(*mapped.source, normals, options.normalMap, progress);
        });
    }
    surface.charts = timed(report, "charts", [&] {
        return makeCharts(*surface.map, kReferenceOversampling * adapted.maxFactor, progress);
    });
    if (mapped.source != nullptr) {
        timed(report, "chart distance",
              [&] { measureChartErrors(*mapped.source, *mapped.samples, surface.charts, progress); });
    }
    surface.hierarchy = timed(report, "levels", [&] {
        const PatchTopology& topology = surface.map->topology();
        return options.technique == "strips"
                   ? makeStripLevels(topology, surface.charts, ladder, options.strips, progress, &report.strips)
                   : makeUniformLevels(topology, surface.charts, ladder, progress);
    });
    return surface;
}

tbb::global_control limitThreads(const BakeOptions& options)
{
    return {tbb::global_control::max_allowed_parallelism,
            options.threads != 0 ? options.threads : static_cast<std::size_t>(tbb::info::default_concurrency())};
}

/// Puts the images into the asset.
void addNormalMaps(const std::vector<NormalMap>& maps, LodAsset& asset, BakeReport& report)
{
    if (!maps.empty() && asset.materials.empty()) { asset.materials.emplace_back(); }
    for (const NormalMap& map : maps) {
        if (map.material >= asset.materials.size()) {
            throw AssetError(report.source + ": a normal map needs the materials of the base mesh to be the source's");
        }
        const std::string name = maps.size() == 1 ? "normals.png" : fmt::format("normals_{}.png", map.material);
        const std::string bytes = imageFiles().encode(name, map.image);
        asset.images.push_back({name, {bytes.begin(), bytes.end()}});
        asset.materials[map.material].textures.push_back({LodTexture::Role::ObjectNormal, "normals", name});
        report.normalMaps.push_back({map.material, map.coverage, map.coveredTwice});
        if (map.coveredTwice > 0.0) {
            report.warnings.push_back(fmt::format("{:.3f} % of what its texture coordinates cover of {} is covered twice",
                                                  100.0 * map.coveredTwice, name));
        }
    }
}

/// Errors, lattice, attributes and normals of the surface that `make` makes of the source of this name.
template <typename MakeSurface>
LodAsset bakeSurface(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report,
                     MakeSurface&& make)
{
    checkTolerance(options);
    const auto start = std::chrono::steady_clock::now();
    const tbb::global_control threads = limitThreads(options);
    PatchedSurface surface = make();
    LodAsset asset = timed(report, "errors", [&] {
        return assembleAsset(*surface.map, surface.charts, surface.hierarchy, options.tolerance, progress);
    });
    const SurfaceAttributes& attributes = surface.map->attributes();
    if (attributes.uvs || attributes.colors) {
        timed(report, "attributes",
              [&] { addAttributes(surface.map->topology(), surface.charts, surface.hierarchy, asset, progress); });
    }
    asset.technique = options.technique;
    asset.source = source.substr(source.find_last_of('/') + 1);
    if (report.tile) {
        asset.source += fmt::format(" (tile {},{} of {} x {})", report.tile->column, report.tile->row,
                                    report.tile->count, report.tile->count);
    }
    asset.sourceTriangles = surface.map->sourceTriangles();
    addNormalMaps(surface.normalMaps, asset, report);
    if (options.normals && surface.normalMaps.empty()) {
        asset.normals = timed(report, "normals", [&] {
            const unsigned most = surface.charts.factor;
            const unsigned resolution = options.normalResolution == 0 ? most : std::min(options.normalResolution, most);
            return bakeNormals(surface.map->topology(), surface.charts, resolution, progress);
        });
    } else {
        for (LodLevel& level : asset.levels) { level.parameters.clear(); } // only normals are looked up by them
    }
    timed(report, "validate", [&] { asset.validate(); });

    report.source = source;
    report.sourceTriangles = asset.sourceTriangles;
    report.patches = asset.patches.size();
    report.diagonal = surface.map->frame().scale;
    report.largestChartError = largestChartError(asset);
    report.stored = summarize(asset);
    report.hasUvs = asset.hasUvs();
    report.uvStep = std::max(asset.uvLattice.step[0], asset.uvLattice.step[1]);
    report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report.peakBytes = peakResidentBytes();
    return asset;
}

} // namespace

const std::vector<std::string>& techniqueNames()
{
    static const std::vector<std::string> names{"uniform", "strips"};
    return names;
}

PatchedSurface makeLevels(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    checkLevels(options);
    return levelsOf(mapSource(source, options, progress, report), options, progress, report);
}

void makeMap(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    const tbb::global_control threads = limitThreads(options);
    checkLevels(options);
    const MappedSource mapped = mapSource(source, options, progress, report);
    adaptedTo(mapped, options);
    report.source = source;
    report.patches = mapped.map->topology().patches.size();
    report.sourceTriangles = mapped.map->sourceTriangles();
    report.diagonal = mapped.map->frame().scale;
}

LodAsset bakeSource(const std::string& source, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    return bakeSurface(source, options, progress, report,
                       [&] { return makeLevels(source, options, progress, report); });
}

LodAsset bakeMesh(SourceMesh mesh, const BakeOptions& options, Progress& progress, BakeReport& report)
{
    const std::string name = mesh.name;
    return bakeSurface(name, options, progress, report, [&] {
        checkLevels(options);
        checkMesh(mesh);
        return levelsOf(mapMesh(std::move(mesh), options, progress, report), options, progress, report);
    });
}

std::string BakeReport::toJson() const
{
    nlohmann::ordered_json json;
    json["source"] = source;
    if (tile) { json["tile"] = {tile->column, tile->row, tile->count}; }
    json["source_triangles"] = sourceTriangles;
    json["patches"] = patches;
    json["diagonal"] = diagonal;
    if (isMesh) {
        json["cleaning"] = {{"welded_vertices", cleaning.weldedVertices},
                            {"unreferenced_vertices", cleaning.unreferencedVertices},
                            {"degenerate_faces", cleaning.degenerateFaces},
                            {"duplicate_faces", cleaning.duplicateFaces},
                            {"flipped_faces", cleaning.flippedFaces},
                            {"non_manifold_edges", cleaning.nonManifoldEdges},
                            {"non_manifold_vertices", cleaning.nonManifoldVertices},
                            {"boundary_edges", cleaning.boundaryEdges},
                            {"components", cleaning.components},
                            {"faces_without_uvs", cleaning.facesWithoutUvs}};
    }
    if (!repairs.empty()) { json["repairs"] = repairs; }
    if (!warnings.empty()) { json["warnings"] = warnings; }
    if (elevationRounds > 0) { json["elevation"] = {{"rounds", elevationRounds}, {"own_triangles", ownTriangles}}; }
    if (voids + filledVoids > 0) { json["voids"] = {{"filled", filledVoids}, {"left_open", voids}}; }
    if (largestChartError > 0.0) { json["largest_chart_error"] = largestChartError; }
    for (const AssetSummary::Level& level : stored.levels) {
        json["levels"].push_back({{"factor", level.factor},
                                  {"patches", level.patches},
                                  {"finest_patches", level.finestPatches},
                                  {"vertices", level.vertices},
                                  {"triangles", level.triangles},
                                  {"largest_error", level.largestError},
                                  {"mean_error", level.meanError}});
        if (hasUvs) { json["levels"].back()["largest_uv_error"] = level.largestUvError; }
    }
    if (hasUvs) { json["uv_step"] = uvStep; }
    for (const NormalMapReport& map : normalMaps) {
        json["normal_maps"].push_back(
            {{"material", map.material}, {"coverage", map.coverage}, {"covered_twice", map.coveredTwice}});
    }
    json["finest_vertices"] = stored.finestVertices;
    json["finest_triangles"] = stored.finestTriangles;
    json["largest_finest_error"] = stored.largestFinestError;
    for (const Stage& stage : stages) { json["stages"].push_back({{"name", stage.name}, {"seconds", stage.seconds}}); }
    if (strips.contractions != 0) {
        json["strips"] = {{"contractions", strips.contractions},
                          {"relayouts", strips.relayouts},
                          {"thread_seconds",
                           {{"placement", strips.placementSeconds},
                            {"error_fits", strips.fitSeconds},
                            {"c_edge", strips.costSeconds},
                            {"edge_intersections", strips.overlaySeconds},
                            {"refits", strips.refitSeconds}}}};
    }
    json["seconds"] = seconds;
    json["peak_bytes"] = peakBytes;
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace); // names of files are any bytes
}

} // namespace osgTessLOD::bake
