// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/LevelErrors.h>
#include <osgTessLOD/bake/MorphedLevels.h>
#include <osgTessLOD/bake/UniformLevels.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

namespace osgTessLOD::bake {
namespace {

using Eigen::ArrayXd;
using Eigen::Vector3d;
using Vectors = std::vector<Vector3d>;

const std::vector<std::uint16_t> kLadder{1, 2, 4, 8};
constexpr unsigned kChartFactor = 16;

struct Surface {
    std::unique_ptr<PatchMap> map;
    ChartSet charts;
    LevelHierarchy hierarchy;
};

Surface makeSurface(const std::string& name)
{
    Progress progress;
    Surface s;
    s.map = makeBuiltinSurface(name, 5000);
    s.charts = makeCharts(*s.map, kChartFactor, progress);
    s.hierarchy = makeUniformLevels(s.map->topology(), s.charts, kLadder, progress);
    return s;
}

const Surface& asteroid()
{
    static const Surface surface = makeSurface("asteroid");
    return surface;
}

/// Steep steps: its morphs are further from the charts than its levels.
const Surface& bricks()
{
    static const Surface surface = makeSurface("bricks");
    return surface;
}

std::vector<std::vector<ChartPoint>> places()
{
    std::vector<std::vector<ChartPoint>> result;
    for (const unsigned factor : kLadder) { result.push_back(patternPoints(factor)); }
    return result;
}

ArrayXd errorsOf(const Vectors& vectors)
{
    return squaredErrors(vectors, sphericalFibonacci(500)).max(0.0).sqrt();
}

Vector3d onPlane(ChartPoint p)
{
    const double scale = 1.0 / ChartPoint::kUnits;
    return Vector3d(1.0, 0.2, -0.1) + scale * p.u * Vector3d(0.9, 0.1, 0.3) + scale * p.v * Vector3d(0.2, 1.1, -0.2);
}

Vectors flatChart()
{
    Vectors chart;
    for (const ChartPoint p : patternPoints(kChartFactor)) { chart.push_back(onPlane(p)); }
    return chart;
}

/// A patch of a plane whose inner vertices are anywhere in it: every morph lies in the plane at its own parameters.
PatchLevels scatteredFlatLevels()
{
    std::mt19937 random(3);
    PatchLevels levels = asteroid().hierarchy.patches[0];
    for (std::size_t level = 0; level < kLadder.size(); ++level) {
        auto points = patternPoints(kLadder[level]);
        std::uniform_int_distribution<std::int32_t> step(-ChartPoint::kUnits / (8 * kLadder[level]),
                                                         ChartPoint::kUnits / (8 * kLadder[level]));
        for (std::uint32_t v = 3U * kLadder[level]; v < points.size(); ++v) {
            points[v].u += step(random);
            points[v].v += step(random);
        }
        for (std::size_t v = 0; v < points.size(); ++v) { levels.positions[level][v] = onPlane(points[v]); }
        levels.parameters.push_back(std::move(points));
    }
    return levels;
}

TEST(LevelErrors, FlatPatchesHaveNoneWhereverTheirVerticesAre)
{
    const LevelErrors errors(kLadder, kChartFactor);
    constexpr double kRounding = 3.0 / ChartPoint::kUnits; // of the parameters of vertices on their way
    for (const LevelVectors& level : errors.measure(scatteredFlatLevels(), flatChart())) {
        EXPECT_LT(fitIsotropic(level.bare), 1e-14F);
        EXPECT_LT(fitIsotropic(level.drawn), kRounding);
        EXPECT_LT(level.betweenSamples, kRounding);
    }
    PatchLevels unaware = scatteredFlatLevels();
    for (auto& parameters : unaware.parameters) { parameters.clear(); }
    EXPECT_GT(fitIsotropic(errors.measure(unaware, flatChart())[2].bare), 0.01F) << "parameters matter";
}

TEST(LevelErrors, BareOnesAreThoseOfTheDifferenceVectors)
{
    const LevelErrors errors(kLadder, kChartFactor);
    const PatchLevels& levels = asteroid().hierarchy.patches[3];
    const Vectors& chart = asteroid().charts.charts[3].positions;
    const auto measured = errors.measure(levels, chart);
    for (std::size_t level = 0; level < kLadder.size(); ++level) {
        Vectors all;
        DifferenceVectors(kChartFactor, kLadder[level]).evaluate(chart, levels.positions[level], all);
        EXPECT_LT((errorsOf(all) - errorsOf(measured[level].bare)).abs().maxCoeff(), 1e-12);
    }
    EXPECT_EQ(errorsOf(measured.back().drawn).maxCoeff(), errorsOf(measured.back().bare).maxCoeff());
}

TEST(LevelErrors, ParametersOfThePatternMakeNoDifference)
{
    const LevelErrors errors(kLadder, kChartFactor);
    PatchLevels levels = asteroid().hierarchy.patches[5];
    const Vectors& chart = asteroid().charts.charts[5].positions;
    const auto without = errors.measure(levels, chart);
    levels.parameters = places();
    const auto with = errors.measure(levels, chart);
    for (std::size_t level = 0; level < kLadder.size(); ++level) {
        EXPECT_EQ(with[level].bare, without[level].bare);
        EXPECT_EQ(with[level].drawn, without[level].drawn);
        EXPECT_EQ(with[level].betweenSamples, without[level].betweenSamples);
    }
}

TEST(LevelErrors, CoarseLevelsCoverFinerOnes)
{
    const LevelErrors errors(kLadder, kChartFactor);
    for (std::size_t p = 0; p < bricks().hierarchy.patches.size(); ++p) {
        const auto levels = errors.measure(bricks().hierarchy.patches[p], bricks().charts.charts[p].positions);
        for (std::size_t level = 0; level + 1 < levels.size(); ++level) {
            EXPECT_GE((errorsOf(levels[level].drawn) - errorsOf(levels[level + 1].drawn)).minCoeff(), -1e-12);
            EXPECT_GE((errorsOf(levels[level].drawn) - errorsOf(levels[level].bare)).minCoeff(), -1e-12);
            EXPECT_GE(levels[level].betweenSamples, levels[level + 1].betweenSamples);
        }
    }
}

TEST(LevelErrors, MorphsAreCoveredExactly)
{
    const LevelErrors errors(kLadder, kChartFactor);
    const Triangulation chartTopology = Triangulation::ofPattern(kChartFactor);
    const std::vector<ChartPoint> chartPoints = patternPoints(kChartFactor);
    for (std::size_t p = 0; p < bricks().hierarchy.patches.size(); ++p) {
        const PatchLevels& levels = bricks().hierarchy.patches[p];
        const Vectors& chart = bricks().charts.charts[p].positions;
        const auto measured = errors.measure(levels, chart);
        for (double at = 0.25; at < 3.0; at += 0.25) {
            const MorphedPatch patch = morphPatch(levels, kLadder, places(), at, {at, at, at});
            const Triangulation topology = Triangulation::ofPattern(kLadder[static_cast<std::size_t>(std::ceil(at))]);
            Vectors vectors;
            DifferenceVectors({topology, patch.points}, {chartTopology, chartPoints})
                .evaluate(chart, patch.positions, vectors);
            const Vectors& drawn = measured[static_cast<std::size_t>(at)].drawn;
            EXPECT_GE((errorsOf(drawn) - errorsOf(vectors)).minCoeff(), -1e-9) << "patch " << p << " at " << at;
        }
    }
}

TEST(LevelErrors, WhatIsDrawnIsCoveredBetweenTheSamplesToo)
{
    const LevelErrors errors(kLadder, kChartFactor);
    const Triangulation chartTopology = Triangulation::ofPattern(kChartFactor);
    const std::vector<ChartPoint> chartPoints = patternPoints(kChartFactor);
    const Directions directions = sphericalFibonacci(500);
    for (const std::size_t trial : {0U, 1U, 2U, 3U, 4U, 5U, 6U, 7U}) {
        const Surface& surface = trial < 2 ? asteroid() : bricks();
        const std::size_t p = 3 * trial;
        const PatchLevels& levels = surface.hierarchy.patches[p];
        const Vectors& chart = surface.charts.charts[p].positions;
        const auto measured = errors.measure(levels, chart);
        std::vector<ArrayXd> fitted;
        for (const LevelVectors& level : measured) {
            const ViewError error = fitQuadratic(level.drawn, level.betweenSamples).error;
            fitted.push_back(squaredErrors(error, directions).sqrt());
        }
        for (double border = 0.0; border <= 3.0; border += 0.125) {
            for (const double inside : {border, std::ceil(border), 2.5, 3.0}) {
                if (inside < border) { continue; }
                const MorphedPatch patch = morphPatch(levels, kLadder, places(), inside, {border, border, border});
                const auto level = static_cast<std::size_t>(std::ceil(inside));
                const Triangulation topology = Triangulation::ofPattern(kLadder[level]);
                Vectors vectors;
                DifferenceVectors({topology, patch.points}, {chartTopology, chartPoints})
                    .evaluate(chart, patch.positions, vectors);
                const auto holding = static_cast<std::size_t>(std::floor(border));
                EXPECT_GE((fitted[holding] - squaredErrors(vectors, directions).max(0.0).sqrt()).minCoeff(), 0.0)
                    << "patch " << p << ", border at " << border << ", inside at " << inside;
            }
        }
    }
}

TEST(MorphedLevels, AreWhatIsDrawn)
{
    Progress progress;
    const Surface& s = asteroid();
    LevelHierarchy hierarchy = s.hierarchy;
    for (PatchLevels& patch : hierarchy.patches) { // of the uniform levels no inner vertex goes to the border
        patch.parents[2][12] = 3;
        patch.parents[3][24] = 5;
    }
    const LodAsset asset = assembleAsset(*s.map, s.charts, hierarchy, 0.0, progress);
    const MorphedSurface surface(asset);
    const float allowed = 4.0F * asset.lattice.step + 1e-6F * static_cast<float>(s.map->frame().scale);
    for (const std::uint32_t p : {0U, 4U, 13U}) {
        for (const float inside : {0.0F, 0.3F, 1.0F, 1.75F, 2.5F, 3.0F}) {
            for (const float border : {0.0F, 0.5F, 1.0F, 1.25F, 2.0F, 2.5F, 3.0F}) {
                if (border > inside) { continue; }
                // One side holds the patch at its level.
                const std::array<float, 3> edgeLevels{border, inside, 0.5F * border};
                const MorphedPatch patch =
                    morphPatch(hierarchy.patches[p], kLadder, places(), inside, {border, inside, 0.5 * border});
                const unsigned level = MorphedSurface::drawnLevel(edgeLevels);
                ASSERT_EQ(patch.positions.size(), TessellationPattern::vertexCount(kLadder[level]));
                for (std::uint32_t v = 0; v < patch.positions.size(); ++v) {
                    const auto drawn = surface.tessLodSurfacePoint(p, edgeLevels, v).position;
                    const Vector3d expected = s.map->frame().center + s.map->frame().scale * patch.positions[v];
                    for (std::size_t k = 0; k < 3; ++k) {
                        EXPECT_NEAR(static_cast<double>(drawn[k]), expected[static_cast<Eigen::Index>(k)],
                                    static_cast<double>(allowed))
                            << "vertex " << v << " inside " << inside << " border " << border;
                    }
                }
            }
        }
    }
}

} // namespace
} // namespace osgTessLOD::bake
