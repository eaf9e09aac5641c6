// SPDX-License-Identifier: MIT
// Deformed control meshes: what the GPU draws of them is its CPU twin's to the bit, closed and lit as it lies; what is selected,
// culled and met follows the pose.
#include <render/ClosedSurface.h>
#include <render/GlTest.h>
#include <render/PlainTwin.h>
#include <render/Poses.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <support/RandomDirection.h>
#include <support/ScreenCamera.h>

#include <osg/GLExtensions>
#include <osg/Material>
#include <osg/MatrixTransform>
#include <osgUtil/IntersectionVisitor>
#include <osgUtil/LineSegmentIntersector>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <utility>

namespace osgTessLOD {
namespace {

constexpr int kPoses = 60;

using Triangle = std::array<std::array<std::uint32_t, 3>, 3>; ///< bits of coordinates

std::uint32_t bitsOf(float number)
{
    std::uint32_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    return bits;
}

Triangle bitsOf(const std::array<osg::Vec3f, 3>& corners)
{
    Triangle t{};
    for (std::size_t c = 0; c < 3; ++c) {
        t[c] = {bitsOf(corners[c].x()), bitsOf(corners[c].y()), bitsOf(corners[c].z())};
    }
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

/// Any levels that a selection could have: one per edge, up to its finest; often whole numbers.
std::vector<PatchRecord> randomRecords(const LodAsset& asset, std::mt19937& random)
{
    std::vector<float> levels;
    for (const LodEdge& edge : asset.edges) {
        const auto finest = static_cast<float>(edge.finestLevel);
        const float level = std::uniform_real_distribution<float>(0.0F, finest)(random);
        levels.push_back(random() % 4 == 0 ? std::round(level) : level);
    }
    std::vector<PatchRecord> records;
    for (std::uint32_t p = 0; p < asset.patches.size(); ++p) {
        const auto& edges = asset.patches[p].edges;
        records.push_back({p, {levels[edges[0]], levels[edges[1]], levels[edges[2]]}});
    }
    std::stable_sort(records.begin(), records.end(), [](const PatchRecord& a, const PatchRecord& b) {
        return MorphedSurface::drawnLevel(a.edgeLevels) < MorphedSurface::drawnLevel(b.edgeLevels);
    });
    return records;
}

class Deformation : public GlTest, public testing::WithParamInterface<Backend> {
protected:
    Deformation() { backend = GetParam(); }

    std::vector<osg::Vec3f> captureDeformed(const GpuAsset& asset, const std::vector<PatchRecord>& records,
                                            const ControlMeshDeformation* deformation,
                                            const std::string& varying = "tessLodObjectPosition")
    {
        const osg::ref_ptr<PatchSelection> selection = new PatchSelection(
            &asset, records, asset.selector().statisticsOf(records), SelectionView(), backend, {}, deformation);
        return selection->capture(renderInfo, varying);
    }

    static void expectEqualToTwin(const GpuAsset& asset, const std::vector<PatchRecord>& records,
                                  const ControlMeshDeformation& deformation, const std::vector<osg::Vec3f>& captured)
    {
        std::size_t at = 0;
        for (const PatchRecord& record : records) {
            std::vector<Triangle> twins;
            std::vector<Triangle> drawn;
            const TessellationPattern pattern(asset.asset().ladder[MorphedSurface::drawnLevel(record.edgeLevels)]);
            for (const TessellationPattern::Triangle& t : pattern.triangles()) {
                std::array<osg::Vec3f, 3> corners;
                for (std::size_t c = 0; c < 3; ++c) {
                    const auto p = asset.surface().tessLodSurfacePoint(record.patch, record.edgeLevels, t[c]);
                    corners[c] = deformation.tessLodDeformed({p.position[0], p.position[1], p.position[2]}, p.weights,
                                                             record.patch);
                }
                twins.push_back(bitsOf(corners));
                ASSERT_LE(at + 3, captured.size());
                drawn.push_back(bitsOf({captured[at], captured[at + 1], captured[at + 2]}));
                at += 3;
            }
            std::sort(twins.begin(), twins.end());
            std::sort(drawn.begin(), drawn.end());
            ASSERT_EQ(drawn, twins) << "patch " << record.patch;
        }
        EXPECT_EQ(at, captured.size());
    }

    void expectSound(LodAsset made, unsigned seed, bool isClosed = true)
    {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(std::move(made));
        std::mt19937 random(seed);
        for (int pose = 0; pose < kPoses && !HasFatalFailure() && !HasNonfatalFailure(); ++pose) {
            const std::vector<PatchRecord> records = randomRecords(asset->asset(), random);
            const double time = 0.1 * pose;
            const osg::ref_ptr<ControlMeshDeformation> deformation =
                pose % 3 == 0   ? deformed(*asset, waves, time)
                : pose % 3 == 1 ? deformed(*asset, bending, time)
                                : wildlyDeformed(*asset, static_cast<unsigned>(pose));
            const std::vector<osg::Vec3f> captured = captureDeformed(*asset, records, deformation.get());
            ASSERT_FALSE(captured.empty());
            expectEqualToTwin(*asset, records, *deformation, captured);
            if (isClosed) { EXPECT_EQ(unmatchedEdges(captured), 0U) << "pose " << pose; }
        }
    }
};

TEST_P(Deformation, everyPoseIsClosedAndEqualToTheTwin)
{
    expectSound(makeSyntheticMixedAsset(16), 1);
    expectSound(synthetic::build(synthetic::bumpySphere(), {1, 2, 4, 6, 8, 12, 16, 24, 32}, false), 2);
}

TEST_P(Deformation, parametersAreBlendedByWithNormalsAndWithout)
{
    expectSound(makeSyntheticDisplacedAsset(16, true), 3);
    expectSound(makeSyntheticDisplacedAsset(16, false), 4);
}

TEST_P(Deformation, attributesAndOpenBordersAreDrawnToo)
{
    expectSound(withAttributes(makeSyntheticSheet(16, 2, true)), 5, false);
}

TEST_P(Deformation, assetsInPagesAreDeformedAlike)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticDisplacedAsset(16, false));
    std::mt19937 random(6);
    for (const std::int64_t limit : {1300, 700}) {
        DrawContext::of(state()).limitTextureBufferTexels(limit);
        EXPECT_GT(asset->pagesFor(state())->size(), 1U);
        const osg::ref_ptr<ControlMeshDeformation> deformation = deformed(*asset, bending, 1.0);
        const std::vector<PatchRecord> records = randomRecords(asset->asset(), random);
        std::vector<osg::Vec3f> captured = captureDeformed(*asset, records, deformation.get());
        EXPECT_EQ(captured.size(), 3 * asset->selector().statisticsOf(records).triangles);
        EXPECT_EQ(unmatchedEdges(captured), 0U);
    }
}

TEST_P(Deformation, theIdentityDrawsTheSameBits)
{
    for (const LodAsset& made : {makeSyntheticMixedAsset(16), makeSyntheticDisplacedAsset(16, true)}) {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(made);
        std::mt19937 random(7);
        const std::vector<PatchRecord> records = randomRecords(asset->asset(), random);
        const osg::ref_ptr<ControlMeshDeformation> identity = new ControlMeshDeformation(asset.get(), {});
        EXPECT_EQ(captureDeformed(*asset, records, identity.get()), captureDeformed(*asset, records, nullptr));
    }
}

TEST_P(Deformation, whatIsNoTransformLeavesItsVertexInPlace)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticAsset(8, false));
    std::vector<osg::Matrixd> transforms = poseOf(asset->asset(), turning, 0.5);
    transforms[0](0, 0) = std::numeric_limits<double>::quiet_NaN();
    transforms[1](3, 1) = std::numeric_limits<double>::infinity();
    transforms[2](1, 3) = 0.5; // perspective
    transforms[3](2, 2) = 1e39;
    transforms.resize(5);
    const osg::ref_ptr<ControlMeshDeformation> odd = new ControlMeshDeformation(asset.get(), transforms);
    std::vector<osg::Matrixd> expected(4);
    expected.push_back(transforms[4]);
    expected.resize(7);
    const osg::ref_ptr<ControlMeshDeformation> same = new ControlMeshDeformation(asset.get(), expected);
    std::mt19937 random(8);
    const std::vector<PatchRecord> records = randomRecords(asset->asset(), random);
    EXPECT_EQ(captureDeformed(*asset, records, odd.get()), captureDeformed(*asset, records, same.get()));
    EXPECT_TRUE(odd->bounds().valid());
    EXPECT_EQ(odd->bounds()._max, same->bounds()._max);
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, Deformation, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

