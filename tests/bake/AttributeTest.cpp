// SPDX-License-Identifier: MIT
// Texture coordinates and colours through the bake: seams become borders, levels have what the charts have.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/AttributeLevels.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/StripSimplifier.h>
#include <osgTessLOD/bake/UniformLevels.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <sstream>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector4f;

constexpr std::uint32_t kAround = 48;
constexpr std::uint32_t kTube = 20;

/// A torus whose texture coordinates run once around it each way, from 0 to 1, with seams where they begin again.
/// Colours are linear in the position.
SourceMesh texturedTorus()
{
    SourceMesh mesh = torus(kAround, kTube);
    for (std::uint32_t j = 0; j < kTube; ++j) {
        for (std::uint32_t i = 0; i < kAround; ++i) {
            const auto uv = [&](std::uint32_t di, std::uint32_t dj) {
                return Vector2f(static_cast<float>(i + di) / kAround, static_cast<float>(j + dj) / kTube);
            };
            mesh.uvs.push_back({uv(0, 0), uv(1, 0), uv(1, 1)});
            mesh.uvs.push_back({uv(0, 0), uv(1, 1), uv(0, 1)});
        }
    }
    for (const Vector3d& p : mesh.positions) {
        Rgba color{0, 0, 0, 255};
        for (std::size_t k = 0; k < 3; ++k) {
            color[k] = static_cast<std::uint8_t>(std::lround(255.0 * (p[static_cast<Eigen::Index>(k)] + 0.5)));
        }
        mesh.colors.push_back(color);
    }
    return mesh;
}

ControlMesh controlMeshOf(SourceMesh mesh, std::size_t patches)
{
    ControlMeshOptions options;
    options.patches = patches;
    Progress progress;
    return ControlMesh(std::move(mesh), options, progress);
}

/// Largest extent of the texture coordinates of one triangle of the charts: more than a few cells where one spans a seam.
float widestTriangle(const ChartSet& set)
{
    const TessellationPattern pattern(set.factor);
    float widest = 0.0F;
    for (const PatchChart& chart : set.charts) {
        for (const auto& t : pattern.triangles()) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Vector2f side = chart.uvs[t[k]] - chart.uvs[t[(k + 1) % 3]];
                if (!side.hasNaN()) { widest = std::max(widest, side.cwiseAbs().maxCoeff()); }
            }
        }
    }
    return widest;
}

TEST(Seams, NoChartTriangleSpansOne)
{
    for (const std::size_t patches : {16U, 60U}) {
        const ControlMesh map = controlMeshOf(texturedTorus(), patches);
        EXPECT_NO_THROW(map.history().validate());
        Progress progress;
        const ChartSet charts = makeCharts(map, 64, progress);
        // A patch of 16 is a quarter of the torus wide, in 64 segments; across a seam it would be 1.
        EXPECT_LT(widestTriangle(charts), 0.2F) << patches;
    }
}

TEST(Seams, UvsAreThoseOfThePlace)
{
    const ControlMesh map = controlMeshOf(texturedTorus(), 40);
    Progress progress;
    const ChartSet charts = makeCharts(map, 16, progress);
    for (const PatchChart& chart : charts.charts) {
        for (std::size_t v = 0; v < chart.positions.size(); ++v) {
            const Vector3d& p = chart.positions[v];
            const double turn = std::atan2(p.y(), p.x()) / (2.0 * kPi);
            const double off = turn - static_cast<double>(chart.uvs[v].x());
            // In a straight cell the angle lags behind a linear one by an eighth of the cell's angle cubed.
            EXPECT_NEAR(off, std::round(off), 1e-3);
            EXPECT_GE(chart.uvs[v].minCoeff(), 0.0F);
            EXPECT_LE(chart.uvs[v].maxCoeff(), 1.0F);
        }
    }
}

TEST(Seams, OtherBordersHaveTheSameBits)
{
    const ControlMesh map = controlMeshOf(texturedTorus(), 40);
    Progress progress;
    const ChartSet charts = makeCharts(map, 16, progress);
    std::size_t seams = 0;
    std::size_t joined = 0;
    for (const auto& edge : map.topology().edges) {
        bool isSeam = false;
        for (unsigned step = 0; step <= charts.factor; ++step) {
            const Vector2f a = charts.charts[edge.patches[0]].uvs[borderVertex(edge, 0, charts.factor, step)];
            const Vector2f b = charts.charts[edge.patches[1]].uvs[borderVertex(edge, 1, charts.factor, step)];
            isSeam = isSeam || a != b;
            const Vector2f jump = (a - b).cwiseAbs();
            for (const float x : {jump.x(), jump.y()}) { EXPECT_TRUE(x == 0.0F || std::fabs(x - 1.0F) < 1e-5F) << x; }
        }
        seams += isSeam ? 1 : 0;
        joined += isSeam ? 0 : 1;
    }
    EXPECT_GT(seams, 4U);
    EXPECT_GT(joined, 20U);
}

