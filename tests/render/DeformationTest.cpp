// SPDX-License-Identifier: MIT
// Deformed control meshes: what the GPU draws of them is its CPU twin's to the bit, closed and lit as it lies; what is selected,
// culled and met follows the pose.
#include <render/CapturedInstead.h>
#include <render/ClosedSurface.h>
#include <render/GlTest.h>
#include <render/Poses.h>
#include <render/ViewerTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/TessLODDrawable.h>
#include <osgTessLOD/render/TessLODInstances.h>

#include <osg/MatrixTransform>
#include <osgUtil/IntersectionVisitor>
#include <osgUtil/LineSegmentIntersector>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

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
        const osg::ref_ptr<PatchSelection> selection =
            new PatchSelection(&asset, records, asset.selector().statisticsOf(records), SelectionView(), backend, {},
                               deformation);
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
        EXPECT_GT(asset->pagesFor(state())->pages().size(), 1U);
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

} // namespace
} // namespace osgTessLOD
