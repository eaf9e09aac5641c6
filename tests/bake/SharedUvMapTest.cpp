// SPDX-License-Identifier: MIT
// Patches from a coarse mesh that shares its texture coordinates with the detailed one.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/AttributeLevels.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/SharedUvMap.h>
#include <osgTessLOD/bake/StripSimplifier.h>
#include <osgTessLOD/bake/UniformLevels.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;

constexpr std::uint32_t kSplit = 16; // segments of a coarse edge in the detailed mesh

/// A bumpy sphere over an octahedron.
Vector3d bumpy(const Vector3d& flat)
{
    const Vector3d d = flat.normalized();
    return d * (1.0 + 0.1 * std::sin(9.0 * d.x()) * std::cos(7.0 * d.y() + 4.0 * d.z()));
}

/// The octahedron's faces in `segments` segments each way, bent by `bend`, each face a triangle of its own in the texture, face k
/// at (k / 4, k mod 4).
SourceMesh octahedron(std::uint32_t segments, Vector3d (*bend)(const Vector3d&))
{
    const std::vector<Vector3d> corners{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    const std::vector<std::array<std::uint32_t, 3>> faces{{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                                          {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    SourceMesh mesh;
    mesh.name = "octahedron";
    const double n = segments;
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        const auto index = [&](std::uint32_t i, std::uint32_t j) { return first + j * (2 * segments + 3 - j) / 2 + i; };
        std::vector<Vector2f> uvs;
        for (std::uint32_t j = 0; j <= segments; ++j) {
            for (std::uint32_t i = 0; i + j <= segments; ++i) {
                const std::array<double, 3> b{(n - i - j) / n, i / n, j / n};
                Vector3d flat = Vector3d::Zero();
                for (std::size_t k = 0; k < 3; ++k) { flat += b[k] * corners[faces[f][k]]; }
                mesh.positions.push_back(bend(flat));
                uvs.emplace_back(static_cast<float>((f % 4 + 0.8 * b[1]) / 4.0),
                                 static_cast<float>((f / 4 + 0.7 * b[2]) / 2.0));
            }
        }
        const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            mesh.triangles.push_back({a, b, c});
            mesh.uvs.push_back({uvs[a - first], uvs[b - first], uvs[c - first]});
        };
        for (std::uint32_t j = 0; j < segments; ++j) {
            for (std::uint32_t i = 0; i + j < segments; ++i) {
                add(index(i, j), index(i + 1, j), index(i, j + 1));
                if (i + j + 1 < segments) { add(index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)); }
            }
        }
    }
    cleanMesh(mesh);
    return mesh;
}

Vector3d asItIs(const Vector3d& p)
{
    return p;
}

SourceMesh detailed()
{
    SourceMesh mesh = octahedron(kSplit, bumpy);
    normalizeFrame(mesh);
    return mesh;
}

TEST(SharedUvMap, PatchesAreTheCoarseTriangles)
{
    const SourceMesh fine = detailed();
    EXPECT_EQ(fine.triangles.size(), 8U * kSplit * kSplit);
    const SharedUvMap map(octahedron(1, asItIs), fine, {});
    EXPECT_EQ(map.topology().patches.size(), 8U);
    EXPECT_EQ(map.topology().edges.size(), 12U);
    EXPECT_EQ(map.sourceTriangles(), fine.triangles.size());
    // Where the detailed mesh has its vertices, the patches have them too; texture coordinates are exact.
    const SourceMesh coarse = octahedron(1, asItIs);
    for (std::uint32_t p = 0; p < 8; ++p) {
        const auto& c = coarse.triangles[p];
        for (std::uint32_t j = 0; j <= kSplit; ++j) {
            for (std::uint32_t i = 0; i + j <= kSplit; ++i) {
                const Vector3d b = Vector3d(kSplit - i - j, i, j) / kSplit;
                const SurfacePoint point = map.evaluate(p, b);
                const Vector3d flat =
                    b[0] * coarse.positions[c[0]] + b[1] * coarse.positions[c[1]] + b[2] * coarse.positions[c[2]];
                const Vector3d expected = (bumpy(flat) - map.frame().center) / map.frame().scale;
                // Texture coordinates have 24 bits, and a detailed triangle is 1/20 wide there.
                EXPECT_LT((point.position - expected).norm(), 1e-6);
                const auto& uv = coarse.uvs[p];
                const Vector2f linear = b[0] * uv[0] + b[1] * uv[1] + b[2] * uv[2];
                EXPECT_LT((point.uv - linear).norm(), 1e-6F);
            }
        }
    }
}

TEST(SharedUvMap, IsClosedAcrossSeamsAndUvsAreExactAtEveryLevel)
{
    Progress progress;
    const SharedUvMap map(octahedron(1, asItIs), detailed(), {});
    ChartSet charts = makeCharts(map, 2 * kSplit, progress);
    measureChartErrors(map.source(), map.sourceSamples(), charts, progress);
    for (const PatchChart& chart : charts.charts) {
        // The pattern's edges, 0.05 long, cut across the detailed mesh's bends of up to a radian: a quarter of that, of 3.6.
        EXPECT_LT(chart.chartError, 6e-3);
    }
    const std::vector<std::uint16_t> ladder{1, 2, 4, 8, 16};
    for (const bool strips : {false, true}) {
        const LevelHierarchy levels = strips ? makeStripLevels(map.topology(), charts, ladder, {}, progress)
                                             : makeUniformLevels(map.topology(), charts, ladder, progress);
        LodAsset asset = assembleAsset(map, charts, levels, 0.0, progress);
        addAttributes(map.topology(), charts, levels, asset, progress);
        EXPECT_NO_THROW(asset.validate());
        for (std::size_t l = 0; l < asset.levels.size(); ++l) {
            for (const float error : asset.levels[l].uvErrors) {
                // Half a step each way, single precision's rounding aside: what 16 bits leave.
                const double halfStep = 0.5 * std::hypot(asset.uvLattice.step[0], asset.uvLattice.step[1]);
                EXPECT_LT(error, halfStep + 1e-6) << "level " << l << (strips ? " by strips" : "");
            }
            const SurfaceMesh surface = extractSurface(asset, ladder[l]);
            std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
            for (const auto& t : surface.triangles) {
                for (std::size_t k = 0; k < 3; ++k) { ++edges[std::minmax(t[k], t[(k + 1) % 3])]; }
            }
            for (const auto& [edge, sides] : edges) { EXPECT_EQ(sides, 2); }
        }
    }
}

TEST(SharedUvMap, OfChartsOverOneAnotherTheNearestCounts)
{
    // Mirrored halves share the texture, as for symmetric models: all eight faces lie over one another.
    const auto stacked = [](SourceMesh mesh) {
        for (auto& uvs : mesh.uvs) {
            const auto low = uvs[0].cwiseMin(uvs[1]).cwiseMin(uvs[2]).eval();
            const Vector2f origin(std::floor(low.x() * 4.0F + 1e-4F) / 4.0F, std::floor(low.y() * 2.0F + 1e-4F) / 2.0F);
            for (Vector2f& uv : uvs) { uv -= origin; }
        }
        return mesh;
    };
    const SourceMesh coarse = octahedron(1, asItIs);
    const SharedUvMap map(stacked(coarse), stacked(detailed()), {});
    for (std::uint32_t p = 0; p < 8; ++p) {
        const auto& c = coarse.triangles[p];
        const Vector3d middle = (coarse.positions[c[0]] + coarse.positions[c[1]] + coarse.positions[c[2]]) / 3.0;
        const Vector3d found =
            map.frame().center + map.frame().scale * map.evaluate(p, Vector3d::Constant(1.0 / 3.0)).position;
        EXPECT_GT(found.normalized().dot(middle.normalized()), 0.99);
    }
}

std::string faultOf(SourceMesh coarse, SourceMesh fine, double tolerance)
{
    try {
        SharedUvOptions options;
        options.tolerance = tolerance;
        const SharedUvMap map(std::move(coarse), std::move(fine), options);
        Progress progress;
        makeCharts(map, 8, progress);
    } catch (const AssetError& error) {
        return error.what();
    }
    return "";
}

TEST(SharedUvMap, WhatTheDetailedMeshLeavesOutIsTakenFromTheNearestOrRefused)
{
    SourceMesh wide = octahedron(1, asItIs);
    for (auto& uvs : wide.uvs) {
        for (Vector2f& uv : uvs) { uv += Vector2f(-0.01F, 0.0F); }
    }
    EXPECT_EQ(faultOf(wide, detailed(), 0.02), "");
    const std::string fault = faultOf(wide, detailed(), 0.001);
    EXPECT_EQ(fault.find("octahedron: triangle "), 0U) << fault; // any of them: all are, and patches are looked up in parallel
    EXPECT_NE(fault.find(" at texture coordinates "), std::string::npos) << fault;
    EXPECT_NE(fault.find("is farther than 0.001"), std::string::npos) << fault;
}

TEST(SharedUvMap, NeedsUvsWithAnArea)
{
    const Vector2f none = Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
    SourceMesh bare = octahedron(1, asItIs);
    bare.uvs[5] = {none, none, none};
    EXPECT_NE(
        faultOf(bare, detailed(), 0.02).find("triangle 5 (counted from 0 after cleaning) has no texture coordinates"),
        std::string::npos);
    SourceMesh fine = detailed();
    fine.uvs.clear();
    EXPECT_NE(faultOf(octahedron(1, asItIs), fine, 0.02).find("has no texture coordinates"), std::string::npos);
    SourceMesh flat = octahedron(1, asItIs);
    flat.uvs[3][2] = flat.uvs[3][1];
    EXPECT_NE(faultOf(flat, detailed(), 0.02).find("triangle 3 (counted from 0 after cleaning) has no area"),
              std::string::npos);
}

std::string writeObj(const TemporaryDirectory& folder, const std::string& name, const SourceMesh& mesh)
{
    const std::string path = folder.file(name);
    std::ofstream file(path);
    file.precision(17);
    for (const Vector3d& p : mesh.positions) { file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n'; }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const Vector2f& uv : mesh.uvs[t]) { file << "vt " << uv.x() << ' ' << uv.y() << '\n'; }
        file << 'f';
        for (std::size_t k = 0; k < 3; ++k) {
            file << ' ' << mesh.triangles[t][k] + 1 << '/' << static_cast<int>(k) - 3;
        }
        file << '\n';
    }
    return path;
}

TEST(SharedUvMap, BakesFilesToTheSameBytesWhateverTheThreads)
{
    const TemporaryDirectory folder;
    const std::string fine = writeObj(folder, "fine.obj", octahedron(kSplit, bumpy));
    BakeOptions options;
    options.maxFactor = 8;
    options.base = writeObj(folder, "coarse.obj", octahedron(1, asItIs));
    std::string first;
    for (const unsigned threads : {1U, 3U}) {
        options.threads = threads;
        Progress progress;
        BakeReport report;
        const LodAsset asset = bakeSource(fine, options, progress, report);
        EXPECT_EQ(asset.patches.size(), 8U);
        EXPECT_TRUE(report.isMesh);
        EXPECT_GT(report.largestChartError, 0.0);
        std::ostringstream stream;
        writeTlod(stream, asset);
        if (first.empty()) { first = stream.str(); }
        EXPECT_EQ(stream.str(), first);
    }
    options.base = folder.file("absent.obj");
    Progress progress;
    BakeReport report;
    EXPECT_THROW(bakeSource(fine, options, progress, report), AssetError);
    options.base = fine;
    EXPECT_THROW(bakeSource("builtin:glacier", options, progress, report), AssetError);
}

TEST(SharedUvMap, TakesSpotAndItsControlMesh)
{
    const char* data = std::getenv("OSGTESSLOD_DATA");
    if (data == nullptr) { GTEST_SKIP() << "OSGTESSLOD_DATA is not set"; }
    BakeOptions options;
    options.maxFactor = 4;
    options.technique = "uniform";
    options.base = std::string(data) + "/textured/spot_control_mesh.obj";
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeSource(std::string(data) + "/textured/spot_5856_uv.obj", options, progress, report);
    EXPECT_EQ(asset.patches.size(), 372U);
    EXPECT_NO_THROW(asset.validate());
    for (const AssetSummary::Level& level : report.stored.levels) { EXPECT_LT(level.largestUvError, 2e-5); }
}

} // namespace
} // namespace osgTessLOD::bake
