// SPDX-License-Identifier: MIT
// Selection of baked meshes of all kinds and sizes through cameras of all kinds.
#include <stress/RandomSource.h>
#include <stress/Stress.h>

#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <support/ScreenDeviation.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <limits>
#include <memory>

namespace osgTessLOD::stress {
namespace {

/// What a random mesh was baked to, and what its drawings are compared with.
struct Model {
    bake::PatchedSurface surface;
    LodAsset asset;
    std::unique_ptr<PatchSelector> selector;
    std::unique_ptr<ScreenDeviation> deviation;
};

std::string writeMesh(const TemporaryDirectory& folder, const SourceMesh& mesh)
{
    SurfaceMesh surface;
    for (const Vector3d& p : mesh.positions) { surface.positions.push_back({p.x(), p.y(), p.z()}); }
    surface.triangles = mesh.triangles;
    const std::string path = folder.file("source.ply");
    writePly(path, surface);
    return path;
}

std::unique_ptr<Model> randomModel(Kind kind, SourceRandom& random)
{
    const TemporaryDirectory folder;
    const Similarity place{random.rotation(), random.magnitude(1e-6, 1e9),
                           random.direction() * (random.chance(0.3) ? 0.0 : random.magnitude(1.0, 1e6))};
    bake::BakeOptions options;
    options.maxFactor = 4U << random.below(2);
    options.controlMesh.patches = 4 + random.below(8);
    options.patchTolerance = 0.05;
    options.tolerance = random.chance(0.5) ? 0.0 : 1e-4;
    options.technique = random.chance(0.5) ? "strips" : "uniform";
    bake::Progress progress;
    bake::BakeReport report;
    auto model = std::make_unique<Model>();
    model->surface = bake::makeLevels(writeMesh(folder, place(randomSource(kind, random))), options, progress, report);
    model->asset = bake::assembleAsset(*model->surface.map, model->surface.charts, model->surface.hierarchy,
                                       options.tolerance, progress);
    model->selector = std::make_unique<PatchSelector>(model->asset);
    model->deviation = std::make_unique<ScreenDeviation>(model->surface, model->asset);
    return model;
}

osg::Vec3d vertexOf(const LodAsset& asset, SourceRandom& random)
{
    const std::vector<LodVertex>& vertices = asset.levels.front().vertices; // three per patch
    const std::uint32_t v = random.below(static_cast<std::uint32_t>(vertices.size()));
    const auto p = asset.position(asset.patches[v / 3], vertices[v]);
    return {p[0], p[1], p[2]};
}

osg::Vec3d toOsg(const Vector3d& v)
{
    return {v.x(), v.y(), v.z()};
}

/// Depth grows from far to near, or ends nowhere, or both: selection looks at x, y and w alone.
void turnDepth(osg::Matrixd& projection, SourceRandom& random)
{
    if (random.chance(0.3)) { projection(2, 2) = -1.0; }
    if (random.chance(0.3)) { projection = projection * osg::Matrixd::scale(1.0, 1.0, -1.0); }
}

/// On a vertex, between two of them, anywhere from 10⁻⁴ to 10⁶ of the model's size from one; with fields of view of 0.1° to 179°,
/// orthographic, or of any viewport up to 32,768 pixels.
ScreenCamera randomCamera(const LodAsset& asset, SourceRandom& random)
{
    osg::Vec3d low(asset.boundsMin[0], asset.boundsMin[1], asset.boundsMin[2]);
    const osg::Vec3d high(asset.boundsMax[0], asset.boundsMax[1], asset.boundsMax[2]);
    const double size = (high - low).length();
    const osg::Vec3d target = vertexOf(asset, random);
    osg::Vec3d eye = target;
    const double where = random.between(0.0, 1.0);
    if (where < 0.2) {
        eye = vertexOf(asset, random);
    } else if (where < 0.4) {
        eye = target + (vertexOf(asset, random) - target) * random.between(0.0, 1.0);
    } else {
        eye = target + toOsg(random.direction()) * size * random.magnitude(1e-4, 1e6);
    }
    ScreenCamera camera;
    const osg::Vec3d center = (target - eye).length() > 1e-9 * size ? target : eye + toOsg(random.direction()) * size;
    camera.localToEye = osg::Matrixd::lookAt(eye, center, toOsg(random.direction()));
    const double unit = random.magnitude(1e-9, 1e9); // of eye space
    camera.localToEye = camera.localToEye * osg::Matrixd::scale(unit, unit, unit);
    constexpr double kSizes[] = {1.0, 64.0, 1000.0, 32768.0};
    camera.width = kSizes[random.below(4)];
    camera.height = kSizes[random.below(4)];
    const double near = 1e-6 * size * unit;
    if (random.chance(0.15)) {
        const double half = size * unit * random.magnitude(1e-3, 1e3);
        camera.projection.makeOrtho(-half, half, -half, half, near, 1e9 * near);
    } else {
        const double angle = random.chance(0.5) ? random.magnitude(0.1, 10.0) : 179.0 - random.magnitude(1e-3, 170.0);
        camera.projection.makePerspective(angle, camera.width / camera.height, near, 1e9 * near);
        turnDepth(camera.projection, random);
    }
    return camera;
}

SelectionOptions randomSelection(SourceRandom& random)
{
    SelectionOptions options;
    options.errorPixels = random.magnitude(1e-3, 100.0);
    options.metric = random.chance(0.7) ? SelectionOptions::Metric::View : SelectionOptions::Metric::Isotropic;
    options.bound = random.chance(0.7) ? SelectionOptions::Bound::Conservative : SelectionOptions::Bound::FirstOrder;
    return options;
}

/// Levels that exist, the same on both sides of a border, and no coarser where less error is asked for.
void expectSoundLevels(const Model& model, const SelectionView& view, const SelectionOptions& options,
                       const PatchRecords& records)
{
    SelectionOptions finer = options;
    finer.errorPixels *= 0.5;
    std::vector<float> levels;
    for (std::uint32_t edge = 0; edge < model.asset.edges.size(); ++edge) {
        levels.push_back(model.selector->edgeLevel(edge, view, options).level);
        ASSERT_GE(levels.back(), 0.0F);
        ASSERT_LE(levels.back(), static_cast<float>(model.asset.edges[edge].finestLevel));
        ASSERT_GE(model.selector->edgeLevel(edge, view, finer).level, levels.back());
    }
    for (const PatchRecord& record : records) {
        for (std::size_t side = 0; side < 3; ++side) {
            ASSERT_EQ(record.edgeLevels[side], levels[model.asset.patches[record.patch].edges[side]]);
        }
    }
}

/// Pixels that a displacement of unit length within the patch makes at most, as render/LevelNeed.cpp derives it; infinite with the
/// eye within the patch's sphere.
double pixelsPerLength(const SelectionView& view, const LodPatch& patch)
{
    if (view.orthographic) { return view.pixelScale; }
    const osg::Vec3d toCenter = osg::Vec3d(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]) - view.eye;
    const double distance = toCenter.length();
    const double radius = patch.boundRadius;
    if (distance <= radius) { return std::numeric_limits<double>::infinity(); }
    const double sine = radius / distance;
    const double axial = std::clamp(toCenter * view.axis / distance, -1.0, 1.0);
    const double leastCosine =
        std::max(axial * std::sqrt(1.0 - sine * sine) - std::sqrt(1.0 - axial * axial) * sine, view.leastCosine);
    const double depth = std::max(distance * axial - radius, (distance - radius) * leastCosine);
    return depth > 0.0 ? view.pixelScale / (leastCosine * depth) : std::numeric_limits<double>::infinity();
}

/// What the comparison itself is off by: positions are drawn in single precision, two units in the last place off
/// (ShaderTwins.SurfacesHaveTheTwinsBits), and parameters are rounded to the chart's lattice, half a unit of 49,152 a side.
double roundingOf(const LodPatch& patch)
{
    double farthest = 0.0;
    for (const float x : patch.boundCenter) {
        farthest = std::max(farthest, std::fabs(double{x}) + double{patch.boundRadius});
    }
    return 2.0 * std::sqrt(3.0) * std::ldexp(farthest, -23) + 2.0 * double{patch.boundRadius} / ChartPoint::kUnits;
}

struct BoundFigures {
    Worst ratio; ///< of what is seen and what was asked for, but for rounding
    std::size_t patches = 0;
    std::size_t refined = 0;
};

void expectBound(const Model& model, const ScreenCamera& camera, const SelectionOptions& options,
                 const PatchRecords& records, SourceRandom& random, BoundFigures& figures)
{
    const SelectionView view = camera.view();
    constexpr unsigned kMostCompared = 3; // overlays take their time
    for (unsigned k = 0; k < kMostCompared && !records.empty(); ++k) {
        const PatchRecord& record = records[random.below(static_cast<std::uint32_t>(records.size()))];
        if (hasSaturatedBorder(model.asset, *model.selector, record.patch, view, options)) { continue; }
        const LodPatch& patch = model.asset.patches[record.patch];
        const double allowed = options.errorPixels * (1.0 + 1e-6) + roundingOf(patch) * pixelsPerLength(view, patch);
        const double seen = model.deviation->pixels(record, camera);
        ASSERT_LE(seen, allowed) << "patch " << record.patch;
        figures.ratio.add(seen / allowed);
        ++figures.patches;
        figures.refined += MorphedSurface::drawnLevel(record.edgeLevels) > 0 ? 1 : 0;
    }
}

TEST(SelectionStress, LevelsAreSoundAndTheBoundIsKeptThroughAnyCamera)
{
    constexpr auto kKinds = static_cast<std::uint32_t>(Kind::kCount);
    BoundFigures figures;
    for (unsigned k = 0; k < trials(kKinds); ++k) {
        SourceRandom random(2000 + k);
        const auto kind = static_cast<Kind>(k % kKinds);
        SCOPED_TRACE(std::string(nameOf(kind)) + ", trial " + std::to_string(k));
        const std::unique_ptr<Model> model = randomModel(kind, random);
        for (unsigned v = 0; v < 60; ++v) {
            SCOPED_TRACE("view " + std::to_string(v));
            const ScreenCamera camera = randomCamera(model->asset, random);
            const SelectionView view = camera.view();
            const SelectionOptions options = randomSelection(random);
            const auto result = model->selector->select(view, options, camera.sides());
            expectSoundLevels(*model, view, options, result.records);
            if (options.bound == SelectionOptions::Bound::Conservative) {
                expectBound(*model, camera, options, result.records, random, figures);
            }
            if (testing::Test::HasFatalFailure()) { return; }
        }
    }
    EXPECT_GT(figures.patches, 30U);
    EXPECT_GT(figures.refined, 5U);
    report("patches compared", static_cast<double>(figures.patches));
    report("of them above the coarsest level", static_cast<double>(figures.refined));
    report("worst deviation in terms of what is allowed", figures.ratio.value());
}

TEST(SelectionStress, WithoutPixelsEverythingIsCoarse)
{
    SourceRandom random(1);
    const std::unique_ptr<Model> model = randomModel(Kind::Ball, random);
    for (unsigned k = 0; k < trials(20); ++k) {
        ScreenCamera camera = randomCamera(model->asset, random);
        (random.chance(0.5) ? camera.width : camera.height) = 0.0;
        const SelectionOptions options = randomSelection(random);
        for (const PatchRecord& record : model->selector->select(camera.view(), options, {}).records) {
            ASSERT_EQ(record.edgeLevels, (std::array<float, 3>{}));
        }
    }
}

} // namespace
} // namespace osgTessLOD::stress
