// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ChildProcess.h"
#include "ReferenceSurface.h"
#include "Yardsticks.h"

#include <support/TemporaryDirectory.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <numeric>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr std::size_t kStagesInTable = 3;

/// Another library's way to make levels.
struct Yardstick {
    const char* name; ///< key of its figures
    LevelChain (*makeChain)(const Triangles& source);
};
constexpr std::array<Yardstick, 2> kYardsticks{Yardstick{"meshoptimizer", meshoptimizerChain},
                                               Yardstick{"osgSimplifier", osgSimplifierChain}};

/// Bakes once. With `details`, also what does not differ from run to run: the file's size and the distance to the source.
Json bakeOnce(const Scene& scene, const std::string& technique, const std::string& path, bool details)
{
    bake::BakeOptions options;
    options.technique = technique;
    const BakedScene baked = bakeToFile(scene, options, path);
    Json json = Json::parse(baked.report.toJson());
    if (!details) { return json; }

    json["fileBytes"] = baked.fileBytes;
    json["normalBytes"] = baked.normalBytes;
    const bake::HausdorffDistance distance = distanceBetween(levelTriangles(baked.asset, baked.asset.ladder.back()),
                                                             sourceTriangles(scene, options.maxFactor));
    json["levelToSource"] = distance.forward;
    json["sourceToLevel"] = distance.backward;
    return json;
}

/// Median over the runs of each stage's seconds, together where a bake goes through it more than once.
Json medianStages(const std::vector<Json>& runs)
{
    Json stages = Json::object();
    for (const Json& stage : runs.front()["stages"]) {
        const auto name = stage["name"].get<std::string>();
        std::vector<double> seconds;
        for (const Json& run : runs) {
            double sum = 0.0;
            for (const Json& other : run["stages"]) {
                if (other["name"] == name) { sum += other["seconds"].get<double>(); }
            }
            seconds.push_back(sum);
        }
        stages[name] = median(seconds);
    }
    return stages;
}

std::string longestStages(const Json& stages, double seconds)
{
    std::vector<std::pair<double, std::string>> order;
    for (const auto& [name, value] : stages.items()) { order.emplace_back(value.get<double>(), name); }
    std::sort(order.rbegin(), order.rend());
    order.resize(std::min(order.size(), kStagesInTable));
    std::string text;
    for (const auto& [value, name] : order) {
        text += fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", name, 100.0 * value / seconds);
    }
    return text;
}

/// Seconds that a yardstick takes for its chain of levels, median over the runs, and the chain; or the limit, if a run
/// reaches it.
Json measureYardstick(const Yardstick& yardstick, const Scene& scene, const BakeBenchmarkOptions& options)
{
    std::vector<double> seconds;
    Json run;
    for (unsigned i = 0; i < options.runs; ++i) {
        fmt::print(stderr, "{}: {} {} of {}\n", scene.name, yardstick.name, i + 1, options.runs);
        try {
            run = runInChild([&] {
                const Triangles source = sourceTriangles(scene, bake::BakeOptions().maxFactor);
                limitChild(options.yardstickSeconds);
                const LevelChain chain = yardstick.makeChain(source);
                return Json{{"seconds", chain.seconds}, {"limitReached", false}, {"triangles", chain.triangles}};
            });
        } catch (const TimeLimitReached&) {
            return {{"seconds", options.yardstickSeconds}, {"limitReached", true}};
        }
        seconds.push_back(run["seconds"].get<double>());
    }
    run["seconds"] = median(seconds);
    return run;
}