// -------------------------------------------------------------------------------------------------- selection ---

ScreenCamera lookingAt(const osg::Vec3d& center, double distance, unsigned seed)
{
    std::mt19937_64 random(seed);
    ScreenCamera camera;
    camera.width = 640.0;
    camera.height = 480.0;
    const osg::Vec3d target = center + randomDirection(random) * 0.8;
    camera.localToEye =
        osg::Matrixd::lookAt(target + randomDirection(random) * distance, target, randomDirection(random));
    camera.projection.makePerspective(35.0, camera.width / camera.height, 0.01, 1000.0);
    return camera;
}

/// Deformed, at the patch's finest level.
std::vector<osg::Vec3d> finestVertices(const GpuAsset& asset, const ControlMeshDeformation& deformation,
                                       std::uint32_t patch)
{
    std::vector<osg::Vec3d> vertices;
    std::array<float, 3> levels{};
    for (std::size_t side = 0; side < 3; ++side) {
        levels[side] = asset.asset().edges[asset.asset().patches[patch].edges[side]].finestLevel;
    }
    const unsigned factor = asset.asset().ladder[MorphedSurface::drawnLevel(levels)];
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
        const auto p = asset.surface().tessLodSurfacePoint(patch, levels, v);
        vertices.push_back(
            deformation.tessLodDeformed({p.position[0], p.position[1], p.position[2]}, p.weights, patch));
    }
    return vertices;
}

