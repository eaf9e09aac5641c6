// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "ModelField.h"
#include "Orbit.h"

#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/DeformableAsset.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/Transform>
#include <osg/Viewport>
#include <osgUtil/CullVisitor>

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <memory>
#include <random>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kViews = 16;

/// Places to select from.
struct Situation {
    const char* name;
    double diagonals; ///< from the middle of the model
    bool looksAway;
};
constexpr Situation kSituations[] = {
    {"home", 3.0, false}, {"close", 0.6, false}, {"far", 3000.0, false}, {"off screen", 3.0, true}};

/// Turned by half a circle.
std::vector<ScreenCamera> lookingAway(std::vector<ScreenCamera> cameras)
{
    for (ScreenCamera& camera : cameras) { camera.localToEye.postMult(osg::Matrixd::rotate(osg::PI, 0.0, 1.0, 0.0)); }
    return cameras;
}

/// Nanoseconds of one selection: the median over `runs` of the mean over the views.
double nanoseconds(const PatchSelector& selector, const SelectionOptions& options,
                   const std::vector<ScreenCamera>& cameras, unsigned runs, SelectionStatistics& statistics)
{
    struct Prepared {
        SelectionView view;
        std::vector<osg::Plane> sides;
    };
    std::vector<Prepared> prepared;
    for (const ScreenCamera& camera : cameras) { prepared.push_back({camera.view(), camera.sides()}); }
    std::vector<double> times;
    for (unsigned run = 0; run < runs; ++run) {
        statistics = SelectionStatistics();
        const auto start = std::chrono::steady_clock::now();
        for (const Prepared& p : prepared) { statistics.add(selector.select(p.view, options, p.sides).statistics); }
        const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
        times.push_back(time.count() / static_cast<double>(prepared.size()));
    }
    return median(times);
}

struct Way {
    const char* name;
    SelectionOptions::Metric metric;
    SelectionOptions::Bound bound;
};
constexpr Way kWays[] = {
    {"conservative", SelectionOptions::Metric::View, SelectionOptions::Bound::Conservative},
    {"first order", SelectionOptions::Metric::View, SelectionOptions::Bound::FirstOrder},
    {"conservative, isotropic", SelectionOptions::Metric::Isotropic, SelectionOptions::Bound::Conservative}};

/// Cameras somewhere in a field of models, a model's height above them, that look across it.
std::vector<ScreenCamera> camerasOver(const LodAsset& field, double modelSize)
{
    std::mt19937 random(2017);
    const auto between = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    std::vector<ScreenCamera> cameras;
    for (unsigned k = 0; k < kViews; ++k) {
        const osg::Vec3d eye(between(field.boundsMin[0], field.boundsMax[0]),
                             between(field.boundsMin[1], field.boundsMax[1]), double{field.boundsMax[2]} + modelSize);
        const double turn = between(0.0, 2.0 * osg::PI);
        ScreenCamera camera;
        camera.width = 1280.0;
        camera.height = 800.0;
        camera.localToEye = osg::Matrixd::lookAt(eye, eye + osg::Vec3d(std::cos(turn), std::sin(turn), -0.3),
                                                 osg::Vec3d(0.0, 0.0, 1.0));
        camera.projection.makePerspective(60.0, camera.width / camera.height, 0.01 * modelSize, 1e6 * modelSize);
        cameras.push_back(camera);
    }
    return cameras;
}

/// Of 20 patches.
LodAsset smallAsteroid()
{
    bake::BakeOptions options;
    options.maxFactor = 16;
    options.normals = false;
    bake::Progress progress;
    bake::BakeReport report;
    return bake::bakeSource("builtin:asteroid", options, progress, report);
}

/// Selections of ever more patches: fields of a baked model.
void measureGrowth(unsigned runs, bool quick, BenchmarkResult& result)
{
    const LodAsset model = smallAsteroid();
    const double size = double{model.boundsMax[2]} - model.boundsMin[2];
    result.tables.push_back({{"patches", "drawn", "µs", "ns / drawn patch", "µs off screen"}, {}});
    std::vector<double> perPatch;
    for (const unsigned side : {7U, 22U, 71U, 224U}) {
        if (quick && side > 22U) { break; }
        fmt::print(stderr, "select: {} patches\n", side * side * model.patches.size());
        const LodAsset field = fieldOf(model, side);
        const PatchSelector selector(field);
        const std::vector<ScreenCamera> cameras = camerasOver(field, size);
        SelectionStatistics statistics;
        const double time = nanoseconds(selector, SelectionOptions(), cameras, runs, statistics);
        perPatch.push_back(time * kViews / static_cast<double>(statistics.patches));
        SelectionStatistics nothing;
        std::vector<ScreenCamera> away = orbitOf(field, 3.0, kViews);
        const double offScreen = nanoseconds(selector, SelectionOptions(), lookingAway(std::move(away)), runs, nothing);
        result.summary["growth"].push_back({{"patches", field.patches.size()},
                                            {"drawn", statistics.patches / kViews},
                                            {"nanoseconds", time},
                                            {"nanosecondsPerDrawnPatch", perPatch.back()},
                                            {"nanosecondsOffScreen", offScreen}});
        result.tables.back().rows.push_back(
            {grouped(field.patches.size()), grouped(statistics.patches / kViews), fmt::format("{:.1f}", time / 1000.0),
             fmt::format("{:.1f}", perPatch.back()), fmt::format("{:.2f}", offScreen / 1000.0)});
    }
    result.summary["ns_per_patch"] = mean(perPatch);
}

