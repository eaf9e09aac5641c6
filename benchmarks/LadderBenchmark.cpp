// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <support/TemporaryDirectory.h>

#include <fmt/format.h>

#include <array>
#include <exception>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<std::uint16_t, 11> kDenseLadder{1, 2, 4, 6, 8, 12, 16, 24, 32, 48, 64};

/// Errors asked for: so many from the least on, in geometric progression up to 12.8 % of the diagonal.
constexpr double kLeastError = 0.0005;
constexpr double kErrorRatio = 1.41421356237309505; // the square root of 2
constexpr int kErrors = 17;

/// A scene with levels at powers of two and at the dense ladder's factors.
struct Ladders {
    BakedScene powers;
    BakedScene dense;
};

Ladders bakeLadders(const Scene& scene, unsigned maxFactor, const TemporaryDirectory& folder)
{
    fmt::print(stderr, "{}: powers of two\n", scene.name);
    bake::BakeOptions options;
    options.tolerance = 0.0; // so that saturated patches are all at one factor
    options.maxFactor = maxFactor;
    Ladders ladders;
    ladders.powers = bakeToFile(scene, options, folder.file("scene.tlod"));
    fmt::print(stderr, "{}: dense ladder\n", scene.name);
    for (const std::uint16_t factor : kDenseLadder) {
        if (factor <= maxFactor) { options.ladder.push_back(factor); }
    }
    ladders.dense = bakeToFile(scene, options, folder.file("scene.tlod"));
    return ladders;
}

double ratioOf(std::uint64_t dense, std::uint64_t powers)
{
    return static_cast<double>(dense) / static_cast<double>(powers);
}

/// What the run time draws where the error may be `errorObject` everywhere: seen from infinity, at a pixel per unit.
SelectionStatistics select(const PatchSelector& selector, double errorObject)
{
    SelectionView view;
    view.orthographic = true;
    view.pixelScale = 1.0;
    SelectionOptions options;
    options.metric = SelectionOptions::Metric::Isotropic;
    options.errorPixels = errorObject;
    return selector.select(view, options, {}).statistics;
}

/// Triangles of all patches but the saturated ones, which are drawn at the finest level and do not keep the error.
std::uint64_t unsaturatedTriangles(const SelectionStatistics& selected, unsigned maxFactor)
{
    return selected.triangles - selected.saturatedPatches * TessellationPattern::triangleCount(maxFactor);
}

/// One row per error; none where no patch keeps the error, or all that do are at the coarsest level: nothing to compare.
std::vector<Json> compareTriangles(const Scene& scene, const Ladders& ladders, unsigned maxFactor)
{
    const PatchSelector powersSelector(ladders.powers.asset);
    const PatchSelector denseSelector(ladders.dense.asset);
    std::vector<Json> rows;
    double error = kLeastError;
    for (int i = 0; i < kErrors; ++i, error *= kErrorRatio) {
        const double errorObject = error * ladders.powers.report.diagonal;
        const SelectionStatistics powers = select(powersSelector, errorObject);
        const SelectionStatistics dense = select(denseSelector, errorObject);
        const std::uint64_t powersTriangles = unsaturatedTriangles(powers, maxFactor);
        const std::uint64_t denseTriangles = unsaturatedTriangles(dense, maxFactor);
        if (powersTriangles <= powers.patches - powers.saturatedPatches) { continue; }
        rows.push_back({{"scene", scene.name},
                        {"errorPercent", 100.0 * error},
                        {"patches", powers.patches},
                        {"saturatedPatches", powers.saturatedPatches},
                        {"powersTriangles", powersTriangles},
                        {"denseTriangles", denseTriangles},
                        {"denseOverPowers", ratioOf(denseTriangles, powersTriangles)}});
    }
    return rows;
}

/// What of a scene does not depend on the error, and the mean over the errors of what does.
Json summarizeScene(const Ladders& ladders, const std::vector<Json>& rows)
{
    std::vector<double> ratios;
    for (const Json& row : rows) { ratios.push_back(row["denseOverPowers"].get<double>()); }
    const BakedScene& powers = ladders.powers;
    const BakedScene& dense = ladders.dense;
    return {{"powersBytes", powers.fileBytes},
            {"denseBytes", dense.fileBytes},
            {"bytesRatio", ratioOf(dense.fileBytes, powers.fileBytes)},
            {"bytesRatioWithoutNormals",
             ratioOf(dense.fileBytes - dense.normalBytes, powers.fileBytes - powers.normalBytes)},
            {"powersSeconds", powers.report.seconds},
            {"denseSeconds", dense.report.seconds},
            {"trianglesRatio", ratios.empty() ? Json() : Json(mean(ratios))}};
}

std::string ratioText(const Json& ratio)
{
    return ratio.is_null() ? "" : fmt::format("{:.3f}", ratio.get<double>());
}

std::vector<std::string> errorRow(const Json& row)
{
    const auto count = [&](const char* key) { return grouped(row[key].get<std::uint64_t>()); };
    return {row["scene"].get<std::string>(), fmt::format("{:.3g}", row["errorPercent"].get<double>()), count("patches"),
            count("saturatedPatches"), count("powersTriangles"), count("denseTriangles"), ratioText(row["denseOverPowers"])};
}

std::vector<std::string> sceneRow(const std::string& name, const Json& scene)
{
    return {name,
            grouped(scene["powersBytes"].get<std::uint64_t>()),
            grouped(scene["denseBytes"].get<std::uint64_t>()),
            ratioText(scene["bytesRatio"]),
            ratioText(scene["bytesRatioWithoutNormals"]),
            fmt::format("{:.1f}", scene["powersSeconds"].get<double>()),
            fmt::format("{:.1f}", scene["denseSeconds"].get<double>()),
            ratioText(scene["trianglesRatio"])};
}

/// Mean over the scenes that have it.
Json meanOverScenes(const Json& scenes, const char* key)
{
    std::vector<double> values;
    for (const Json& scene : scenes) {
        if (!scene[key].is_null()) { values.push_back(scene[key].get<double>()); }
    }
    return values.empty() ? Json() : Json(mean(values));
}

} // namespace

BenchmarkResult benchmarkLadders(const std::vector<Scene>& scenes, unsigned maxFactor)
{
    const TemporaryDirectory folder;
    BenchmarkResult result;
    result.tables.resize(2);
    result.tables[0].headers = {"scene",           "error %", "patches", "saturated", "powers of two", "dense ladder",
                                "dense : powers"};
    result.tables[1].headers = {"scene", "powers' bytes", "dense bytes", "dense : powers", "without normals",
                                "powers' seconds", "dense seconds", "triangles"};
    Json byScene = Json::object();
    for (const Scene& scene : scenes) {
        try {
            const Ladders ladders = bakeLadders(scene, maxFactor, folder);
            const std::vector<Json> rows = compareTriangles(scene, ladders, maxFactor);
            for (const Json& row : rows) {
                result.rows.push_back(row);
                result.tables[0].rows.push_back(errorRow(row));
            }
            byScene[scene.name] = summarizeScene(ladders, rows);
            result.tables[1].rows.push_back(sceneRow(scene.name, byScene[scene.name]));
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"dense_over_powers_triangles", meanOverScenes(byScene, "trianglesRatio")},
                      {"dense_over_powers_bytes", meanOverScenes(byScene, "bytesRatio")},
                      {"dense_over_powers_bytes_without_normals", meanOverScenes(byScene, "bytesRatioWithoutNormals")},
                      {"scenes", byScene}};
    return result;
}

} // namespace osgTessLOD::benchmarks
