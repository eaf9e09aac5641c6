// SPDX-License-Identifier: MIT
// Which levels are stored, and what the errors of those that are then stand for.
#include <asset/OpenEdges.h>
#include <bake/ProceduralMeshes.h>
#include <bake/SmallTopologies.h>

#include <osgTessLOD/asset/AssetSummary.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/FinestLevels.h>
#include <osgTessLOD/bake/LevelErrors.h>
#include <osgTessLOD/bake/StripSimplifier.h>
#include <osgTessLOD/bake/UniformLevels.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

// ---- the choice, with errors made up

constexpr std::uint8_t kLast = 6;

std::vector<FinestLevels> choose(const PatchTopology& topology, double tolerance, const ErrorAtFinest& error)
{
    Progress progress;
    return chooseFinestLevels(topology, kLast, tolerance, error, progress);
}

std::vector<unsigned> levelsOf(const std::vector<FinestLevels>& finest)
{
    std::vector<unsigned> levels;
    for (const FinestLevels& f : finest) { levels.push_back(f.patch); }
    return levels;
}

/// How far the coarsest border of a patch stays behind.
unsigned lagOf(const FinestLevels& finest)
{
    return finest.patch - *std::min_element(finest.borders.begin(), finest.borders.end());
}

TEST(ChooseFinestLevels, KeepsAllWithoutTolerance)
{
    const auto finest = choose(tetrahedron(), 0.0, [](std::uint32_t, const FinestLevels&) -> double {
        throw std::logic_error("there is nothing to measure");
    });
    ASSERT_EQ(finest.size(), 4U);
    for (const FinestLevels& f : finest) {
        EXPECT_EQ(f.patch, kLast);
        EXPECT_EQ(f.borders, (std::array<std::uint8_t, 3>{kLast, kLast, kLast}));
    }
}

TEST(ChooseFinestLevels, TakesTheCoarsestFromWhichOnAllAreGoodEnough)
{
    // Of a single patch: level 2 would do, were level 3 not worse.
    const std::vector<double> errors{9, 8, 1, 5, 2, 1, 0.5};
    const PatchTopology single = PatchTopology::build(3, {{0, 1, 2}});
    const auto error = [&](std::uint32_t, const FinestLevels& f) { return errors[f.patch]; };
    EXPECT_EQ(levelsOf(choose(single, 2.0, error)), std::vector<unsigned>{4});
    EXPECT_EQ(levelsOf(choose(single, 5.0, error)), std::vector<unsigned>{2});
    EXPECT_EQ(levelsOf(choose(single, 9.0, error)), std::vector<unsigned>{0});
    EXPECT_EQ(levelsOf(choose(single, 0.1, error)), std::vector<unsigned>{6});
}

TEST(ChooseFinestLevels, OneNeighbourTakesAPatchAsFarAsItNeedsToGo)
{
    // Patch 0 of a tetrahedron needs level 4, the others none. A patch is drawn at the largest of its borders' levels.
    const auto error = [](std::uint32_t p, const FinestLevels& f) { return p == 0 && f.patch < 4 ? 1.0 : 0.0; };
    const auto finest = choose(tetrahedron(), 0.5, error);
    std::vector<unsigned> levels = levelsOf(finest);
    EXPECT_EQ(levels[0], 4U);
    std::sort(levels.begin(), levels.end());
    EXPECT_EQ(levels, (std::vector<unsigned>{0, 0, 4, 4}));
}

TEST(ChooseFinestLevels, NeighboursFollowAsFarAsALaggingBorderCosts)
{
    // Patch 0 of a fan needs level 5; a border that stays behind by more than two levels is too much for any patch.
    const auto error = [](std::uint32_t p, const FinestLevels& f) {
        return (p == 0 && f.patch < 5) || lagOf(f) > 2 ? 1.0 : 0.0;
    };
    // Its outer border is open. Around it 5, 3, 1, 0 would do for lagging.
    EXPECT_EQ(levelsOf(choose(closedFan(8), 0.5, error)), (std::vector<unsigned>{5, 3, 1, 0, 0, 0, 1, 3}));
}

