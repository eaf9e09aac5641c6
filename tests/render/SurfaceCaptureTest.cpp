// SPDX-License-Identifier: MIT
// What the GPU draws: equal to its CPU twin to the bit, closed, and continuous in the view.
#include <render/CapturedInstead.h>
#include <render/ClosedSurface.h>
#include <render/GlTest.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <utility>

namespace osgTessLOD {
namespace {

using Vec3 = MorphedSurface::Vec3;
using Triangle = std::array<Vec3, 3>;

Triangle rotated(Triangle t)
{
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

/// Oriented triangles of one record by the CPU twin, sorted.
std::vector<Triangle> twinTriangles(const GpuAsset& asset, const PatchRecord& record)
{
    const unsigned factor = asset.asset().ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
    std::vector<Triangle> triangles;
    const TessellationPattern pattern(factor);
    for (const TessellationPattern::Triangle& t : pattern.triangles()) {
        Triangle corners{};
        for (std::size_t k = 0; k < 3; ++k) {
            corners[k] = asset.surface().tessLodSurfacePoint(record.patch, record.edgeLevels, t[k]).position;
        }
        triangles.push_back(rotated(corners));
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

void expectEqualToTwin(const GpuAsset& asset, const std::vector<PatchRecord>& records,
                       const std::vector<osg::Vec3f>& captured)
{
    std::size_t at = 0;
    for (const PatchRecord& record : records) {
        const std::vector<Triangle> expected = twinTriangles(asset, record);
        ASSERT_LE(at + 3 * expected.size(), captured.size());
        std::vector<Triangle> drawn;
        for (std::size_t k = 0; k < expected.size(); ++k, at += 3) {
            Triangle t{};
            for (std::size_t c = 0; c < 3; ++c) {
                const osg::Vec3f& p = captured[at + c];
                t[c] = {p.x(), p.y(), p.z()};
            }
            drawn.push_back(rotated(t));
        }
        std::sort(drawn.begin(), drawn.end());
        ASSERT_EQ(drawn, expected) << "patch " << record.patch << " at " << record.edgeLevels[0] << " "
                                   << record.edgeLevels[1] << " " << record.edgeLevels[2];
    }
    EXPECT_EQ(at, captured.size());
}

void expectClosed(const std::vector<osg::Vec3f>& captured)
{
    EXPECT_FALSE(captured.empty());
    EXPECT_EQ(unmatchedEdges(captured), 0U);
}

/// Three corners after three corners, in an order of their own.
std::vector<osg::Vec3f> sortedTriangles(std::vector<osg::Vec3f> corners)
{
    std::vector<std::array<osg::Vec3f, 3>> triangles;
    for (std::size_t k = 0; k < corners.size(); k += 3) {
        triangles.push_back({corners[k], corners[k + 1], corners[k + 2]});
    }
    std::sort(triangles.begin(), triangles.end());
    for (std::size_t k = 0; k < corners.size(); ++k) { corners[k] = triangles[k / 3][k % 3]; }
    return corners;
}

/// A third of the inner vertices come out of border vertices. The synthetic assets follow the tessellator's own merging,
/// in which none does; simplified ones are full of them.
LodAsset withBorderParents(LodAsset asset)
{
    for (std::size_t level = 1; level < asset.levels.size(); ++level) {
        const unsigned factor = asset.ladder[level];
        const std::uint32_t count = TessellationPattern::vertexCount(factor);
        std::vector<LodVertex>& vertices = asset.levels[level].vertices;
        for (std::uint32_t k = 0; k < vertices.size(); ++k) {
            if (k % count < TessellationPattern::borderVertexCount(factor) || k % 3 != 0) { continue; }
            const std::uint32_t borders = TessellationPattern::borderVertexCount(asset.ladder[level - 1]);
            vertices[k] = LodVertex::pack(vertices[k].offset(), 7 * k % borders);
        }
    }
    asset.validate();
    return asset;
}

/// Any levels that a selection could have: one per edge, up to its finest; often whole numbers and the ends.
std::vector<PatchRecord> randomRecords(const LodAsset& asset, std::mt19937& random)
{
    std::vector<float> levels;
    for (const LodEdge& edge : asset.edges) {
        const auto finest = static_cast<float>(edge.finestLevel);
        const float level = std::uniform_real_distribution<float>(0.0F, finest)(random);
        const unsigned kind = random() % 4;
        levels.push_back(kind == 0 ? std::round(level) : kind == 1 && random() % 2 == 0 ? finest : level);
    }
    std::vector<PatchRecord> records;
    for (std::uint32_t p = 0; p < asset.patches.size(); ++p) {
        const auto& edges = asset.patches[p].edges;
        records.push_back({p, {levels[edges[0]], levels[edges[1]], levels[edges[2]]}});
    }
    return records;
}

osg::Vec3d randomEye(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    osg::Vec3d direction(normal(random), normal(random), normal(random));
    direction.normalize();
    return direction * std::exp(std::uniform_real_distribution<double>(0.0, 3.0)(random));
}

/// Every vertex of the drawn patterns, captured at these positions with these weights, is one of the twin's.
void expectWeightsOfTwin(const GpuAsset& asset, const std::vector<PatchRecord>& records,
                         const std::vector<osg::Vec3f>& positions, const std::vector<osg::Vec3f>& weights)
{
    ASSERT_EQ(positions.size(), weights.size());
    std::size_t at = 0;
    for (const PatchRecord& record : records) {
        const unsigned factor = asset.asset().ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
        std::multimap<Vec3, Vec3> twins;
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            const auto point = asset.surface().tessLodSurfacePoint(record.patch, record.edgeLevels, v);
            ASSERT_NEAR(point.weights[0] + point.weights[1] + point.weights[2], 1.0, 1e-6);
            twins.emplace(point.position, point.weights);
        }
        for (const std::size_t end = at + 3 * TessellationPattern::triangleCount(factor); at < end; ++at) {
            const auto [first, last] = twins.equal_range({positions[at].x(), positions[at].y(), positions[at].z()});
            const auto isDrawn = [&](const auto& twin) {
                return (osg::Vec3f(twin.second[0], twin.second[1], twin.second[2]) - weights[at]).length() < 1e-6F;
            };
            ASSERT_TRUE(std::any_of(first, last, isDrawn))
                << "patch " << record.patch << " at " << record.edgeLevels[0] << " " << record.edgeLevels[1] << " "
                << record.edgeLevels[2];
        }
    }
}

class SurfaceCapture : public GlTest, public testing::WithParamInterface<Backend> {
protected:
    SurfaceCapture() { backend = GetParam(); }
    void expectSound(LodAsset made, unsigned count)
    {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(std::move(made));
        std::mt19937 random(7);
        for (unsigned k = 0; k < count && !HasFatalFailure() && !HasNonfatalFailure(); ++k) {
            std::vector<PatchRecord> records = randomRecords(asset->asset(), random);
            const std::vector<osg::Vec3f> captured = capture(*asset, records);
            expectEqualToTwin(*asset, records, captured);
            if (asset->asset().edges.front().patches[1] != kNoPatch) { expectClosed(captured); }
        }
    }
};

TEST_P(SurfaceCapture, parametersDoNotMoveTheSurface)
{
    expectSound(makeSyntheticDisplacedAsset(16), 10);
}

TEST_P(SurfaceCapture, weightsAreTheTwins)
{
    LodAsset dropped = makeSyntheticDisplacedAsset(16);
    for (LodLevel& level : dropped.levels) { level.parameters.clear(); }
    const std::vector<LodAsset> assets{
        makeSyntheticAsset(16), dropped, makeSyntheticDisplacedAsset(16),
        withBorderParents(makeSyntheticDisplacedAsset(16)),
        synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(16), true, {4, 2, 1, 4, 0, 3, 2, 4}, true)};
    for (const LodAsset& made : assets) {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(made);
        std::mt19937 random(8);
        for (int k = 0; k < 10 && !HasFatalFailure(); ++k) {
            std::vector<PatchRecord> records = randomRecords(made, random);
            const std::vector<osg::Vec3f> at = capture(*asset, records);
            expectWeightsOfTwin(*asset, records, at, capture(*asset, records, "tessLodWeights"));
        }
    }
}

/// Sorted; of each triangle the first of its three rotations, whatever corners are alike.
std::vector<Triangle> sortedTriangles(std::vector<Triangle> triangles)
{
    for (Triangle& t : triangles) {
        const Triangle once{t[1], t[2], t[0]};
        const Triangle twice{t[2], t[0], t[1]};
        t = std::min({t, once, twice});
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

TEST_P(SurfaceCapture, attributesAreTheTwins)
{
    using Point = MorphedSurface::TessLodPoint;
    struct Attribute {
        const char* expression;
        Vec3 (*twin)(const Point&);
    };
    const std::array<Attribute, 3> attributes{
        {{"point.texCoord", [](const Point& p) { return p.texCoord; }},
         {"point.color.rgb", [](const Point& p) { return Vec3{p.color[0], p.color[1], p.color[2]}; }},
         {"point.color.aga", [](const Point& p) { return Vec3{p.color[3], p.color[1], p.color[3]}; }}}};
    for (const LodAsset& made : {withAttributes(withBorderParents(makeSyntheticDisplacedAsset(16))),
                                 withAttributes(makeSyntheticMixedAsset(16))}) {
        made.validate();
        for (const Attribute& attribute : attributes) {
            const CapturedInstead instead(attribute.expression);
            const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(made);
            std::mt19937 random(9);
            for (int k = 0; k < 5; ++k) {
                std::vector<PatchRecord> records = randomRecords(made, random);
                const std::vector<osg::Vec3f> captured = capture(*asset, records);
                std::size_t at = 0;
                for (const PatchRecord& record : records) {
                    const unsigned factor = made.ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
                    std::vector<Triangle> twins;
                    std::vector<Triangle> drawn;
                    const TessellationPattern pattern(factor);
                    for (const TessellationPattern::Triangle& t : pattern.triangles()) {
                        Triangle twin{};
                        Triangle own{};
                        for (std::size_t c = 0; c < 3; ++c, ++at) {
                            twin[c] = attribute.twin(
                                asset->surface().tessLodSurfacePoint(record.patch, record.edgeLevels, t[c]));
                            ASSERT_LT(at, captured.size());
                            own[c] = {captured[at].x(), captured[at].y(), captured[at].z()};
                        }
                        twins.push_back(twin);
                        drawn.push_back(own);
                    }
                    ASSERT_EQ(sortedTriangles(drawn), sortedTriangles(twins)) << attribute.expression << ", patch "
                                                                              << record.patch;
                }
            }
        }
    }
}

TEST_P(SurfaceCapture, attributesDoNotMoveTheSurface)
{
    expectSound(withAttributes(makeSyntheticAsset(16, true)), 5);
}

TEST_P(SurfaceCapture, anyLegalLevelsGiveAClosedSurfaceEqualToTheTwin)
{
    expectSound(makeSyntheticAsset(32, false), 40);
    expectSound(makeSyntheticMixedAsset(32), 40);
}

TEST_P(SurfaceCapture, innerVerticesMayComeOutOfBorders)
{
    expectSound(withBorderParents(makeSyntheticAsset(32, false)), 40);
    expectSound(withBorderParents(makeSyntheticMixedAsset(32)), 40);
}

TEST_P(SurfaceCapture, normalsDoNotMoveTheSurface)
{
    expectSound(makeSyntheticAsset(16, true), 10);
}

TEST_P(SurfaceCapture, openBordersAreDrawnToo)
{
    expectSound(makeSyntheticSheet(16, 2, false), 10);
}

TEST_P(SurfaceCapture, denserLaddersWork)
{
    const std::vector<std::uint16_t> ladder{1, 2, 4, 6, 8, 12, 16, 24, 32};
    expectSound(synthetic::build(synthetic::bumpySphere(), ladder, false), 30);
    expectSound(synthetic::build(synthetic::bumpySphere(), {2, 6, 10}, false), 30);
}

TEST_P(SurfaceCapture, largestFactorIsSplitOverSeveralDraws)
{
    // 8 · 8 · 2 patches of 3,169 vertices: far more than one draw may have on a software rasterizer.
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticSheet(64, 8, false));
    std::vector<PatchRecord> records = asset->selector().uniformRecords(6).vector();
    const std::vector<osg::Vec3f> captured = capture(*asset, records);
    EXPECT_EQ(captured.size(), 3U * 128U * 6144U);
    expectEqualToTwin(*asset, records, captured);
}

TEST_P(SurfaceCapture, assetsOverTheLimitOfTextureBuffersAreDrawnPageByPage)
{
    LodAsset few =
        synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(16), true, {4, 2, 1, 4, 0, 3, 2, 4}, true);
    for (const LodAsset& made : {makeSyntheticDisplacedAsset(16), withBorderParents(std::move(few))}) {
        const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(made);
        std::mt19937 random(9);
        std::vector<PatchRecord> records = randomRecords(made, random);
        std::map<std::string, std::vector<osg::Vec3f>> whole;
        DrawContext::of(state()).limitTextureBufferTexels(std::numeric_limits<std::int64_t>::max());
        for (const char* varying : {"tessLodObjectPosition", "tessLodWeights"}) {
            whole[varying] = sortedTriangles(capture(*asset, records, varying));
        }
        std::size_t pagesBefore = asset->pagesFor(state())->size();
        EXPECT_EQ(pagesBefore, 1U);
        for (const std::int64_t limit : {1300, 700, 1}) {
            DrawContext::of(state()).limitTextureBufferTexels(limit);
            const AssetPages& pages = *asset->pagesFor(state());
            EXPECT_GT(pages.size(), pagesBefore);
            pagesBefore = pages.size();
            for (std::size_t k = 0; k < pages.size(); ++k) {
                const auto page = pages.make(k, pages.whole());
                EXPECT_EQ(page->bytes(), pages.bytes(k, pages.whole())) << limit;
                for (const TexelBuffer& buffer : page->buffers) {
                    EXPECT_TRUE(buffer.texture->getTextureWidth() <= limit || page->patchCount == 1) << limit;
                }
            }
            for (const auto& [varying, triangles] : whole) {
                if (limit == 1 && varying == "tessLodWeights") {
                    continue;
                } // no room for normals, so no use for weights
                EXPECT_EQ(sortedTriangles(capture(*asset, records, varying)), triangles) << varying << " " << limit;
            }
            EXPECT_EQ(capture(*asset, records).size(), whole["tessLodObjectPosition"].size());
        }
        EXPECT_EQ(pagesBefore, made.patches.size());
    }
}

TEST_P(SurfaceCapture, everySelectionIsClosed)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(makeSyntheticAsset(32, false));
    std::mt19937 random(11);
    std::size_t mixed = 0;
    for (int k = 0; k < 60; ++k) {
        SelectionView view;
        view.eye = randomEye(random);
        view.pixelScale = 1000.0;
        SelectionOptions options;
        options.cullPatches = false;
        options.errorPixels = std::exp(std::uniform_real_distribution<double>(-1.5, 5.0)(random));
        PatchSelector::Result result = asset->selector().select(view, options, {});
        ASSERT_EQ(result.records.size(), 8U);
        mixed += MorphedSurface::drawnLevel(result.records.front().edgeLevels) !=
                         MorphedSurface::drawnLevel(result.records.back().edgeLevels)
                     ? 1
                     : 0;
        std::vector<PatchRecord> records = result.records.vector();
        const std::vector<osg::Vec3f> captured = capture(*asset, records);
        EXPECT_EQ(captured.size(), 3 * result.statistics.triangles);
        expectClosed(captured);
    }
    EXPECT_GT(mixed, 10U); // or the test shows little
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, SurfaceCapture, testing::Values(Backend::Tessellation, Backend::Instanced),
                         [](const auto& named) { return std::string(nameOf(named.param)); });

/// Largest distance that a vertex moves between two frames. A vertex of the finer pattern is compared with the vertex of
/// the coarser one that it comes out of: its ancestor.
double largestMove(const GpuAsset& asset, const PatchRecord& before, const PatchRecord& after)
{
    const LodAsset& a = asset.asset();
    const bool refined = MorphedSurface::drawnLevel(after.edgeLevels) >= MorphedSurface::drawnLevel(before.edgeLevels);
    const PatchRecord& fine = refined ? after : before;
    const PatchRecord& coarse = refined ? before : after;
    const unsigned coarseLevel = MorphedSurface::drawnLevel(coarse.edgeLevels);
    double largest = 0.0;
    const unsigned fineLevel = MorphedSurface::drawnLevel(fine.edgeLevels);
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(a.ladder[fineLevel]); ++v) {
        std::uint32_t ancestor = v;
        for (unsigned level = fineLevel; level > coarseLevel; --level) {
            const std::uint32_t slot = a.levelSlots(level)[fine.patch];
            const std::uint32_t first = slot * TessellationPattern::vertexCount(a.ladder[level]);
            ancestor = a.levels[level].vertices[first + ancestor].parent();
        }
        const Vec3 p = asset.surface().tessLodSurfacePoint(fine.patch, fine.edgeLevels, v).position;
        const Vec3 q = asset.surface().tessLodSurfacePoint(coarse.patch, coarse.edgeLevels, ancestor).position;
        largest = std::max(largest, (osg::Vec3d(p[0], p[1], p[2]) - osg::Vec3d(q[0], q[1], q[2])).length());
    }
    return largest;
}

/// Largest move of any vertex in any frame of a flight from afar to the surface, past it and away.
double largestMoveOfFlight(const GpuAsset& asset, int frames, std::size_t& levelChanges)
{
    double largest = 0.0;
    std::vector<PatchRecord> last;
    for (int frame = 0; frame <= frames; ++frame) {
        const double t = static_cast<double>(frame) / frames;
        const double radius = std::exp(4.0 * std::fabs(2.0 * t - 1.0)) * 1.1;
        SelectionView view;
        view.eye = osg::Vec3d(std::cos(5.0 * t), std::sin(5.0 * t), 0.4 * std::sin(9.0 * t)) * radius;
        view.pixelScale = 40.0; // with errors from 0.5 down: runs through all levels
        SelectionOptions options;
        options.errorPixels = 4.0;
        std::vector<PatchRecord> records = asset.selector().select(view, options, {}).records.vector();
        std::sort(records.begin(), records.end(),
                  [](const PatchRecord& a, const PatchRecord& b) { return a.patch < b.patch; });
        for (std::size_t p = 0; p < last.size(); ++p) {
            largest = std::max(largest, largestMove(asset, last[p], records[p]));
            levelChanges +=
                MorphedSurface::drawnLevel(last[p].edgeLevels) != MorphedSurface::drawnLevel(records[p].edgeLevels) ? 1
                                                                                                                    : 0;
        }
        last = std::move(records);
    }
    return largest;
}

void expectContinuous(LodAsset made)
{
    const osg::ref_ptr<GpuAsset> asset = makeGpuAsset(std::move(made));
    std::size_t changes = 0;
    const double coarseSteps = largestMoveOfFlight(*asset, 400, changes);
    const double fineSteps = largestMoveOfFlight(*asset, 3200, changes);
    EXPECT_GT(changes, 20U);
    EXPECT_GT(coarseSteps, 0.0);
    // A step 8 times shorter moves vertices about 8 times less; a pop would be as large as before.
    EXPECT_LT(fineSteps, 0.25 * coarseSteps);
}

TEST(SurfaceContinuity, smallStepsMoveVerticesByLittle)
{
    expectContinuous(makeSyntheticAsset(8, false));
    expectContinuous(makeSyntheticMixedAsset(8));
}

TEST(SurfaceContinuity, verticesFromBordersDoNotPop)
{
    expectContinuous(withBorderParents(makeSyntheticAsset(8, false)));
    expectContinuous(withBorderParents(makeSyntheticMixedAsset(8)));
}

TEST(SurfaceContinuity, levelsOfEqualErrorDoNotPop)
{
    LodAsset asset = makeSyntheticAsset(8, false);
    for (std::size_t level : {1U, 2U}) { asset.levels[level].errors = asset.levels[0].errors; }
    expectContinuous(std::move(asset));
}

} // namespace
} // namespace osgTessLOD