TEST(DeformedSelection, patchesInViewAreDrawnAndOthersAreNot)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticSheet(8, 6, false));
    std::size_t culled = 0;
    std::size_t drawn = 0;
    for (unsigned pose = 0; pose < kPoses; ++pose) {
        const osg::ref_ptr<ControlMeshDeformation> deformation =
            pose % 4 == 3 ? wildlyDeformed(*asset, pose) : deformed(*asset, bending, 0.1 * pose);
        const ScreenCamera camera = lookingAt(deformation->bounds().center(), 2.0, pose);
        std::vector<bool> isDrawn(asset->asset().patches.size(), false);
        const auto selected = deformation->selector().select(camera.view(), SelectionOptions(), camera.sides());
        for (const PatchRecord& record : selected.records) { isDrawn[record.patch] = true; }
        culled += selected.statistics.culledPatches;
        drawn += selected.records.size();
        for (std::uint32_t p = 0; p < isDrawn.size(); ++p) {
            const BoundSphere& sphere = deformation->selector().deformedSphere(p);
            for (const osg::Vec3d& at : finestVertices(*asset, *deformation, p)) {
                ASSERT_TRUE(deformation->bounds().contains(at)) << "pose " << pose;
                ASSERT_LE((at - osg::Vec3d(sphere.center)).length(), sphere.radius) << "pose " << pose;
                const auto sides = camera.sides();
                const bool isInView = std::all_of(sides.begin(), sides.end(),
                                                  [&](const osg::Plane& side) { return side.distance(at) >= 0.0; });
                ASSERT_TRUE(isDrawn[p] || !isInView) << "pose " << pose << ", patch " << p;
            }
        }
    }
    EXPECT_GT(culled, 500U);
    EXPECT_GT(drawn, 500U);
}