TEST(ChooseFinestLevels, OnlyBordersThatCostSomethingBecomeFiner)
{
    // Patch 0 of a fan needs level 3; its side 1 is open. Side 0 may not stay behind, side 2 may.
    const auto needsSide0 = [](std::uint32_t p, const FinestLevels& f) {
        return p == 0 && (f.patch < 3 || f.borders[0] < 3) ? 1.0 : 0.0;
    };
    EXPECT_EQ(choose(closedFan(8), 0.5, needsSide0)[0].borders, (std::array<std::uint8_t, 3>{3, 3, 0}));
    // Each may, but not both, unless by one level.
    const auto needsEither = [](std::uint32_t p, const FinestLevels& f) {
        return p == 0 && (f.patch < 3 || (f.borders[0] < 2 && f.borders[2] < 2)) ? 1.0 : 0.0;
    };
    EXPECT_EQ(choose(closedFan(8), 0.5, needsEither)[0].borders, (std::array<std::uint8_t, 3>{2, 3, 2}));
}

TEST(ChooseFinestLevels, RoughPatchesGetNoWorseByTheirNeighbours)
{
    // Patch 0 is above the tolerance even at the last level, by itself; lagging by two levels or more adds to it.
    const auto error = [](std::uint32_t p, const FinestLevels& f) {
        return (p == 0 ? 7.0 : 0.0) + (lagOf(f) > 1 ? 0.25 : 0.0);
    };
    const auto finest = choose(closedFan(6), 0.5, error);
    EXPECT_EQ(levelsOf(finest), (std::vector<unsigned>{6, 5, 0, 0, 0, 5})) << "0.25 is nothing to the others";
}

TEST(ChooseFinestLevels, HoldsWhateverTheErrors)
{
    std::mt19937 random(17);
    for (const auto& [name, topology] : smallTopologies()) {
        SCOPED_TRACE(name);
        for (int trial = 0; trial < 20; ++trial) {
            std::vector<std::vector<double>> own(topology.patches.size());
            for (auto& levels : own) {
                const double scale = std::exp(std::normal_distribution<double>(0.0, 3.0)(random));
                for (unsigned level = 0; level <= kLast; ++level) {
                    levels.push_back(scale *
                                     std::exp(-1.0 * level + std::normal_distribution<double>(0.0, 0.3)(random)));
                }
            }
            const auto error = [&](std::uint32_t p, const FinestLevels& f) {
                return own[p][f.patch] + 0.2 * own[p][f.patch - lagOf(f)] * lagOf(f);
            };
            const double tolerance = 0.05;
            const auto finest = choose(topology, tolerance, error);
            for (std::uint32_t p = 0; p < finest.size(); ++p) {
                const double allowed = finest[p].patch == kLast ? std::max(tolerance, own[p][kLast]) : tolerance;
                EXPECT_LE(error(p, finest[p]), allowed);
                EXPECT_EQ(*std::max_element(finest[p].borders.begin(), finest[p].borders.end()), finest[p].patch)
                    << "a patch is drawn at the largest of its borders' levels";
                for (std::size_t side = 0; side < 3; ++side) {
                    std::uint8_t least = finest[p].patch;
                    for (const std::uint32_t q : topology.edges[topology.patchEdges[p][side]].patches) {
                        if (q != kNoPatch) { least = std::min(least, finest[q].patch); }
                    }
                    EXPECT_EQ(finest[p].borders[side], least);
                }
            }
        }
    }
}

// ---- assets

/// An octahedron of 32 flat patches, with bumps around one of its corners: closed.
class PartlyFlatMap : public PatchMap {
public:
    PartlyFlatMap()
    {
        const SourceMesh mesh = sphere(1);
        _topology = PatchTopology::build(static_cast<std::uint32_t>(mesh.positions.size()), mesh.triangles);
        for (const Vector3d& p : mesh.positions) { _base.emplace_back(p / p.lpNorm<1>()); }
        _name = "partly flat";
    }
    std::uint64_t sourceTriangles() const override { return 0; }
    SurfacePoint evaluate(std::uint32_t patch, const Vector3d& b) const override
    {
        const auto& corners = _topology.patches[patch];
        const Vector3d flat = b[0] * _base[corners[0]] + b[1] * _base[corners[1]] + b[2] * _base[corners[2]];
        const double wave = std::sin(23.0 * flat.y() + 0.7) * std::cos(19.0 * flat.z() + 11.0 * flat.x());
        const double height = 0.1 * wave * std::exp(-9.0 * (flat - Vector3d(1.0, 0.1, 0.2)).squaredNorm());
        return {flat + height * Vector3d(0.8, 0.36, 0.48), Vector3d::UnitX()};
    }

private:
    std::vector<Vector3d> _base;
};

