// SPDX-License-Identifier: MIT
// A whole bake: from a file to an asset.
#include <asset/OpenEdges.h>
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/Baker.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include <atomic>
#include <fstream>
#include <limits>
#include <sstream>

namespace osgTessLOD::bake {
namespace {

std::string writeAsciiPly(const TemporaryDirectory& folder, const SourceMesh& mesh,
                          const std::string& name = "source.ply")
{
    const std::string path = folder.file(name);
    std::ofstream file(path);
    file.precision(17);
    file << "ply\nformat ascii 1.0\nelement vertex " << mesh.positions.size()
         << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << mesh.triangles.size()
         << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const auto& p : mesh.positions) { file << p.x() << ' ' << p.y() << ' ' << p.z() << '\n'; }
    for (const auto& [a, b, c] : mesh.triangles) { file << "3 " << a << ' ' << b << ' ' << c << '\n'; }
    return path;
}

BakeOptions smallOptions()
{
    BakeOptions options;
    options.maxFactor = 8;
    options.controlMesh.patches = 24;
    options.patchTolerance = 0.02; // factor 8 would take hundreds of patches to get nearer
    return options;
}

LodAsset bake(const std::string& source, const BakeOptions& options)
{
    Progress progress;
    BakeReport report;
    return bakeSource(source, options, progress, report);
}

std::string bytesOf(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return stream.str();
}

TEST(Baker, BakesAClosedMeshIntoClosedLevels)
{
    const TemporaryDirectory folder;
    const std::string source = writeAsciiPly(folder, noisy(torus(48, 20), 0.004, 41));
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeSource(source, smallOptions(), progress, report);
    EXPECT_NO_THROW(asset.validate());
    EXPECT_EQ(asset.ladder, (std::vector<std::uint16_t>{1, 2, 4, 8}));
    EXPECT_EQ(asset.sourceTriangles, 1920U);
    EXPECT_EQ(asset.source, "source.ply");
    EXPECT_EQ(asset.technique, "strips");
    EXPECT_EQ(asset.normals.resolution, 16U);
    for (const unsigned factor : asset.ladder) { EXPECT_EQ(openEdges(extractSurface(asset, factor).triangles), 0U); }

    EXPECT_TRUE(report.isMesh);
    EXPECT_EQ(report.sourceTriangles, 1920U);
    EXPECT_EQ(report.patches, asset.patches.size());
    EXPECT_EQ(report.cleaning.components, 1U);
    EXPECT_EQ(report.cleaning.boundaryEdges, 0U);
    EXPECT_NEAR(report.diagonal, 1.0, 1e-9) << "procedural meshes are in the working frame";
    ASSERT_EQ(report.stored.levels.size(), 4U);
    for (std::size_t level = 0; level < 4; ++level) {
        EXPECT_EQ(report.stored.levels[level].factor, asset.ladder[level]);
        EXPECT_GE(report.stored.levels[level].largestError, report.stored.levels[level].meanError);
        EXPECT_GE(report.stored.levels[level].meanError, 0.0);
        EXPECT_GE(report.stored.levels[level].largestError, report.largestChartError);
    }
    EXPECT_LT(report.stored.levels[3].largestError, report.stored.levels[0].largestError);
    EXPECT_GT(report.peakBytes, 1U << 20);
    EXPECT_GT(report.seconds, 0.0);
    double inStages = 0.0;
    for (const auto& stage : report.stages) { inStages += stage.seconds; }
    EXPECT_LE(inStages, report.seconds);
}

TEST(Baker, BakesAMeshInMemoryLikeTheSameFromAFile)
{
    const TemporaryDirectory folder;
    SourceMesh mesh = noisy(torus(48, 20), 0.004, 41);
    const std::string source = writeAsciiPly(folder, mesh);
    mesh.frame = WorkingFrame(); // as the file has it
    mesh.name = "elsewhere/source.ply";
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeMesh(mesh, smallOptions(), progress, report);
    EXPECT_EQ(bytesOf(asset), bytesOf(bake(source, smallOptions())));
    EXPECT_TRUE(report.isMesh);
    EXPECT_EQ(report.source, "elsewhere/source.ply");
    EXPECT_EQ(report.cleaning.components, 1U);
}

TEST(Baker, RefusesMeshesInMemoryThatAreNone)
{
    const auto expectRefused = [](SourceMesh mesh, const std::string& why) {
        mesh.name = "thing";
        Progress progress;
        BakeReport report;
        try {
            bakeMesh(std::move(mesh), smallOptions(), progress, report);
            FAIL() << why;
        } catch (const AssetError& error) {
            EXPECT_EQ(std::string(error.what()).rfind("thing: ", 0), 0U) << error.what();
            EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
        }
    };
    const SourceMesh sound = torus(12, 8);
    expectRefused(SourceMesh(), "no vertices");
    SourceMesh mesh = sound;
    mesh.triangles.clear();
    expectRefused(mesh, "no faces");
    mesh = sound;
    mesh.triangles[3][1] = static_cast<std::uint32_t>(mesh.positions.size());
    expectRefused(mesh, "face 3");
    mesh = sound;
    mesh.positions[5].y() = std::numeric_limits<double>::quiet_NaN();
    expectRefused(mesh, "vertex 5");
    mesh = sound;
    mesh.uvs.resize(mesh.triangles.size() - 1);
    expectRefused(mesh, "texture coordinates");
    mesh = sound;
    mesh.colors.resize(mesh.triangles.size());
    expectRefused(mesh, "colours");
}

TEST(Baker, BakesABuiltin)
{
    BakeOptions options;
    options.maxFactor = 4;
    options.normals = false;
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeSource("builtin:glacier", options, progress, report);
    EXPECT_NO_THROW(asset.validate());
    EXPECT_EQ(asset.patches.size(), 32U);
    EXPECT_EQ(asset.normals.resolution, 0U);
    EXPECT_FALSE(report.isMesh);
    EXPECT_EQ(asset.ladder.back(), 4U);
}

TEST(Baker, BakesStripsOfAMeshAndABuiltin)
{
    const TemporaryDirectory folder;
    const std::string mesh = writeAsciiPly(folder, noisy(torus(48, 20), 0.004, 41));
    for (const std::string& source : {mesh, std::string("builtin:glacier")}) {
        BakeOptions options = smallOptions();
        options.technique = "strips";
        if (source == mesh) { options.ladder = {1, 2, 6, 8}; }
        options.threads = 1;
        const LodAsset asset = bake(source, options);
        EXPECT_NO_THROW(asset.validate());
        EXPECT_EQ(asset.technique, "strips");
        EXPECT_EQ(asset.ladder, source == mesh ? options.ladder : (std::vector<std::uint16_t>{1, 2, 4, 8}));
        for (const unsigned factor : asset.ladder) {
            if (source == mesh) { EXPECT_EQ(openEdges(extractSurface(asset, factor).triangles), 0U); }
        }
        options.threads = 2;
        EXPECT_TRUE(bytesOf(bake(source, options)) == bytesOf(asset)) << source;
    }
}

TEST(Baker, RefusesTechniquesAndLaddersThatAreNone)
{
    BakeOptions options = smallOptions();
    options.technique = "magic";
    EXPECT_THROW(bake("builtin:glacier", options), AssetError);
    options.technique = "strips";
    for (const std::vector<std::uint16_t>& ladder :
         {std::vector<std::uint16_t>{1, 3, 8}, {0, 8}, {1, 4}, {1, 4, 2, 8}, {1, 2, 2, 8}, {2, 4, 8}, {1, 2, 4, 8, 16}}) {
        options.ladder = ladder;
        EXPECT_THROW(bake("builtin:glacier", options), AssetError);
    }
    options.technique = "uniform";
    options.ladder = {1, 2, 6, 8};
    EXPECT_THROW(bake("builtin:glacier", options), AssetError);
}

TEST(Baker, StripsStoreWhereTheirVerticesLie)
{
    BakeOptions options;
    options.maxFactor = 8;
    options.technique = "strips";
    Progress progress;
    BakeReport report;
    const PatchedSurface surface = makeLevels("builtin:glacier", options, progress, report);
    const LodAsset asset = bake("builtin:glacier", options);
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        std::vector<std::uint32_t> expected;
        for (const PatchLevels& levels : surface.hierarchy.patches) {
            for (const ChartPoint& point : levels.parameters[level]) { expected.push_back(point.bits()); }
        }
        EXPECT_EQ(asset.levels[level].parameters, expected) << level;
        EXPECT_EQ(expected.empty(), level == 0 || level == 3)
            << "the single triangle and the finest level lie as the pattern";
    }
    options.technique = "uniform";
    for (const LodLevel& level : bake("builtin:glacier", options).levels) { EXPECT_TRUE(level.parameters.empty()); }
}

