// SPDX-License-Identifier: MIT
// osgtesslodbench: measures what bakes and frames take, and how good the error metric is.
#include "Benchmark.h"
#include "Machine.h"

#include <osgTessLOD/asset/AtomicFile.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <stdexcept>

namespace {

using namespace osgTessLOD::benchmarks;

/// What the command line asks for.
struct Arguments {
    std::vector<std::string> scenes;
    std::string jsonFile;
    std::string csvFile;
    BakeBenchmarkOptions bake;
    LookBenchmarkOptions look;
    CurveBenchmarkOptions curve;
    ScaleBenchmarkOptions scale;
    std::vector<std::string> methods;
    unsigned frames = 20;
    unsigned sceneFrames = SceneBenchmarkOptions().frames;
    std::size_t directions = 1000000;
    unsigned maxFactor = 64;
    unsigned views = 160;
    std::size_t points = 100000;
    std::size_t rays = 1'000'000;
    unsigned runs = 21;
    bool quick = false;
    bool markdown = false;
};

void declareCommon(CLI::App& command, Arguments& arguments)
{
    command
        .add_option("--scene", arguments.scenes,
                    "measure this scene: a name or a file; may be given several times. Without: the built-in "
                    "surfaces, and scans/*.{ply,obj} in the folder that OSGTESSLOD_DATA names")
        ->allow_extra_args(false);
    command.add_flag("--quick", arguments.quick, "measure the two smallest scenes a few times: under a minute");
    command.add_option("--json", arguments.jsonFile, "write all figures to this file");
    command.add_option("--csv", arguments.csvFile, "write the rows, without what has parts, as comma-separated values");
    command.add_flag("--markdown", arguments.markdown, "print the tables as Markdown, and nothing else");
}

void declareCurve(CLI::App& command, Arguments& arguments)
{
    CurveBenchmarkOptions& options = arguments.curve;
    command.add_option("--path", options.paths, "draw along this path only; may be given several times")
        ->allow_extra_args(false)
        ->check(CLI::IsMember(pathNames()));
    command.add_option("--frames", options.path.frames, "frames of each path")
        ->capture_default_str()
        ->check(CLI::Range(2, 1000));
    command.add_option("--width", options.path.width, "pixels")->capture_default_str()->check(CLI::Range(16, 16384));
    command.add_option("--height", options.path.height, "pixels")->capture_default_str()->check(CLI::Range(16, 16384));
    command.add_option("--runs", options.runs, "times of each frame to take the median of, after one to warm up")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    command.add_option("--points", options.points, "of each surface that are measured in each frame")
        ->capture_default_str()
        ->check(CLI::Range(100, 10000000));
    command.add_option("--limit", options.simplifierSeconds, "seconds that osgUtil::Simplifier may take for its levels")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    command.add_option("--most-triangles", options.mostTriangles, "where the full mesh would have more, it is not drawn")
        ->capture_default_str();
    command.add_option("--seed", options.seed, "of the order that contestants are drawn in")->capture_default_str();
}

std::vector<Scene> scenesOf(const Arguments& arguments)
{
    if (arguments.scenes.empty()) { return arguments.quick ? quickScenes() : allScenes(); }
    std::vector<Scene> scenes;
    for (const std::string& name : arguments.scenes) { scenes.push_back(findScene(name)); }
    return scenes;
}

void writeReport(osgTessLOD::AtomicFile& file, const BenchmarkResult& result)
{
    nlohmann::ordered_json machine = describeMachine();
    if (!result.glRenderer.empty()) { machine["glRenderer"] = result.glRenderer; }
    const nlohmann::ordered_json report{{"summary", result.summary}, {"rows", result.rows}, {"machine", machine}};
    file.stream() << report.dump(2) << '\n';
    file.commit();
}

/// A number or a text; a text with commas or quotes is quoted.
std::string csvCell(const nlohmann::ordered_json& value)
{
    if (value.is_null()) { return ""; }
    if (!value.is_string()) { return value.dump(); }
    const auto text = value.get<std::string>();
    if (text.find_first_of(",\"\n") == std::string::npos) { return text; }
    std::string quoted = "\"";
    for (const char c : text) { quoted += c == '"' ? "\"\"" : std::string(1, c); }
    return quoted + '"';
}

/// The first row names the columns: keys of the first of `rows`, but for those of objects and arrays.
void writeCsv(osgTessLOD::AtomicFile& file, const nlohmann::ordered_json& rows)
{
    std::vector<std::string> keys;
    if (!rows.empty()) {
        for (const auto& [key, value] : rows.front().items()) {
            if (!value.is_structured()) { keys.push_back(key); }
        }
    }
    const auto writeLine = [&](const auto& cellOf) {
        const char* separator = "";
        for (const std::string& key : keys) {
            file.stream() << separator << cellOf(key);
            separator = ",";
        }
        file.stream() << '\n';
    };
    writeLine([](const std::string& key) { return csvCell(key); });
    for (const nlohmann::ordered_json& row : rows) {
        writeLine([&](const std::string& key) { return row.contains(key) ? csvCell(row[key]) : std::string(); });
    }
    file.commit();
}

BakeBenchmarkOptions bakeOptions(const Arguments& arguments)
{
    constexpr unsigned kQuickSeconds = 5;
    BakeBenchmarkOptions options = arguments.bake;
    if (arguments.quick) {
        options.runs = 1;
        options.yardstickSeconds = std::min(options.yardstickSeconds, kQuickSeconds);
    }
    return options;
}

void printTables(const std::vector<ResultTable>& tables, bool markdown)
{
    const char* separator = "";
    for (const ResultTable& table : tables) {
        if (table.rows.empty()) { continue; }
        fmt::print("{}{}", separator, table.toText(markdown));
        separator = "\n";
    }
}

enum class Command { Bake, Frame, Metric, Simplify, Levels, Ladder, Bound, View, Select, Memory, Scene, Throughput, Terrain, Look, Displacement, Curve, Scale };

CurveBenchmarkOptions curveOptions(const Arguments& arguments)
{
    CurveBenchmarkOptions options = arguments.curve;
    if (arguments.quick) {
        options.path = {320, 200, 2, 4};
        options.errorsPixels = {0.5, 4.0};
        options.runs = 1;
        options.points = 4000;
        options.maxFactor = 8;
        options.simplifierSeconds = std::min(options.simplifierSeconds, 5U);
    }
    return options;
}

ScaleBenchmarkOptions scaleOptions(const Arguments& arguments)
{
    return arguments.quick ? ScaleBenchmarkOptions{{100'000, 400'000}, "uniform", 1} : arguments.scale;
}

BenchmarkResult measure(Command command, const std::vector<Scene>& scenes, const Arguments& arguments)
{
    constexpr std::size_t kQuickDirections = 10000;
    constexpr unsigned kQuickFactor = 16;
    constexpr unsigned kQuickSceneFactor = 8;
    constexpr unsigned kQuickViews = 32;
    constexpr std::size_t kQuickPoints = 10000;
    constexpr std::size_t kQuickRays = 20000;
    const unsigned maxFactor = arguments.quick ? std::min(arguments.maxFactor, kQuickFactor) : arguments.maxFactor;
    switch (command) {
    case Command::Bake: return benchmarkBakes(scenes, bakeOptions(arguments));
    case Command::Frame: return benchmarkFrames(scenes, arguments.quick ? 3 : arguments.frames);
    case Command::Levels: return benchmarkLevels(scenes, maxFactor);
    case Command::Ladder: return benchmarkLadders(scenes, maxFactor);
    case Command::Simplify: return benchmarkSimplification(scenes, arguments.methods);
    case Command::Bound:
        return benchmarkBound(scenes, arguments.quick ? kQuickViews : arguments.views,
                              arguments.quick ? kQuickPoints : arguments.points);
    case Command::Memory: return benchmarkMemory(scenes);
    case Command::Terrain: return benchmarkTerrain(scenes);
    case Command::Curve: return benchmarkCurves(scenes, curveOptions(arguments));
    case Command::Look: return benchmarkLook(scenes, arguments.look);
    case Command::Scene:
        return benchmarkScenes(scenes, arguments.quick
                                           ? SceneBenchmarkOptions{1, std::min(maxFactor, kQuickSceneFactor)}
                                           : SceneBenchmarkOptions{arguments.sceneFrames, maxFactor});
    case Command::Throughput:
        return arguments.quick ? benchmarkThroughput(scenes, {100'000}, 3)
                               : benchmarkThroughput(scenes, {1'000'000, 4'000'000}, arguments.frames);
    case Command::Displacement:
        return arguments.quick ? benchmarkDisplacement(scenes, {4}, kQuickRays)
                               : benchmarkDisplacement(scenes, {8, 16}, arguments.rays);
    case Command::Scale: return benchmarkScale(scenes, scaleOptions(arguments));
    case Command::View: return benchmarkViews(scenes);
    case Command::Select: return benchmarkSelection(scenes, arguments.quick ? 3 : arguments.runs, arguments.quick);
    default: return benchmarkMetric(scenes, arguments.quick ? kQuickDirections : arguments.directions);
    }
}

/// Simplifying scans takes minutes: they are compared only where they are asked for.
bool takesScansByName(Command command)
{
    return command == Command::Simplify || command == Command::Levels || command == Command::Ladder ||
           command == Command::Bound || command == Command::Memory || command == Command::Scene ||
           command == Command::Throughput || command == Command::Displacement || command == Command::Curve ||
           command == Command::Scale;
}

bool takesBakedScenes(Command command)
{
    return command == Command::Frame || command == Command::View || command == Command::Select ||
           command == Command::Memory || command == Command::Throughput;
}

/// The exit status: 1 if a scene could not be measured.
int run(Command command, const Arguments& arguments)
{
    std::vector<Scene> scenes = scenesOf(arguments);
    if (command == Command::Terrain && arguments.scenes.empty()) { scenes = terrainScenes(); }
    if (takesScansByName(command) && arguments.scenes.empty()) {
        scenes.erase(std::remove_if(scenes.begin(), scenes.end(), [](const Scene& s) { return !isBuiltin(s); }),
                     scenes.end());
    }
    for (const Scene& scene : scenes) {
        if (!takesBakedScenes(command) && isBaked(scene)) {
            throw std::runtime_error(scene.source + ": is baked already");
        }
    }
    // Before anything is measured: a file that cannot be written is to be known at once.
    const auto fileAt = [](const std::string& path) {
        return path.empty() ? nullptr : std::make_unique<osgTessLOD::AtomicFile>(path);
    };
    const std::unique_ptr<osgTessLOD::AtomicFile> jsonFile = fileAt(arguments.jsonFile);
    const std::unique_ptr<osgTessLOD::AtomicFile> csvFile = fileAt(arguments.csvFile);

    const BenchmarkResult result = measure(command, scenes, arguments);
    printTables(result.tables, arguments.markdown);
    if (!arguments.markdown && !result.glRenderer.empty()) { fmt::print("GL renderer: {}\n", result.glRenderer); }
    if (jsonFile) { writeReport(*jsonFile, result); }
    if (csvFile) { writeCsv(*csvFile, result.rows); }
    for (const std::string& failure : result.failures) { fmt::print(stderr, "osgtesslodbench: {}\n", failure); }
    return result.failures.empty() ? 0 : 1;
}

} // namespace

int main(int argc, char** argv)
{
    Arguments arguments;
    CLI::App app("Measures what baking surfaces and drawing them takes, and how good the error metric is.",
                 "osgtesslodbench");
    app.require_subcommand(1);
    CLI::App* bake = app.add_subcommand("bake", "time, memory, file size and error of bakes");
    CLI::App* frame = app.add_subcommand("frame", "times and triangles of frames drawn without a window");
    CLI::App* simplify = app.add_subcommand("simplify", "errors of the ways to make levels, relative to uniform ones");
    simplify->add_option("--method", arguments.methods, "measure this one only; may be given several times")
        ->allow_extra_args(false)
        ->check(CLI::IsMember(simplifyMethods()));
    CLI::App* metric = app.add_subcommand("metric", "how far approximations of the view-dependent error are above it");
    CLI::App* levels = app.add_subcommand("levels", "distances of levels from the source, by strips and uniform ones");
    CLI::App* ladder = app.add_subcommand("ladder", "triangles drawn and bytes with more levels than powers of two");
    CLI::App* scene = app.add_subcommand("scene", "400 placements drawn, by levels, metrics and drawables");
    scene->add_option("--frames", arguments.sceneFrames, "frames to take the median of, after one to warm up")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    for (CLI::App* command : {levels, ladder, scene}) {
        command->add_option("--max-factor", arguments.maxFactor, "tessellation factor of the finest level")
            ->capture_default_str()
            ->check(CLI::IsMember({2U, 4U, 8U, 16U, 32U, 64U}));
    }
    CLI::App* bound = app.add_subcommand("bound", "deviations on screen in terms of those asked for");
    bound->add_option("--views", arguments.views, "random views of each scene")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    bound->add_option("--points", arguments.points, "random points of the surface in each view")
        ->capture_default_str()
        ->check(CLI::Range(0, 100000000));
    CLI::App* view = app.add_subcommand("view", "triangles by the error as seen, relative to the isotropic one");
    CLI::App* select = app.add_subcommand("select", "what selecting levels and patches takes");
    select->add_option("--runs", arguments.runs, "measurements to take the median of")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    CLI::App* displacement = app.add_subcommand("displacement", "patches as elevations, and distances of sampled displacement");
    displacement->add_option("--rays", arguments.rays, "random rays that are to meet each scene's patches once")
        ->capture_default_str()
        ->check(CLI::Range(0, 100000000));
    CLI::App* memory = app.add_subcommand("memory", "bytes on the GPU and in the file per vertex");
    CLI::App* throughput = app.add_subcommand("throughput", "triangles per second, relative to a static mesh of them");
    CLI::App* terrain = app.add_subcommand("terrain", "height errors of what is drawn, beside grids and meshoptimizer");
    CLI::App* look = app.add_subcommand("look", "pictures of what is drawn, compared with those of all triangles");
    look->add_option("--color-image", arguments.look.colorImage, "image of the surface's colour")->check(CLI::ExistingFile);
    look->add_option("--keep", arguments.look.keepFolder, "keep the pictures in this folder")->check(CLI::ExistingDirectory);
    CLI::App* curve = app.add_subcommand("curve", "triangles, times and memory by the error of what is drawn, beside other LODs");
    declareCurve(*curve, arguments);
    CLI::App* scale = app.add_subcommand("scale", "bakes, files, loading and frames of ever larger sources");
    scale->add_option("--triangles", arguments.scale.triangles, "of the sources, rising")->capture_default_str();
    scale->add_option("--technique", arguments.scale.technique, "how levels are made")
        ->capture_default_str()
        ->check(CLI::IsMember(osgTessLOD::bake::techniqueNames()));
    scale->add_option("--frames", arguments.scale.frames, "frames to take the median of")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    for (CLI::App* command : {scale, curve, bound, view, select, memory, scene, throughput, terrain, look, displacement}) { declareCommon(*command, arguments); }
    look->get_option("--scene")->required();
    declareCommon(*bake, arguments);
    declareCommon(*levels, arguments);
    declareCommon(*ladder, arguments);
    declareCommon(*simplify, arguments);
    declareCommon(*frame, arguments);
    declareCommon(*metric, arguments);
    metric->add_option("--directions", arguments.directions, "random directions per patch and level")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000000));
    bake->add_option("--runs", arguments.bake.runs, "bakes per scene, each in a process of its own")
        ->capture_default_str()
        ->check(CLI::Range(1, 1000));
    bake->add_option("--technique", arguments.bake.technique, "how levels are made")
        ->capture_default_str()
        ->check(CLI::IsMember(osgTessLOD::bake::techniqueNames()));
    bake->add_option("--limit", arguments.bake.yardstickSeconds,
                     "seconds that meshoptimizer and osgUtil::Simplifier may take each")
        ->capture_default_str()
        ->check(CLI::Range(1, 100000));
    bake->add_option("--keep", arguments.bake.keepFolder, "keep the .tlod files in this folder, for frame --scene")
        ->check(CLI::ExistingDirectory);
    for (CLI::App* command : {frame, throughput}) {
        command->add_option("--frames", arguments.frames, "frames to take the median of, after two to warm up")
            ->capture_default_str()
            ->check(CLI::Range(1, 100000));
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 1;
    }
    try {
        return run(bake->parsed()         ? Command::Bake
                   : frame->parsed()      ? Command::Frame
                   : simplify->parsed()   ? Command::Simplify
                   : levels->parsed()     ? Command::Levels
                   : ladder->parsed()     ? Command::Ladder
                   : bound->parsed()      ? Command::Bound
                   : view->parsed()       ? Command::View
                   : select->parsed()     ? Command::Select
                   : memory->parsed()     ? Command::Memory
                   : scene->parsed()      ? Command::Scene
                   : throughput->parsed() ? Command::Throughput
                   : terrain->parsed()    ? Command::Terrain
                   : look->parsed()       ? Command::Look
                   : displacement->parsed() ? Command::Displacement
                   : curve->parsed()      ? Command::Curve
                   : scale->parsed()      ? Command::Scale
                                          : Command::Metric,
                   arguments);
    } catch (const std::exception& error) {
        fmt::print(stderr, "osgtesslodbench: {}\n", error.what());
        return 1;
    }
}
