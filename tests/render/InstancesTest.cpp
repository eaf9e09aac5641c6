// SPDX-License-Identifier: MIT
// One drawable at many placements is what as many drawables under transforms are: in what is selected, captured, seen and met.
#include <render/GlTest.h>
#include <render/PlainTwin.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/LightModel>
#include <osg/TriangleFunctor>
#include <osgUtil/IntersectionVisitor>
#include <osgUtil/LineSegmentIntersector>
#include <osgUtil/PolytopeIntersector>
#include <osgUtil/Statistics>

#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <set>

namespace osgTessLOD {
namespace {

constexpr int kSize = 240;

using Matrices = std::vector<osg::Matrixd>;

std::shared_ptr<const LodAsset> shared(LodAsset asset)
{
    return std::make_shared<const LodAsset>(std::move(asset));
}

/// Of every kind: as it is, moved, turned, scaled, stretched, sheared, mirrored.
Matrices variedPlacements()
{
    osg::Matrixd sheared;
    sheared(1, 0) = 0.8;
    sheared(2, 1) = -0.4;
    const osg::Vec3d tilted(1.0, 2.0, 0.5);
    return {osg::Matrixd(),
            osg::Matrixd::translate(0.0, 2.75, 0.0),
            osg::Matrixd::rotate(0.7, tilted) * osg::Matrixd::translate(0.0, -3.0, 0.0),
            osg::Matrixd::scale(0.5, 0.5, 0.5) * osg::Matrixd::translate(0.0, 0.0, 2.5),
            osg::Matrixd::scale(0.3, 1.5, 0.6) * osg::Matrixd::rotate(1.1, tilted) *
                osg::Matrixd::translate(0.5, 2.5, 2.5),
            sheared * osg::Matrixd::translate(-1.0, 0.0, -3.0),
            osg::Matrixd::scale(-0.9, 0.9, 0.9) * osg::Matrixd::rotate(2.0, tilted) *
                osg::Matrixd::translate(0.0, -2.5, 2.5),
            osg::Matrixd::scale(1.0, -0.4, 1.2) * osg::Matrixd::translate(1.0, 3.0, -2.5)};
}

/// side × side of them, turned, in the plane of the ground.
Matrices grid(int side, double spacing = 2.5)
{
    Matrices placements;
    for (int k = 0; k < side * side; ++k) {
        placements.push_back(osg::Matrixd::rotate(0.7 * k, 0.0, 0.0, 1.0) *
                             osg::Matrixd::translate((k % side) * spacing, (k / side) * spacing, 0.0));
    }
    return placements;
}

osg::ref_ptr<TessLODInstances> makeInstances(const std::shared_ptr<const LodAsset>& asset, const Matrices& placements)
{
    osg::ref_ptr<TessLODInstances> instances = new TessLODInstances(asset);
    instances->setPlacements(placements);
    return instances;
}

osg::ref_ptr<osg::Group> underTransforms(TessLODDrawable& drawable, const Matrices& placements)
{
    osg::ref_ptr<osg::Group> group = new osg::Group;
    for (const osg::Matrixd& placement : placements) {
        const osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(placement);
        transform->addChild(&drawable);
        group->addChild(transform);
    }
    return group;
}

/// What was selected for a placement, and the triangles that came of it.
struct Placed {
    std::vector<PatchRecord> records;
    std::vector<osg::Vec3f> corners;

    bool hasSameRecords(const Placed& other) const
    {
        return records.size() == other.records.size() &&
               std::memcmp(records.data(), other.records.data(), records.size() * sizeof(PatchRecord)) == 0;
    }
};
using PlacedByNumber = std::map<std::size_t, Placed>;

/// At the end of a camera's frame: captures every selection of the frame, and has what is in the context then be looked at.
class FrameCapture : public osg::Camera::DrawCallback {
public:
    explicit FrameCapture(const std::shared_ptr<const LodAsset>& asset)
        : _asset(asset)
    {
    }
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        entries = observer->take();
        corners.clear();
        for (const auto& entry : entries) { corners.push_back(entry.selection->capture(renderInfo)); }
        projection = renderInfo.getState()->getProjectionMatrix();
    }