TEST(Baker, KeepsThePlaceAndSizeOfTheSource)
{
    const TemporaryDirectory folder;
    SourceMesh mesh = sphere(3);
    for (auto& p : mesh.positions) { p = Eigen::Vector3d(1000.0, -20.0, 3.0) + 50.0 * p; }
    const double sphereRadius = 50.0 / std::sqrt(12.0); // its box has a diagonal of 50
    Progress progress;
    BakeReport report;
    BakeOptions options = smallOptions();
    options.patchTolerance = 0.002;
    const LodAsset asset = bakeSource(writeAsciiPly(folder, mesh), options, progress, report);
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        for (const auto& p : extractSurface(asset, asset.ladder[level]).positions) {
            const double radius = (Eigen::Vector3d(p[0], p[1], p[2]) - Eigen::Vector3d(1000.0, -20.0, 3.0)).norm();
            EXPECT_LT(radius, sphereRadius + report.stored.levels[level].largestError);
        }
    }
    EXPECT_LT(report.stored.levels.back().largestError, 0.02 * sphereRadius);
}

TEST(Baker, SameBytesWhateverTheThreads)
{
    const TemporaryDirectory folder;
    const std::string mesh = writeAsciiPly(folder, noisy(torus(32, 14), 0.006, 42));
    for (const std::string& source : {mesh, std::string("builtin:glacier")}) {
        BakeOptions options = smallOptions();
        options.threads = 1;
        options.tolerance = source == mesh ? 0.012 : 0.02;
        const LodAsset asset = bake(source, options);
        const std::uint64_t all = asset.patches.size() * 96U;
        EXPECT_LT(summarize(asset).finestTriangles, all) << source << ": patches are to end at different levels";
        EXPECT_GT(summarize(asset).finestTriangles, all / 16) << source;
        const std::string one = bytesOf(asset);
        options.threads = 2;
        EXPECT_TRUE(bytesOf(bake(source, options)) == one) << source;
        options.threads = 0;
        EXPECT_TRUE(bytesOf(bake(source, options)) == one) << source;
    }
}