/// The runs of one scene as one row; the first has the details.
Json summarize(const Scene& scene, const std::string& technique, const std::vector<Json>& runs)
{
    std::vector<double> seconds;
    std::vector<double> peaks;
    for (const Json& run : runs) {
        seconds.push_back(run["seconds"].get<double>());
        peaks.push_back(run["peak_bytes"].get<double>());
    }
    const Json& first = runs.front();
    const double diagonal = first["diagonal"].get<double>();
    const auto vertices = first["finest_vertices"].get<std::uint64_t>();
    const auto bytes = first["fileBytes"].get<std::uint64_t>();
    const auto geometryBytes = bytes - first["normalBytes"].get<std::uint64_t>();
    const auto percent = [&](const Json& distance) { return 100.0 * distance.get<double>() / diagonal; };
    return {{"scene", scene.name},
            {"technique", technique},
            {"sourceTriangles", first["source_triangles"]},
            {"patches", first["patches"]},
            {"factor", first["levels"].back()["factor"]},
            {"finestVertices", vertices},
            {"runs", runs.size()},
            {"seconds", median(seconds)},
            {"secondsLeast", *std::min_element(seconds.begin(), seconds.end())},
            {"secondsMost", *std::max_element(seconds.begin(), seconds.end())},
            {"stageSeconds", medianStages(runs)},
            {"peakMebibytes", median(peaks) / kMebibyte},
            {"fileBytes", bytes},
            {"fileBytesPerFinestVertex", static_cast<double>(bytes) / static_cast<double>(vertices)},
            {"geometryBytesPerFinestVertex", static_cast<double>(geometryBytes) / static_cast<double>(vertices)},
            {"levelToSourcePercent", percent(first["levelToSource"])},
            {"sourceToLevelPercent", percent(first["sourceToLevel"])},
            {"boundPercent", percent(first["largest_finest_error"])}};
}

bool boundHolds(const Json& row)
{
    const auto bound = row["boundPercent"].get<double>();
    return keepsBound(row["levelToSourcePercent"].get<double>(), bound) &&
           keepsBound(row["sourceToLevelPercent"].get<double>(), bound);
}

std::string secondsText(const Json& row)
{
    const auto text = [&](const char* key) { return fmt::format("{:.1f}", row[key].get<double>()); };
    if (row["runs"] == 1) { return text("seconds"); }
    return text("seconds") + " (" + text("secondsLeast") + "–" + text("secondsMost") + ")";
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto number = [&](const char* key) { return row[key].get<double>(); };
    return {row["scene"].get<std::string>(),
            grouped(row["sourceTriangles"].get<std::uint64_t>()),
            grouped(row["patches"].get<std::uint64_t>()),
            secondsText(row),
            longestStages(row["stageSeconds"], number("seconds")),
            fmt::format("{:.0f}", number("peakMebibytes")),
            grouped(row["fileBytes"].get<std::uint64_t>()),
            fmt::format("{:.1f}", number("fileBytesPerFinestVertex")),
            fmt::format("{:.1f}", number("geometryBytesPerFinestVertex")),
            fmt::format("{:.4f}", number("levelToSourcePercent")),
            fmt::format("{:.4f}", number("sourceToLevelPercent")),
            fmt::format("{:.4f}", number("boundPercent"))};
}

/// A figure that the limit makes a bound: a yardstick that reached it takes longer, and the bake's part of it is less.
std::string bounded(const Json& yardstick, const char* sign, const char* key)
{
    return fmt::format("{}{:.3g}", yardstick["limitReached"].get<bool>() ? sign : "", yardstick[key].get<double>());
}

std::string chainText(const Json& yardstick)
{
    if (yardstick["limitReached"].get<bool>()) { return ""; }
    const Json& triangles = yardstick["triangles"];
    return fmt::format("{} to {}", triangles.size() - 1, grouped(triangles.back().get<std::uint64_t>()));
}

std::vector<std::string> comparisonRow(const Json& row)
{
    std::vector<std::string> cells{row["scene"].get<std::string>(), grouped(row["sourceTriangles"].get<std::uint64_t>()),
                                   secondsText(row)};
    for (const Yardstick& yardstick : kYardsticks) {
        const Json& figures = row[yardstick.name];
        cells.push_back(bounded(figures, "> ", "seconds"));
        cells.push_back(chainText(figures));
        cells.push_back(bounded(figures, "< ", "ratio"));
    }
    return cells;
}