TEST(Seams, FacesWithoutUvsHavePatchesOfTheirOwn)
{
    SourceMesh mesh = texturedTorus();
    const Vector2f none = Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (mesh.positions[mesh.triangles[t][0]].x() < -0.1) { mesh.uvs[t] = {none, none, none}; }
    }
    const ControlMesh map = controlMeshOf(std::move(mesh), 40);
    Progress progress;
    const ChartSet charts = makeCharts(map, 16, progress);
    std::size_t without = 0;
    for (const PatchChart& chart : charts.charts) {
        const auto missing =
            std::count_if(chart.uvs.begin(), chart.uvs.end(), [](const Vector2f& uv) { return uv.hasNaN(); });
        EXPECT_TRUE(missing == 0 || missing == static_cast<long>(chart.uvs.size())) << missing;
        without += missing != 0 ? 1 : 0;
    }
    EXPECT_GT(without, 4U);
    EXPECT_LT(without, charts.charts.size() - 4);
    EXPECT_LT(widestTriangle(charts), 0.5F);
}

TEST(Seams, ChartsOfSingleQuadsStayAsTheyAre)
{
    SourceMesh mesh = texturedTorus();
    for (std::size_t t = 0; t < mesh.uvs.size(); ++t) {
        for (Vector2f& uv : mesh.uvs[t]) { uv.x() += static_cast<float>(t / 2); }
    }
    const std::size_t triangles = mesh.triangles.size();
    const ControlMesh map = controlMeshOf(std::move(mesh), 10);
    EXPECT_EQ(map.topology().patches.size(), triangles) << "no vertex has a seam to go along";
}

/// Everything up to the asset, at factors up to 8.
struct Baked {
    std::unique_ptr<ControlMesh> map;
    ChartSet charts;
    LevelHierarchy hierarchy;
    LodAsset asset;
};

Baked bake(SourceMesh mesh, bool strips, const std::vector<std::uint16_t>& ladder = {1, 2, 4, 8})
{
    Progress progress;
    Baked baked;
    baked.map = std::make_unique<ControlMesh>(controlMeshOf(std::move(mesh), 40));
    const PatchTopology& topology = baked.map->topology();
    baked.charts = makeCharts(*baked.map, 2U * ladder.back(), progress);
    baked.hierarchy = strips ? makeStripLevels(topology, baked.charts, ladder, {}, progress)
                             : makeUniformLevels(topology, baked.charts, ladder, progress);
    baked.asset = assembleAsset(*baked.map, baked.charts, baked.hierarchy, 0.0, progress);
    addAttributes(topology, baked.charts, baked.hierarchy, baked.asset, progress);
    return baked;
}

ChartPoint pointOf(const Baked& baked, std::uint32_t patch, std::size_t level, std::uint32_t vertex)
{
    const PatchLevels& levels = baked.hierarchy.patches[patch];
    return levels.hasParameters(level) ? levels.parameters[level][vertex]
                                       : TessellationPattern::chartPoint(baked.hierarchy.ladder[level], vertex);
}

/// What a chart has at a point, linear in its triangles.
template <typename Value>
Value chartValue(const TessellationPattern& pattern, const std::vector<Value>& values, double u, double v)
{
    const auto at = pattern.locate({1.0 - u - v, u, v});
    const auto& t = pattern.triangles()[at.triangle];
    return static_cast<float>(at.weights[0]) * values[t[0]] + static_cast<float>(at.weights[1]) * values[t[1]] +
           static_cast<float>(at.weights[2]) * values[t[2]];
}

class AttributesOf : public testing::TestWithParam<std::pair<bool, std::vector<std::uint16_t>>> {
protected:
    Baked made() const { return bake(texturedTorus(), GetParam().first, GetParam().second); }
};

INSTANTIATE_TEST_SUITE_P(Techniques, AttributesOf,
                         testing::Values(std::make_pair(false, std::vector<std::uint16_t>{1, 2, 4, 8}),
                                         std::make_pair(true, std::vector<std::uint16_t>{1, 2, 4, 8}),
                                         std::make_pair(true, std::vector<std::uint16_t>{1, 2, 4, 6, 8, 10, 14, 16})));

