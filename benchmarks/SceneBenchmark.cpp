// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.8.4 and fig. 4.11.
#include "BakedScene.h"
#include "Benchmark.h"
#include "ChildProcess.h"

#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/StripSimplifier.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <osgtesslodviewer/SceneDrawables.h>
#include <osgtesslodviewer/SelectionTotals.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>
#include <support/TemporaryDirectory.h>

#include <fmt/format.h>
#include <osg/MatrixTransform>
#include <osg/Stats>
#include <osgViewer/Viewer>

#include <array>
#include <cmath>
#include <exception>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kSide = 20;
constexpr int kWidth = 1920;
constexpr int kHeight = 1140;
constexpr double kFovDegrees = 40.0;
constexpr unsigned kWarmUpFrames = 1; ///< in which programs are compiled and buffers uploaded
constexpr unsigned kLateFrames = 1;   ///< in which the last timer query is read

enum class Levels { Uniform, StraightStrips, Strips };
enum class Shown { Instances, Transforms };

struct Contestant {
    const char* name;
    Levels levels;
    SelectionOptions::Metric metric;
    Shown shown;
};
constexpr Contestant kBaseline{"uniform, isotropic", Levels::Uniform, SelectionOptions::Metric::Isotropic,
                               Shown::Instances};
constexpr Contestant kFull{"full", Levels::Strips, SelectionOptions::Metric::View, Shown::Instances};
constexpr Contestant kFullUnderTransforms{"full, transforms", Levels::Strips, SelectionOptions::Metric::View,
                                          Shown::Transforms};
constexpr std::array<Contestant, 5> kContestants{
    kBaseline, Contestant{"uniform, view", Levels::Uniform, SelectionOptions::Metric::View, Shown::Instances},
    Contestant{"straight strips, view", Levels::StraightStrips, SelectionOptions::Metric::View, Shown::Instances},
    kFull, kFullUnderTransforms};

void bakeLevels(const Scene& scene, Levels levels, unsigned maxFactor, const std::string& path)
{
    bake::BakeOptions options;
    options.maxFactor = maxFactor;
    options.technique = levels == Levels::Uniform ? "uniform" : "strips";
    options.strips.strips =
        levels == Levels::StraightStrips ? bake::StripOptions::Strips::Straight : bake::StripOptions::Strips::Optimal;
    runInChild([&] {
        bakeToFile(scene, options, path);
        return Json();
    });
}

/// Evenly distributed over all orientations.
osg::Quat randomOrientation(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    osg::Quat orientation(normal(random), normal(random), normal(random), normal(random));
    return orientation / orientation.length();
}

osg::BoundingBox boxOf(const LodAsset& asset)
{
    return {asset.boundsMin[0], asset.boundsMin[1], asset.boundsMin[2],
            asset.boundsMax[0], asset.boundsMax[1], asset.boundsMax[2]};
}

double spacingOf(const LodAsset& asset)
{
    return 2.0 * static_cast<double>(boxOf(asset).radius());
}

/// On a square grid whose middle is the origin, a diagonal apart, each turned about the middle of its box.
std::vector<osg::Matrixd> gridOf(const LodAsset& asset)
{
    const double spacing = spacingOf(asset);
    std::mt19937 random(1);
    std::vector<osg::Matrixd> placements;
    for (int row = 0; row < kSide; ++row) {
        for (int column = 0; column < kSide; ++column) {
            const osg::Vec3d place(column - 0.5 * (kSide - 1), row - 0.5 * (kSide - 1), 0.0);
            placements.push_back(osg::Matrixd::translate(-osg::Vec3d(boxOf(asset).center())) *
                                 osg::Matrixd::rotate(randomOrientation(random)) *
                                 osg::Matrixd::translate(place * spacing));
        }
    }
    return placements;
}

/// The drawable, or one shared by transforms, at the placements.
osg::ref_ptr<osg::Node> sceneOf(const std::shared_ptr<const LodAsset>& asset, const Contestant& contestant,
                                Backend backend)
{
    SelectionOptions options;
    options.errorPixels = 1.0;
    options.metric = contestant.metric;
    options.backend = backend;
    const std::vector<osg::Matrixd> placements = gridOf(*asset);
    if (contestant.shown == Shown::Instances) {
        const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(asset);
        instances->setOptions(options);
        instances->setPlacements(placements);
        return instances;
    }
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    drawable->setOptions(options);
    const osg::ref_ptr<osg::Group> group = new osg::Group;
    for (const osg::Matrixd& placement : placements) {
        const osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(placement);
        transform->addChild(drawable);
        group->addChild(transform);
    }
    return group;
}

