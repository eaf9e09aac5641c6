// SPDX-License-Identifier: MIT
// The strips technique as a whole.
#include <bake/BumpyMap.h>
#include <bake/SmallTopologies.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/StripSimplifier.h>

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <set>

namespace osgTessLOD::bake {
namespace {

using Ladder = std::vector<std::uint16_t>;

LevelHierarchy simplified(const PatchMap& map, const Ladder& ladder, const StripOptions& options,
                          StripReport* report = nullptr)
{
    Progress progress;
    unsigned chartFactor = 2;
    while (chartFactor < 2U * ladder.back()) { chartFactor *= 2; }
    const ChartSet charts = makeCharts(map, chartFactor, progress);
    return makeStripLevels(map.topology(), charts, ladder, options, progress, report);
}

void expectPositiveTriangles(const LevelHierarchy& hierarchy)
{
    for (std::size_t level = hierarchy.ladder.front() == 1 ? 1 : 0; level + 1 < hierarchy.ladder.size(); ++level) {
        const TessellationPattern pattern(hierarchy.ladder[level]);
        for (const PatchLevels& patch : hierarchy.patches) {
            const auto& at = patch.parameters[level];
            ASSERT_EQ(at.size(), pattern.vertexCount());
            for (const auto& t : pattern.triangles()) { ASSERT_GT(orientation(at[t[0]], at[t[1]], at[t[2]]), 0); }
        }
    }
}

/// Every coarse triangle is the image of exactly one fine one, and no other image is a triangle.
void expectParentsCoverThePattern(const LevelHierarchy& hierarchy)
{
    for (std::size_t level = 1; level < hierarchy.ladder.size(); ++level) {
        if (hierarchy.ladder[level - 1] == 1) { continue; }
        const TessellationPattern fine(hierarchy.ladder[level]), coarse(hierarchy.ladder[level - 1]);
        const auto canonical = [](TessellationPattern::Triangle t) {
            std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
            return t;
        };
        std::multiset<TessellationPattern::Triangle> expected;
        for (const auto& t : coarse.triangles()) { expected.insert(canonical(t)); }
        for (const PatchLevels& patch : hierarchy.patches) {
            const auto& parents = patch.parents[level];
            std::multiset<TessellationPattern::Triangle> images;
            for (const auto& t : fine.triangles()) {
                const TessellationPattern::Triangle image{parents[t[0]], parents[t[1]], parents[t[2]]};
                if (image[0] != image[1] && image[1] != image[2] && image[2] != image[0]) {
                    images.insert(canonical(image));
                }
            }
            ASSERT_EQ(images, expected);
        }
    }
}

void expectSharedBorders(const PatchTopology& topology, const LevelHierarchy& hierarchy)
{
    for (std::size_t level = 0; level < hierarchy.ladder.size(); ++level) {
        const unsigned factor = hierarchy.ladder[level];
        for (const auto& edge : topology.edges) {
            if (edge.patches[1] == kNoPatch || factor == 1) { continue; }
            const PatchLevels &a = hierarchy.patches[edge.patches[0]], &b = hierarchy.patches[edge.patches[1]];
            for (unsigned step = 1; step < factor; ++step) {
                const std::uint32_t u = borderVertex(edge, 0, factor, step), v = borderVertex(edge, 1, factor, step);
                ASSERT_EQ(a.positions[level][u], b.positions[level][v]);
                if (level + 1 == hierarchy.ladder.size()) { continue; } // at the pattern's places
                const auto along = alongBorder(edge.sides[0], a.parameters[level][u]);
                ASSERT_EQ(borderParameter(edge.sides[0], along), a.parameters[level][u]);
                ASSERT_EQ(borderParameter(edge.sides[1], ChartPoint::kUnits - along), b.parameters[level][v]);
            }
        }
    }
}

TEST(StripSimplifier, LevelsAreSoundWhateverTheSurfaceAndMethod)
{
    const Ladder ladder{1, 2, 4, 6, 8, 16};
    for (const auto& [name, topology] : smallTopologies()) {
        SCOPED_TRACE(name);
        const BumpyMap map(topology, 0.3, true);
        for (const PlacementMethod placement :
             {PlacementMethod::VolumeUv, PlacementMethod::Quadric, PlacementMethod::LindstromTurk}) {
            for (const StripOptions::Strips strips : {StripOptions::Strips::Optimal, StripOptions::Strips::Straight}) {
                for (const StripOptions::Cost cost : {StripOptions::Cost::Residual, StripOptions::Cost::ViewError}) {
                    StripOptions options;
                    options.placement = placement;
                    options.strips = strips;
                    options.cost = cost;
                    const LevelHierarchy hierarchy = simplified(map, ladder, options);
                    expectPositiveTriangles(hierarchy);
                    expectParentsCoverThePattern(hierarchy);
                    expectSharedBorders(topology, hierarchy);
                }
            }
        }
    }
}

TEST(StripSimplifier, KeepsCornersAndTheFinestLevelsParameters)
{
    const BumpyMap map(tetrahedron());
    const LevelHierarchy hierarchy = simplified(map, {2, 8, 32}, StripOptions());
    for (const PatchLevels& patch : hierarchy.patches) {
        for (std::size_t level = 0; level < 3; ++level) {
            const unsigned factor = hierarchy.ladder[level];
            for (unsigned k = 0; k < 3; ++k) {
                EXPECT_EQ(patch.positions[level][k * factor], patch.positions[2][k * 32]);
                if (level < 2) { EXPECT_EQ(patch.parameters[level][k * factor], borderParameter(k, 0)); }
            }
        }
        EXPECT_TRUE(patch.parameters[2].empty()) << "at the pattern's places";
    }
}

TEST(StripSimplifier, StraightStripsHaveTheTessellatorsParents)
{
    StripOptions options;
    options.strips = StripOptions::Strips::Straight;
    const BumpyMap map(tetrahedron());
    const LevelHierarchy hierarchy = simplified(map, {1, 2, 4, 8, 16, 32}, options);
    for (const PatchLevels& patch : hierarchy.patches) {
        for (std::size_t level = 2; level < 6; ++level) {
            for (std::uint32_t v = 0; v < patch.parents[level].size(); ++v) {
                ASSERT_EQ(patch.parents[level][v], TessellationPattern::tessellatorAncestor(
                                                       hierarchy.ladder[level], v, hierarchy.ladder[level - 1]));
            }
        }
    }
}

TEST(StripSimplifier, TakesAnyLadder)
{
    const PatchTopology topology = tetrahedron();
    const BumpyMap map(topology);
    for (const Ladder& ladder :
         {Ladder{1}, Ladder{2}, Ladder{1, 2}, Ladder{1, 8}, Ladder{4, 6}, Ladder{1, 4, 6, 10, 16}}) {
        const LevelHierarchy hierarchy = simplified(map, ladder, StripOptions());
        EXPECT_EQ(hierarchy.ladder, ladder);
        for (std::size_t level = 0; level < ladder.size(); ++level) {
            for (const PatchLevels& patch : hierarchy.patches) {
                EXPECT_EQ(patch.positions[level].size(), TessellationPattern::vertexCount(ladder[level]));
                if (level == 0) { continue; }
                ASSERT_EQ(patch.parents[level].size(), TessellationPattern::vertexCount(ladder[level]));
                for (const std::uint32_t parent : patch.parents[level]) {
                    EXPECT_LT(parent, TessellationPattern::vertexCount(ladder[level - 1]));
                }
            }
        }
        expectPositiveTriangles(hierarchy);
        expectParentsCoverThePattern(hierarchy);
    }
}

TEST(StripSimplifier, SameLevelsWhateverTheThreads)
{
    const BumpyMap map(torusOfPatches(), 0.2, true);
    const Ladder ladder{1, 2, 4, 8, 16};
    std::vector<LevelHierarchy> results;
    for (const std::size_t threads : {1, 2, 5}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        results.push_back(simplified(map, ladder, StripOptions()));
    }
    for (std::size_t p = 0; p < results[0].patches.size(); ++p) {
        for (std::size_t r = 1; r < results.size(); ++r) {
            EXPECT_EQ(results[0].patches[p].positions, results[r].patches[p].positions);
            EXPECT_EQ(results[0].patches[p].parents, results[r].patches[p].parents);
            EXPECT_EQ(results[0].patches[p].parameters, results[r].patches[p].parameters);
        }
    }
}

TEST(StripSimplifier, StopsWhenAsked)
{
    class Impatient : public Progress {
    public:
        void begin(const std::string& stage, std::uint64_t, const std::string&) override
        {
            inStrips = stage == "strips";
        }
        bool stopRequested() const override { return inStrips; }
        bool inStrips = false;
    } progress;
    const BumpyMap map(tetrahedron());
    const ChartSet charts = makeCharts(map, 32, progress);
    EXPECT_THROW(makeStripLevels(map.topology(), charts, {1, 2, 4, 8, 16}, StripOptions(), progress), Interrupted);
}

} // namespace
} // namespace osgTessLOD::bake
