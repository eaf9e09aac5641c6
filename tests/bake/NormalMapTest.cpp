// SPDX-License-Identifier: MIT
// Normals over a mesh's own texture coordinates: what the images hold, and which texture coordinates have none.
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/NormalMap.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Corners = std::array<Vector2f, 3>;

/// Triangles that are as good as any others, of these texture coordinates.
SourceMesh meshOf(const std::vector<Corners>& uvs)
{
    SourceMesh mesh;
    mesh.name = "made.obj";
    for (std::uint32_t t = 0; t < uvs.size(); ++t) {
        const double z = t;
        mesh.positions.insert(mesh.positions.end(), {Vector3d(0, 0, z), Vector3d(1, 0, z), Vector3d(0, 1, z)});
        mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
        mesh.uvs.push_back(uvs[t]);
    }
    return mesh;
}

/// Each triangle's normal as it likes.
CornerNormals normalsOf(const std::vector<Vector3f>& ofTriangles)
{
    CornerNormals normals;
    for (const Vector3f& n : ofTriangles) { normals.push_back({n.normalized(), n.normalized(), n.normalized()}); }
    return normals;
}

CornerNormals upwards(std::size_t triangles)
{
    return normalsOf(std::vector<Vector3f>(triangles, Vector3f::UnitZ()));
}

std::vector<NormalMap> mapsOf(const SourceMesh& mesh, const CornerNormals& normals, std::uint32_t size = 64)
{
    Progress progress;
    return makeNormalMaps(mesh, normals, size, progress);
}

std::string faultOf(const SourceMesh& mesh)
{
    try {
        mapsOf(mesh, upwards(mesh.triangles.size()));
    } catch (const AssetError& error) {
        return error.what();
    }
    return "none";
}

Vector3f normalAt(const NormalMap& map, std::uint32_t column, std::uint32_t row)
{
    const float* p = &map.image.pixels[3 * (std::size_t{row} * map.image.width + column)];
    return Vector3f(2.0F * p[0] - 1.0F, 2.0F * p[1] - 1.0F, 2.0F * p[2] - 1.0F);
}

const Corners kLower{Vector2f(0, 0), Vector2f(1, 0), Vector2f(0, 1)};
const Corners kUpper{Vector2f(1, 1), Vector2f(0, 1), Vector2f(1, 0)};

TEST(NormalMap, HasTheMeshsNormalsWhereItsTextureCoordinatesAre)
{
    // One plane's normals, linear over the whole square, so that the two triangles agree.
    const auto normalAtUv = [](const Vector2f& uv) { return Vector3f(0.6F * uv.x(), 0.3F * uv.y(), 1.0F); };
    CornerNormals normals;
    for (const Corners& corners : {kLower, kUpper}) {
        normals.push_back({normalAtUv(corners[0]), normalAtUv(corners[1]), normalAtUv(corners[2])});
    }
    const std::vector<NormalMap> maps = mapsOf(meshOf({kLower, kUpper}), normals);
    ASSERT_EQ(maps.size(), 1U);
    EXPECT_EQ(maps[0].image.width, 64U);
    EXPECT_EQ(maps[0].image.height, 64U);
    EXPECT_EQ(maps[0].image.channels, 3U);
    EXPECT_EQ(maps[0].coverage, 1.0) << "each sample once, those on the diagonal too";
    EXPECT_EQ(maps[0].coveredTwice, 0.0);
    for (std::uint32_t row = 0; row < 64; ++row) {
        for (std::uint32_t column = 0; column < 64; ++column) {
            const float u = (static_cast<float>(column) + 0.5F) / 64.0F;
            const float v = 1.0F - (static_cast<float>(row) + 0.5F) / 64.0F; // rows come from the top
            // The mean of unit vectors around is off by the square of what they differ by in a texel, 0.01.
            EXPECT_LT((normalAt(maps[0], column, row) - normalAtUv(Vector2f(u, v)).normalized()).norm(), 1e-4F)
                << column << ", " << row;
        }
    }
}

TEST(NormalMap, FillsWhatNothingCovers)
{
    const Vector3f left = Vector3f(-1, 0, 1).normalized();
    const Vector3f right = Vector3f(1, 0, 1).normalized();
    const Corners inTheLeft{Vector2f(0.1F, 0.1F), Vector2f(0.3F, 0.1F), Vector2f(0.1F, 0.3F)};
    const Corners inTheRight{Vector2f(0.7F, 0.6F), Vector2f(0.9F, 0.6F), Vector2f(0.7F, 0.8F)};
    const NormalMap map = mapsOf(meshOf({inTheLeft, inTheRight}), normalsOf({left, right}))[0];
    EXPECT_NEAR(map.coverage, 0.04, 0.002); // a boundary of 0.7 / 256 on each side
    std::size_t mixed = 0;
    for (std::uint32_t row = 0; row < 64; ++row) {
        for (std::uint32_t column = 0; column < 64; ++column) {
            const Vector3f n = normalAt(map, column, row);
            ASSERT_NEAR(n.norm(), 1.0F, 1e-5F) << "nowhere is nothing";
            if (column < 32 && row >= 32) { EXPECT_LT((n - left).norm(), 1e-5F) << column << ", " << row; }
            if (column >= 32 && row < 32) { EXPECT_LT((n - right).norm(), 1e-5F) << column << ", " << row; }
            mixed += (n - left).norm() > 1e-3F && (n - right).norm() > 1e-3F ? 1 : 0;
        }
    }
    EXPECT_EQ(mixed, 2 * 32 * 32U) << "quarters with nothing have the mean of all";
}