    /// By camera. Selections in the order of visits to drawables under transforms, or of one of placements.
    PlacedByNumber placed(const Matrices& placements, const std::string& camera = "main") const
    {
        PlacedByNumber result;
        for (std::size_t e = 0; e < entries.size(); ++e) {
            if (entries[e].camera != camera || entries[e].records.empty()) { continue; }
            const RecordPlacements& where = entries[e].selection->placements();
            const auto at = std::find(placements.begin(), placements.end(), entries[e].localToWorld);
            std::size_t corner = 0;
            for (std::size_t k = 0; k < entries[e].records.size(); ++k) {
                const PatchRecord& record = entries[e].records[k];
                const std::size_t number =
                    where.set.valid() ? where.numbers[k] : static_cast<std::size_t>(at - placements.begin());
                const unsigned factor = _asset->ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
                const std::size_t end = corner + 3 * TessellationPattern::triangleCount(factor);
                result[number].records.push_back(record);
                if (end > corners[e].size()) {
                    ADD_FAILURE() << "too few triangles captured";
                    return result;
                }
                auto& to = result[number].corners;
                to.insert(to.end(), corners[e].begin() + static_cast<std::ptrdiff_t>(corner),
                          corners[e].begin() + static_cast<std::ptrdiff_t>(end));
                corner = end;
            }
            EXPECT_EQ(corner, corners[e].size());
        }
        return result;
    }
    SelectionStatistics statistics() const
    {
        SelectionStatistics sum;
        for (const auto& entry : entries) { sum.add(entry.selection->statistics()); }
        return sum;
    }

    osg::ref_ptr<RecordingObserver> observer = new RecordingObserver;
    mutable std::vector<RecordingObserver::Entry> entries;
    mutable std::vector<std::vector<osg::Vec3f>> corners;
    mutable osg::Matrixd projection;

private:
    std::shared_ptr<const LodAsset> _asset;
};

class Instances : public testing::TestWithParam<Backend> {
protected:
    Instances()
    {
        viewer.setThreadingModel(osgViewer::Viewer::SingleThreaded);
        setUpHeadless(camera(), kSize, kSize);
        camera().setName("main");
        camera().setClearColor(osg::Vec4(0.1F, 0.2F, 0.5F, 1.0F));
        camera().setFinalDrawCallback(snapshot.get());
        camera().setPostDrawCallback(capture.get());
        lookFrom({11.0, 1.0, 2.0}, osg::Vec3d());
        viewer.setSceneData(root.get());
        viewer.realize();
        viewer.renderingTraversals(); // a viewer's first frame is brighter
    }
    ~Instances() override { EXPECT_EQ(warnings.text(), ""); }

    osg::Camera& camera() { return *viewer.getCamera(); }
    osg::State& state() { return *camera().getGraphicsContext()->getState(); }
    void lookFrom(const osg::Vec3d& eye, const osg::Vec3d& at)
    {
        camera().setViewMatrixAsLookAt(eye, at, osg::Vec3d(0.0, 0.1, 1.0));
    }
    void use(LodAsset made, Matrices where)
    {
        asset = shared(std::move(made));
        placements = std::move(where);
        const osg::ref_ptr<FrameCapture> before = capture;
        capture = new FrameCapture(asset);
        camera().setPostDrawCallback(capture.get());
        drawable = new TessLODDrawable(asset);
        instances = makeInstances(asset, placements);
        transforms = underTransforms(*drawable, placements);
        for (TessLODDrawable* shown : {drawable.get(), static_cast<TessLODDrawable*>(instances.get())}) {
            shown->setSelectionObserver(capture->observer.get());
        }
        setOptions([](SelectionOptions&) {});
    }
    void setOptions(const std::function<void(SelectionOptions&)>& change)
    {
        SelectionOptions options = drawable->getOptions();
        options.backend = GetParam();
        change(options);
        drawable->setOptions(options);
        instances->setOptions(options);
    }
    void show(osg::Node& node)
    {
        root->removeChildren(0, root->getNumChildren());
        root->addChild(&node);
        viewer.renderingTraversals();
    }
    PlacedByNumber placedUnderTransforms(const std::string& from = "main")
    {
        show(*transforms);
        return capture->placed(placements, from);
    }
    PlacedByNumber placedAsInstances(const std::string& from = "main")
    {
        show(*instances);
        return capture->placed(placements, from);
    }
    osg::ref_ptr<osg::Image> pictureOf(osg::Node& node)
    {
        show(node);
        return osg::clone(&snapshot->image(), osg::CopyOp::DEEP_COPY_ALL);
    }
    void expectSameRecords()
    {
        const PlacedByNumber wanted = placedUnderTransforms();
        const PlacedByNumber found = placedAsInstances();
        ASSERT_EQ(found.size(), wanted.size());
        for (const auto& [number, placed] : wanted) {
            ASSERT_EQ(found.count(number), 1U) << number;
            EXPECT_TRUE(found.at(number).hasSameRecords(placed)) << number;
        }
    }

