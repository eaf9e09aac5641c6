// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/Baker.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/AttributeLevels.h>
#include <osgTessLOD/bake/BakeStages.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/NormalBaker.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/SourceMapping.h>
#include <osgTessLOD/bake/UniformLevels.h>

#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <tbb/info.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cmath>
#include <functional>
#include <utility>

namespace osgTessLOD::bake {

namespace {

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
    if (map != 0 && ((map & (map - 1)) != 0 || map < kMinNormalMap || map > kMaxNormalMap)) {
        throw AssetError(fmt::format("the size of a normal map must be a power of two from {} to {}, not {}", kMinNormalMap,
                                     kMaxNormalMap, map));
    }
    ladderOf(options);
    const auto& names = techniqueNames();
    if (std::find(names.begin(), names.end(), options.technique) == names.end()) {
        throw AssetError("there is no technique " + options.technique);
    }
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
    surface.normalMaps = std::move(mapped.normalMaps);
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

/// A name for the image of a material's normals that nothing else in the asset refers to.
std::string normalImageName(const LodAsset& asset, std::string material)
{
    const auto isPlain = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == '.'; };
    std::replace_if(material.begin(), material.end(), [&](char c) { return !isPlain(c); }, '_');
    const std::string stem = material.empty() ? "normals" : "normals-" + material;
    const auto isTaken = [&](const std::string& name) {
        return std::any_of(asset.images.begin(), asset.images.end(), [&](const LodImage& image) { return image.name == name; }) ||
               std::any_of(asset.materials.begin(), asset.materials.end(), [&](const LodMaterial& other) {
                   return std::any_of(other.textures.begin(), other.textures.end(),
                                      [&](const LodTexture& texture) { return texture.image == name; });
               });
    };
    std::string name = stem + ".png";
    for (unsigned number = 2; isTaken(name); ++number) { name = fmt::format("{}_{}.png", stem, number); }
    return name;
}

/// Puts the images into the asset.
void addNormalMaps(std::vector<StoredNormalMap> maps, LodAsset& asset, BakeReport& report)
{
    if (!maps.empty() && asset.materials.empty()) { asset.materials.emplace_back(); }
    for (StoredNormalMap& map : maps) {
        const std::string name = normalImageName(asset, map.material ? asset.materials[*map.material].name : "");
        report.normalMaps.push_back({name, map.png.size(), map.coverage, map.coveredTwice});
        asset.images.push_back({name, std::move(map.png)});
        for (std::size_t m = 0; m < asset.materials.size(); ++m) {
            if (map.material && *map.material != m) { continue; }
            asset.materials[m].textures.push_back({LodTexture::Role::ObjectNormal, "normals", name});
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
    addNormalMaps(std::move(surface.normalMaps), asset, report);
    if (options.normals && options.normalMap == 0) {
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

} // namespace osgTessLOD::bake