TEST(NormalMap, AllowsChartsThatTouchAreMirroredOrGoRound)
{
    const std::vector<Corners> touching{kLower, {kUpper[0], kUpper[2], kUpper[1]}};
    EXPECT_EQ(mapsOf(meshOf(touching), upwards(2))[0].coveredTwice, 0.0);

    const Vector2f shift(-0.25F, 3.5F); // over the image's borders
    std::vector<Corners> shifted{kLower, kUpper};
    for (Corners& corners : shifted) {
        for (Vector2f& uv : corners) { uv += shift; }
    }
    const NormalMap map = mapsOf(meshOf(shifted), normalsOf({Vector3f(1, 0, 1), Vector3f(-1, 0, 1)}))[0];
    EXPECT_EQ(map.coverage, 1.0);
    EXPECT_EQ(map.coveredTwice, 0.0);
    // (0.1, 0.1) of the lower triangle is at (0.85, 0.6) of the image: row 25 from the top.
    EXPECT_GT(normalAt(map, 54, 25).x(), 0.0F);
    EXPECT_LT(normalAt(map, 41, 35).x(), 0.0F) << "(0.9, 0.95) of the upper one, at (0.65, 0.45)";

    Corners nudged = kUpper; // by less than a thousandth of it all
    for (Vector2f& uv : nudged) { uv.x() -= 0.0005F; }
    const NormalMap overlapping = mapsOf(meshOf({kLower, nudged}), upwards(2), 2048)[0];
    EXPECT_GT(overlapping.coveredTwice, 0.0);
    EXPECT_LT(overlapping.coveredTwice, 0.001);
}

TEST(NormalMap, RefusesTextureCoordinatesThatHaveNone)
{
    const std::string advice = "which a normal map cannot have: bake normals per patch (without --normal-map)";
    EXPECT_EQ(faultOf(meshOf({kLower, kLower})), "made.obj: the texture coordinates overlap in 100.0 % of what they cover, " +
                                                     advice + ", or unwrap it anew");
    EXPECT_EQ(faultOf(meshOf({kLower, {kLower[0], kLower[2], kLower[1]}})).find("made.obj: the texture coordinates overlap"), 0U)
        << "mirrored";
    Corners half = kLower;
    for (Vector2f& uv : half) { uv *= 0.5F; }
    EXPECT_EQ(faultOf(meshOf({kLower, half})),
              "made.obj: the texture coordinates overlap in 24.9 % of what they cover, " + advice + ", or unwrap it anew")
        << "a quarter, but for samples on the diagonal";
    Corners wide = kLower;
    for (Vector2f& uv : wide) { uv *= 2.0F; }
    EXPECT_EQ(faultOf(meshOf({wide})).find("made.obj: the texture coordinates overlap"), 0U) << "with itself, as it repeats";

    SourceMesh mesh = meshOf({kLower, kUpper});
    for (Vector2f& uv : mesh.uvs[1]) { uv.setConstant(std::numeric_limits<float>::quiet_NaN()); }
    EXPECT_EQ(faultOf(mesh), "made.obj: has faces without texture coordinates, " + advice);
    mesh.uvs[1] = kUpper;
    mesh.uvs[1][0].x() = -65.0F;
    EXPECT_EQ(faultOf(mesh), "made.obj: has texture coordinates (-65, 1) beyond 64, " + advice);
    mesh.uvs.clear();
    EXPECT_EQ(faultOf(mesh), "made.obj: no texture coordinates for a normal map");
    EXPECT_EQ(faultOf(meshOf({{kLower[0], kLower[0], kLower[0]}})),
              "made.obj: texture coordinates cover nothing of a normal map");
}

TEST(NormalMap, IsOneForEachMaterial)
{
    SourceMesh mesh = meshOf({kLower, kLower});
    mesh.materials.resize(3);
    mesh.materials[2].name = "wood";
    mesh.triangleMaterials = {0, 2};
    const std::vector<NormalMap> maps = mapsOf(mesh, normalsOf({Vector3f(1, 0, 0), Vector3f(0, 1, 0)}));
    ASSERT_EQ(maps.size(), 2U);
    EXPECT_EQ(maps[0].material, 0U);
    EXPECT_EQ(maps[1].material, 2U);
    EXPECT_LT((normalAt(maps[0], 5, 40) - Vector3f::UnitX()).norm(), 1e-5F);
    EXPECT_LT((normalAt(maps[1], 5, 40) - Vector3f::UnitY()).norm(), 1e-5F);
    mesh.triangleMaterials = {2, 2};
    EXPECT_EQ(faultOf(mesh).find("made.obj: the texture coordinates of material wood overlap in 100.0 %"), 0U);
}