    WarningCollector warnings;
    std::shared_ptr<const LodAsset> asset;
    Matrices placements;
    osg::ref_ptr<TessLODDrawable> drawable;
    osg::ref_ptr<TessLODInstances> instances;
    osg::ref_ptr<osg::Group> transforms;
    osg::ref_ptr<Snapshot> snapshot = new Snapshot;
    osg::ref_ptr<FrameCapture> capture = new FrameCapture(nullptr);
    osg::ref_ptr<osg::Group> root = new osg::Group;
    osgViewer::Viewer viewer;
};

INSTANTIATE_TEST_SUITE_P(EveryBackend, Instances, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& tested) { return std::string(nameOf(tested.param)); });

TEST_P(Instances, areTheTrianglesOfDrawablesUnderTransforms)
{
    use(makeSyntheticDisplacedAsset(16), variedPlacements());
    const PlacedByNumber wanted = placedUnderTransforms();
    const PlacedByNumber found = placedAsInstances();
    ASSERT_EQ(wanted.size(), placements.size()) << "all are in view";
    ASSERT_EQ(found.size(), placements.size());
    const osg::ref_ptr<Placements> twin = new Placements(placements, instances->getGpuAsset()->bounds());
    std::set<unsigned> levels;
    for (const auto& [number, placed] : wanted) {
        const Placed& other = found.at(number);
        EXPECT_TRUE(other.hasSameRecords(placed)) << number;
        ASSERT_EQ(other.corners.size(), placed.corners.size()) << number;
        for (const PatchRecord& record : placed.records) {
            levels.insert(MorphedSurface::drawnLevel(record.edgeLevels));
        }
        const bool isMovedOnly = number < 2;
        for (std::size_t k = 0; k < placed.corners.size(); ++k) {
            const osg::Vec3f& drawn = other.corners[k];
            const osg::Vec3d exact = osg::Vec3d(placed.corners[k]) * placements[number];
            ASSERT_EQ(drawn, twin->tessLodPlaced(placed.corners[k], static_cast<std::uint32_t>(number))) << number;
            ASSERT_LT((osg::Vec3d(drawn) - exact).length(), 2e-6) << number;
            if (isMovedOnly) { ASSERT_EQ(drawn, osg::Vec3f(exact)) << number; }
        }
    }
    EXPECT_GT(levels.size(), 1U) << "of several levels, or their grouping is not looked at";
}

TEST_P(Instances, areSelectedForOneByOne)
{
    use(makeSyntheticAsset(32), grid(7));
    for (const osg::Vec3d eye : {osg::Vec3d(-4.0, -3.0, 1.0), osg::Vec3d(7.0, 7.0, 0.4), osg::Vec3d(5.0, -30.0, 9.0)}) {
        lookFrom(eye, {8.0, 7.0, 0.0});
        for (const double errorPixels : {0.2, 3.0}) {
            setOptions([&](SelectionOptions& options) { options.errorPixels = errorPixels; });
            expectSameRecords();
            const SelectionStatistics ours = capture->statistics();
            show(*transforms);
            const SelectionStatistics theirs = capture->statistics();
            EXPECT_EQ(ours.patches, theirs.patches);
            EXPECT_EQ(ours.triangles, theirs.triangles);
            EXPECT_EQ(ours.saturatedPatches, theirs.saturatedPatches);
            EXPECT_EQ(ours.patchesByLevel, theirs.patchesByLevel);
            EXPECT_EQ(ours.patches + ours.culledPatches, placements.size() * asset->patches.size());
        }
    }
}

TEST_P(Instances, areSelectedForByWhatIsAskedForAndTheLodScale)
{
    use(makeSyntheticAsset(32), variedPlacements());
    setOptions([](SelectionOptions& options) {
        options.metric = SelectionOptions::Metric::Isotropic;
        options.bound = SelectionOptions::Bound::FirstOrder;
        options.maxFactor = 8;
    });
    expectSameRecords();
    const std::uint64_t before = capture->statistics().triangles;
    camera().setLODScale(8.0F);
    expectSameRecords();
    EXPECT_LT(capture->statistics().triangles, before);
}