/// From beside a corner of the grid, over the middle: a part of it is out of view.
void setUpCamera(osg::Camera& camera, osg::GraphicsContext& context, double spacing)
{
    camera.setGraphicsContext(&context);
    camera.setViewport(0, 0, kWidth, kHeight);
    camera.setDrawBuffer(GL_BACK);
    camera.setReadBuffer(GL_BACK);
    camera.setProjectionMatrixAsPerspective(kFovDegrees, static_cast<double>(kWidth) / kHeight, 1.0, 100.0);
    const double corner = -(0.5 * kSide + 1.0) * spacing;
    camera.setViewMatrixAsLookAt(osg::Vec3d(corner, corner, 5.0 * spacing), osg::Vec3d(), osg::Vec3d(0.0, 0.0, 1.0));
}

std::uint64_t placementsIn(const std::vector<FrameSelection>& selections)
{
    std::set<std::uint32_t> numbers;
    std::uint64_t drawables = 0;
    for (const FrameSelection& entry : selections) {
        const RecordPlacements& placements = entry.selection->placements();
        numbers.insert(placements.numbers.begin(), placements.numbers.end());
        drawables += !placements.set.valid() && !entry.selection->records().empty() ? 1 : 0;
    }
    return numbers.size() + drawables;
}

/// Milliseconds of the frames that have any; null where none does.
Json medianOf(const osg::Stats& stats, const std::string& attribute, const std::vector<unsigned>& frames)
{
    std::vector<double> milliseconds;
    for (const unsigned frame : frames) {
        double seconds = 0.0;
        if (stats.getAttribute(frame, attribute, seconds)) { milliseconds.push_back(1e3 * seconds); }
    }
    if (milliseconds.empty()) { return nullptr; }
    return median(milliseconds);
}

/// Draws frames and tells what was drawn in them, and what they took.
Json draw(const std::string& path, const Contestant& contestant, Backend backend, unsigned frames)
{
    std::string error;
    const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(kWidth, kHeight, error);
    if (!context) { throw std::runtime_error("no OpenGL without a window: " + error); }
    const auto asset = std::make_shared<const LodAsset>(readTlod(path));
    const osg::ref_ptr<osg::Node> scene = sceneOf(asset, contestant, backend);
    SelectionTotals totals(findDrawables(*scene));
    osgViewer::Viewer viewer;
    osg::Camera& camera = *viewer.getCamera();
    viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
    viewer.setSceneData(scene);
    setUpCamera(camera, *context, spacingOf(*asset));
    camera.setStats(new osg::Stats("camera", kWarmUpFrames + frames + kLateFrames + 1));
    camera.getStats()->collectStats("rendering", true);
    camera.getStats()->collectStats("gpu", true);
    viewer.realize();
    if (!viewer.isRealized()) { throw std::runtime_error("the OpenGL context could not be made"); }

    std::vector<unsigned> measured;
    std::uint64_t drawCalls = 0;
    std::uint64_t drawCallsBefore = 0;
    for (unsigned frame = 0; frame < kWarmUpFrames + frames + kLateFrames; ++frame) {
        totals.beginFrame();
        viewer.frame();
        context->makeCurrent();
        glFinish(); // so that no frame waits for the one before
        const std::uint64_t all = DrawContext::of(*context->getState()).drawCalls();
        drawCalls = all - drawCallsBefore;
        drawCallsBefore = all;
        if (frame >= kWarmUpFrames && frame < kWarmUpFrames + frames) {
            measured.push_back(viewer.getFrameStamp()->getFrameNumber());
        }
    }
    const std::vector<FrameSelection> selections = totals.thisFrame(&camera);
    const SelectionSums sums = SelectionTotals::sum(selections);
    const osg::Stats& stats = *camera.getStats();
    osg::RenderInfo renderInfo(context->getState(), nullptr);
    std::optional<Backend> drawnBy;
    if (!selections.empty()) { drawnBy = selections.front().selection->backend(renderInfo); }
    if (!drawnBy) { throw std::runtime_error("this OpenGL context cannot draw it"); }
    return {{"backend", nameOf(*drawnBy)},
            {"placements", placementsIn(selections)},
            {"patches", sums.patches},
            {"saturatedPatches", sums.saturatedPatches},
            {"triangles", sums.triangles},
            {"drawCalls", drawCalls},
            {"cullMilliseconds", medianOf(stats, "Cull traversal time taken", measured)},
            {"drawMilliseconds", medianOf(stats, "Draw traversal time taken", measured)},
            {"gpuMilliseconds", medianOf(stats, "GPU draw time taken", measured)},
            {"renderer", std::string(reinterpret_cast<const char*>(glGetString(GL_RENDERER)))}};
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto count = [&](const char* key) { return grouped(row[key].get<std::uint64_t>()); };
    const auto time = [&](const char* key) {
        return row[key].is_null() ? std::string("–") : fmt::format("{:.2f}", row[key].get<double>());
    };
    return {row["scene"].get<std::string>(),
            row["contestant"].get<std::string>(),
            row["backend"].get<std::string>(),
            count("placements"),
            count("patches"),
            count("saturatedPatches"),
            count("triangles"),
            count("drawCalls"),
            time("cullMilliseconds"),
            time("drawMilliseconds"),
            time("gpuMilliseconds")};
}

