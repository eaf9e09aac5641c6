// SPDX-License-Identifier: MIT
#include <benchmarks/CurveSummary.h>

#include <gtest/gtest.h>

namespace osgTessLOD::benchmarks {
namespace {

using Json = nlohmann::ordered_json;

TEST(CostAt, IsLinearInLogarithmsBetweenMeasurements)
{
    const std::vector<CurvePoint> curve{{0.5, 400.0}, {2.0, 100.0}, {8.0, 25.0}};
    EXPECT_NEAR(*costAt(1.0, curve), 200.0, 1e-9);
    EXPECT_NEAR(*costAt(4.0, curve), 50.0, 1e-9);
    EXPECT_DOUBLE_EQ(*costAt(2.0, curve), 100.0);
}

TEST(CostAt, IsOfWhatKeepsTheErrorAtLeastCost)
{
    EXPECT_DOUBLE_EQ(*costAt(1.0, {{0.1, 400.0}, {0.9, 300.0}}), 300.0) << "nothing is beyond";
    EXPECT_DOUBLE_EQ(*costAt(1.0, {{0.9, 300.0}, {0.4, 200.0}, {3.0, 250.0}}), 200.0) << "what is beyond costs more";
    EXPECT_FALSE(costAt(1.0, {{1.5, 400.0}, {3.0, 300.0}})) << "nothing is so near";
    EXPECT_FALSE(costAt(1.0, {}));
}

/// A row of frames that have each of these largest errors and triangles.
Json row(const char* contestant, double asked, const std::vector<CurvePoint>& frames)
{
    Json json{{"scene", "s"},
              {"path", "p"},
              {"contestant", contestant},
              {"errorPixels", asked},
              {"largestPromised", 0.0},
              {"frames", Json::array()}};
    for (const CurvePoint& frame : frames) {
        json["frames"].push_back({{"largestPixels", frame.error},
                                  {"largestInSpace", 2.0 * frame.error},
                                  {"triangles", frame.cost},
                                  {"cullMilliseconds", 1.0},
                                  {"drawMilliseconds", frame.cost}});
        json["largestPromised"] = std::max(json["largestPromised"].get<double>(), frame.error);
    }
    return json;
}

TEST(SummarizeCurves, ComparesWithTheBestOtherAtEqualErrors)
{
    const Json rows{row("a", 1.0, {{0.5, 80.0}, {1.5, 50.0}}), row("a", 4.0, {{2.0, 20.0}, {6.0, 10.0}}),
                    row("b", 1.0, {{1.0, 100.0}, {1.0, 100.0}}), row("c", 1.0, {{1.0, 80.0}, {1.0, 90.0}})};
    const Json summary = summarizeCurves(rows, {"a"});
    const Json& found = summary["equal_error"]["rows"][0];
    EXPECT_EQ(found["triangles"]["other"], "c");
    EXPECT_EQ(found["triangles"]["frames"], 1) << "in the second, a is never so near";
    EXPECT_NEAR(found["triangles"]["ratio"].get<double>(), 40.0 / 80.0, 1e-9);
    EXPECT_NEAR(summary["equal_error"]["triangles_over_best_other"].get<double>(), 0.5, 1e-9);
    EXPECT_NEAR(summary["triangles_over_best_other_at_1px"].get<double>(), 130.0 / 170.0, 1e-9);
    EXPECT_DOUBLE_EQ(summary["max_measured_over_asked"].get<double>(), 1.5);
}

} // namespace
} // namespace osgTessLOD::benchmarks