TEST_P(Instances, outOfViewAreNotDrawn)
{
    use(makeSyntheticAsset(8), grid(9));
    lookFrom({-8.0, -8.0, 2.0}, {0.0, 0.0, 0.0});
    camera().setProjectionMatrixAsPerspective(12.0, 1.0, 0.1, 100.0);
    const std::size_t inView = placedAsInstances().size();
    EXPECT_GT(inView, 0U);
    EXPECT_LT(inView, placements.size() / 2);
    expectSameRecords();

    lookFrom({-8.0, -8.0, 2.0}, {-20.0, -20.0, 0.0});
    EXPECT_TRUE(placedAsInstances().empty());
    instances->setCullingActive(false);
    setOptions([](SelectionOptions& options) { options.cullPatches = false; });
    EXPECT_EQ(placedAsInstances().size(), placements.size());
}

TEST_P(Instances, tooSmallToBeSeenAreLeftOutAsOsgDoes)
{
    Matrices where = grid(2);
    where.push_back(osg::Matrixd::scale(1e-3, 1e-3, 1e-3));
    use(makeSyntheticAsset(8), where);
    EXPECT_EQ(placedUnderTransforms().size(), 4U);
    EXPECT_EQ(placedAsInstances().size(), 4U);
    camera().setCullingMode(camera().getCullingMode() & ~osg::CullSettings::SMALL_FEATURE_CULLING);
    EXPECT_EQ(placedUnderTransforms().size(), 5U);
    EXPECT_EQ(placedAsInstances().size(), 5U);
}

TEST_P(Instances, takeADrawPerLevel)
{
    use(makeSyntheticAsset(16, false), grid(6));
    lookFrom({-3.0, -3.0, 1.0}, {4.0, 4.0, 0.0});
    // Captures draw as well.
    camera().setPostDrawCallback(nullptr);
    const auto drawCallsOf = [&](osg::Node& node) {
        const std::uint64_t before = DrawContext::of(state()).drawCalls();
        show(node);
        return DrawContext::of(state()).drawCalls() - before;
    };
    show(*instances); // knows the context from here on
    const std::uint64_t ours = drawCallsOf(*instances);
    const SelectionStatistics statistics = capture->observer->take().back().selection->statistics();
    std::uint64_t levels = 0;
    std::uint64_t wanted = 0; // more than levels where the context has draws be split
    for (std::size_t level = 0; level < asset->ladder.size(); ++level) {
        const std::uint64_t patches = statistics.patchesByLevel[level];
        const std::uint64_t most = DrawContext::of(state()).verticesPerDraw(GetParam()) /
                                   TessellationPattern::vertexCount(asset->ladder[level]);
        levels += patches > 0 ? 1 : 0;
        wanted += (patches + most - 1) / most;
    }
    EXPECT_GE(levels, 3U);
    EXPECT_EQ(ours, wanted);
    if (GetParam() == Backend::Instanced) { EXPECT_EQ(ours, levels); }
    EXPECT_GT(drawCallsOf(*transforms), 3 * ours);
}

TEST_P(Instances, lookLikeDrawablesUnderTransforms)
{
    const osg::ref_ptr<osg::LightModel> twoSided = new osg::LightModel;
    twoSided->setTwoSided(true);
    root->getOrCreateStateSet()->setAttribute(twoSided);
    // With normals and without, closed and open: the backs of the sheets are seen at half of the placements.
    const LodAsset shapes[] = {makeSyntheticAsset(16, true), makeSyntheticAsset(16, false),
                               makeSyntheticSheet(8, 2, true), makeSyntheticSheet(8, 2, false)};
    for (std::size_t shape = 0; shape < std::size(shapes); ++shape) {
        use(shapes[shape], variedPlacements());
        show(*transforms); // the first frame with a surface in it is brighter, too
        for (const double side : {1.0, -1.0}) {
            lookFrom({11.0 * side, 1.0, 6.0 * side}, osg::Vec3d());
            const osg::ref_ptr<osg::Image> nothing = pictureOf(*new osg::Group);
            const osg::ref_ptr<osg::Image> theirs = pictureOf(*transforms);
            const osg::ref_ptr<osg::Image> ours = pictureOf(*instances);
            EXPECT_GT(differingPixels(*theirs, *nothing, 0), 3000U) << shape;
            // Positions round otherwise by another order of multiplications: pixels at silhouettes.
            EXPECT_LE(differingPixels(*theirs, *ours, 3), 20U) << shape;
        }
    }
}