/// The bakes' seconds to a yardstick's: the geometric mean over the scenes, and whether a limit makes it an upper bound.
void addRatio(Json& summary, const Json& rows, const Yardstick& yardstick, const std::string& key)
{
    if (rows.empty()) { return; }
    double logarithms = 0.0;
    bool isUpperBound = false;
    for (const Json& row : rows) {
        const Json& figures = row[yardstick.name];
        logarithms += std::log(figures["ratio"].get<double>());
        isUpperBound = isUpperBound || figures["limitReached"].get<bool>();
    }
    summary[key] = std::exp(logarithms / static_cast<double>(rows.size()));
    summary[key + "_is_upper_bound"] = isUpperBound;
}

Json summaryOf(const Json& rows)
{
    Json secondsByScene = Json::object();
    double triangles = 0.0;
    double seconds = 0.0;
    double peak = 0.0;
    double distance = 0.0;
    double bytes = 0.0;
    for (const Json& row : rows) {
        secondsByScene[row["scene"].get<std::string>()] = row["seconds"];
        triangles += row["sourceTriangles"].get<double>();
        seconds += row["seconds"].get<double>();
        peak = std::max(peak, row["peakMebibytes"].get<double>());
        bytes = std::max(bytes, row["fileBytesPerFinestVertex"].get<double>());
        distance =
            std::max({distance, row["levelToSourcePercent"].get<double>(), row["sourceToLevelPercent"].get<double>()});
    }
    Json summary{{"scenes", rows.size()},
                 {"seconds", secondsByScene},
                 {"source_triangles_per_second", rows.empty() ? 0.0 : triangles / seconds},
                 {"largestPeakMebibytes", peak},
                 {"largestFileBytesPerFinestVertex", bytes},
                 {"largestDistancePercent", distance}};
    addRatio(summary, rows, kYardsticks[0], "meshoptimizer_ratio");
    addRatio(summary, rows, kYardsticks[1], "osg_simplifier_ratio");
    return summary;
}

/// All of one scene's row.
Json measureScene(const Scene& scene, const BakeBenchmarkOptions& options, const std::string& path)
{
    std::vector<Json> bakes;
    for (unsigned run = 0; run < options.runs; ++run) {
        fmt::print(stderr, "{}: bake {} of {}\n", scene.name, run + 1, options.runs);
        bakes.push_back(runInChild([&] { return bakeOnce(scene, options.technique, path, run == 0); }));
    }
    Json row = summarize(scene, options.technique, bakes);
    for (const Yardstick& yardstick : kYardsticks) {
        Json figures = measureYardstick(yardstick, scene, options);
        figures["ratio"] = row["seconds"].get<double>() / figures["seconds"].get<double>();
        row[yardstick.name] = figures;
    }
    return row;
}

} // namespace

double median(std::vector<double> values)
{
    if (values.empty()) { return 0.0; }
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2.0;
}

double mean(const std::vector<double>& values)
{
    const double sum = std::accumulate(values.begin(), values.end(), 0.0);
    return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

BenchmarkResult benchmarkBakes(const std::vector<Scene>& scenes, const BakeBenchmarkOptions& options)
{
    const TemporaryDirectory folder;
    const auto fileOf = [&](const Scene& scene) {
        return options.keepFolder.empty() ? folder.file("scene.tlod") : options.keepFolder + "/" + scene.name + ".tlod";
    };
    BenchmarkResult result;
    result.tables.resize(2);
    result.tables[0].headers = {"scene",           "triangles",        "patches",          "seconds",
                                "longest stages",  "peak MiB",         "file bytes",       "B / vertex",
                                "without normals", "level → source %", "source → level %", "bound %"};
    result.tables[1].headers = {"scene", "triangles", "seconds", "meshoptimizer s", "levels", "ratio",
                                "osgUtil::Simplifier s", "levels", "ratio"};
    for (const Scene& scene : scenes) {
        try {
            result.rows.push_back(measureScene(scene, options, fileOf(scene)));
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
            continue;
        }
        const Json& row = result.rows.back();
        if (!boundHolds(row)) {
            result.failures.push_back(scene.name + ": the finest level is further from the source than its bound");
        }
        result.tables[0].rows.push_back(tableRow(row));
        result.tables[1].rows.push_back(comparisonRow(row));
    }
    result.summary = summaryOf(result.rows);
    return result;
}

} // namespace osgTessLOD::benchmarks
