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
constexpr unsigned kWarmUpFrames = 2;
constexpr unsigned kLateFrames = 3; ///< until the last timer query has answered

enum class Levels { Uniform, StraightStrips, Strips };
enum class Shown { Instances, Transforms };

struct Contestant {
    const char* name;
    Levels levels;
    SelectionOptions::Metric metric;
    Shown shown;
};
constexpr Contestant kBaseline{"uniform, isotropic", Levels::Uniform, SelectionOptions::Metric::Isotropic, Shown::Instances};
constexpr Contestant kFull{"full", Levels::Strips, SelectionOptions::Metric::View, Shown::Instances};
constexpr Contestant kFullUnderTransforms{"full, transforms", Levels::Strips, SelectionOptions::Metric::View,
                                          Shown::Transforms};
constexpr std::array<Contestant, 5> kContestants{
    kBaseline, Contestant{"uniform, view", Levels::Uniform, SelectionOptions::Metric::View, Shown::Instances},
    Contestant{"straight strips, view", Levels::StraightStrips, SelectionOptions::Metric::View, Shown::Instances}, kFull,
    kFullUnderTransforms};

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

/// On a square grid whose middle is the origin, a diagonal apart, each turned about the middle of its box.
std::vector<osg::Matrixd> gridOf(const osg::BoundingBox& box)
{
    const double spacing = 2.0 * static_cast<double>(box.radius());
    std::mt19937 random(1);
    std::vector<osg::Matrixd> placements;
    for (int k = 0; k < kSide * kSide; ++k) {
        const double x = k % kSide - 0.5 * (kSide - 1);
        const double y = k / kSide - 0.5 * (kSide - 1);
        placements.push_back(osg::Matrixd::translate(-osg::Vec3d(box.center())) *
                             osg::Matrixd::rotate(randomOrientation(random)) *
                             osg::Matrixd::translate(x * spacing, y * spacing, 0.0));
    }
    return placements;
}

/// The drawable, or one shared by transforms, at the placements.
osg::ref_ptr<osg::Node> sceneOf(const std::shared_ptr<const LodAsset>& asset, const Contestant& contestant,
                                double& spacing)
{
    SelectionOptions options;
    options.errorPixels = 1.0;
    options.metric = contestant.metric;
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    drawable->setOptions(options);
    spacing = 2.0 * static_cast<double>(drawable->getBoundingBox().radius());
    const std::vector<osg::Matrixd> placements = gridOf(drawable->getBoundingBox());
    if (contestant.shown == Shown::Instances) {
        const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(asset);
        instances->setOptions(options);
        instances->setPlacements(placements);
        return instances;
    }
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
    camera.getStats()->collectStats("rendering", true);
    camera.getStats()->collectStats("gpu", true);
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

/// Draws frames and tells what they took.
Json draw(const std::string& path, const Contestant& contestant, unsigned frames)
{
    std::string error;
    const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(kWidth, kHeight, error);
    if (!context) { throw std::runtime_error("no OpenGL without a window: " + error); }
    double spacing = 0.0;
    const osg::ref_ptr<osg::Node> scene =
        sceneOf(std::make_shared<const LodAsset>(readTlod(path)), contestant, spacing);
    SelectionTotals totals(findDrawables(*scene));
    osgViewer::Viewer viewer;
    viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
    viewer.setSceneData(scene);
    setUpCamera(*viewer.getCamera(), *context, spacing);
    viewer.realize();
    if (!viewer.isRealized()) { throw std::runtime_error("the OpenGL context could not be made"); }

    std::vector<unsigned> measured;
    std::uint64_t drawCalls = 0;
    for (unsigned frame = 0; frame < kWarmUpFrames + frames + kLateFrames; ++frame) {
        totals.beginFrame();
        const std::uint64_t before = drawCalls;
        viewer.frame();
        context->makeCurrent();
        glFinish(); // so that no frame waits for the one before
        drawCalls = DrawContext::of(*context->getState()).drawCalls() - before;
        if (frame >= kWarmUpFrames && frame < kWarmUpFrames + frames) {
            measured.push_back(viewer.getFrameStamp()->getFrameNumber());
        }
    }
    return {};
}

} // namespace

} // namespace osgTessLOD::benchmarks