/// Asks to stop once it was told of `limit` advances.
class StopAfter : public Progress {
public:
    explicit StopAfter(int limit)
        : _limit(limit)
    {
    }
    void begin(const std::string& stage, std::uint64_t, const std::string&) override { stages.push_back(stage); }
    void advance(std::uint64_t) override { ++calls; }
    bool stopRequested() const override { return calls >= _limit; }

    std::atomic<int> calls{0};
    std::vector<std::string> stages;

private:
    int _limit;
};

TEST(Baker, StopsWhereverItIsAskedTo)
{
    const TemporaryDirectory folder;
    BakeOptions options = smallOptions();
    options.maxFactor = 4;
    const std::string mesh = writeAsciiPly(folder, torus(32, 14));
    for (const std::string& source : {mesh, std::string("builtin:glacier")}) {
        StopAfter never(std::numeric_limits<int>::max());
        BakeReport report;
        bakeSource(source, options, never, report);
        const int all = never.calls;
        ASSERT_GT(all, 20);
        EXPECT_GE(never.stages.size(), 4U);
        for (const int limit : {1, 2, 3, all / 8, all / 4, all / 2, 3 * all / 4, all}) {
            StopAfter progress(limit);
            BakeReport ignored;
            EXPECT_THROW(bakeSource(source, options, progress, ignored), Interrupted) << limit << " of " << all;
        }
    }
}