double cpuMilliseconds(const Json& row)
{
    return row["cullMilliseconds"].get<double>() + row["drawMilliseconds"].get<double>();
}

/// What `of(row)` is of one contestant to that of another, mean over the scenes that both were measured in; null without any.
template <class Of>
Json meanRatio(const Json& rows, const Contestant& contestant, const Contestant& other, const Of& of)
{
    std::vector<double> ratios;
    for (const Json& row : rows) {
        for (const Json& base : rows) {
            const bool isPair = row["scene"] == base["scene"] && row["contestant"] == contestant.name &&
                                base["contestant"] == other.name;
            if (isPair && of(base) > 0.0) { ratios.push_back(of(row) / of(base)); }
        }
    }
    if (ratios.empty()) { return nullptr; }
    return mean(ratios);
}

Json summaryOf(const Json& rows)
{
    const auto number = [](const char* key) {
        return [key](const Json& row) { return row[key].is_null() ? 0.0 : row[key].get<double>(); };
    };
    return {{"triangles_ratio", meanRatio(rows, kFull, kBaseline, number("triangles"))},
            {"cpu_time_ratio", meanRatio(rows, kFull, kBaseline, cpuMilliseconds)},
            {"gpu_time_ratio", meanRatio(rows, kFull, kBaseline, number("gpuMilliseconds"))},
            {"instances_over_transforms",
             {{"draw_calls_ratio", meanRatio(rows, kFull, kFullUnderTransforms, number("drawCalls"))},
              {"cull_time_ratio", meanRatio(rows, kFull, kFullUnderTransforms, number("cullMilliseconds"))},
              {"draw_time_ratio", meanRatio(rows, kFull, kFullUnderTransforms, number("drawMilliseconds"))},
              {"gpu_time_ratio", meanRatio(rows, kFull, kFullUnderTransforms, number("gpuMilliseconds"))}}}};
}

void measure(const Scene& scene, const SceneBenchmarkOptions& options, BenchmarkResult& result)
{
    const TemporaryDirectory folder;
    std::map<Levels, std::string> baked;
    Backend backend = Backend::Auto; // for the first to try: all are drawn by the same
    for (const Contestant& contestant : kContestants) {
        fmt::print(stderr, "{}: {}\n", scene.name, contestant.name);
        std::string& path = baked[contestant.levels];
        if (path.empty()) {
            path = folder.file(std::to_string(baked.size()) + ".tlod");
            bakeLevels(scene, contestant.levels, options.maxFactor, path);
        }
        Json row{{"scene", scene.name}, {"contestant", contestant.name}};
        row.update(runInChild([&] { return draw(path, contestant, backend, options.frames); }));
        result.glRenderer = row["renderer"].get<std::string>();
        row.erase("renderer");
        backend = *backendNamed(row["backend"].get<std::string>());
        result.tables.front().rows.push_back(tableRow(row));
        result.rows.push_back(std::move(row));
    }
}

} // namespace

BenchmarkResult benchmarkScenes(const std::vector<Scene>& scenes, const SceneBenchmarkOptions& options)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene",     "contestant", "backend", "placements", "patches", "saturated",
                                            "triangles", "draw calls", "cull ms", "draw ms",    "GPU ms"};
    for (const Scene& scene : scenes) {
        try {
            measure(scene, options, result);
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = summaryOf(result.rows);
    return result;
}

} // namespace osgTessLOD::benchmarks
