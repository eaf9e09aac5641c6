// SPDX-License-Identifier: MIT
#include "Benchmark.h"
#include "ChildProcess.h"
#include "ReferenceSurface.h"
#include "WorkFolder.h"

#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/Baker.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <filesystem>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kMebibyte = 1024.0 * 1024.0;
constexpr std::size_t kStagesInTable = 3;

/// Bakes once. With `details`, also what does not differ from run to run: the file's size and the distance to the source.
Json bakeOnce(const Scene& scene, const std::string& path, bool details)
{
    bake::Progress progress;
    bake::BakeReport report;
    const LodAsset asset = bake::bakeSource(scene.source, bake::BakeOptions(), progress, report);
    Json json = Json::parse(report.toJson());
    if (!details) { return json; }

    writeTlod(path, asset);
    json["fileBytes"] = std::filesystem::file_size(path);
    json["normalBytes"] = std::uint64_t{0};
    for (const TlodChunk& chunk : readTlodContents(path)) {
        if (chunk.type == "NRML") {
            json["normalBytes"] = json["normalBytes"].get<std::uint64_t>() + chunk.storedBytes;
        }
    }
    const bake::HausdorffDistance distance = distanceToSource(asset, scene);
    json["levelToSource"] = distance.forward;
    json["sourceToLevel"] = distance.backward;
    return json;
}

/// Median over the runs of each stage's seconds.
Json medianStages(const std::vector<Json>& runs)
{
    Json stages = Json::object();
    for (const Json& stage : runs.front()["stages"]) {
        const auto name = stage["name"].get<std::string>();
        std::vector<double> seconds;
        for (const Json& run : runs) {
            for (const Json& other : run["stages"]) {
                if (other["name"] == name) { seconds.push_back(other["seconds"].get<double>()); }
            }
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

/// The runs of one scene as one row; the first has the details.
Json summarize(const Scene& scene, const std::vector<Json>& runs)
{
    std::vector<double> seconds;
    std::vector<double> peaks;
    for (const Json& run : runs) {
        seconds.push_back(run["seconds"].get<double>());
        peaks.push_back(run["peak_bytes"].get<double>());
    }
    const Json& first = runs.front();
    const double diagonal = first["diagonal"].get<double>();
    const Json& finest = first["levels"].back();
    const auto vertices = finest["vertices"].get<std::uint64_t>();
    const auto bytes = first["fileBytes"].get<std::uint64_t>();
    const auto geometryBytes = bytes - first["normalBytes"].get<std::uint64_t>();
    const auto percent = [&](const Json& distance) { return 100.0 * distance.get<double>() / diagonal; };
    return {{"scene", scene.name},
            {"sourceTriangles", first["source_triangles"]},
            {"patches", first["patches"]},
            {"factor", finest["factor"]},
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
            {"boundPercent", percent(finest["largest_error"])}};
}

/// Distances are computed in single precision.
bool boundHolds(const Json& row)
{
    constexpr double kTolerancePercent = 1e-4;
    const double bound = row["boundPercent"].get<double>() + kTolerancePercent;
    return row["levelToSourcePercent"].get<double>() <= bound && row["sourceToLevelPercent"].get<double>() <= bound;
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

Json summaryOf(const Json& rows)
{
    double seconds = 0.0;
    double peak = 0.0;
    double distance = 0.0;
    double bytes = 0.0;
    for (const Json& row : rows) {
        seconds += row["seconds"].get<double>();
        peak = std::max(peak, row["peakMebibytes"].get<double>());
        bytes = std::max(bytes, row["fileBytesPerFinestVertex"].get<double>());
        distance =
            std::max({distance, row["levelToSourcePercent"].get<double>(), row["sourceToLevelPercent"].get<double>()});
    }
    return {{"scenes", rows.size()},
            {"seconds", seconds},
            {"largestPeakMebibytes", peak},
            {"largestFileBytesPerFinestVertex", bytes},
            {"largestDistancePercent", distance}};
}

} // namespace

double median(std::vector<double> values)
{
    if (values.empty()) { return 0.0; }
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2.0;
}

BenchmarkResult benchmarkBakes(const std::vector<Scene>& scenes, unsigned runs, const std::string& keepFolder)
{
    const WorkFolder folder;
    const auto fileOf = [&](const Scene& scene) {
        return keepFolder.empty() ? folder.file("scene.tlod") : keepFolder + "/" + scene.name + ".tlod";
    };
    BenchmarkResult result;
    result.table.headers = {"scene",           "triangles",        "patches",          "seconds",
                            "longest stages",  "peak MiB",         "file bytes",       "B / vertex",
                            "without normals", "level → source %", "source → level %", "bound %"};
    for (const Scene& scene : scenes) {
        std::vector<Json> all;
        try {
            for (unsigned run = 0; run < runs; ++run) {
                fmt::print(stderr, "{}: bake {} of {}\n", scene.name, run + 1, runs);
                all.push_back(runInChild([&] { return bakeOnce(scene, fileOf(scene), run == 0); }));
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
            continue;
        }
        result.rows.push_back(summarize(scene, all));
        if (!boundHolds(result.rows.back())) {
            result.failures.push_back(scene.name + ": the finest level is further from the source than its bound");
        }
        result.table.rows.push_back(tableRow(result.rows.back()));
    }
    result.summary = summaryOf(result.rows);
    return result;
}

} // namespace osgTessLOD::benchmarks