constexpr unsigned kChartFactor = 32;

class PartlyFlat : public testing::TestWithParam<const char*> {
protected:
    PartlyFlat()
    {
        charts = makeCharts(map, kChartFactor, progress);
        hierarchy = std::string(GetParam()) == "strips"
                        ? makeStripLevels(map.topology(), charts, {1, 2, 4, 6, 10, 16}, StripOptions(), progress)
                        : makeUniformLevels(map.topology(), charts, {1, 2, 4, 8, 16}, progress);
    }
    LodAsset assemble(double tolerance)
    {
        LodAsset asset = assembleAsset(map, charts, hierarchy, tolerance, progress);
        asset.validate();
        return asset;
    }
    std::uint8_t last() const { return static_cast<std::uint8_t>(hierarchy.ladder.size() - 1); }

    Progress progress;
    PartlyFlatMap map;
    ChartSet charts;
    LevelHierarchy hierarchy;
};

INSTANTIATE_TEST_SUITE_P(Techniques, PartlyFlat, testing::Values("strips", "uniform"),
                         [](const auto& test) { return std::string(test.param); });

/// Differences between borders' finest levels and their patches', most first.
std::vector<unsigned> steps(const LodAsset& asset)
{
    std::vector<unsigned> result;
    for (const LodPatch& patch : asset.patches) {
        for (const std::uint32_t e : patch.edges) { result.push_back(patch.finestLevel - asset.edges[e].finestLevel); }
    }
    std::sort(result.rbegin(), result.rend());
    return result;
}

TEST_P(PartlyFlat, FlatPartsKeepCoarseLevelsOnly)
{
    const AssetSummary summary = summarize(assemble(0.002));
    EXPECT_GE(summary.levels.front().finestPatches, 12U);
    EXPECT_GE(summary.levels.back().finestPatches + summary.levels[last() - 1U].finestPatches, 4U);
    std::uint64_t ends = 0;
    for (const AssetSummary::Level& level : summary.levels) { ends += level.finestPatches; }
    EXPECT_EQ(ends, 32U);
}

TEST_P(PartlyFlat, ToleranceZeroStoresAllAndLargerOnesNeverMore)
{
    std::uint64_t before = 32U * TessellationPattern::triangleCount(16);
    EXPECT_EQ(summarize(assemble(0.0)).finestTriangles, before);
    for (const double tolerance : {1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 2e-3, 4e-3, 8e-3, 0.02, 0.04, 0.08, 0.2}) {
        const std::uint64_t triangles = summarize(assemble(tolerance)).finestTriangles;
        EXPECT_LE(triangles, before) << tolerance;
        before = triangles;
    }
    EXPECT_EQ(before, 32U) << "bumps are less than 0.2 high";
}

TEST_P(PartlyFlat, EveryPatchIsWithinTheToleranceUnlessItHasAllLevels)
{
    const LodAsset all = assemble(0.0);
    for (const double tolerance : {1e-3, 5e-3, 0.02}) {
        const LodAsset asset = assemble(tolerance);
        for (std::size_t p = 0; p < asset.patches.size(); ++p) {
            const std::uint8_t finest = asset.patches[p].finestLevel;
            const double error = asset.levels[finest].errors[asset.levelSlots(finest)[p]].isotropic;
            const double own = finest == last() ? static_cast<double>(all.levels[last()].errors[p].isotropic) : 0.0;
            EXPECT_LE(error, std::max(tolerance, own) * (1.0 + 1e-6)) << "rounded to single precision";
        }
    }
}

TEST_P(PartlyFlat, SurfacesAreClosedAtEveryFactor)
{
    for (const double tolerance : {2e-3, 5e-3, 0.02}) {
        const LodAsset asset = assemble(tolerance);
        ASSERT_GT(steps(asset).front(), 0U) << tolerance;
        for (const unsigned factor : asset.ladder) {
            EXPECT_EQ(openEdges(extractSurface(asset, factor).triangles), 0U) << tolerance << ", factor " << factor;
        }
    }
}

