// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.5 and fig. 2.6.
#include "BakedScene.h"
#include "Benchmark.h"
#include "Orbit.h"

#include <osgTessLOD/render/PatchSelector.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kViews = 72;
constexpr double kDiagonals = 3.0;
constexpr std::array<double, 4> kErrorPixels{0.5, 1.0, 2.0, 4.0};

/// Of a whole orbit.
struct OrbitTriangles {
    std::uint64_t view = 0;
    std::uint64_t isotropic = 0;
    double least = 1.0; ///< of the views' ratios
    double largest = 0.0;
    std::uint64_t saturatedPatches = 0; ///< by the isotropic error
    std::uint64_t patches = 0;

    double ratio() const { return static_cast<double>(view) / static_cast<double>(isotropic); }
};

OrbitTriangles measure(const PatchSelector& selector, const std::vector<ScreenCamera>& orbit, SelectionOptions options)
{
    OrbitTriangles sum;
    for (const ScreenCamera& camera : orbit) {
        options.metric = SelectionOptions::Metric::View;
        const SelectionStatistics view = selector.select(camera.view(), options, camera.sides()).statistics;
        options.metric = SelectionOptions::Metric::Isotropic;
        const SelectionStatistics isotropic = selector.select(camera.view(), options, camera.sides()).statistics;
        sum.view += view.triangles;
        sum.isotropic += isotropic.triangles;
        const double ratio = static_cast<double>(view.triangles) / static_cast<double>(isotropic.triangles);
        sum.least = std::min(sum.least, ratio);
        sum.largest = std::max(sum.largest, ratio);
        sum.saturatedPatches += isotropic.saturatedPatches;
        sum.patches += isotropic.patches;
    }
    return sum;
}

Json summarize(const OrbitTriangles& sum)
{
    return {{"view", sum.view / kViews},
            {"isotropic", sum.isotropic / kViews},
            {"ratio", sum.ratio()},
            {"least", sum.least},
            {"largest", sum.largest},
            {"saturated", static_cast<double>(sum.saturatedPatches) / static_cast<double>(sum.patches)}};
}

std::vector<std::string> tableRow(const Json& row)
{
    std::vector<std::string> cells{row["scene"].get<std::string>(),
                                   fmt::format("{}", row["errorPixels"].get<double>())};
    for (const char* bound : {"conservative", "firstOrder"}) {
        const Json& orbit = row[bound];
        cells.push_back(grouped(orbit["isotropic"].get<std::uint64_t>()));
        cells.push_back(grouped(orbit["view"].get<std::uint64_t>()));
        cells.push_back(fmt::format("{:.3f} ({:.3f}–{:.3f})", orbit["ratio"].get<double>(),
                                    orbit["least"].get<double>(), orbit["largest"].get<double>()));
    }
    cells.push_back(fmt::format("{:.0f} %", 100.0 * row["conservative"]["saturated"].get<double>()));
    return cells;
}

} // namespace

BenchmarkResult benchmarkViews(const std::vector<Scene>& scenes)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene", "error px",           "isotropic",
                                            "view",  "conservative ratio", "isotropic",
                                            "view",  "first order ratio",  "saturated"};
    Json byScene = Json::object();
    Json firstOrderByScene = Json::object();
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: view\n", scene.name);
        try {
            const LodAsset asset = loadOrBake(scene);
            const PatchSelector selector(asset);
            const std::vector<ScreenCamera> orbit = orbitOf(asset, kDiagonals, kViews);
            std::vector<double> ratios;
            std::vector<double> firstOrderRatios;
            for (const double errorPixels : kErrorPixels) {
                SelectionOptions options;
                options.errorPixels = errorPixels;
                const OrbitTriangles conservative = measure(selector, orbit, options);
                options.bound = SelectionOptions::Bound::FirstOrder;
                const OrbitTriangles firstOrder = measure(selector, orbit, options);
                ratios.push_back(conservative.ratio());
                firstOrderRatios.push_back(firstOrder.ratio());
                result.rows.push_back({{"scene", scene.name},
                                       {"errorPixels", errorPixels},
                                       {"conservative", summarize(conservative)},
                                       {"firstOrder", summarize(firstOrder)}});
                result.tables.front().rows.push_back(tableRow(result.rows.back()));
            }
            byScene[scene.name] = mean(ratios);
            firstOrderByScene[scene.name] = mean(firstOrderRatios);
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"view_over_isotropic", byScene}, {"first_order_view_over_isotropic", firstOrderByScene}};
    return result;
}

} // namespace osgTessLOD::benchmarks
