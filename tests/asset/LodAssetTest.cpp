// SPDX-License-Identifier: MIT
#include "SyntheticAsset.h"

#include <osgTessLOD/asset/AssetError.h>

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace osgTessLOD {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(LodVertex, packsItsFourNumbersAndGivesThemBack)
{
    std::mt19937 random(8);
    const auto check = [](const std::array<std::int32_t, 3>& offset, std::uint32_t parent) {
        const LodVertex v = LodVertex::pack(offset, parent);
        EXPECT_EQ(v.offset(), offset);
        EXPECT_EQ(v.parent(), parent);
    };
    for (int k = 0; k < 1000; ++k) {
        const auto any = [&] { return static_cast<std::int32_t>(random() & 0x1FFFF); };
        check({any(), any(), any()}, random() & LodVertex::kMaxParent);
    }
    check({Lattice::kMaxOffset, 0, 0}, 0);
    check({0, Lattice::kMaxOffset, 0}, 0);
    check({0, 0, Lattice::kMaxOffset}, 0);
    check({0, 0, 0}, LodVertex::kMaxParent);
    EXPECT_EQ(LodVertex::pack({1, 1, 1}, 1).bits, 1ULL | 1ULL << 17 | 1ULL << 34 | 1ULL << 51);
}

TEST(LodAsset, OpenBordersMayEndBeforeTheirPatchAndStayThere)
{
    const LodAsset sheet = makeSyntheticSheet(8);
    EXPECT_FALSE(sheet.hasSeams());
    const LodAsset seams = withSeams(sheet);
    EXPECT_TRUE(seams.hasSeams());
    EXPECT_NO_THROW(seams.validate());
    const auto open = std::find_if(sheet.edges.begin(), sheet.edges.end(),
                                   [](const LodEdge& edge) { return edge.patches[1] == kNoPatch; });
    const auto at = static_cast<std::size_t>(open - sheet.edges.begin());
    LodAsset asset = sheet;
    asset.edges[at].finestLevel = 4; // of 0 … 3
    EXPECT_THROW(asset.validate(), AssetError);
    asset.edges[at].finestLevel = 2;
    EXPECT_NO_THROW(asset.validate());
    asset.edges[at].coarsestLevel = 1;
    EXPECT_THROW(asset.validate(), AssetError) << "neither drawn as fine as may be nor fixed";
    LodAsset inside = sheet;
    const auto shared = std::find_if(inside.edges.begin(), inside.edges.end(),
                                     [](const LodEdge& edge) { return edge.patches[1] != kNoPatch; });
    shared->coarsestLevel = shared->finestLevel;
    EXPECT_THROW(inside.validate(), AssetError);
}

TEST(LodAsset, positionIsTheIntegerSumTimesTheStep)
{
    LodAsset asset;
    asset.lattice.step = 0.1F;
    LodPatch patch;
    patch.latticeOrigin = {-100, 0, 1 << 20};
    const auto p = asset.position(patch, LodVertex::pack({30, 7, Lattice::kMaxOffset}, 0));
    EXPECT_EQ(p[0], -70.0F * 0.1F);
    EXPECT_EQ(p[1], 7.0F * 0.1F);
    EXPECT_EQ(p[2], float((1 << 20) + Lattice::kMaxOffset) * 0.1F);
}

TEST(LodAsset, levelSlotsNumberThePatchesThatReachALevel)
{
    LodAsset asset;
    asset.patches.resize(4);
    asset.patches[0].finestLevel = 2;
    asset.patches[1].finestLevel = 0;
    asset.patches[2].finestLevel = 1;
    asset.patches[3].finestLevel = 2;
    EXPECT_EQ(asset.levelSlots(0), (std::vector<std::uint32_t>{0, 1, 2, 3}));
    EXPECT_EQ(asset.levelSlots(1), (std::vector<std::uint32_t>{0, kNoPatch, 1, 2}));
    EXPECT_EQ(asset.levelSlots(2), (std::vector<std::uint32_t>{0, kNoPatch, kNoPatch, 1}));
    EXPECT_EQ(asset.levelSlots(3), (std::vector<std::uint32_t>{kNoPatch, kNoPatch, kNoPatch, kNoPatch}));
}

TEST(LodAsset, syntheticAssetsAreValid)
{
    for (const unsigned factor : {1U, 2U, 8U, 64U}) {
        EXPECT_NO_THROW(makeSyntheticAsset(factor).validate()) << factor;
        EXPECT_NO_THROW(makeSyntheticSheet(factor).validate()) << factor;
        EXPECT_NO_THROW(makeSyntheticDisplacedAsset(factor).validate()) << factor;
        EXPECT_NO_THROW(makeSyntheticMixedAsset(factor).validate()) << factor;
    }
    EXPECT_NO_THROW(
        synthetic::build(synthetic::bumpySphere(), {1, 2, 6, 10, 16}, true, {4, 2, 1, 4, 0, 3, 2, 4}, true).validate());
    const LodAsset asset = makeSyntheticAsset(16);
    EXPECT_EQ(asset.patches.size(), 8U);
    EXPECT_EQ(asset.edges.size(), 12U);
    EXPECT_EQ(asset.normals.resolution, 16U);
    for (const LodEdge& edge : asset.edges) { EXPECT_NE(edge.patches[1], kNoPatch); }
    const LodAsset sheet = makeSyntheticSheet();
    EXPECT_EQ(std::count_if(sheet.edges.begin(), sheet.edges.end(),
                            [](const LodEdge& edge) { return edge.patches[1] == kNoPatch; }),
              8);
}

TEST(LodAsset, anyLadderMayBeValid)
{
    const auto dense = synthetic::build(synthetic::bumpySphere(), {1, 2, 4, 6, 8, 12, 16, 24, 32, 48, 64}, false);
    EXPECT_NO_THROW(dense.validate());
    const auto jump = synthetic::build(synthetic::bumpySphere(), {1, 16}, false);
    EXPECT_NO_THROW(jump.validate());
    const auto high = synthetic::build(synthetic::wavySheet(1), {1, 64, 128}, false);
    EXPECT_NO_THROW(high.validate());
}

/// A change to the asset of the tests below and a part of the message it must give.
struct Corruption {
    const char* message;
    std::function<void(LodAsset&)> apply;
};

LodVertex& vertexOf(LodAsset& a, std::size_t level, std::size_t patch, std::uint32_t vertex)
{
    return a.levels[level].vertices[patch * TessellationPattern::vertexCount(a.ladder[level]) + vertex];
}

void setParent(LodAsset& a, std::size_t level, std::size_t patch, std::uint32_t vertex, std::uint32_t parent)
{
    LodVertex& v = vertexOf(a, level, patch, vertex);
    v = LodVertex::pack(v.offset(), parent);
}

void moveVertex(LodAsset& a, std::size_t level, std::size_t patch, std::uint32_t vertex)
{
    LodVertex& v = vertexOf(a, level, patch, vertex);
    auto offset = v.offset();
    offset[0] += offset[0] == 0 ? 1 : -1;
    v = LodVertex::pack(offset, v.parent());
}

const std::vector<Corruption>& frameCorruptions()
{
    static const std::vector<Corruption> list{
        {"ladder has 0 levels", [](LodAsset& a) { a.ladder.clear(); }},
        {"ladder has 17 levels", [](LodAsset& a) { a.ladder.resize(17); }},
        {"ladder starts with factor 2", [](LodAsset& a) { a.ladder[0] = 2; }},
        {"invalid factor 3", [](LodAsset& a) { a.ladder[1] = 3; }},
        {"invalid factor 130", [](LodAsset& a) { a.ladder[3] = 130; }},
        {"ladder does not rise at level 2", [](LodAsset& a) { a.ladder[2] = 2; }},
        {"13 bits", [](LodAsset& a) { a.ladder[2] = 126, a.ladder[3] = 128; }},
        {"3 levels for a ladder of 4", [](LodAsset& a) { a.levels.pop_back(); }},
        {"lattice step", [](LodAsset& a) { a.lattice.step = 0.0F; }},
        {"lattice step", [](LodAsset& a) { a.lattice.step = -1.0F; }},
        {"lattice step", [](LodAsset& a) { a.lattice.step = kNaN; }},
        {"lattice step", [](LodAsset& a) { a.lattice.step = 1e30F; }},
        {"lattice origin is not finite", [](LodAsset& a) { a.lattice.origin[1] = kInfinity; }},
        {"bounds are not finite", [](LodAsset& a) { a.boundsMin[2] = -kInfinity; }},
        {"bounds are not finite", [](LodAsset& a) { a.boundsMax[0] = kNaN; }},
        {"bounds are empty", [](LodAsset& a) { a.boundsMin[0] = a.boundsMax[0] + 1.0F; }},
        {"normal resolution 3", [](LodAsset& a) { a.normals.resolution = 3; }},
        {"normal resolution 2048", [](LodAsset& a) { a.normals.resolution = 2048; }},
        {"normals have too few levels", [](LodAsset& a) { a.normals.levels.pop_back(); }},
        {"normals have too many levels", [](LodAsset& a) { a.normals.levels.emplace_back(); }},
        {"normals of resolution 0 with levels", [](LodAsset& a) { a.normals.resolution = 0; }},
        {"normals of resolution 4", [](LodAsset& a) { a.normals.levels[2].pop_back(); }},
    };
    return list;
}

const std::vector<Corruption>& topologyCorruptions()
{
    static const std::vector<Corruption> list{
        {"no patches", [](LodAsset& a) { a.patches.clear(); }},
        {"base vertex out of range", [](LodAsset& a) { a.patches[5].baseVertices[1] = 6; }},
        {"edge out of range", [](LodAsset& a) { a.patches[5].edges[1] = 12; }},
        {"the same corner twice", [](LodAsset& a) { a.patches[0].baseVertices[1] = a.patches[0].baseVertices[0]; }},
        {"lattice origin too large", [](LodAsset& a) { a.patches[2].latticeOrigin[0] = 0x7FFFFFFF; }},
        {"finest level out of range", [](LodAsset& a) { a.patches[7].finestLevel = 4; }},
        {"bounding sphere", [](LodAsset& a) { a.patches[1].boundCenter[1] = kNaN; }},
        {"bounding sphere", [](LodAsset& a) { a.patches[1].boundRadius = -1.0F; }},
        {"chart error", [](LodAsset& a) { a.patches[1].chartError = kInfinity; }},
        {"chart error", [](LodAsset& a) { a.patches[1].chartError = -0.1F; }},
        {"normal cone", [](LodAsset& a) { a.patches[1].coneAxis[0] = kNaN; }},
        {"normal cone", [](LodAsset& a) { a.levels[1].errors[1].coneCosine = 1.5F; }},
        {"normal cone", [](LodAsset& a) { a.levels[1].errors[1].coneCosine = kNaN; }},
        {"not a unit vector", [](LodAsset& a) { a.patches[1].coneAxis = {0.0F, 0.0F, 0.5F}; }},
        {"patch out of range", [](LodAsset& a) { a.edges[3].patches[0] = kNoPatch; }},
        {"patch out of range", [](LodAsset& a) { a.edges[3].patches[1] = 8; }},
        {"the same patch on both sides", [](LodAsset& a) { a.edges[3].patches[1] = a.edges[3].patches[0]; }},
        {"right direction", [](LodAsset& a) { std::swap(a.edges[3].patches[0], a.edges[3].patches[1]); }},
        {"right direction", [](LodAsset& a) { std::swap(a.edges[3].baseVertices[0], a.edges[3].baseVertices[1]); }},
        {"does not refer back", [](LodAsset& a) { a.edges[3].patches[1] = (a.edges[3].patches[1] + 4) % 8; }},
        {"does not refer back", [](LodAsset& a) { a.edges[3].patches[1] = kNoPatch; }}, // patch → edge
        {"finest level is not the smaller", [](LodAsset& a) { a.edges[3].finestLevel = 1; }},
    };
    return list;
}

const std::vector<Corruption>& levelCorruptions()
{
    // Factor 8, level 3; level 2 has factor 4. Vertex 3 of side 0 parents to 2, vertex 16 is corner 2, 24 … are inner.
    static const std::vector<Corruption> list{
        {"level 2: ", [](LodAsset& a) { a.levels[2].vertices.pop_back(); }},
        {"level 2: 7 errors, not 8", [](LodAsset& a) { a.levels[2].errors.pop_back(); }},
        {"level 1, error 3", [](LodAsset& a) { a.levels[1].errors[3].isotropic = -1.0F; }},
        {"level 1, error 3", [](LodAsset& a) { a.levels[1].errors[3].isotropic = kNaN; }},
        {"level 1, error 3", [](LodAsset& a) { a.levels[1].errors[3].quadratic.q[4] = kInfinity; }},
        {"level 1, error 3", [](LodAsset& a) { a.levels[1].errors[3].quadratic.q[1] = -1.0F; }},
        {"patch 4, level 0: parent out of range", [](LodAsset& a) { setParent(a, 0, 4, 1, 1); }},
        {"patch 4, level 3: parent out of range", [](LodAsset& a) { setParent(a, 3, 4, 30, 19); }},
        {"patch 4, level 1: parent out of range", [](LodAsset& a) { setParent(a, 1, 4, 6, 3); }},
        {"parent of a corner", [](LodAsset& a) { setParent(a, 3, 4, 16, 9); }},
        {"vertex 3: parent is not on the same border", [](LodAsset& a) { setParent(a, 3, 4, 3, 13); }}, // inner
        {"vertex 3: parent is not on the same border", [](LodAsset& a) { setParent(a, 3, 4, 3, 5); }},  // next side
        {"vertex 3: parent is not on the same border", [](LodAsset& a) { setParent(a, 3, 4, 3, 0); }},  // backwards
        {"vertex 3: parent is not on the same border", [](LodAsset& a) { setParent(a, 3, 4, 3, 3); }},  // a gap
        {"leaves out part of the border",
         [](LodAsset& a) { // parents 0 1 1 1 1 1 1 2 of 0 … 4
             for (std::uint32_t v = 1; v < 7; ++v) { setParent(a, 3, 4, v, 1); }
             setParent(a, 3, 4, 7, 2);
         }},
        {"corner is not at its base vertex", [](LodAsset& a) { moveVertex(a, 3, 4, 16); }},
        {"corner is not at its base vertex", [](LodAsset& a) { ++a.baseVertices[2][0]; }},
        {"level 3, position 3: its patches' vertices differ",
         [](LodAsset& a) {
             const LodEdge& edge = a.edges[a.patches[4].edges[0]];
             moveVertex(a, 3, 4, edge.patches[0] == 4 ? 3 : 5);
         }},
        {"position 4: its patches' parents differ",
         [](LodAsset& a) { // in order on either side, but the middle goes to the left on this one only
             const LodEdge& edge = a.edges[a.patches[4].edges[0]];
             ASSERT_EQ(edge.patches[0], 4U);
             setParent(a, 3, 4, 3, 1);
             setParent(a, 3, 4, 4, 1);
             const std::uint32_t other = edge.patches[1];
             const auto& sides = a.patches[other].edges;
             const auto side = static_cast<std::uint32_t>(
                 std::find(sides.begin(), sides.end(), a.patches[4].edges[0]) - sides.begin());
             setParent(a, 3, other, 8 * side + 5, 4 * side + 3);
         }},
    };
    return list;
}

const std::vector<Corruption>& parameterCorruptions()
{
    // Levels 1 and 2, of factors 2 and 4, have parameters. Of factor 4, vertex 1 is of side 0, 4 corner 1, 12 … are inner.
    static constexpr std::int32_t kUnits = ChartPoint::kUnits;
    static const auto parameter = [](LodAsset& a, std::uint32_t vertex) -> std::uint32_t& {
        return a.levels[2].parameters[4 * TessellationPattern::vertexCount(4) + vertex];
    };
    static const std::vector<Corruption> list{
        {"level 2: 151 parameters, not 152 or none", [](LodAsset& a) { a.levels[2].parameters.pop_back(); }},
        {"level 3: 1 parameters, not", [](LodAsset& a) { a.levels[3].parameters.push_back(0); }},
        {"patch 4, level 2, vertex 13: parameters are outside",
         [](LodAsset& a) {
             parameter(a, 13) = ChartPoint{kUnits / 2, kUnits / 2 + 1}.bits();
         }},
        {"vertex 13: parameters are outside", [](LodAsset& a) { parameter(a, 13) = 0xFFFF; }},
        {"vertex 4: parameters of a corner",
         [](LodAsset& a) {
             parameter(a, 4) = ChartPoint{kUnits - 1, 1}.bits();
         }},
        {"vertex 1: parameters are not on", [](LodAsset& a) { parameter(a, 1) += 1U << 16; }},
        {"vertex 5: parameters are not on", [](LodAsset& a) { parameter(a, 5) -= 1; }},
        {"vertex 9: parameters are not on", [](LodAsset& a) { parameter(a, 9) += 1; }},
        {"its patches' parameters differ", [](LodAsset& a) { parameter(a, 1) += 1; }},
        {"its patches' parameters differ", [](LodAsset& a) { parameter(a, 5) += 0xFFFF; }}, // u − 1, v + 1
    };
    return list;
}

void expectRejected(const std::vector<Corruption>& corruptions, const LodAsset& sound = makeSyntheticAsset(8))
{
    for (std::size_t k = 0; k < corruptions.size(); ++k) {
        LodAsset asset = sound;
        corruptions[k].apply(asset);
        try {
            asset.validate();
            ADD_FAILURE() << "accepted corruption " << k << ": " << corruptions[k].message;
        } catch (const AssetError& error) {
            EXPECT_NE(std::string(error.what()).find(corruptions[k].message), std::string::npos)
                << "corruption " << k << ": \"" << error.what() << "\" does not say \"" << corruptions[k].message << '"';
        }
    }
}

TEST(LodAsset, rejectsAFrameThatIsWrong) { expectRejected(frameCorruptions()); }

TEST(LodAsset, rejectsWrongTopology) { expectRejected(topologyCorruptions()); }

TEST(LodAsset, rejectsWrongLevels)
{
    expectRejected(levelCorruptions());
}

TEST(LodAsset, rejectsWrongParameters)
{
    expectRejected(parameterCorruptions(), makeSyntheticDisplacedAsset(8));
}

TEST(LodAsset, rejectsWrongAttributes)
{
    const std::vector<Corruption> list{
        {"level 2: 151 texture coordinates, not 152", [](LodAsset& a) { a.levels[2].uvs.pop_back(); }},
        {"level 1: 0 texture coordinates, not 56", [](LodAsset& a) { a.levels[1].uvs.clear(); }},
        {"level 1: 7 errors of texture coordinates, not 8", [](LodAsset& a) { a.levels[1].uvErrors.pop_back(); }},
        {"level 1: errors of texture coordinates are not", [](LodAsset& a) { a.levels[1].uvErrors[3] = -1.0F; }},
        {"level 1: errors of texture coordinates are not", [](LodAsset& a) { a.levels[1].uvErrors[3] = kNaN; }},
        {"level 0, vertex 5: texture coordinates out of range", [](LodAsset& a) { a.levels[0].uvs[5] = 0xFFFF; }},
        {"level 0, vertex 5: texture coordinates out of range", [](LodAsset& a) { a.levels[0].uvs[5] = 0xFFFF0000U; }},
        {"grid of texture coordinates is not finite", [](LodAsset& a) { a.uvLattice.step[1] = -1.0F; }},
        {"grid of texture coordinates is not finite", [](LodAsset& a) { a.uvLattice.step[0] = 1e38F; }},
        {"grid of texture coordinates is not finite", [](LodAsset& a) { a.uvLattice.origin[0] = kNaN; }},
        {"level 3: 1 colours, not 488", [](LodAsset& a) { a.levels[3].colors.resize(1); }},
        {"its patches' colours differ", [](LodAsset& a) { a.levels[2].colors[4 * 19 + 1] ^= 1U; }},
    };
    expectRejected(list, withAttributes(makeSyntheticAsset(8)));
}

TEST(LodAsset, uvsAreOffByHalfAStepAtMost)
{
    const UvLattice lattice{{-1.5F, 0.25F}, {3.0F / UvLattice::kUnits, 0.5F / UvLattice::kUnits}};
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(0.0F, 1.0F);
    for (int k = 0; k < 1000; ++k) {
        const float u = -1.5F + 3.0F * unit(random);
        const float v = 0.25F + 0.5F * unit(random);
        const auto back = lattice.decode(lattice.encode(u, v));
        // Beside half a step, single precision's rounding of numbers up to 1.5.
        EXPECT_NEAR(back[0], u, 0.5F * lattice.step[0] + 2e-7F);
        EXPECT_NEAR(back[1], v, 0.5F * lattice.step[1] + 2e-7F);
        EXPECT_EQ(back[2], 1.0F);
    }
    EXPECT_EQ(lattice.encode(2e6F, -2e6F), UvLattice::kUnits); // to the box
    EXPECT_EQ(lattice.encode(std::numeric_limits<float>::quiet_NaN(), 0.0F), UvLattice::kNone);
    EXPECT_EQ(lattice.decode(UvLattice::kNone), (std::array<float, 3>{0.0F, 0.0F, 0.0F}));
    EXPECT_EQ((UvLattice{{0.5F, 0.5F}, {0.0F, 0.0F}}).encode(0.5F, 0.5F), 0U) << "a single point";
}

TEST(LodAsset, sharedBordersAreComparedUpToTheEdgesFinestLevelOnly)
{
    // Where a neighbour stops at level 1, the finer patch's border at level 3 is its own affair.
    auto shape = synthetic::bumpySphere();
    LodAsset asset = synthetic::build(shape, synthetic::powersOfTwo(8), false, {3, 1, 1, 1, 1, 1, 1, 1});
    moveVertex(asset, 3, 0, 3);
    EXPECT_NO_THROW(asset.validate());
    moveVertex(asset, 1, 0, 1);
    EXPECT_THROW(asset.validate(), AssetError);
}

TEST(LodAsset, syntheticBoundsHoldTheSurface)
{
    for (const LodAsset& asset : {makeSyntheticAsset(8), makeSyntheticSheet(8)}) {
        for (std::size_t level = 0; level < asset.levels.size(); ++level) {
            const std::size_t count = TessellationPattern::vertexCount(asset.ladder[level]);
            for (std::size_t v = 0; v < asset.levels[level].vertices.size(); ++v) {
                const LodPatch& patch = asset.patches[v / count]; // every patch reaches every level
                const auto p = asset.position(patch, asset.levels[level].vertices[v]);
                double squared = 0.0;
                for (std::size_t k = 0; k < 3; ++k) {
                    EXPECT_GE(p[k], asset.boundsMin[k]);
                    EXPECT_LE(p[k], asset.boundsMax[k]);
                    squared += std::pow(double{p[k]} - double{patch.boundCenter[k]}, 2);
                }
                EXPECT_LE(std::sqrt(squared), patch.boundRadius);
            }
        }
    }
}

} // namespace
} // namespace osgTessLOD