/// Bends all of the field, other than the last time.
std::vector<osg::Matrixd> bent(const std::vector<osg::Vec3d>& baseVertices, double curvature)
{
    std::vector<osg::Matrixd> transforms;
    for (const osg::Vec3d& at : baseVertices) {
        transforms.push_back(osg::Matrixd::translate(-at) * osg::Matrixd::rotate(curvature * at.x(), 0.0, 1.0, 0.0) *
                             osg::Matrixd::translate(at));
    }
    return transforms;
}

/// New poses of the control mesh of ever more patches: to make one, to make ready for selecting, and to select, against
/// selecting undeformed.
void measurePoses(unsigned runs, bool quick, BenchmarkResult& result)
{
    const LodAsset model = smallAsteroid();
    const double size = double{model.boundsMax[2]} - model.boundsMin[2];
    result.tables.push_back({{"patches", "base vertices", "first µs", "pose ns / base vertex", "refit ns / patch",
                              "select ns / patch", "undeformed ns / patch"},
                             {}});
    for (const unsigned side : {7U, 22U, 71U}) {
        if (quick && side > 22U) { break; }
        const osg::ref_ptr<GpuAsset> field = new GpuAsset(std::make_shared<const LodAsset>(fieldOf(model, side)));
        const std::vector<osg::Vec3d> baseVertices = ControlMeshDeformation::baseVertices(field->asset());
        const std::vector<ScreenCamera> cameras = camerasOver(field->asset(), size);
        const auto elapsed = [](std::chrono::steady_clock::time_point start) {
            return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
        };
        const auto begin = std::chrono::steady_clock::now();
        field->deformable();
        const double first = elapsed(begin);
        std::vector<double> poses;
        std::vector<double> refits;
        SelectionStatistics statistics;
        double select = 0.0;
        for (unsigned run = 0; run < runs; ++run) {
            const std::vector<osg::Matrixd> transforms = bent(baseVertices, 0.001 * run / size);
            auto start = std::chrono::steady_clock::now();
            const osg::ref_ptr<ControlMeshDeformation> pose = new ControlMeshDeformation(field.get(), transforms);
            poses.push_back(elapsed(start));
            start = std::chrono::steady_clock::now();
            pose->selector();
            refits.push_back(elapsed(start));
            if (run + 1 == runs) { select = nanoseconds(pose->selector(), SelectionOptions(), cameras, runs, statistics); }
        }
        const double undeformed = nanoseconds(field->selector(), SelectionOptions(), cameras, runs, statistics);
        const auto patches = static_cast<double>(field->asset().patches.size());
        const Json row{{"patches", field->asset().patches.size()},
                       {"baseVertices", baseVertices.size()},
                       {"firstNanoseconds", first},
                       {"poseNanosecondsPerBaseVertex", median(poses) / static_cast<double>(baseVertices.size())},
                       {"refitNanosecondsPerPatch", median(refits) / patches},
                       {"selectNanosecondsPerPatch", select / patches},
                       {"undeformedNanosecondsPerPatch", undeformed / patches}};
        result.summary["poses"].push_back(row);
        result.tables.back().rows.push_back({grouped(field->asset().patches.size()), grouped(baseVertices.size()),
                                             fmt::format("{:.0f}", first / 1000.0),
                                             fmt::format("{:.1f}", row["poseNanosecondsPerBaseVertex"].get<double>()),
                                             fmt::format("{:.1f}", row["refitNanosecondsPerPatch"].get<double>()),
                                             fmt::format("{:.1f}", row["selectNanosecondsPerPatch"].get<double>()),
                                             fmt::format("{:.1f}", row["undeformedNanosecondsPerPatch"].get<double>())});
    }
}

/// What a cull traversal of `node` takes, without a graphics context: nanoseconds, the median over `runs` of the mean over the
/// cameras.
double cullNanoseconds(osg::Node& node, const std::vector<ScreenCamera>& cameras, unsigned runs)
{
    const osg::ref_ptr<osgUtil::CullVisitor> visitor = new osgUtil::CullVisitor;
    visitor->setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
    const osg::ref_ptr<osgUtil::StateGraph> graph = new osgUtil::StateGraph;
    const osg::ref_ptr<osgUtil::RenderStage> stage = new osgUtil::RenderStage;
    visitor->setStateGraph(graph.get());
    visitor->setRenderStage(stage.get());
    std::vector<double> times;
    for (unsigned run = 0; run < runs; ++run) {
        double time = 0.0;
        for (const ScreenCamera& camera : cameras) {
            visitor->reset();
            graph->clean();
            stage->reset();
            const auto start = std::chrono::steady_clock::now();
            visitor->pushViewport(new osg::Viewport(0.0, 0.0, camera.width, camera.height));
            visitor->pushProjectionMatrix(new osg::RefMatrix(camera.projection));
            visitor->pushModelViewMatrix(new osg::RefMatrix(camera.localToEye), osg::Transform::ABSOLUTE_RF);
            node.accept(*visitor);
            visitor->popModelViewMatrix();
            visitor->popProjectionMatrix();
            visitor->popViewport();
            time += std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
        }
        times.push_back(time / static_cast<double>(cameras.size()));
    }
    return median(times);
}