/// What bakeSource says against this source.
std::string complaint(const std::string& source, const BakeOptions& options = smallOptions())
{
    try {
        bake(source, options);
    } catch (const AssetError& error) {
        return error.what();
    }
    ADD_FAILURE() << source << " was baked";
    return {};
}

TEST(Baker, NamesTheFileThatItCannotBake)
{
    const TemporaryDirectory folder;
    const auto expectNamed = [&](const std::string& name, const std::string& content) {
        const std::string path = folder.file(name);
        std::ofstream(path) << content;
        EXPECT_NE(complaint(path).find(path), std::string::npos) << name;
    };
    expectNamed("empty.ply", "");
    expectNamed("garbage.ply", "ply\nthis is no mesh\n");
    expectNamed("unknown.xyz", "1 2 3\n");
    expectNamed("nofaces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    expectNamed("degenerate.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    expectNamed("index.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 7\n");
    expectNamed("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const std::string missing = folder.file("missing.ply");
    EXPECT_NE(complaint(missing).find(missing), std::string::npos);
    EXPECT_NE(complaint("builtin:teapot").find("glacier"), std::string::npos) << "lists the known ones";
}

TEST(Baker, RefusesFactorsOffTheLadder)
{
    for (const unsigned factor : {0U, 3U, 12U, 128U}) {
        BakeOptions options = smallOptions();
        options.maxFactor = factor;
        EXPECT_NE(complaint("builtin:glacier", options).find(std::to_string(factor)), std::string::npos);
    }
}

TEST(Baker, RefusesTolerancesThatAreNone)
{
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    for (const double tolerance : {-1e-9, -1.0, kInfinity, std::numeric_limits<double>::quiet_NaN()}) {
        BakeOptions options = smallOptions();
        options.tolerance = tolerance;
        EXPECT_NE(complaint("builtin:glacier", options).find("tolerance"), std::string::npos) << tolerance;
    }
}

TEST(Baker, FlatMeshesKeepTheirFirstLevelWhereverTheyAre)
{
    const TemporaryDirectory folder;
    SourceMesh mesh = flatGrid(16);
    for (auto& p : mesh.positions) { p = Eigen::Vector3d(300.0, -20.0, 3.0) + 50.0 * p; }
    const std::string source = writeAsciiPly(folder, mesh);
    BakeOptions options = smallOptions();
    EXPECT_EQ(summarize(bake(source, options)).finestTriangles, bake(source, options).patches.size());
    options.tolerance = 0.0;
    const LodAsset all = bake(source, options);
    EXPECT_EQ(summarize(all).finestTriangles, all.patches.size() * 96U);
}

TEST(Baker, EveryFactorOfTheLadderWorks)
{
    const TemporaryDirectory folder;
    const std::string source = writeAsciiPly(folder, sphere(3));
    for (const unsigned factor : {1U, 2U, 16U, 64U}) {
        BakeOptions options = smallOptions();
        options.maxFactor = factor;
        options.controlMesh.patches = 8; // strips of factor 64 take their time
        const LodAsset asset = bake(source, options);
        EXPECT_NO_THROW(asset.validate());
        EXPECT_EQ(asset.ladder.back(), factor);
    }
}

TEST(Baker, BakesIntoAsFewPatchesAsThereCanBe)
{
    const TemporaryDirectory folder;
    for (const SourceMesh& mesh : {sphere(4), torus(40, 16), openGrid(20), cube(6)}) {
        BakeOptions options = smallOptions();
        options.controlMesh.patches = 1;
        const std::string source = writeAsciiPly(folder, mesh);
        ASSERT_NO_THROW(bake(source, options).validate()) << mesh.name;
    }
}

TEST(Baker, ThousandsOfPiecesAreNotAllFine)
{
    TemporaryDirectory folder;
    SourceMesh pieces;
    constexpr std::uint32_t kPieces = 700; // of four patches each, 17 million triangles at factor 64
    for (std::uint32_t k = 0; k < kPieces; ++k) {
        const Eigen::Vector3d at(3.0 * (k % 30), 3.0 * (k / 30), 0.0);
        for (const Eigen::Vector3d& corner : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0),
                                              Eigen::Vector3d(0, 0, 1)}) {
            pieces.positions.push_back(at + corner);
        }
        const std::uint32_t first = 4 * k;
        pieces.triangles.insert(pieces.triangles.end(), {{first, first + 2, first + 1},
                                                         {first, first + 1, first + 3},
                                                         {first, first + 3, first + 2},
                                                         {first + 1, first + 2, first + 3}});
    }
    BakeOptions options;
    options.technique = "uniform";
    options.normals = false;
    const LodAsset asset = bake(writeAsciiPly(folder, pieces), options);
    EXPECT_EQ(asset.patches.size(), 4U * kPieces);
    EXPECT_EQ(asset.ladder, (std::vector<std::uint16_t>{1, 2, 4, 8, 16}));
}

