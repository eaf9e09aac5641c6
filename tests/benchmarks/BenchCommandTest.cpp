// SPDX-License-Identifier: MIT
// The benchmark command as a program: that what it writes agrees with itself. Times are never looked at.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/SurfaceMesh.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>
#include <utility>

namespace osgTessLOD {
namespace {

using Json = nlohmann::json;

class BenchCommand : public testing::Test {
protected:
    struct Outcome {
        int status;
        std::string output; ///< errors included
    };
    Outcome run(const std::string& arguments) const
    {
        const std::string log = _folder.file("log");
        const std::string command =
            "env -u OSGTESSLOD_DATA " OSGTESSLOD_BENCH " " + arguments + " > '" + log + "' 2>&1";
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, readBytes(log)};
    }
    /// What the command writes to --json.
    Json report(const std::string& arguments) const
    {
        const std::string path = _folder.file("report.json");
        const Outcome outcome = run(arguments + " --json '" + path + "'");
        EXPECT_EQ(outcome.status, 0) << outcome.output;
        return Json::parse(readBytes(path));
    }
    /// The path of a torus of 1,280 triangles.
    std::string torus() const
    {
        const bake::SourceMesh mesh = bake::torus(40, 16);
        SurfaceMesh surface;
        for (const auto& p : mesh.positions) { surface.positions.push_back({p.x(), p.y(), p.z()}); }
        surface.triangles = mesh.triangles;
        writePly(_folder.file("torus.ply"), surface);
        return _folder.file("torus.ply");
    }