TEST_P(Instances, areBoundedAsDrawablesUnderTransforms)
{
    use(makeSyntheticAsset(16), variedPlacements());
    for (const auto mode : {osg::CullSettings::COMPUTE_NEAR_FAR_USING_BOUNDING_VOLUMES,
                            osg::CullSettings::COMPUTE_NEAR_FAR_USING_PRIMITIVES}) {
        camera().setComputeNearFarMode(mode);
        for (const osg::Vec3d eye :
             {osg::Vec3d(11.0, 1.0, 2.0), osg::Vec3d(2.0, 0.3, 0.2), osg::Vec3d(0.2, 1.4, 0.0)}) {
            lookFrom(eye, {-3.0, 0.3, 0.3});
            show(*transforms);
            const osg::Matrixd theirs = capture->projection;
            show(*instances);
            for (int k = 0; k < 16; ++k) {
                EXPECT_NEAR(capture->projection.ptr()[k], theirs.ptr()[k], 1e-4 * (1.0 + std::fabs(theirs.ptr()[k])));
            }
        }
    }
}

TEST_P(Instances, areSelectedForByTheViewThatShadowsInherit)
{
    use(makeSyntheticAsset(32), variedPlacements());
    const osg::ref_ptr<osg::Group> scene = new osg::Group;
    const osg::ref_ptr<osg::Camera> texture = makeTextureCamera(scene.get(), 64);
    texture->setReferenceFrame(osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT);
    texture->setProjectionMatrixAsPerspective(60.0, 1.0, 0.1, 100.0);
    texture->setViewMatrixAsLookAt(osg::Vec3d(0.0, 0.0, 12.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    setOptions([](SelectionOptions& options) { options.cullPatches = false; });
    scene->addChild(instances);
    const osg::ref_ptr<osg::Group> both = new osg::Group;
    both->addChild(texture);
    both->addChild(scene);
    show(*both);
    const PlacedByNumber shadow = capture->placed(placements, "texture");
    const PlacedByNumber main = capture->placed(placements, "main");
    ASSERT_EQ(main.size(), placements.size());
    ASSERT_EQ(shadow.size(), placements.size());
    for (const auto& [number, placed] : main) { EXPECT_TRUE(placed.hasSameRecords(shadow.at(number))) << number; }
}

TEST_P(Instances, canBeFrozen)
{
    Matrices alike = grid(4);
    for (osg::Matrixd& placement : alike) { placement = osg::Matrixd::scale(1.5, 1.5, 1.5) * placement; }
    use(makeSyntheticAsset(32), alike);
    lookFrom({-5.0, -4.0, 3.0}, {5.0, 5.0, 0.0});
    const PlacedByNumber live = placedAsInstances();
    const SelectionView view = capture->entries.front().selection->view();
    setOptions([&](SelectionOptions& options) {
        options.frozen = true;
        options.frozenView = view;
    });
    const PlacedByNumber frozen = placedAsInstances();
    ASSERT_EQ(frozen.size(), live.size());
    const auto levelsOf = [](const Placed& placed) {
        std::map<std::uint32_t, std::array<float, 3>> levels;
        for (const PatchRecord& record : placed.records) { levels[record.patch] = record.edgeLevels; }
        return levels;
    };
    for (const auto& [number, placed] : live) {
        const auto wanted = levelsOf(placed);
        const auto found = levelsOf(frozen.at(number));
        ASSERT_EQ(found.size(), wanted.size());
        for (const auto& [patch, levels] : wanted) {
            for (std::size_t side = 0; side < 3; ++side) { EXPECT_NEAR(found.at(patch)[side], levels[side], 1e-3); }
        }
    }
}

TEST_P(Instances, canBePlacedAnew)
{
    use(makeSyntheticAsset(8), grid(3));
    lookFrom({-9.0, -7.0, 8.0}, {2.0, 2.0, 0.0});
    const PlacedByNumber before = placedAsInstances();
    const osg::ref_ptr<const PatchSelection> old = capture->entries.front().selection;
    const std::vector<osg::Vec3f> oldCorners = capture->corners.front();

    placements.resize(5);
    for (osg::Matrixd& placement : placements) { placement *= osg::Matrixd::translate(0.0, 0.0, 0.5); }
    instances->setPlacements(placements);
    const PlacedByNumber after = placedAsInstances();
    ASSERT_EQ(before.size(), 9U);
    ASSERT_EQ(after.size(), 5U);
    for (const auto& [number, placed] : after) {
        for (const osg::Vec3f& corner : placed.corners) {
            ASSERT_LT((osg::Vec3d(corner) * osg::Matrixd::inverse(placements[number])).length(), 1.2) << number;
        }
    }
    // What was selected before is drawn as it was.
    osg::RenderInfo renderInfo(&state(), nullptr);
    ASSERT_TRUE(camera().getGraphicsContext()->makeCurrent());
    EXPECT_EQ(old->capture(renderInfo), oldCorners);

    instances->setPlacements({});
    EXPECT_TRUE(placedAsInstances().empty());
    EXPECT_FALSE(instances->getBoundingBox().valid());
}

TEST_P(Instances, showTheAssetThatTheyAreGivenLater)
{
    use(makeSyntheticAsset(8), grid(3));
    lookFrom({-9.0, -7.0, 8.0}, {2.0, 2.0, 0.0});
    const osg::ref_ptr<TessLODInstances> later = new TessLODInstances;
    later->setPlacements(placements);
    EXPECT_FALSE(later->getBoundingBox().valid());
    show(*later);
    EXPECT_TRUE(capture->entries.empty());
    later->setAsset(asset);
    later->setOptions(instances->getOptions());
    later->setSelectionObserver(capture->observer.get());
    EXPECT_EQ(later->getBoundingBox()._max, instances->getBoundingBox()._max);
    show(*later);
    EXPECT_EQ(capture->placed(placements).size(), 9U);
}

TEST_P(Instances, areDrawnPageByPageToo)
{
    use(makeSyntheticDisplacedAsset(16), variedPlacements());
    const auto triangles = [&] {
        std::vector<std::array<osg::Vec3f, 3>> all;
        show(*instances);
        for (const auto& corners : capture->corners) {
            for (std::size_t k = 0; k < corners.size(); k += 3) {
                all.push_back({corners[k], corners[k + 1], corners[k + 2]});
            }
        }
        std::sort(all.begin(), all.end());
        return all;
    };
    const auto whole = triangles();
    DrawContext::of(state()).limitTextureBufferTexels(1300);
    EXPECT_GT(instances->getGpuAsset()->pagesFor(state())->size(), 1U);
    EXPECT_EQ(triangles(), whole);
}

TEST_P(Instances, moreThanAContextHasRoomForAreNotDrawn)
{
    use(makeSyntheticAsset(4), grid(3));
    instances->releaseGLObjects();
    DrawContext::of(state()).limitTextureBufferTexels(6 * 9 - 1);
    const WarningCollector expected;
    show(*instances);
    EXPECT_TRUE(capture->corners.front().empty());
    show(*instances);
    const std::string text = expected.text();
    EXPECT_NE(text.find("9 placements"), std::string::npos) << text;
    EXPECT_EQ(text.find("placements", text.find("9 placements") + 12), std::string::npos) << "said once: " << text;
}

TEST_P(Instances, ofSingularAndInfinitePlacementsDoNoHarm)
{
    use(makeSyntheticAsset(8), grid(2));
    const PlacedByNumber wanted = placedAsInstances();
    osg::Matrixd projective;
    projective(0, 3) = 0.1;
    placements.push_back(osg::Matrixd::scale(0.0, 0.0, 0.0));
    placements.push_back(osg::Matrixd::scale(1.0, 0.0, 1.0));
    placements.push_back(osg::Matrixd::translate(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0));
    placements.push_back(osg::Matrixd::scale(1e300, 1.0, 1.0));
    placements.push_back(projective);
    instances->setPlacements(placements);
    EXPECT_TRUE(instances->getBoundingBox().valid());
    EXPECT_LT(instances->getBoundingBox().radius(), 10.0F);
    PlacedByNumber found = placedAsInstances();
    for (const auto& [number, placed] : wanted) { EXPECT_EQ(found[number].corners, placed.corners); }
    for (const std::size_t number : {6U, 7U, 8U}) { EXPECT_EQ(found.count(number), 0U); }
}

// ------------------------------------------------------------------------------------------- without a viewer ---

class InstancesGl : public GlTest {};

TEST_F(InstancesGl, drawAgainAfterTheirObjectsWereReleased)
{
    const osg::ref_ptr<TessLODInstances> instances = makeInstances(shared(makeSyntheticAsset(8)), variedPlacements());
    instances->compileGLObjects(renderInfo);
    for (osg::State* which : {&state(), static_cast<osg::State*>(nullptr)}) {
        instances->drawImplementation(renderInfo);
        instances->releaseGLObjects(which);
        osg::flushAllDeletedGLObjects(state().getContextID());
        state().reset();
        state().setCheckForGLErrors(osg::State::ONCE_PER_ATTRIBUTE);
        instances->resizeGLObjectBuffers(8);
    }
    const osg::ref_ptr<TessLODInstances> empty = new TessLODInstances;
    empty->compileGLObjects(renderInfo);
    empty->drawImplementation(renderInfo);
    empty->releaseGLObjects();
}

TEST_F(InstancesGl, areSharedByCopies)
{
    const osg::ref_ptr<TessLODInstances> instances = makeInstances(shared(makeSyntheticAsset(8)), variedPlacements());
    for (const auto flags : {osg::CopyOp::SHALLOW_COPY, osg::CopyOp::DEEP_COPY_ALL}) {
        const osg::ref_ptr<TessLODInstances> copy = osg::clone(instances.get(), osg::CopyOp(flags));
        EXPECT_EQ(copy->getGpuAsset(), instances->getGpuAsset());
        EXPECT_EQ(copy->getPlacements(), instances->getPlacements());
        EXPECT_EQ(copy->getBoundingBox()._min, instances->getBoundingBox()._min);
        EXPECT_EQ(copy->getBoundingBox()._max, instances->getBoundingBox()._max);
        copy->setPlacements({osg::Matrixd()});
        EXPECT_EQ(instances->getPlacements().size(), variedPlacements().size());
    }
    EXPECT_STREQ(instances->className(), "TessLODInstances");
}

// ------------------------------------------------------------------------------------------------------ picking ---

TEST(InstancesPicking, boundsHoldAllThatIsDrawn)
{
    const osg::ref_ptr<TessLODInstances> instances = makeInstances(shared(makeSyntheticAsset(16)), variedPlacements());
    osg::BoundingBox box = instances->getBoundingBox();
    EXPECT_LT(box.radius(), 8.0F);
    const osg::Vec3f rounding(1e-5F, 1e-5F, 1e-5F);
    box._min -= rounding;
    box._max += rounding;
    for (const osg::Vec3f& p : instances->getPickingSurface()->vertices()) { ASSERT_TRUE(box.contains(p)); }
}

TEST(InstancesPicking, meetsWhatIsMetUnderTransforms)
{
    const std::shared_ptr<const LodAsset> asset = shared(makeSyntheticAsset(16));
    const Matrices placements = variedPlacements();
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    const osg::ref_ptr<TessLODInstances> instances = makeInstances(asset, placements);
    const osg::Matrixd outer = osg::Matrixd::scale(2.0, 2.0, 2.0) * osg::Matrixd::translate(1.0, 0.0, 0.0);
    const osg::ref_ptr<osg::MatrixTransform> ours = new osg::MatrixTransform(outer);
    ours->addChild(instances);
    const osg::ref_ptr<osg::MatrixTransform> theirs = new osg::MatrixTransform(outer);
    theirs->addChild(underTransforms(*drawable, placements));

    using Line = osgUtil::LineSegmentIntersector;
    const auto hits = [](osg::Node& scene, const osg::Vec3d& start, const osg::Vec3d& end, bool useTree) {
        const osg::ref_ptr<Line> line = new Line(start, end);
        osgUtil::IntersectionVisitor visitor(line.get());
        visitor.setUseKdTreeWhenAvailable(useTree);
        scene.accept(visitor);
        return line->getIntersections();
    };
    std::set<std::uint32_t> met;
    for (const bool useTree : {true, false}) {
        for (int k = 0; k < 60; ++k) {
            const osg::Vec3d end(-30.0, 7.5 * std::sin(0.7 * k), 7.0 * std::sin(1.9 * k));
            const osg::Vec3d start(30.0, 0.9 * end.y(), 0.9 * end.z());
            const auto wanted = hits(*theirs, start, end, useTree);
            const auto found = hits(*ours, start, end, useTree);
            ASSERT_EQ(found.size(), wanted.size());
            auto other = wanted.begin();
            for (const Line::Intersection& hit : found) {
                EXPECT_NEAR((hit.getWorldIntersectPoint() - other->getWorldIntersectPoint()).length(), 0.0, 1e-5);
                EXPECT_NEAR((hit.getWorldIntersectNormal() - other->getWorldIntersectNormal()).length(), 0.0, 1e-4);
                const std::optional<std::uint32_t> number = TessLODInstances::placementOf(hit.matrix.get());
                ASSERT_TRUE(number);
                EXPECT_EQ(placements[*number] * outer, *other->matrix);
                met.insert(*number);
                EXPECT_EQ(hit.nodePath.back(), hit.drawable);
                EXPECT_EQ(hit.nodePath[hit.nodePath.size() - 2], instances);
                EXPECT_FALSE(TessLODInstances::placementOf(other->matrix.get()));
                ++other;
            }
        }
    }
    EXPECT_EQ(met.size(), placements.size()) << "the lines meet all";
    instances->setNodeMask(0);
    EXPECT_TRUE(hits(*ours, osg::Vec3d(30.0, 0.0, 0.0), osg::Vec3d(-30.0, 0.0, 0.0), true).empty());
}

TEST(InstancesPicking, polytopesMeetThemToo)
{
    const osg::ref_ptr<TessLODInstances> instances = makeInstances(shared(makeSyntheticAsset(8)), grid(3));
    osg::Polytope column; // a thin one through the middle of the second placement
    column.add(osg::Plane(1.0, 0.0, 0.0, -2.4));
    column.add(osg::Plane(-1.0, 0.0, 0.0, 2.6));
    column.add(osg::Plane(0.0, 1.0, 0.0, 0.1));
    column.add(osg::Plane(0.0, -1.0, 0.0, 0.1));
    const osg::ref_ptr<osgUtil::PolytopeIntersector> polytope = new osgUtil::PolytopeIntersector(column);
    osgUtil::IntersectionVisitor visitor(polytope.get());
    instances->accept(visitor);
    ASSERT_TRUE(polytope->containsIntersections());
    for (const auto& hit : polytope->getIntersections()) {
        EXPECT_EQ(TessLODInstances::placementOf(hit.matrix.get()), std::optional<std::uint32_t>(1));
    }
}

TEST(InstancesPicking, functorsSeeAllPlacementsWithinTheLimit)
{
    struct Sum {
        std::size_t triangles = 0;
        double volume = 0.0;
        void operator()(const osg::Vec3& a, const osg::Vec3& b, const osg::Vec3& c, bool = false)
        {
            ++triangles;
            volume += osg::Vec3d(a) * (osg::Vec3d(b) ^ osg::Vec3d(c)) / 6.0;
        }
    };
    const std::shared_ptr<const LodAsset> asset = shared(makeSyntheticAsset(16));
    const Matrices placements = variedPlacements();
    const osg::ref_ptr<TessLODInstances> instances = makeInstances(asset, placements);
    const osg::ref_ptr<TessLODDrawable> drawable = new TessLODDrawable(asset);
    PickingOptions options;
    options.finestLevel = 3;
    drawable->setPickingOptions(options);
    instances->setPickingOptions(options);
    osg::TriangleFunctor<Sum> one;
    drawable->accept(one);
    double volume = 0.0; // outside out at every placement
    for (const osg::Matrixd& m : placements) {
        volume +=
            one.volume * std::fabs(osg::Vec3d(m(0, 0), m(0, 1), m(0, 2)) *
                                   (osg::Vec3d(m(1, 0), m(1, 1), m(1, 2)) ^ osg::Vec3d(m(2, 0), m(2, 1), m(2, 2))));
    }
    osg::TriangleFunctor<Sum> all;
    instances->accept(all);
    EXPECT_EQ(all.triangles, placements.size() * one.triangles);
    EXPECT_NEAR(all.volume, volume, 1e-4 * volume);

    options.maxTriangles = placements.size() * 8 * 6; // factor 2: six of a patch
    instances->setPickingOptions(options);
    osg::TriangleFunctor<Sum> few;
    instances->accept(few);
    EXPECT_EQ(few.triangles, placements.size() * 8 * 6);
    instances->setPlacements({placements.front()});
    osg::TriangleFunctor<Sum> first;
    instances->accept(first);
    EXPECT_EQ(first.triangles, 8U * 24U) << "the others leave room for a finer level";
}

} // namespace
} // namespace osgTessLOD