TEST_P(AttributesOf, AreTheChartsWhereTheVerticesLie)
{
    const Baked baked = made();
    EXPECT_NO_THROW(baked.asset.validate());
    const TessellationPattern chart(baked.charts.factor);
    for (std::size_t l = 0; l < baked.asset.levels.size(); ++l) {
        const LodLevel& level = baked.asset.levels[l];
        const std::uint32_t count = TessellationPattern::vertexCount(baked.asset.ladder[l]);
        for (std::uint32_t p = 0; p < baked.asset.patches.size(); ++p) {
            for (std::uint32_t v = 0; v < count; ++v) {
                const ChartPoint point = pointOf(baked, p, l, v);
                constexpr double kUnits = ChartPoint::kUnits;
                const std::size_t at = p * std::size_t{count} + v;
                const Vector2f uv = chartValue(chart, baked.charts.charts[p].uvs, point.u / kUnits, point.v / kUnits);
                const auto stored = baked.asset.uvLattice.decode(level.uvs[at]);
                // Half a step, and single precision's rounding of numbers up to 1.
                EXPECT_NEAR(stored[0], uv.x(), 0.5F * baked.asset.uvLattice.step[0] + 3e-7F);
                EXPECT_NEAR(stored[1], uv.y(), 0.5F * baked.asset.uvLattice.step[1] + 3e-7F);
                const Vector4f color =
                    chartValue(chart, baked.charts.charts[p].colors, point.u / kUnits, point.v / kUnits);
                for (unsigned k = 0; k < 4; ++k) {
                    EXPECT_NEAR(static_cast<float>(level.colors[at] >> 8 * k & 0xFFU), 255.0F * color[k], 0.501F);
                }
            }
        }
    }
}

TEST_P(AttributesOf, AreTheSameOnBothSidesOfBordersThatAreNoSeams)
{
    const Baked baked = made();
    std::size_t joined = 0;
    for (const auto& edge : baked.map->topology().edges) {
        const auto& a = baked.charts.charts[edge.patches[0]].uvs;
        const auto& b = baked.charts.charts[edge.patches[1]].uvs;
        bool isSeam = false;
        for (unsigned step = 0; step <= baked.charts.factor; ++step) {
            isSeam = isSeam || a[borderVertex(edge, 0, baked.charts.factor, step)] !=
                                   b[borderVertex(edge, 1, baked.charts.factor, step)];
        }
        if (isSeam) { continue; }
        ++joined;
        for (std::size_t l = 0; l < baked.asset.levels.size(); ++l) {
            const unsigned factor = baked.asset.ladder[l];
            const std::size_t count = TessellationPattern::vertexCount(factor);
            const auto& uvs = baked.asset.levels[l].uvs;
            for (unsigned step = 0; step <= factor; ++step) {
                EXPECT_EQ(uvs[edge.patches[0] * count + borderVertex(edge, 0, factor, step)],
                          uvs[edge.patches[1] * count + borderVertex(edge, 1, factor, step)]);
            }
        }
    }
    EXPECT_GT(joined, 20U);
}

TEST_P(AttributesOf, UvErrorsAreTheLargestAnywhere)
{
    const Baked baked = made();
    const TessellationPattern chart(baked.charts.factor);
    std::mt19937 random(17);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (std::size_t l = 0; l < baked.asset.levels.size(); ++l) {
        const LodLevel& level = baked.asset.levels[l];
        const TessellationPattern pattern(baked.asset.ladder[l]);
        float largestError = 0.0F;
        double largestSeen = 0.0;
        for (std::uint32_t p = 0; p < baked.asset.patches.size(); ++p) {
            double seen = 0.0;
            for (int k = 0; k < 2000; ++k) {
                const auto& t = pattern.triangles()[random() % pattern.triangles().size()];
                const double r = std::sqrt(unit(random));
                const double s = unit(random);
                const std::array<double, 3> weights{1.0 - r, r * (1.0 - s), r * s};
                double u = 0.0;
                double v = 0.0;
                Eigen::Vector2d own = Eigen::Vector2d::Zero();
                for (std::size_t c = 0; c < 3; ++c) {
                    const ChartPoint point = pointOf(baked, p, l, t[c]);
                    u += weights[c] * point.u / ChartPoint::kUnits;
                    v += weights[c] * point.v / ChartPoint::kUnits;
                    const auto uv =
                        baked.asset.uvLattice.decode(level.uvs[p * std::size_t{pattern.vertexCount()} + t[c]]);
                    own += weights[c] * Eigen::Vector2d(uv[0], uv[1]);
                }
                const Vector2f reference = chartValue(chart, baked.charts.charts[p].uvs, u, v);
                seen = std::max(seen, (own - reference.cast<double>()).norm());
            }
            EXPECT_LE(seen, static_cast<double>(level.uvErrors[p]) + 1e-6) << "level " << l << ", patch " << p;
            largestSeen = std::max(largestSeen, seen);
            largestError = std::max(largestError, level.uvErrors[p]);
        }
        EXPECT_GT(largestSeen, 0.5 * static_cast<double>(largestError)) << "level " << l;
    }
    const auto worst = [&](std::size_t l) {
        const auto& errors = baked.asset.levels[l].uvErrors;
        return *std::max_element(errors.begin(), errors.end());
    };
    EXPECT_LT(worst(baked.asset.levels.size() - 1), 0.5F * worst(0));
}