/// Sums up what is selected.
class Sum : public SelectionObserver {
public:
    void selected(const osg::Camera*, const osg::Matrixd&, const PatchSelection& selection) override
    {
        total.add(selection.statistics());
    }
    SelectionStatistics total;
};

/// Cull traversals of ever more placements of one model.
void measurePlacements(unsigned runs, bool quick, BenchmarkResult& result)
{
    const auto model = std::make_shared<const LodAsset>(smallAsteroid());
    const double size = double{model->boundsMax[2]} - model->boundsMin[2];
    result.tables.push_back(
        {{"placements", "patches drawn", "µs", "ns / drawn patch", "ns / placement", "µs off screen"}, {}});
    for (const unsigned side : {1U, 10U, 32U, 100U, 316U}) {
        if (quick && side > 32U) { break; }
        fmt::print(stderr, "select: {} placements\n", side * side);
        std::vector<osg::Matrixd> placements;
        for (unsigned k = 0; k < side * side; ++k) {
            placements.push_back(osg::Matrixd::rotate(k, 0.0, 0.0, 1.0) *
                                 osg::Matrixd::translate(1.5 * size * (k % side), 1.5 * size * (k / side), 0.0));
        }
        const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(model);
        instances->setPlacements(std::move(placements));
        const osg::ref_ptr<Sum> sum = new Sum;
        instances->setSelectionObserver(sum.get());
        LodAsset field; // for its box
        for (int axis = 0; axis < 3; ++axis) {
            field.boundsMin[static_cast<std::size_t>(axis)] = instances->getBoundingBox()._min[axis];
            field.boundsMax[static_cast<std::size_t>(axis)] = instances->getBoundingBox()._max[axis];
        }
        const double time = cullNanoseconds(*instances, camerasOver(field, size), runs);
        const auto drawn = static_cast<double>(sum->total.patches) / (runs * kViews);
        const double offScreen = cullNanoseconds(*instances, lookingAway(orbitOf(field, 3.0, kViews)), runs);
        result.summary["placements"].push_back({{"placements", side * side},
                                                {"drawn", drawn},
                                                {"nanoseconds", time},
                                                {"nanosecondsOffScreen", offScreen}});
        result.tables.back().rows.push_back({grouped(side * side), fmt::format("{:.0f}", drawn),
                                             fmt::format("{:.1f}", time / 1000.0), fmt::format("{:.1f}", time / drawn),
                                             fmt::format("{:.1f}", time / (side * side)),
                                             fmt::format("{:.2f}", offScreen / 1000.0)});
    }
}

} // namespace

BenchmarkResult benchmarkSelection(const std::vector<Scene>& scenes, unsigned runs, bool quick)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene", "patches", "from", "selection", "drawn", "µs", "ns / patch"};
    std::vector<double> atHome;
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: select\n", scene.name);
        try {
            const LodAsset asset = loadOrBake(scene);
            const PatchSelector selector(asset);
            for (const Situation& situation : kSituations) {
                std::vector<ScreenCamera> cameras = orbitOf(asset, situation.diagonals, kViews);
                if (situation.looksAway) { cameras = lookingAway(std::move(cameras)); }
                for (const Way& way : kWays) {
                    SelectionOptions options;
                    options.metric = way.metric;
                    options.bound = way.bound;
                    SelectionStatistics statistics;
                    const double time = nanoseconds(selector, options, cameras, runs, statistics);
                    const double perPatch = time / static_cast<double>(asset.patches.size());
                    if (&situation == &kSituations[0] && &way == &kWays[0]) { atHome.push_back(perPatch); }
                    result.rows.push_back({{"scene", scene.name},
                                           {"patches", asset.patches.size()},
                                           {"from", situation.name},
                                           {"selection", way.name},
                                           {"drawn", statistics.patches / kViews},
                                           {"nanoseconds", time},
                                           {"nanosecondsPerPatch", perPatch}});
                    result.tables.front().rows.push_back({scene.name, grouped(asset.patches.size()), situation.name,
                                                          way.name, grouped(statistics.patches / kViews),
                                                          fmt::format("{:.2f}", time / 1000.0),
                                                          fmt::format("{:.1f}", perPatch)});
                }
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"ns_per_patch_at_home", mean(atHome)}, {"runs", runs}};
    measureGrowth(runs, quick, result);
    measurePlacements(runs, quick, result);
    measurePoses(runs, quick, result);
    return result;
}

} // namespace osgTessLOD::benchmarks
