// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.8.3 and fig. 4.10.
#include "Benchmark.h"

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/SymmetricHull.h>

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <memory>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kFinest = 64;
constexpr unsigned kFactors[] = {64, 32, 16, 8, 4};
constexpr Eigen::Index kDirections = 10000;
constexpr char kFull[] = "voluv+refit+cost";

/// The reference and what the errors of all methods are relative to.
struct Reference {
    bake::PatchedSurface surface; ///< with uniform levels
    bake::Triangulation chartTriangles = bake::Triangulation::ofPattern(2 * kFinest);
    std::vector<ChartPoint> chartPoints = bake::patternPoints(2 * kFinest);
    bake::Directions directions = bake::sphericalFibonacci(kDirections);
};

/// Mean over directions of E(d) of one level of one patch.
double meanError(const Reference& reference, const std::vector<Eigen::Vector3d>& chart,
                 const std::vector<Eigen::Vector3d>& level, const std::vector<ChartPoint>& parameters, unsigned factor)
{
    const bake::Triangulation triangles = bake::Triangulation::ofPattern(factor);
    const std::vector<ChartPoint> points = parameters.empty() ? bake::patternPoints(factor) : parameters;
    const bake::DifferenceVectors differences({triangles, points}, {reference.chartTriangles, reference.chartPoints});
    std::vector<Eigen::Vector3d> vectors;
    differences.evaluate(chart, level, vectors);
    return bake::squaredErrors(bake::symmetricHull(vectors), reference.directions).sqrt().mean();
}

/// Mean over patches too, for each of kFactors.
std::vector<double> meanErrors(const Reference& reference, const bake::LevelHierarchy& hierarchy)
{
    const std::size_t patches = hierarchy.patches.size();
    std::vector<double> means;
    for (const unsigned factor : kFactors) {
        const auto level = static_cast<std::size_t>(
            std::find(hierarchy.ladder.begin(), hierarchy.ladder.end(), factor) - hierarchy.ladder.begin());
        std::vector<double> errors(patches);
        tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t p) {
            const bake::PatchLevels& levels = hierarchy.patches[p];
            const std::vector<ChartPoint> none;
            errors[p] = meanError(reference, reference.surface.charts.charts[p].positions, levels.positions[level],
                                  levels.parameters.empty() ? none : levels.parameters[level], factor);
        });
        double sum = 0.0;
        for (const double error : errors) { sum += error; }
        means.push_back(sum / static_cast<double>(patches));
    }
    return means;
}

bake::StripOptions optionsOf(const std::string& method)
{
    bake::StripOptions options;
    options.placement = method.rfind("qem", 0) == 0  ? bake::PlacementMethod::Quadric
                        : method.rfind("lt", 0) == 0 ? bake::PlacementMethod::LindstromTurk
                                                     : bake::PlacementMethod::VolumeUv;
    options.refit = method.find("+refit") != std::string::npos;
    options.cost = method.find("+cost") != std::string::npos ? bake::StripOptions::Cost::ViewError
                                                             : bake::StripOptions::Cost::Residual;
    return options;
}

Reference makeReference(const Scene& scene)
{
    bake::Progress progress;
    bake::BakeReport report;
    bake::BakeOptions options;
    options.technique = "uniform";
    options.maxFactor = kFinest;
    Reference reference;
    reference.surface = bake::makeLevels(scene.source, options, progress, report);
    return reference;
}

Json relative(const std::vector<double>& errors, const std::vector<double>& uniform)
{
    Json json = Json::object();
    for (std::size_t i = 0; i < errors.size(); ++i) {
        json[std::to_string(kFactors[i])] = uniform[i] > 0.0 ? errors[i] / uniform[i] : 1.0;
    }
    return json;
}

Json measure(const Reference& reference, const Scene& scene, const std::string& method,
             const std::vector<double>& uniform)
{
    bake::Progress progress;
    bake::StripReport report;
    const auto start = std::chrono::steady_clock::now();
    const bake::LevelHierarchy hierarchy =
        bake::makeStripLevels(reference.surface.map->topology(), reference.surface.charts,
                              reference.surface.hierarchy.ladder, optionsOf(method), progress, &report);
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    return {{"scene", scene.name},
            {"method", method},
            {"overUniform", relative(meanErrors(reference, hierarchy), uniform)},
            {"seconds", elapsed.count()},
            {"contractions", report.contractions},
            {"relayouts", report.relayouts}};
}

std::vector<std::string> tableRow(const Json& row)
{
    std::vector<std::string> cells{row["scene"].get<std::string>(), row["method"].get<std::string>()};
    for (const auto& [factor, value] : row["overUniform"].items()) {
        cells.push_back(fmt::format("{:.3f}", value.get<double>()));
    }
    cells.push_back(fmt::format("{:.1f}", row["seconds"].get<double>()));
    cells.push_back(std::to_string(row["relayouts"].get<std::uint64_t>()));
    return cells;
}

/// Means over the scenes of each method.
Json summaryOf(const Json& rows)
{
    Json summary{{"full_over_uniform", Json::object()}, {"methods", Json::object()}};
    for (const std::string& method : simplifyMethods()) {
        Json mean = Json::object();
        std::size_t count = 0;
        for (const Json& row : rows) {
            if (row["method"] != method) { continue; }
            ++count;
            for (const auto& [factor, value] : row["overUniform"].items()) {
                mean[factor] = mean.value(factor, 0.0) + value.get<double>();
            }
        }
        for (auto& value : mean) { value = value.get<double>() / static_cast<double>(count); }
        if (method == kFull) { summary["full_over_uniform"] = mean; }
        if (count > 0) { summary["methods"][method] = mean; }
    }
    return summary;
}

} // namespace

std::vector<std::string> simplifyMethods()
{
    std::vector<std::string> methods;
    for (const char* placement : {"qem", "lt", "voluv"}) {
        for (const char* rest : {"", "+refit", "+cost", "+refit+cost"}) {
            methods.push_back(std::string(placement) + rest);
        }
    }
    return methods;
}

BenchmarkResult benchmarkSimplification(const std::vector<Scene>& scenes, const std::vector<std::string>& methods)
{
    BenchmarkResult result;
    ResultTable& table = result.tables.emplace_back();
    table.headers = {"scene", "method"};
    for (const unsigned factor : kFactors) { table.headers.push_back(std::to_string(factor)); }
    table.headers.insert(table.headers.end(), {"seconds", "relayouts"});
    for (const Scene& scene : scenes) {
        try {
            const Reference reference = makeReference(scene);
            const std::vector<double> uniform = meanErrors(reference, reference.surface.hierarchy);
            for (const std::string& method : methods.empty() ? simplifyMethods() : methods) {
                fmt::print(stderr, "{}: {}\n", scene.name, method);
                result.rows.push_back(measure(reference, scene, method, uniform));
                table.rows.push_back(tableRow(result.rows.back()));
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = summaryOf(result.rows);
    return result;
}

} // namespace osgTessLOD::benchmarks