TEST(Attributes, CostNothingWhereThereAreNone)
{
    const Baked baked = bake(torus(kAround, kTube), true);
    EXPECT_FALSE(baked.asset.hasUvs());
    EXPECT_FALSE(baked.asset.hasColors());
    for (const PatchChart& chart : baked.charts.charts) {
        EXPECT_TRUE(chart.uvs.empty());
        EXPECT_TRUE(chart.colors.empty());
    }
    EXPECT_NO_THROW(baked.asset.validate());
}

/// The torus as an OBJ file with texture coordinates.
std::string writeObj(const TemporaryDirectory& folder, const SourceMesh& mesh)
{
    const std::string path = folder.file("textured.obj");
    std::ofstream file(path);
    file.precision(17);
    for (const auto& p : mesh.positions) { file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n'; }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        for (const auto& uv : mesh.uvs[t]) { file << "vt " << uv.x() << ' ' << uv.y() << '\n'; }
        file << 'f';
        for (std::size_t k = 0; k < 3; ++k) {
            file << ' ' << mesh.triangles[t][k] + 1 << '/' << static_cast<int>(k) - 3;
        }
        file << '\n';
    }
    return path;
}

TEST(Attributes, OfAFileAreTheSameBytesWhateverTheThreads)
{
    const TemporaryDirectory folder;
    const std::string path = writeObj(folder, texturedTorus());
    BakeOptions options;
    options.maxFactor = 8;
    options.controlMesh.patches = 24;
    options.patchTolerance = 0.02;
    std::string first;
    for (const unsigned threads : {1U, 3U}) {
        options.threads = threads;
        Progress progress;
        BakeReport report;
        const LodAsset asset = bakeSource(path, options, progress, report);
        EXPECT_TRUE(asset.hasUvs());
        EXPECT_TRUE(report.hasUvs);
        EXPECT_GT(report.stored.levels.front().largestUvError, report.stored.levels.back().largestUvError);
        EXPECT_NE(report.toJson().find("largest_uv_error"), std::string::npos);
        std::ostringstream stream;
        writeTlod(stream, asset);
        if (first.empty()) { first = stream.str(); }
        EXPECT_EQ(stream.str(), first);
    }
}

TEST(Attributes, InTooManyPiecesAreRefusedOrLeftOut)
{
    // Every quad by itself, no vertex to collapse: 18,000 patches, at factor 64 each with a chart of 12,481 vertices.
    const TemporaryDirectory folder;
    SourceMesh mesh = torus(150, 60);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto u = static_cast<float>(t / 2);
        mesh.uvs.push_back({Vector2f(u, 0.0F), Vector2f(u + 0.5F, t % 2 == 0 ? 0.0F : 1.0F),
                            Vector2f(t % 2 == 0 ? u + 0.5F : u, 1.0F)});
    }
    const std::string path = writeObj(folder, mesh);
    BakeOptions options;
    options.ladder = {1, 2, 4, 8, 16, 32, 64}; // or the largest factor would be 8
    Progress progress;
    BakeReport report;
    try {
        bakeSource(path, options, progress, report);
        FAIL();
    } catch (const AssetError& error) {
        const std::string what = error.what();
        EXPECT_NE(what.find("textured.obj: the seams of its texture coordinates and materials leave no fewer than 18000 patches"),
                  std::string::npos)
            << what;
    }
    options.uvs = false;
    options.ladder.clear();
    options.maxFactor = 4;
    options.technique = "uniform";
    options.patchTolerance = 0.05;
    EXPECT_FALSE(bakeSource(path, options, progress, report).hasUvs());
}

TEST(Attributes, WithoutNormalsNoParametersAreStored)
{
    const TemporaryDirectory folder;
    const std::string path = writeObj(folder, texturedTorus());
    BakeOptions options;
    options.maxFactor = 8;
    options.controlMesh.patches = 24;
    options.patchTolerance = 0.02;
    options.normals = false;
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeSource(path, options, progress, report);
    for (const LodLevel& level : asset.levels) { EXPECT_TRUE(level.parameters.empty()); }
}

} // namespace
} // namespace osgTessLOD::bake