TEST(Baker, BakesASingleTriangle)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("triangle.obj");
    std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    const LodAsset asset = bake(path, smallOptions());
    EXPECT_NO_THROW(asset.validate());
    EXPECT_EQ(asset.patches.size(), 1U);
    EXPECT_EQ(asset.patches[0].finestLevel, 0U) << "it is flat";
    EXPECT_LT(static_cast<double>(asset.levels[0].errors[0].isotropic), 1e-4);
    EXPECT_EQ(extractSurface(asset, 8).triangles.size(), 1U);
}

TEST(BakeReport, IsCompleteJson)
{
    const TemporaryDirectory folder;
    Progress progress;
    BakeReport report;
    bakeSource(writeAsciiPly(folder, sphere(3)), smallOptions(), progress, report);
    const auto json = nlohmann::json::parse(report.toJson());
    EXPECT_EQ(json["source_triangles"], 512);
    EXPECT_EQ(json["patches"], report.patches);
    EXPECT_EQ(json["levels"].size(), 4U);
    EXPECT_EQ(json["levels"][3]["factor"], 8);
    std::uint64_t triangles = 0;
    for (const auto& level : json["levels"]) {
        const auto factor = level["factor"].get<std::uint64_t>();
        const auto perPatch = factor == 1 ? 1 : 3 * factor * factor / 2;
        EXPECT_EQ(level["triangles"], level["patches"].get<std::uint64_t>() * perPatch);
        triangles += level["finest_patches"].get<std::uint64_t>() * perPatch;
    }
    EXPECT_EQ(json["finest_triangles"], triangles);
    EXPECT_LE(json["largest_finest_error"], json["levels"][0]["largest_error"]);
    EXPECT_GT(json["stages"].size(), 3U);
    EXPECT_TRUE(json["stages"][0]["seconds"].is_number());
    EXPECT_GT(json["peak_bytes"], 0);
    EXPECT_GT(json["seconds"], 0.0);
    EXPECT_TRUE(json.contains("cleaning"));
}

TEST(Baker, RefusesSizesThatSinglePrecisionCannotHold)
{
    for (const double scale : {3e38, 1e-37}) {
        SourceMesh mesh = sphere(2);
        mesh.name = "ball";
        for (Eigen::Vector3d& p : mesh.positions) { p *= scale; }
        Progress progress;
        BakeReport report;
        BakeOptions options;
        options.maxFactor = 2;
        try {
            bakeMesh(std::move(mesh), options, progress, report);
            FAIL() << scale;
        } catch (const AssetError& error) {
            EXPECT_EQ(std::string(error.what()).rfind("ball: its size, ", 0), 0U) << error.what();
        }
    }
}

} // namespace
} // namespace osgTessLOD::bake