/// A hill over a square, n × n quads, whose texture coordinates are its plan.
SourceMesh hill(std::uint32_t n)
{
    SourceMesh mesh;
    mesh.name = "hill.obj";
    for (std::uint32_t j = 0; j <= n; ++j) {
        for (std::uint32_t i = 0; i <= n; ++i) {
            const double x = static_cast<double>(i) / n;
            const double y = static_cast<double>(j) / n;
            mesh.positions.emplace_back(x, y, 0.2 * std::sin(3.0 * x) * std::sin(5.0 * y));
        }
    }
    const auto uv = [&](std::uint32_t v) { return mesh.positions[v].head<2>().cast<float>().eval(); };
    for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i < n; ++i) {
            const std::uint32_t a = j * (n + 1) + i;
            for (const std::array<std::uint32_t, 3>& t :
                 {std::array<std::uint32_t, 3>{a, a + 1, a + n + 2}, {a, a + n + 2, a + n + 1}}) {
                mesh.triangles.push_back(t);
                mesh.uvs.push_back({uv(t[0]), uv(t[1]), uv(t[2])});
            }
        }
    }
    return mesh;
}

TEST(NormalMap, TakesThePlaceOfNormalsPerPatchInTheAsset)
{
    BakeOptions options;
    options.maxFactor = 8;
    options.normalMap = 128;
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeMesh(hill(96), options, progress, report);
    EXPECT_EQ(asset.normals.resolution, 0U);
    for (const LodLevel& level : asset.levels) { EXPECT_TRUE(level.parameters.empty()); }
    ASSERT_EQ(asset.materials.size(), 1U);
    ASSERT_EQ(asset.materials[0].textures.size(), 1U);
    const LodTexture& texture = asset.materials[0].textures[0];
    EXPECT_EQ(texture.role, LodTexture::Role::ObjectNormal);
    ASSERT_NE(asset.imageOf(texture), nullptr);
    EXPECT_EQ(asset.imageOf(texture)->name, "normals.png");
    ASSERT_EQ(report.normalMaps.size(), 1U);
    EXPECT_EQ(report.normalMaps[0].coverage, 1.0);
    EXPECT_NE(report.toJson().find("\"normal_maps\""), std::string::npos);

    std::stringstream file;
    writeTlod(file, asset);
    const LodAsset read = readTlod(file, "read");
    EXPECT_EQ(read.materials, asset.materials);
    EXPECT_EQ(read.images, asset.images);

    // The image's file has the normals of the surface: in the middle of a texel, of z = 0.2 sin 3x sin 5y.
    const TemporaryDirectory folder;
    std::ofstream(folder.file("n.png"), std::ios::binary)
        .write(reinterpret_cast<const char*>(asset.images[0].bytes.data()), // NOLINT: bytes are characters
               static_cast<std::streamsize>(asset.images[0].bytes.size()));
    NormalMap map;
    map.image = imageFiles().read(folder.file("n.png"), 3);
    EXPECT_EQ(map.image.largestInteger, 65535.0);
    for (std::uint32_t k = 2; k < 126; k += 4) {
        const double x = (k + 0.5) / 128.0;
        const double y = 1.0 - (k + 0.5) / 128.0;
        const Vector3d n(-0.6 * std::cos(3.0 * x) * std::sin(5.0 * y), -std::sin(3.0 * x) * std::cos(5.0 * y), 1.0);
        // The mesh's own are off by the square of its steps times the third derivatives: 0.2 · 5³ / 96² = 0.0027, some third of it.
        EXPECT_LT((normalAt(map, k, k).cast<double>() - n.normalized()).norm(), 1e-3) << k;
    }
}

TEST(NormalMap, IsOnlyOfMeshesWithTextureCoordinates)
{
    Progress progress;
    const auto fault = [&](const std::string& source, BakeOptions options) {
        BakeReport report;
        try {
            bakeSource(source, options, progress, report);
        } catch (const AssetError& error) {
            return std::string(error.what());
        }
        return std::string("none");
    };
    BakeOptions options;
    options.normalMap = 128;
    const std::string only = ": only meshes that are baked with their texture coordinates have normal maps over them";
    EXPECT_EQ(fault("builtin:asteroid", options), "builtin:asteroid" + only);
    EXPECT_EQ(fault("a.png", options), "a.png" + only);
    options.uvs = false;
    EXPECT_EQ(fault("a.obj", options), "a.obj" + only);
    options.uvs = true;
    options.normalMap = 100;
    EXPECT_EQ(fault("a.obj", options), "the size of a normal map must be a power of two up to 8192, not 100");
    options.normalMap = 16384;
    EXPECT_EQ(fault("a.obj", options), "the size of a normal map must be a power of two up to 8192, not 16384");
}

} // namespace
} // namespace osgTessLOD::bake
