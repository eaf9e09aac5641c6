// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/Refit.h>
#include <osgTessLOD/bake/UniformLevels.h>

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <tbb/global_control.h>

#include <memory>
#include <random>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;
using Positions = std::vector<Vector3d>;

constexpr unsigned kChartFactor = 16;

struct Level {
    std::unique_ptr<PatchMap> map;
    ChartSet charts;
    unsigned factor;
    std::vector<Positions> positions;
    std::vector<std::vector<ChartPoint>> parameters;
    RefitResult refitted(const RefitOptions& options = {})
    {
        return refit(map->topology(), charts, factor, parameters, options, positions);
    }
};

Level uniformLevel(const std::string& name, std::size_t level)
{
    Progress progress;
    const std::vector<std::uint16_t> ladder{1, 2, 4, 8};
    Level result;
    result.map = makeBuiltinSurface(name, 5000);
    result.charts = makeCharts(*result.map, kChartFactor, progress);
    result.factor = ladder[level];
    for (PatchLevels& patch : makeUniformLevels(result.map->topology(), result.charts, ladder, progress).patches) {
        result.positions.push_back(patch.positions[level]);
    }
    result.parameters.resize(result.positions.size());
    return result;
}

void expectSharedVerticesAgree(const Level& level)
{
    for (const PatchTopology::Edge& edge : level.map->topology().edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        for (unsigned step = 0; step <= level.factor; ++step) {
            EXPECT_EQ(level.positions[edge.patches[0]][borderVertex(edge, 0, level.factor, step)],
                      level.positions[edge.patches[1]][borderVertex(edge, 1, level.factor, step)]);
        }
    }
}

TEST(Refit, LowersTheErrorAndKeepsCornersAndBorders)
{
    for (const char* name : {"asteroid", "glacier", "seashell"}) {
        for (const std::size_t index : {1U, 2U, 3U}) {
            Level level = uniformLevel(name, index);
            const std::vector<Positions> before = level.positions;
            const RefitResult result = level.refitted();
            EXPECT_GE(result.passes, 1U) << name;
            EXPECT_LT(result.errorAfter, 0.95 * result.errorBefore) << name;
            expectSharedVerticesAgree(level);
            for (std::size_t p = 0; p < before.size(); ++p) {
                for (unsigned k = 0; k < 3; ++k) {
                    EXPECT_EQ(level.positions[p][k * level.factor], before[p][k * level.factor]);
                }
            }
        }
    }
}

TEST(Refit, WithNothingToGainChangesNothing)
{
    Level level = uniformLevel("asteroid", 3);
    for (std::size_t p = 0; p < level.positions.size(); ++p) { // the level is the chart: both of factor 8
        level.charts.charts[p].positions = level.positions[p];
    }
    level.charts.factor = 8;
    const std::vector<Positions> before = level.positions;
    const RefitResult result = level.refitted();
    EXPECT_EQ(result.errorBefore, 0.0);
    EXPECT_EQ(result.passes, 0U);
    EXPECT_EQ(level.positions, before);
}

TEST(Refit, FindsAPlaneWhereverItsVerticesAreInTheChart)
{
    // A linear chart: every vertex belongs exactly where its parameters are.
    const auto onPlane = [](ChartPoint p) {
        return Vector3d(1e-5 * p.u, 2e-5 * p.v, 1e-5 * p.u - 1e-5 * p.v);
    };
    Level level = uniformLevel("glacier", 2);
    std::mt19937 random(4);
    std::uniform_int_distribution<std::int32_t> step(-ChartPoint::kUnits / 40, ChartPoint::kUnits / 40);
    // One patch alone: nobody shares its borders.
    const PatchTopology topology = PatchTopology::build(3, {{0, 1, 2}});
    level.charts.charts.resize(1);
    level.charts.charts[0].positions.clear();
    for (const ChartPoint p : patternPoints(kChartFactor)) { level.charts.charts[0].positions.push_back(onPlane(p)); }
    std::vector<std::vector<ChartPoint>> parameters{patternPoints(level.factor)};
    std::vector<Positions> positions(1);
    for (std::uint32_t v = 0; v < parameters[0].size(); ++v) {
        const bool inner = v >= TessellationPattern::borderVertexCount(level.factor);
        if (inner) { parameters[0][v] = {parameters[0][v].u + step(random), parameters[0][v].v + step(random)}; }
        const bool corner = !inner && v % level.factor == 0;
        positions[0].push_back(onPlane(parameters[0][v]) + (corner ? Vector3d::Zero() : Vector3d(0.1, -0.05, 0.03 * v)));
    }
    const RefitResult result = refit(topology, level.charts, level.factor, parameters, {}, positions);
    EXPECT_GT(result.errorBefore, 0.05);
    EXPECT_LT(result.errorAfter, 1e-8);
    for (std::size_t v = 0; v < positions[0].size(); ++v) {
        EXPECT_LT((positions[0][v] - onPlane(parameters[0][v])).norm(), 1e-7);
    }
}

