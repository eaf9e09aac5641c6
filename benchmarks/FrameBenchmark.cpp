// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ChildProcess.h"

#include <osgTessLOD/bake/Baker.h>
#include <osgtesslodviewer/HeadlessRun.h>
#include <osgtesslodviewer/SceneDrawables.h>
#include <osgtesslodviewer/SceneLoading.h>
#include <osgtesslodviewer/ViewerOptions.h>
#include <support/TemporaryDirectory.h>

#include <fmt/format.h>
#include <osg/ArgumentParser>
#include <osg/ComputeBoundsVisitor>
#include <osgViewer/Viewer>

#include <algorithm>
#include <array>
#include <exception>
#include <fstream>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kWidth = 1280;
constexpr int kHeight = 800;
constexpr std::array<double, 2> kErrorsPixels{1.0, 4.0};

/// Where to look from: along the axis of OSG's home position, which is −y, at the centre of the bounding box.
struct View {
    const char* name;
    std::optional<double>
        distance; ///< of the eye from the centre in diagonals of the bounding box; none: home position
};
constexpr std::array<View, 3> kViews{View{"close", 0.6}, View{"home", std::nullopt}, View{"far", 10.0}};

osg::ref_ptr<osg::Node> load(const std::string& path)
{
    addPluginFolders();
    std::string program = "osgtesslodbench";
    std::string file = path;
    std::array<char*, 2> words{program.data(), file.data()};
    int count = static_cast<int>(words.size());
    osg::ArgumentParser arguments(&count, words.data());
    std::string error;
    const osg::ref_ptr<osg::Node> scene = loadScene(arguments, error);
    if (!scene) { throw std::runtime_error(error); }
    return scene;
}

LookAt lookFrom(osg::Node& scene, double diagonals)
{
    osg::ComputeBoundsVisitor visitor;
    scene.accept(visitor);
    const osg::BoundingBox& box = visitor.getBoundingBox();
    const osg::Vec3d center(box.center());
    const double diagonal = 2.0 * static_cast<double>(box.radius());
    return {center - osg::Vec3d(0.0, diagonals * diagonal, 0.0), center, osg::Vec3d(0.0, 0.0, 1.0)};
}

/// Nothing that is written to std::cout is shown while this lives.
class QuietOutput {
public:
    QuietOutput()
        : _before(std::cout.rdbuf(_sink.rdbuf()))
    {
    }
    ~QuietOutput() { std::cout.rdbuf(_before); }
    QuietOutput(const QuietOutput&) = delete;
    QuietOutput& operator=(const QuietOutput&) = delete;

private:
    std::ostringstream _sink;
    std::streambuf* _before;
};

/// The viewer's statistics of a headless run.
Json drawOnce(const std::string& path, const View& view, double errorPixels, unsigned frames,
              const std::string& statsFile)
{
    const osg::ref_ptr<osg::Node> scene = load(path);
    changeOptions(findDrawables(*scene), [&](SelectionOptions& options) { options.errorPixels = errorPixels; });
    ViewerOptions options;
    options.headless = true;
    options.width = kWidth;
    options.height = kHeight;
    options.frames = frames;
    options.statsFile = statsFile;
    if (view.distance) { options.camera = lookFrom(*scene, *view.distance); }
    {
        const QuietOutput quiet;
        osgViewer::Viewer viewer;
        runHeadless(viewer, *scene, options);
    }
    std::ifstream file(statsFile);
    return Json::parse(file);
}

Json toRow(const Scene& scene, const View& view, double errorPixels, const Json& statistics)
{
    Json row{{"scene", scene.name}, {"view", view.name}, {"errorPixels", errorPixels}};
    for (const char* key : {"patchesDrawn", "patchesCulled", "patchesSaturated", "triangles", "patchesByFactor"}) {
        row[key] = statistics[key];
    }
    for (const auto& [key, value] : statistics["times"].items()) { row[key] = value; }
    return row;
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto count = [&](const char* key) { return grouped(row[key].get<unsigned long long>()); };
    const auto time = [&](const char* key) { return fmt::format("{:.2f}", row[key].get<double>()); };
    return {row["scene"].get<std::string>(),
            row["view"].get<std::string>(),
            fmt::format("{:g}", row["errorPixels"].get<double>()),
            count("patchesDrawn"),
            count("patchesCulled"),
            count("patchesSaturated"),
            count("triangles"),
            time("cullMilliseconds"),
            time("drawMilliseconds"),
            time("frameMilliseconds")};
}

void benchmarkScene(const Scene& scene, unsigned frames, const TemporaryDirectory& folder, BenchmarkResult& result)
{
    const std::string path = bakedFile(scene, bake::BakeOptions(), folder.file("scene.tlod"));
    for (const View& view : kViews) {
        for (const double errorPixels : kErrorsPixels) {
            fmt::print(stderr, "{}: {} view, {:g} pixels\n", scene.name, view.name, errorPixels);
            const Json statistics =
                runInChild([&] { return drawOnce(path, view, errorPixels, frames, folder.file("statistics.json")); });
            result.glRenderer = statistics["gl"]["renderer"].get<std::string>();
            result.rows.push_back(toRow(scene, view, errorPixels, statistics));
            result.tables.front().rows.push_back(tableRow(result.rows.back()));
        }
    }
}

Json summaryOf(const Json& rows)
{
    std::vector<double> perTriangle;
    double longest = 0.0;
    std::uint64_t saturated = 0;
    for (const Json& row : rows) {
        longest = std::max(longest, row["frameMilliseconds"].get<double>());
        saturated += row["patchesSaturated"].get<std::uint64_t>();
        const double triangles = row["triangles"].get<double>();
        if (triangles > 0.0) { perTriangle.push_back(1e6 * row["drawMilliseconds"].get<double>() / triangles); }
    }
    return {{"measurements", rows.size()},
            {"longestFrameMilliseconds", longest},
            {"saturatedPatches", saturated},
            {"medianDrawNanosecondsPerTriangle", median(perTriangle)}};
}

} // namespace

BenchmarkResult benchmarkFrames(const std::vector<Scene>& scenes, unsigned frames)
{
    const TemporaryDirectory folder;
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene",     "view",      "error px", "drawn",   "culled",
                                            "saturated", "triangles", "cull ms",  "draw ms", "frame ms"};
    for (const Scene& scene : scenes) {
        try {
            benchmarkScene(scene, frames, folder, result);
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = summaryOf(result.rows);
    return result;
}

} // namespace osgTessLOD::benchmarks