TEST_P(PartlyFlat, SurvivesItsFile)
{
    for (const double tolerance : {2e-3, 0.2}) { // of the latter only the first level has anything
        LodAsset asset = assemble(tolerance);
        asset.technique = GetParam();
        asset.source = "test";
        std::stringstream file;
        writeTlod(file, asset);
        const LodAsset read = readTlod(file, "test");
        EXPECT_EQ(summarize(read).finestTriangles, summarize(asset).finestTriangles);
        EXPECT_EQ(extractSurface(read, 16).positions, extractSurface(asset, 16).positions);
    }
}

/// Difference vectors between a patch as the run time draws it and its chart.
std::vector<Vector3d> drawnVectors(const MorphedSurface& surface, const std::vector<std::uint16_t>& ladder,
                                   std::uint32_t p, const std::array<float, 3>& edgeLevels, const PatchChart& chart)
{
    const unsigned factor = ladder[MorphedSurface::drawnLevel(edgeLevels)];
    std::vector<Vector3d> positions;
    std::vector<ChartPoint> points;
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
        const auto point = surface.tessLodSurfacePoint(p, edgeLevels, v);
        positions.emplace_back(point.position[0], point.position[1], point.position[2]);
        const auto units = [&](std::size_t corner) {
            return static_cast<std::int32_t>(
                std::lround(static_cast<double>(point.weights[corner]) * ChartPoint::kUnits));
        };
        points.push_back({units(1), std::min(units(2), ChartPoint::kUnits - units(1))});
    }
    std::vector<Vector3d> vectors;
    DifferenceVectors({Triangulation::ofPattern(factor), points},
                      {Triangulation::ofPattern(kChartFactor), patternPoints(kChartFactor)})
        .evaluate(chart.positions, positions, vectors);
    return vectors;
}

TEST_P(PartlyFlat, WhatIsDrawnIsWithinTheErrorsThatAreClaimed)
{
    const Directions directions = sphericalFibonacci(200);
    std::mt19937 random(23);
    std::size_t lagging = 0;
    for (const double tolerance : {2e-3, 8e-3, 0.02}) {
        const LodAsset asset = assemble(tolerance);
        const MorphedSurface surface(asset);
        for (std::uint32_t p = 0; p < asset.patches.size(); ++p) {
            const LodPatch& patch = asset.patches[p];
            for (int trial = 0; trial < 12; ++trial) {
                // What level k claims holds while no border is below k, or below its own finest level.
                const unsigned k = std::uniform_int_distribution<unsigned>(0, patch.finestLevel)(random);
                const bool whole = trial % 2 == 0; // levels; else anything between
                std::array<float, 3> edgeLevels{};
                for (std::size_t side = 0; side < 3; ++side) {
                    const unsigned finest = asset.edges[patch.edges[side]].finestLevel;
                    const float least = static_cast<float>(std::min(k, finest));
                    const float level =
                        std::uniform_real_distribution<float>(least, static_cast<float>(finest) + 0.99F)(random);
                    edgeLevels[side] = whole ? std::floor(level) : std::min(level, static_cast<float>(finest));
                }
                lagging += *std::min_element(edgeLevels.begin(), edgeLevels.end()) < static_cast<float>(k) ? 1 : 0;
                const auto vectors = drawnVectors(surface, asset.ladder, p, edgeLevels, charts.charts[p]);
                const LevelError& claimed = asset.levels[k].errors[asset.levelSlots(k)[p]];
                // Half a unit of the chart's lattice is 1e-5 of a patch; between levels, errors are sampled.
                const double rounding = 5e-5;
                const double slack = whole ? 0.0 : 0.02 * static_cast<double>(claimed.isotropic);
                double longest = 0.0;
                for (const Vector3d& v : vectors) { longest = std::max(longest, v.norm()); }
                EXPECT_LE(longest, static_cast<double>(claimed.isotropic) + rounding + slack)
                    << "patch " << p << ", level " << k << " of " << int(patch.finestLevel) << ", borders "
                    << edgeLevels[0] << " " << edgeLevels[1] << " " << edgeLevels[2];
                const Eigen::ArrayXd drawn = squaredErrors(vectors, directions).max(0.0).sqrt();
                const Eigen::ArrayXd bound = squaredErrors(claimed.quadratic, directions).max(0.0).sqrt();
                EXPECT_LE((drawn - bound).maxCoeff(), rounding + slack);
            }
        }
    }
    EXPECT_GT(lagging, 100U);
}

} // namespace
} // namespace osgTessLOD::bake
