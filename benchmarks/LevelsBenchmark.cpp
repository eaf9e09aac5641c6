// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ReferenceSurface.h"

#include <support/TemporaryDirectory.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <exception>
#include <map>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 2> kTechniques{"strips", "uniform"};

double symmetricPercent(const Json& level)
{
    return std::max(level["levelToSourcePercent"].get<double>(), level["sourceToLevelPercent"].get<double>());
}

/// The scene's levels by one technique, coarse first. Distances and errors are in % of the diagonal of the source's
/// bounding box.
std::vector<Json> measureLevels(const Scene& scene, const char* technique, unsigned maxFactor, const Triangles& source,
                                const TemporaryDirectory& folder)
{
    fmt::print(stderr, "{}: {}\n", scene.name, technique);
    bake::BakeOptions options;
    options.technique = technique;
    options.maxFactor = maxFactor;
    options.tolerance = 0.0; // every level of every patch is compared
    const BakedScene baked = bakeToFile(scene, options, folder.file("scene.tlod"));
    const auto percent = [&](double distance) { return 100.0 * distance / baked.report.diagonal; };
    std::vector<Json> levels;
    for (std::size_t l = 0; l < baked.report.stored.levels.size(); ++l) {
        const AssetSummary::Level& level = baked.report.stored.levels[l];
        const bake::HausdorffDistance distance = distanceBetween(levelTriangles(baked.asset, level.factor), source);
        levels.push_back({{"factor", level.factor},
                          {"triangles", level.triangles},
                          {"bytes", baked.levelBytes[l]},
                          {"levelToSourcePercent", percent(distance.forward)},
                          {"sourceToLevelPercent", percent(distance.backward)},
                          {"largestErrorPercent", percent(level.largestError)},
                          {"meanErrorPercent", percent(level.meanError)}});
    }
    return levels;
}

/// One row per factor: the levels of both techniques, and the distance and mean error by strips to the uniform ones.
std::vector<Json> measureScene(const Scene& scene, unsigned maxFactor, const TemporaryDirectory& folder)
{
    const Triangles source = sourceTriangles(scene, maxFactor);
    std::vector<Json> rows;
    for (const char* technique : kTechniques) {
        const std::vector<Json> levels = measureLevels(scene, technique, maxFactor, source, folder);
        rows.resize(levels.size());
        for (std::size_t l = 0; l < levels.size(); ++l) {
            rows[l]["scene"] = scene.name;
            rows[l]["factor"] = levels[l]["factor"];
            rows[l][technique] = levels[l];
        }
    }
    const auto meanError = [](const Json& level) { return level["meanErrorPercent"].get<double>(); };
    const auto ratio = [](double strips, double uniform) { return uniform > 0.0 ? strips / uniform : 1.0; };
    for (Json& row : rows) {
        row["hausdorffOverUniform"] = ratio(symmetricPercent(row["strips"]), symmetricPercent(row["uniform"]));
        row["meanErrorOverUniform"] = ratio(meanError(row["strips"]), meanError(row["uniform"]));
    }
    return rows;
}

std::vector<std::string> tableRow(const Json& row)
{
    std::vector<std::string> cells{row["scene"].get<std::string>(), std::to_string(row["factor"].get<unsigned>()),
                                   grouped(row["strips"]["triangles"].get<std::uint64_t>())};
    for (const char* key : {"levelToSourcePercent", "sourceToLevelPercent", "largestErrorPercent", "meanErrorPercent"}) {
        for (const char* technique : kTechniques) {
            cells.push_back(fmt::format("{:.3f}", row[technique][key].get<double>()));
        }
    }
    cells.push_back(fmt::format("{:.2f}", row["hausdorffOverUniform"].get<double>()));
    cells.push_back(fmt::format("{:.2f}", row["meanErrorOverUniform"].get<double>()));
    for (const char* technique : kTechniques) { cells.push_back(grouped(row[technique]["bytes"].get<std::uint64_t>())); }
    return cells;
}

/// Mean over the scenes of `key`, by factor.
Json meansByFactor(const Json& rows, const char* key)
{
    std::map<unsigned, std::vector<double>> values;
    for (const Json& row : rows) { values[row["factor"].get<unsigned>()].push_back(row[key].get<double>()); }
    Json means = Json::object();
    for (const auto& [factor, ofFactor] : values) { means[std::to_string(factor)] = mean(ofFactor); }
    return means;
}

} // namespace

BenchmarkResult benchmarkLevels(const std::vector<Scene>& scenes, unsigned maxFactor)
{
    const TemporaryDirectory folder;
    BenchmarkResult result;
    ResultTable& table = result.tables.emplace_back();
    table.headers = {"scene", "factor", "triangles", "strips → source %", "uniform", "source → strips %", "uniform",
                     "strips claim %", "uniform", "mean claim %", "uniform", "distance ratio", "mean claim ratio",
                     "strips bytes", "uniform"};
    for (const Scene& scene : scenes) {
        try {
            for (const Json& row : measureScene(scene, maxFactor, folder)) {
                result.rows.push_back(row);
                table.rows.push_back(tableRow(row));
                for (const char* technique : kTechniques) {
                    const Json& level = row[technique];
                    if (keepsBound(symmetricPercent(level), level["largestErrorPercent"].get<double>())) { continue; }
                    result.failures.push_back(fmt::format("{}: {}'s level of factor {} is further from the source than claimed",
                                                          scene.name, technique, row["factor"].get<unsigned>()));
                }
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"strips_over_uniform_hausdorff", meansByFactor(result.rows, "hausdorffOverUniform")},
                      {"strips_over_uniform_mean_error", meansByFactor(result.rows, "meanErrorOverUniform")}};
    return result;
}

} // namespace osgTessLOD::benchmarks