    TemporaryDirectory _folder;
};

/// That each level has about half of the former's triangles, from the source down to few.
void expectHalving(const Json& triangles)
{
    ASSERT_GE(triangles.size(), 4U);
    for (std::size_t l = 1; l < triangles.size(); ++l) {
        EXPECT_NEAR(triangles[l].get<double>() / triangles[l - 1].get<double>(), 0.5, 0.1) << "level " << l;
    }
    EXPECT_LE(triangles.back(), 100U);
}

TEST_F(BenchCommand, BakeHasOtherLibrariesHalveTheSameTriangles)
{
    const Json report = this->report("bake --technique uniform --runs 1 --scene '" + torus() + "'");
    const Json& row = report["rows"].at(0);
    EXPECT_EQ(row["technique"], "uniform");
    for (const char* name : {"meshoptimizer", "osgSimplifier"}) {
        EXPECT_FALSE(row[name]["limitReached"]) << name;
        EXPECT_EQ(row[name]["triangles"].at(0), row["sourceTriangles"]) << name;
        expectHalving(row[name]["triangles"]);
    }
    const Json& summary = report["summary"];
    EXPECT_EQ(summary["seconds"]["torus"], row["seconds"]);
    EXPECT_DOUBLE_EQ(summary["source_triangles_per_second"], 1280.0 / row["seconds"].get<double>());
    for (const auto& [mean, yardstick] :
         {std::pair("meshoptimizer_ratio", "meshoptimizer"), std::pair("osg_simplifier_ratio", "osgSimplifier")}) {
        const auto ratio = row[yardstick]["ratio"].get<double>();
        EXPECT_NEAR(summary[mean].get<double>(), ratio, 1e-12 * ratio) << "a geometric mean, by logarithms";
    }
    EXPECT_FALSE(summary["osg_simplifier_ratio_is_upper_bound"]);
}

TEST_F(BenchCommand, BakeEndsAYardstickAtItsLimit)
{
    // osgUtil::Simplifier takes minutes for half a million triangles.
    const Json report = this->report("bake --technique uniform --runs 1 --limit 1 --scene asteroid");
    const Json& simplifier = report["rows"].at(0)["osgSimplifier"];
    EXPECT_TRUE(simplifier["limitReached"]);
    EXPECT_EQ(simplifier["seconds"], 1);
    EXPECT_TRUE(report["summary"]["osg_simplifier_ratio_is_upper_bound"]);
}

TEST_F(BenchCommand, LevelsAreAsNearAsTheyClaim)
{
    const Json report = this->report("levels --max-factor 4 --scene asteroid");
    ASSERT_EQ(report["rows"].size(), 3U);
    for (const Json& row : report["rows"]) {
        for (const char* technique : {"strips", "uniform"}) {
            const Json& level = row[technique];
            const double nearest = level["largestErrorPercent"].get<double>() + 1e-4;
            EXPECT_GT(level["levelToSourcePercent"], 0.0) << row;
            EXPECT_LE(level["levelToSourcePercent"], nearest) << row;
            EXPECT_LE(level["sourceToLevelPercent"], nearest) << row;
            EXPECT_LE(level["meanErrorPercent"], level["largestErrorPercent"]) << row;
            EXPECT_GT(level["bytes"], 0U) << row;
        }
        const std::string factor = std::to_string(row["factor"].get<unsigned>());
        EXPECT_DOUBLE_EQ(report["summary"]["strips_over_uniform_hausdorff"][factor], row["hausdorffOverUniform"]);
    }
}

TEST_F(BenchCommand, LadderComparesTrianglesAtEqualErrors)
{
    const Json report = this->report("ladder --max-factor 8 --scene asteroid");
    ASSERT_FALSE(report["rows"].empty());
    double before = 0.0;
    for (const Json& row : report["rows"]) {
        EXPECT_GT(row["errorPercent"], before) << row;
        EXPECT_LT(row["saturatedPatches"], row["patches"]) << row;
        EXPECT_DOUBLE_EQ(row["denseOverPowers"],
                         row["denseTriangles"].get<double>() / row["powersTriangles"].get<double>());
        before = row["errorPercent"];
    }
    EXPECT_GT(report["summary"]["dense_over_powers_bytes"], 1.0) << "one more level";
    EXPECT_GT(report["summary"]["dense_over_powers_triangles"], 0.0);
}

TEST_F(BenchCommand, BoundIsKeptByConservativeAndNotByFirstOrder)
{
    const Json report = this->report("bound --views 24 --points 2000 --scene asteroid");
    ASSERT_EQ(report["rows"].size(), 3U);
    double largest = 0.0;
    for (const Json& row : report["rows"]) {
        for (const char* bound : {"conservative", "firstOrder"}) {
            EXPECT_GT(row[bound]["patches"], 10U) << row;
            EXPECT_LT(row[bound]["tightness"], row[bound]["maxRatio"]) << row;
            EXPECT_GT(row[bound]["points"], 1000U) << row;
            EXPECT_GT(row[bound]["maxRatioOfPoints"], 0.0) << row;
        }
        largest = std::max(largest, row["conservative"]["maxRatio"].get<double>());
    }
    EXPECT_DOUBLE_EQ(report["summary"]["conservative_max_ratio"], largest);
    EXPECT_LE(largest, 1.0 + 1e-5);
    EXPECT_LE(report["summary"]["conservative_max_ratio_of_points"], 1.0 + 1e-5);
    EXPECT_GT(report["summary"]["first_order_max_ratio"], 1.0);
}

TEST_F(BenchCommand, ViewAndSelectTakeBakedScenes)
{
    ASSERT_EQ(
        run("bake --technique uniform --runs 1 --limit 1 --scene '" + torus() + "' --keep '" + _folder.file("") + "'")
            .status,
        0);
    const std::string scene = " --scene '" + _folder.file("torus.tlod") + "'";
    const Json view = this->report("view" + scene);
    ASSERT_EQ(view["rows"].size(), 4U);
    for (const Json& row : view["rows"]) {
        for (const char* bound : {"conservative", "firstOrder"}) {
            EXPECT_LE(row[bound]["view"], row[bound]["isotropic"]) << row;
            EXPECT_GT(row[bound]["view"], 0U) << row;
        }
    }
    EXPECT_LE(view["summary"]["view_over_isotropic"]["torus"], 1.0);
    const Json select = this->report("select --quick" + scene);
    ASSERT_EQ(select["rows"].size(), 12U);
    EXPECT_EQ(select["summary"]["ns_per_patch_at_home"], select["rows"][0]["nanosecondsPerPatch"]);
    const Json& growth = select["summary"]["growth"];
    ASSERT_EQ(growth.size(), 2U);
    EXPECT_EQ(growth[1]["patches"], 9680U);
    for (const Json& row : growth) { EXPECT_LT(row["drawn"], row["patches"]) << "some are out of view: " << row; }
    EXPECT_GT(select["summary"]["ns_per_patch"], 0.0);
    const Json& placements = select["summary"]["placements"];
    ASSERT_EQ(placements.size(), 3U);
    EXPECT_GT(placements[2]["drawn"], placements[1]["drawn"]);
    EXPECT_LT(placements[2]["drawn"], 20U * 1024U) << "some are out of view";
    for (const Json& row : select["rows"]) { EXPECT_EQ(row["drawn"] == 0U, row["from"] == "off screen") << row; }
}

TEST_F(BenchCommand, MemoryAddsUp)
{
    const std::string baked = _folder.file("torus.tlod");
    ASSERT_EQ(
        run("bake --technique uniform --runs 1 --limit 1 --scene '" + torus() + "' --keep '" + _folder.file("") + "'")
            .status,
        0);
    const Json report = this->report("memory --scene '" + baked + "'");
    ASSERT_EQ(report["rows"].size(), 1U);
    const Json& row = report["rows"][0];
    EXPECT_GT(row["gpuVertices"], 8.0) << "8 bytes at the finest level, and the coarser ones";
    EXPECT_EQ(row["gpuParameters"], 0.0) << "uniform levels have none";
    EXPECT_GT(row["gpuNormals"], 4.0);
    EXPECT_LT(row["fileWithoutNormals"], row["file"]);
    EXPECT_NEAR(row["file"].get<double>() * row["finestVertices"].get<double>(),
                static_cast<double>(readBytes(baked).size()), 0.5);
    EXPECT_EQ(report["summary"]["gpu_bytes_per_finest_vertex"], row["gpuVertices"]);
}

TEST_F(BenchCommand, ScaleShowsWhatGrowsWithTheSource)
{
    const Json report = this->report("scale --scene asteroid --technique uniform --frames 1 --triangles 400000 --triangles 1600000");
    const Json& rows = report["rows"];
    ASSERT_EQ(rows.size(), 4U) << "two sizes, two views";
    for (const Json& row : rows) {
        EXPECT_GE(row["firstPictureSeconds"], row["loadSeconds"]);
        EXPECT_GT(row["triangles"], 0U);
        EXPECT_LE(row["gpuMebibytes"], row["gpuWholeMebibytes"]);
    }
    EXPECT_LT(rows[0]["gpuMebibytes"], rows[1]["gpuMebibytes"]) << "from afar less is needed";
    EXPECT_GT(rows[2]["fileBytes"], 3 * rows[0]["fileBytes"].get<std::uint64_t>());
    EXPECT_EQ(report["summary"]["frame_over_smallest"].size(), 2U);
}

TEST_F(BenchCommand, SceneComparesLevelsMetricsAndDrawables)
{
    const Json report = this->report("scene --frames 1 --max-factor 4 --scene asteroid");
    ASSERT_EQ(report["rows"].size(), 5U);
    std::map<std::string, Json> rows;
    for (const Json& row : report["rows"]) {
        rows[row["contestant"]] = row;
        EXPECT_GT(row["placements"], 100U) << row;
        EXPECT_LT(row["placements"], 400U) << "some are out of view: " << row;
        EXPECT_EQ(row["backend"], report["rows"][0]["backend"]) << row;
        EXPECT_GE(row["patches"], row["placements"]) << row;
        EXPECT_GE(row["triangles"], row["patches"]) << row;
        EXPECT_LE(row["saturatedPatches"], row["patches"]) << row;
        EXPECT_GT(row["cullMilliseconds"], 0.0) << row;
        EXPECT_GT(row["drawMilliseconds"], 0.0) << row;
    }
    EXPECT_LE(rows["uniform, view"]["triangles"], rows["uniform, isotropic"]["triangles"]);
    const Json& instances = rows["full"];
    const Json& transforms = rows["full, transforms"];
    for (const char* key : {"placements", "patches", "saturatedPatches", "triangles"}) {
        EXPECT_EQ(instances[key], transforms[key]) << key;
    }
    EXPECT_GE(transforms["drawCalls"], transforms["placements"]);
    EXPECT_LT(5 * instances["drawCalls"].get<unsigned>(), transforms["drawCalls"].get<unsigned>());
    EXPECT_DOUBLE_EQ(report["summary"]["triangles_ratio"],
                     instances["triangles"].get<double>() / rows["uniform, isotropic"]["triangles"].get<double>());
    EXPECT_GT(report["summary"]["cpu_time_ratio"], 0.0);
    EXPECT_TRUE(report["summary"].contains("gpu_time_ratio"));
    EXPECT_EQ(run("scene --scene '" + _folder.file("x.tlod") + "'").status, 1);
}

TEST_F(BenchCommand, ThroughputComparesTheSameTriangles)
{
    ASSERT_EQ(
        run("bake --technique uniform --runs 1 --limit 1 --scene '" + torus() + "' --keep '" + _folder.file("") + "'")
            .status,
        0);
    const Json report = this->report("throughput --quick --scene '" + _folder.file("torus.tlod") + "'");
    ASSERT_EQ(report["rows"].size(), 1U);
    const Json& row = report["rows"][0];
    EXPECT_GE(row["triangles"], 100'000U);
    EXPECT_EQ(row["staticTriangles"], row["triangles"]);
    for (const char* backend : {"tessellation", "instanced"}) {
        EXPECT_NEAR(row[backend]["rateOverStatic"].get<double>(),
                    row[backend]["trianglesPerSecond"].get<double>() / row["staticTrianglesPerSecond"].get<double>(),
                    1e-9);
        EXPECT_EQ(report["summary"]["rate_over_static"][backend], row[backend]["rateOverStatic"]);
    }
}

TEST_F(BenchCommand, CurveMeasuresWhatEachContestantDraws)
{
    const std::string csv = _folder.file("curve.csv");
    const Json report =
        this->report("curve --quick --limit 1 --path fly-in --path field --scene asteroid --csv '" + csv + "'");
    std::map<std::string, std::size_t> rows;
    std::map<std::string, double> largest;
    for (const Json& row : report["rows"]) {
        const std::string contestant = row["contestant"];
        ++rows[contestant];
        ASSERT_EQ(row["frames"].size(), 2U) << row;
        EXPECT_GT(row["drawMilliseconds"], 0.0) << row;
        EXPECT_GT(row["gpuBytes"], 0U) << row;
        EXPECT_LE(row["largestPromised"], row["largestPixels"]) << row;
        EXPECT_LE(row["rmsPixels"], row["largestPixels"]) << row;
        for (const Json& frame : row["frames"]) {
            EXPECT_GT(frame["triangles"], 0U) << frame;
            EXPECT_GE(frame["triangles"], frame["submitted"]) << frame;
            EXPECT_GT(frame["points"], 0U) << frame;
            EXPECT_LE(frame["ssim"], 1.0) << frame;
        }
        if (contestant == "full mesh") {
            EXPECT_LT(row["largestPixels"], 0.02) << "it is the source, in single precision: " << row;
            EXPECT_EQ(row["psnr"], 100.0) << row;
        } else {
            double& ratio = largest[contestant];
            ratio = std::max(ratio, row["largestPromised"].get<double>() / row["errorPixels"].get<double>());
        }
    }
    EXPECT_EQ(rows["full mesh"], 2U) << "a row for each path";
    for (const char* name : {"meshoptimizer", "meshoptimizer, clusters", "uniform, isotropic", "tessellation",
                             "instanced", "first order"}) {
        EXPECT_EQ(rows[name], 2U * 2U) << name << ", for each path and error";
        EXPECT_GT(largest[name], 0.0) << name;
    }
    const Json& summary = report["summary"];
    EXPECT_EQ(summary["max_measured_over_asked"], largest["tessellation"]);
    EXPECT_LE(summary["max_measured_over_asked"], 1.0);
    EXPECT_LE(largest["instanced"], 1.0);
    EXPECT_TRUE(summary["triangles_over_best_other_at_1px"].is_null()) << "1 pixel is not asked for";
    EXPECT_EQ(summary["equal_error"]["rows"].size(), 2U * 3U);
    EXPECT_GT(summary["equal_error"]["triangles_over_best_other"], 0.0);

    const std::string lines = readBytes(csv);
    EXPECT_EQ(lines.rfind("scene,path,contestant,errorPixels,", 0), 0U) << lines.substr(0, 100);
    EXPECT_EQ(static_cast<std::size_t>(std::count(lines.begin(), lines.end(), '\n')), report["rows"].size() + 1);
    EXPECT_NE(lines.find("\"meshoptimizer, clusters\""), std::string::npos);
}

TEST_F(BenchCommand, NamesWhatItCannotMeasure)
{
    const std::string path = _folder.file("empty.obj");
    writeBytes(path, "");
    for (const char* command : {"bake", "levels", "ladder"}) {
        const Outcome outcome = run(std::string(command) + " --scene '" + path + "'");
        EXPECT_EQ(outcome.status, 1) << command;
        EXPECT_NE(outcome.output.find("osgtesslodbench: empty: " + path), std::string::npos) << outcome.output;
    }
    EXPECT_EQ(run("levels --scene nowhere").status, 1);
}

TEST_F(BenchCommand, DisplacementMeetsEveryPatchOnceAndFitsBest)
{
    const Json report = this->report("displacement --quick --scene '" + torus() + "'");
    ASSERT_EQ(report["rows"].size(), 1U);
    const Json& row = report["rows"][0];
    EXPECT_EQ(row["strayRays"], 0);
    EXPECT_EQ(row["sourceTriangles"], 1280);
    for (const char* technique : {"intersection", "interpolation", "fit"}) {
        EXPECT_GE(row[technique]["largestPercent"], row[technique]["meanPercent"]);
        EXPECT_GE(row[technique]["meanSquarePercent2"].get<double>(), 0.0);
    }
    EXPECT_LE(row["fit"]["meanSquarePercent2"], row["intersection"]["meanSquarePercent2"]);
    EXPECT_EQ(report["summary"]["intersection_mean_square_over_intersection"], 1.0);
}

} // namespace
} // namespace osgTessLOD