TEST(DeformedSelection, whatIsTurnedIsSelectedAsUnderATransform)
{
    // Spheres are made larger by 10⁻⁶ of their coordinates, and a level is gone through while the error changes by a tenth.
    constexpr float kTolerance = 2e-3F;
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticMixedAsset(16));
    std::size_t between = 0;
    for (unsigned pose = 0; pose < kPoses; ++pose) {
        const osg::Matrixd placement = turning(osg::Vec3d(), 0.1 * pose);
        const osg::ref_ptr<ControlMeshDeformation> deformation = deformed(*asset, turning, 0.1 * pose);
        ScreenCamera camera = lookingAt(deformation->bounds().center(), 1.5 + 0.3 * pose, pose);
        SelectionOptions options;
        options.errorPixels = 0.5 + pose % 7;
        const auto turned = deformation->selector().select(camera.view(), options, camera.sides());
        camera.localToEye.preMult(placement);
        const auto expected = asset->selector().select(camera.view(), options, camera.sides());
        std::map<std::uint32_t, std::array<float, 3>> levels;
        for (const PatchRecord& record : expected.records) { levels[record.patch] = record.edgeLevels; }
        ASSERT_EQ(turned.records.size(), levels.size()) << "pose " << pose;
        for (const PatchRecord& record : turned.records) {
            for (std::size_t side = 0; side < 3; ++side) {
                const float level = levels.at(record.patch)[side];
                ASSERT_NEAR(record.edgeLevels[side], level, kTolerance) << "pose " << pose;
                between += level != std::floor(level) ? 1 : 0;
            }
        }
    }
    EXPECT_GT(between, 10U);
}

// ------------------------------------------------------------------------------------------------- in a scene ---

std::shared_ptr<const LodAsset> shared(LodAsset asset)
{
    return std::make_shared<const LodAsset>(std::move(asset));
}

TEST(DeformedDrawable, sharesItsDeformationAndForgetsItWithTheAsset)
{
    WarningCollector warnings;
    const auto asset = shared(makeSyntheticAsset(8, false));
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    const osg::BoundingBox undeformed = drawable->getBoundingBox();
    const osg::ref_ptr<ControlMeshDeformation> pose = deformed(*drawable->getGpuAsset(), turning, 1.0);
    drawable->setDeformation(pose);
    EXPECT_EQ(drawable->getBoundingBox()._min, pose->bounds()._min);
    for (const auto how : {osg::CopyOp::SHALLOW_COPY, osg::CopyOp::DEEP_COPY_ALL}) {
        const osg::ref_ptr<TessLODDrawable> copy = osg::clone(drawable.get(), how);
        EXPECT_EQ(copy->getDeformation(), pose.get());
        EXPECT_EQ(copy->getBoundingBox()._max, pose->bounds()._max);
    }
    drawable->setDeformation(nullptr);
    EXPECT_EQ(drawable->getBoundingBox()._min, undeformed._min);
    const osg::ref_ptr<TessLODDrawable> sibling = new TessLODDrawable(asset); // with GL objects of its own
    sibling->setDeformation(pose);
    EXPECT_EQ(sibling->getDeformation(), pose.get());
    sibling->setAsset(shared(makeSyntheticAsset(8, false)));
    EXPECT_EQ(sibling->getDeformation(), nullptr);
    EXPECT_EQ(warnings.text(), "");
    sibling->setDeformation(pose);
    EXPECT_EQ(sibling->getDeformation(), nullptr);
    EXPECT_NE(warnings.text().find("another asset"), std::string::npos);
}

double heightOfHit(osg::Node& scene)
{
    const osg::ref_ptr<osgUtil::LineSegmentIntersector> line =
        new osgUtil::LineSegmentIntersector(osg::Vec3d(0.1, 0.05, 50.0), osg::Vec3d(0.1, 0.05, -50.0));
    osgUtil::IntersectionVisitor visitor(line.get());
    scene.accept(visitor);
    return line->containsIntersections() ? line->getFirstIntersection().getWorldIntersectPoint().z() : 1e9;
}