TEST(Refit, FirstPassSolvesTheLeastSquaresProblem)
{
    Level level = uniformLevel("glacier", 1);
    const PatchTopology topology = PatchTopology::build(3, {{0, 1, 2}});
    level.charts.charts.resize(1);
    level.positions.resize(1);
    level.parameters.resize(1);
    const DifferenceVectors differences(kChartFactor, level.factor);
    const Positions& chart = level.charts.charts[0].positions;
    const auto rows = static_cast<Eigen::Index>(differences.rows().size());
    Eigen::MatrixXd c = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(level.positions[0].size()));
    Eigen::MatrixXd target = Eigen::MatrixXd::Zero(rows, 3);
    for (Eigen::Index i = 0; i < rows; ++i) {
        const DifferenceVectors::Row& row = differences.rows()[static_cast<std::size_t>(i)];
        for (std::size_t k = 0; k < 3; ++k) {
            c(i, row.levelVertices[k]) += row.levelWeights[k];
            target.row(i) += row.chartWeights[k] * chart[row.chartVertices[k]].transpose();
        }
    }
    const Eigen::MatrixXd expected = c.colPivHouseholderQr().solve(target);
    RefitOptions options;
    options.moveCorners = true;
    options.mostPasses = 1;
    // From far away, so that this pass is sure to be kept.
    for (Vector3d& x : level.positions[0]) { x += Vector3d(1.0, 2.0, 3.0); }
    const RefitResult result = refit(topology, level.charts, level.factor, level.parameters, options, level.positions);
    EXPECT_EQ(result.passes, 1U);
    for (Eigen::Index v = 0; v < expected.rows(); ++v) {
        EXPECT_LT((level.positions[0][static_cast<std::size_t>(v)] - expected.row(v).transpose()).norm(), 1e-7);
    }
}

TEST(Refit, MovesCornersWhereAllowedAndStillTogether)
{
    Level fixed = uniformLevel("asteroid", 3);
    Level moving = uniformLevel("asteroid", 3);
    RefitOptions options;
    options.moveCorners = true;
    const double kept = fixed.refitted().errorAfter;
    EXPECT_LT(moving.refitted(options).errorAfter, kept);
    expectSharedVerticesAgree(moving);
}

TEST(Refit, WeightsLowerTheErrorFurther)
{
    RefitOptions onlyLeastSquares;
    onlyLeastSquares.mostPasses = 1;
    Level plain = uniformLevel("asteroid", 2);
    Level weighted = uniformLevel("asteroid", 2);
    const double leastSquares = plain.refitted(onlyLeastSquares).errorAfter;
    const RefitResult result = weighted.refitted();
    EXPECT_GE(result.passes, 2U);
    EXPECT_LT(result.errorAfter, 0.99 * leastSquares);
}

TEST(Refit, DoesNotDependOnTheNumberOfThreads)
{
    std::vector<std::vector<Positions>> results;
    for (const std::size_t threads : {1U, 4U}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        Level level = uniformLevel("seashell", 2);
        level.refitted();
        results.push_back(level.positions);
    }
    EXPECT_EQ(results[0], results[1]);
}

TEST(Refit, TakesParametersOfThePattern)
{
    Level without = uniformLevel("asteroid", 2);
    Level with = uniformLevel("asteroid", 2);
    for (auto& parameters : with.parameters) { parameters = patternPoints(with.factor); }
    without.refitted();
    with.refitted();
    EXPECT_EQ(with.positions, without.positions);
}

} // namespace
} // namespace osgTessLOD::bake
