// SPDX-License-Identifier: MIT
#include "Benchmark.h"

#include <osgTessLOD/bake/AssetAssembler.h>
#include <support/ScreenDeviation.h>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <exception>
#include <random>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;
using SelectedBound = SelectionOptions::Bound;

constexpr std::array<double, 3> kErrorPixels{0.5, 1.0, 4.0};
/// Patches that are compared in a view and error at most, evenly spread over those selected: overlays take their time.
constexpr std::size_t kPatchesPerView = 8;
constexpr double kRounding = 1e-5; ///< of positions and parameters to single precision and to the chart's lattice

/// Patches that random points are taken of, likewise.
constexpr std::size_t kSampledPatchesPerView = 32;

/// Deviations in terms of those asked for, one per view, error and patch.
struct Ratios {
    std::vector<double> all;
    std::vector<double> refined;  ///< of patches above level 0
    double largestOfPoints = 0.0; ///< of random points of triangles
    std::uint64_t points = 0;

    double largest() const { return all.empty() ? 0.0 : *std::max_element(all.begin(), all.end()); }
    void append(const Ratios& other)
    {
        all.insert(all.end(), other.all.begin(), other.all.end());
        refined.insert(refined.end(), other.refined.begin(), other.refined.end());
        largestOfPoints = std::max(largestOfPoints, other.largestOfPoints);
        points += other.points;
    }
};

/// A scene with all that its deviations are measured by.
struct MeasuredScene {
    bake::PatchedSurface surface;
    LodAsset asset;
    PatchSelector selector;
    ScreenDeviation deviation;

    explicit MeasuredScene(const Scene& scene)
        : surface(levelsOf(scene))
        , asset(assetOf(surface))
        , selector(asset)
        , deviation(surface, asset)
    {
    }

    /// At vertices and crossings, and at about so many random points, which `random` chooses.
    Ratios ratiosIn(const ScreenCamera& camera, const SelectionOptions& options, std::size_t points,
                    std::mt19937_64 random) const
    {
        const SelectionView view = camera.view();
        std::vector<PatchRecord> records = selector.select(view, options, camera.sides()).records.vector();
        records.erase(std::remove_if(records.begin(), records.end(),
                                     [&](const PatchRecord& record) {
                                         return hasSaturatedBorder(asset, selector, record.patch, view, options);
                                     }),
                      records.end());
        Ratios ratios;
        for (const PatchRecord& record : spread(records, kPatchesPerView)) {
            ratios.all.push_back(deviation.pixels(record, camera) / options.errorPixels);
            if (MorphedSurface::drawnLevel(record.edgeLevels) > 0) { ratios.refined.push_back(ratios.all.back()); }
        }
        const std::vector<PatchRecord> sampled = spread(records, kSampledPatchesPerView);
        for (const PatchRecord& record : sampled) {
            const auto found = deviation.sample(record, camera, (points + sampled.size() - 1) / sampled.size(), random);
            ratios.largestOfPoints = std::max(ratios.largestOfPoints, found.pixels / options.errorPixels);
            ratios.points += found.points;
        }
        return ratios;
    }

private:
    /// So many of the records at most.
    static std::vector<PatchRecord> spread(const std::vector<PatchRecord>& records, std::size_t most)
    {
        std::vector<PatchRecord> some;
        const std::size_t count = std::min(records.size(), most);
        for (std::size_t k = 0; k < count; ++k) { some.push_back(records[k * records.size() / count]); }
        return some;
    }
    static bake::PatchedSurface levelsOf(const Scene& scene)
    {
        bake::Progress progress;
        bake::BakeReport report;
        return bake::makeLevels(scene.source, bake::BakeOptions(), progress, report);
    }
    static LodAsset assetOf(const bake::PatchedSurface& surface)
    {
        bake::Progress progress;
        return bake::assembleAsset(*surface.map, surface.charts, surface.hierarchy, bake::BakeOptions().tolerance, progress);
    }
};

std::vector<ScreenCamera> camerasAbout(const LodAsset& asset, unsigned views)
{
    RandomCameras random(asset, 2017);
    std::vector<ScreenCamera> cameras;
    while (cameras.size() < views) { cameras.push_back(random.next()); }
    return cameras;
}

Ratios measure(const MeasuredScene& scene, const std::vector<ScreenCamera>& cameras, const SelectionOptions& options,
               std::size_t points)
{
    std::vector<Ratios> byView(cameras.size());
    tbb::parallel_for(std::size_t{0}, cameras.size(),
                      [&](std::size_t k) { byView[k] = scene.ratiosIn(cameras[k], options, points, std::mt19937_64(k)); });
    Ratios ratios;
    for (const Ratios& view : byView) { ratios.append(view); }
    return ratios;
}

Json summarize(const Ratios& ratios)
{
    return {{"patches", ratios.all.size()},
            {"maxRatio", ratios.largest()},
            {"tightness", mean(ratios.refined)},
            {"points", ratios.points},
            {"maxRatioOfPoints", ratios.largestOfPoints}};
}

std::vector<std::string> tableRow(const Json& row)
{
    std::vector<std::string> cells{row["scene"].get<std::string>(),
                                   fmt::format("{}", row["errorPixels"].get<double>())};
    for (const char* bound : {"conservative", "firstOrder"}) {
        cells.push_back(grouped(row[bound]["patches"].get<std::uint64_t>()));
        cells.push_back(fmt::format("{:.4f}", row[bound]["maxRatio"].get<double>()));
        cells.push_back(fmt::format("{:.3f}", row[bound]["tightness"].get<double>()));
        cells.push_back(grouped(row[bound]["points"].get<std::uint64_t>()));
        cells.push_back(fmt::format("{:.4f}", row[bound]["maxRatioOfPoints"].get<double>()));
    }
    return cells;
}

} // namespace

BenchmarkResult benchmarkBound(const std::vector<Scene>& scenes, unsigned views, std::size_t points)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {
        "scene",   "error px",        "patches",   "conservative max", "tightness",     "points", "their max",
        "patches", "first order max", "tightness", "points",           "their max"};
    Ratios conservative;
    Ratios firstOrder;
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: bound\n", scene.name);
        try {
            const MeasuredScene measured(scene);
            const std::vector<ScreenCamera> cameras = camerasAbout(measured.asset, views);
            for (const double errorPixels : kErrorPixels) {
                SelectionOptions options;
                options.errorPixels = errorPixels;
                const Ratios kept = measure(measured, cameras, options, points);
                options.bound = SelectedBound::FirstOrder;
                const Ratios approximate = measure(measured, cameras, options, points);
                conservative.append(kept);
                firstOrder.append(approximate);
                result.rows.push_back({{"scene", scene.name},
                                       {"errorPixels", errorPixels},
                                       {"conservative", summarize(kept)},
                                       {"firstOrder", summarize(approximate)}});
                result.tables.front().rows.push_back(tableRow(result.rows.back()));
                const double largest = std::max(kept.largest(), kept.largestOfPoints);
                if (largest > 1.0 + kRounding) {
                    result.failures.push_back(
                        fmt::format("{}: {} times the {} pixels asked for", scene.name, largest, errorPixels));
                }
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"conservative_max_ratio", conservative.largest()},
                      {"conservative_max_ratio_of_points", conservative.largestOfPoints},
                      {"conservative_tightness", mean(conservative.refined)},
                      {"first_order_max_ratio", firstOrder.largest()},
                      {"first_order_tightness", mean(firstOrder.refined)},
                      {"views", views},
                      {"patches", conservative.all.size()},
                      {"points", conservative.points}};
    return result;
}

} // namespace osgTessLOD::benchmarks