TEST(DeformedDrawable, isMetWhereItIsPosed)
{
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(shared(makeSyntheticAsset(16, false)));
    const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(drawable->getAsset());
    instances->setPlacements({osg::Matrixd::translate(0.0, 0.0, 10.0)});
    const double before = heightOfHit(*drawable);
    for (const double height : {1.0, -2.0, 0.0}) {
        const Motion raised = [=](const osg::Vec3d&, double) { return osg::Matrixd::translate(0.0, 0.0, height); };
        const osg::ref_ptr<ControlMeshDeformation> pose = deformed(*drawable->getGpuAsset(), raised, 0.0);
        drawable->setDeformation(pose);
        instances->setDeformation(pose);
        EXPECT_NEAR(heightOfHit(*drawable), before + height, 1e-5);
        EXPECT_NEAR(heightOfHit(*instances), before + height + 10.0, 1e-5);
    }
}

/// A viewer with one camera at (0, 0, 7), and what was captured and seen at the end of its last frame.
class DeformedScene : public testing::Test {
protected:
    static constexpr int kSize = 160;

    DeformedScene()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        osg::Camera& camera = *viewer.getCamera();
        setUpHeadless(camera, kSize, kSize);
        camera.setViewMatrixAsLookAt(osg::Vec3d(0.0, 0.0, 7.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
        camera.setFinalDrawCallback(snapshot.get());
        viewer.realize();
    }
    ~DeformedScene() override { EXPECT_EQ(warnings.text(), ""); }

    const osg::Image& picture(osg::Node& scene)
    {
        if (viewer.getSceneData() != &scene) {
            viewer.setSceneData(&scene);
            viewer.frame(); // in which the faster backend is found
        }
        viewer.frame();
        return snapshot->image();
    }

    WarningCollector warnings;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osgViewer::Viewer viewer;
};

/// Mean difference of channels, of 255, over pixels that both pictures cover.
double meanDifference(const osg::Image& a, const osg::Image& b)
{
    double sum = 0.0;
    std::size_t count = 0;
    for (int y = 0; y < a.t(); ++y) {
        for (int x = 0; x < a.s(); ++x) {
            const unsigned char* p = a.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
            const unsigned char* q = b.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
            if (p[0] != p[2] || q[0] != q[2]) { continue; } // the background is blue
            sum += std::abs(p[0] - q[0]);
            ++count;
        }
    }
    EXPECT_GT(count, 1000U);
    return sum / static_cast<double>(count);
}

TEST_F(DeformedScene, isLitAsItLies)
{
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(shared(makeSyntheticDisplacedAsset(32, true)));
    SelectionOptions options;
    options.errorPixels = 0.01;
    drawable->setOptions(options);
    const osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    drawable->setSelectionObserver(observer.get());
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(drawable.get());
    const osg::ref_ptr<osg::Material> gray = new osg::Material; // whatever colours there are
    scene->getOrCreateStateSet()->setAttribute(gray.get());
    const Motion mirrored = [](const osg::Vec3d&, double) { return osg::Matrixd::scale(-1.0, 0.6, 0.8); };
    const Motion shifted = [](const osg::Vec3d& at, double) { // moves, and turns nothing
        return osg::Matrixd::translate(0.0, 0.0, 0.7 * at.x());
    };
    // Pictures of triangles with normals of their own differ by 1.9 as it is. By Σ wᵢ Aᵢ alone it is 2.9, 5.9, 13.8 and 1.9, by
    // normals that are not turned 3.6, 9.6, 13.8 and 7.6.
    struct Case {
        Motion motion;
        double most;
    };
    for (const auto& [motion, most] : {Case{waves, 2.6}, Case{bending, 4.2}, Case{shifted, 6.5}, Case{mirrored, 2.3}}) {
        const bool isMirror = most == 2.3;
        drawable->setDeformation(deformed(*drawable->getGpuAsset(), motion, 1.0));
        const osg::ref_ptr<osg::Image> drawn = osg::clone(&picture(*scene), osg::CopyOp::DEEP_COPY_ALL);
        const auto entries = observer->take();
        viewer.getCamera()->getGraphicsContext()->makeCurrent();
        osg::RenderInfo renderInfo(viewer.getCamera()->getGraphicsContext()->getState(), nullptr);
        std::vector<osg::Vec3f> corners = entries.back().selection->capture(renderInfo);
        viewer.getCamera()->getGraphicsContext()->releaseContext();
        for (std::size_t k = 0; k < corners.size() && isMirror; k += 3) { std::swap(corners[k], corners[k + 1]); }
        const osg::ref_ptr<osg::Geometry> plain = plainGeometry(corners);
        const osg::ref_ptr<osg::Group> other = new osg::Group;
        other->addChild(plain.get());
        other->setStateSet(scene->getStateSet());
        EXPECT_LT(meanDifference(*drawn, picture(*other)), most);
    }
}

TEST_F(DeformedScene, instancesShareThePose)
{
    const auto asset = shared(makeSyntheticAsset(16, true));
    const std::vector<osg::Matrixd> placements{osg::Matrixd::translate(-0.9, 0.0, 0.0),
                                               osg::Matrixd::rotate(1.0, 0.2, 1.0, 0.0) *
                                                   osg::Matrixd::translate(0.9, 0.3, -1.0)};
    const osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(asset);
    const osg::ref_ptr<ControlMeshDeformation> pose = deformed(*instances->getGpuAsset(), bending, 1.0);
    instances->setPlacements(placements);
    instances->setDeformation(pose);
    const osg::ref_ptr<osg::Group> group = new osg::Group;
    for (const osg::Matrixd& placement : placements) {
        const osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(placement);
        const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
        drawable->setDeformation(pose);
        transform->addChild(drawable.get());
        group->addChild(transform.get());
    }
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    scene->addChild(instances.get());
    const osg::ref_ptr<osg::Image> drawn = osg::clone(&picture(*scene), osg::CopyOp::DEEP_COPY_ALL);
    EXPECT_LE(differingPixels(*drawn, picture(*group), 8), 10U);
}

TEST_F(DeformedScene, theControlShaderLeavesSelectionToTheProcessor)
{
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(shared(makeSyntheticAsset(16, true)));
    SelectionOptions options;
    options.selector = SelectionOptions::Selector::Gpu;
    drawable->setOptions(options);
    const osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    drawable->setSelectionObserver(observer.get());
    drawable->setDeformation(deformed(*drawable->getGpuAsset(), bending, 1.0));
    picture(*drawable);
    EXPECT_FALSE(observer->take().back().selection->isSelectedWhenDrawn());
    drawable->setDeformation(nullptr);
    picture(*drawable);
    EXPECT_TRUE(observer->take().back().selection->isSelectedWhenDrawn());
}

TEST_F(DeformedScene, aThousandPosesLeaveNothingBehind)
{
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(shared(makeSyntheticAsset(4, true)));
    const auto objectsAfter = [&](int frames) {
        for (int frame = 0; frame < frames; ++frame) {
            drawable->setDeformation(deformed(*drawable->getGpuAsset(), bending, 0.01 * frame));
            picture(*drawable);
        }
        osg::GraphicsContext& context = *viewer.getCamera()->getGraphicsContext();
        context.makeCurrent();
        const auto* gl = context.getState()->get<osg::GLExtensions>();
        std::size_t count = 0;
        for (GLuint name = 1; name < 10'000; ++name) {
            count += (gl->glIsBuffer(name) != 0 ? 1 : 0) + (glIsTexture(name) != 0 ? 1 : 0);
        }
        context.releaseContext();
        return count;
    };
    const std::size_t before = objectsAfter(20);
    EXPECT_LE(objectsAfter(1000), before + 2);
}

} // namespace
} // namespace osgTessLOD
