// SPDX-License-Identifier: MIT
// Normals over a mesh's own texture coordinates: what the images hold, and which texture coordinates have none.
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AssetImages.h>
#include <osgTessLOD/asset/TlodFile.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/NormalMap.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <utility>
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

std::vector<NormalMap> mapsOf(const SourceMesh& mesh, const CornerNormals& normals, std::uint32_t size = 64, bool together = false)
{
    Progress progress;
    std::vector<NormalMap> maps;
    makeNormalMaps(mesh, normals, size, together, progress, [&](NormalMap map) { maps.push_back(std::move(map)); });
    return maps;
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

/// Channels have 10 bits: half a step of 2 / 1023 in each of three.
constexpr float kRounding = 0.0018F;

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
            EXPECT_LT((normalAt(maps[0], column, row) - normalAtUv(Vector2f(u, v)).normalized()).norm(), 1e-4F + kRounding)
                << column << ", " << row;
        }
    }
}

/// Two triangles.
std::vector<Corners> rectangle(float left, float bottom, float right, float top)
{
    const Vector2f a(left, bottom), b(right, bottom), c(right, top), d(left, top);
    return {{a, b, c}, {a, c, d}};
}

std::vector<Corners> operator+(std::vector<Corners> a, const std::vector<Corners>& b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

TEST(NormalMap, GrowsChartsUntilTheyMeet)
{
    const Vector3f left = Vector3f(-1, 0, 1).normalized();
    const Vector3f right = Vector3f(1, 0, 1).normalized();
    // Columns 16 to 31 and 48 to 55 of 64: the first ends where blocks of all powers of two do, and so do texels of mip-maps.
    const std::vector<Corners> charts = rectangle(0.25F, 0.25F, 0.5F, 0.75F) + rectangle(0.75F, 0.25F, 0.875F, 0.75F);
    const NormalMap map = mapsOf(meshOf(charts), normalsOf({left, left, right, right}))[0];
    EXPECT_DOUBLE_EQ(map.coverage, 16.0 * 32 / 4096 + 8.0 * 32 / 4096);
    for (std::uint32_t row = 0; row < 64; ++row) {
        for (std::uint32_t column = 0; column < 64; ++column) {
            // Within 6 texels, between charts that are 16 apart, and 24 round the image's border, which repeats.
            const bool isNear = row >= 10 && row < 54;
            const bool isLeft = isNear && column >= 10 && column < 38;
            const bool isRight = isNear && column >= 42 && column < 62;
            const Vector3f n = normalAt(map, column, row);
            ASSERT_NEAR(n.norm(), 1.0F, kRounding) << "nowhere is nothing";
            if (isLeft) { EXPECT_LT((n - left).norm(), kRounding) << column << ", " << row; }
            if (isRight) { EXPECT_LT((n - right).norm(), kRounding) << column << ", " << row; }
        }
    }
}

TEST(NormalMap, HasTheMeanOfWhatIsInATexelAlone)
{
    // Two strips of half a texel, one of a quarter of a texel with nothing beside it, and two whose border goes through points of one of them.
    const Vector3f up = Vector3f::UnitZ();
    const Vector3f aside = Vector3f::UnitX();
    const float texel = 1.0F / 64;
    const std::vector<Corners> strips = rectangle(10 * texel, 0, 10.5F * texel, 1) + rectangle(10.5F * texel, 0, 11 * texel, 1) +
                                        rectangle(40 * texel, 0, 40.25F * texel, 1) + rectangle(50 * texel, 0, 50.375F * texel, 1) +
                                        rectangle(50.375F * texel, 0, 51 * texel, 1);
    const NormalMap map = mapsOf(meshOf(strips), normalsOf({up, up, aside, aside, aside, aside, up, up, aside, aside}))[0];
    EXPECT_DOUBLE_EQ(map.coverage, 2.25 / 64);
    for (std::uint32_t row = 0; row < 64; ++row) {
        EXPECT_LT((normalAt(map, 10, row) - (up + aside).normalized()).norm(), kRounding) << row;
        EXPECT_LT((normalAt(map, 40, row) - aside).norm(), kRounding) << row;
        const Vector3f n = normalAt(map, 50, row);
        EXPECT_LT(std::min((n - (up + 3 * aside).normalized()).norm(), (n - (up + aside).normalized()).norm()), kRounding) << row;
    }
}

TEST(NormalMap, CountsEachPointOfChartsThatTouchOnce)
{
    // A square in 24 × 24 cells whose corners lie anywhere, half of the triangles mirrored.
    constexpr int kCells = 24;
    std::mt19937 random(7);
    std::uniform_real_distribution<float> anywhere(-0.35F, 0.35F);
    std::vector<Vector2f> corners;
    for (int j = 0; j <= kCells; ++j) {
        for (int i = 0; i <= kCells; ++i) {
            const bool isInside = i > 0 && i < kCells && j > 0 && j < kCells;
            const Vector2f shift = isInside ? Vector2f(anywhere(random), anywhere(random)) : Vector2f(0, 0);
            corners.push_back((Vector2f(static_cast<float>(i), static_cast<float>(j)) + shift) / kCells);
        }
    }
    std::vector<Corners> triangles;
    for (int j = 0; j < kCells; ++j) {
        for (int i = 0; i < kCells; ++i) {
            const std::size_t a = static_cast<std::size_t>(j) * (kCells + 1) + static_cast<std::size_t>(i);
            triangles.push_back({corners[a], corners[a + 1], corners[a + kCells + 2]});
            triangles.push_back({corners[a + kCells + 1], corners[a + kCells + 2], corners[a]});
        }
    }
    for (std::size_t t = 0; t < triangles.size(); t += 3) { std::swap(triangles[t][0], triangles[t][1]); }
    for (const std::uint32_t size : {64U, 256U}) {
        const NormalMap map = mapsOf(meshOf(triangles), upwards(triangles.size()), size)[0];
        EXPECT_EQ(map.coverage, 1.0);
        EXPECT_EQ(map.coveredTwice, 0.0);
    }
}

TEST(NormalMap, AllowsSeamsThatOverlapByAHairAndWhatGoesRound)
{
    const auto overlappingBy = [](float width) { return rectangle(0, 0, 0.5F, 1) + rectangle(0.5F - width, 0, 1.0F - width, 1); };
    EXPECT_EQ(mapsOf(meshOf(overlappingBy(0.4F / 1024)), upwards(4), 1024)[0].coveredTwice, 0.0) << "texels";
    EXPECT_NEAR(mapsOf(meshOf(overlappingBy(1.0F / 2048)), upwards(4), 2048)[0].coveredTwice, 1.0 / 2047, 1e-6);
    EXPECT_THROW(mapsOf(meshOf(overlappingBy(2.0F / 1024)), upwards(4), 1024), AssetError);

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
}

TEST(NormalMap, RefusesTextureCoordinatesThatHaveNone)
{
    const std::string advice = "which a normal map cannot have: bake normals per patch (without --normal-map)";
    const auto overlaps = [&](const std::string& percent) {
        return "made.obj: the texture coordinates overlap in " + percent + " % of what they cover, " + advice + ", or unwrap it anew";
    };
    EXPECT_EQ(faultOf(meshOf(rectangle(0, 0, 1, 1) + rectangle(0, 0, 1, 1))), overlaps("100.0"));
    EXPECT_EQ(faultOf(meshOf(rectangle(0, 0, 1, 1) + rectangle(0, 0, 0.5F, 0.5F))), overlaps("25.0"));
    EXPECT_EQ(faultOf(meshOf(rectangle(0, 0, 1, 1) + rectangle(0.5F, 0, 0, 0.5F))), overlaps("25.0")) << "mirrored";
    EXPECT_EQ(faultOf(meshOf(rectangle(0, 0, 2, 1))), overlaps("100.0")) << "with itself, as it repeats";
    EXPECT_EQ(faultOf(meshOf(rectangle(-32, -32, 32, 32))), overlaps("100.0")) << "soon";

    SourceMesh mesh = meshOf({kLower, kUpper});
    for (Vector2f& uv : mesh.uvs[1]) { uv.setConstant(std::numeric_limits<float>::quiet_NaN()); }
    EXPECT_EQ(faultOf(mesh), "made.obj: has faces without texture coordinates, " + advice);
    mesh.uvs[1] = kUpper;
    mesh.uvs[1][0].x() = -33.0F;
    EXPECT_EQ(faultOf(mesh), "made.obj: has texture coordinates (-33, 1) beyond 32, " + advice);
    mesh.uvs.clear();
    EXPECT_EQ(faultOf(mesh), "made.obj: no texture coordinates for a normal map");
    EXPECT_EQ(faultOf(meshOf({{kLower[0], kLower[0], kLower[0]}})),
              "made.obj: texture coordinates cover nothing of a normal map");
}

TEST(NormalMap, IsOneForEachMaterialOrForAll)
{
    SourceMesh mesh = meshOf({kLower, kLower});
    mesh.materials.resize(3);
    mesh.materials[2].name = "wood";
    mesh.triangleMaterials = {0, 2};
    const CornerNormals normals = normalsOf({Vector3f(1, 0, 0), Vector3f(0, 1, 0)});
    const std::vector<NormalMap> maps = mapsOf(mesh, normals);
    ASSERT_EQ(maps.size(), 2U);
    EXPECT_EQ(maps[0].material, std::uint16_t{0});
    EXPECT_EQ(maps[1].material, std::uint16_t{2});
    EXPECT_LT((normalAt(maps[0], 5, 40) - Vector3f::UnitX()).norm(), kRounding);
    EXPECT_LT((normalAt(maps[1], 5, 40) - Vector3f::UnitY()).norm(), kRounding);
    EXPECT_THROW(mapsOf(mesh, normals, 64, true), AssetError) << "together they overlap";

    mesh.uvs[1] = kUpper;
    const std::vector<NormalMap> together = mapsOf(mesh, normals, 64, true);
    ASSERT_EQ(together.size(), 1U);
    EXPECT_FALSE(together[0].material);
    EXPECT_LT((normalAt(together[0], 5, 58) - Vector3f::UnitX()).norm(), kRounding);
    EXPECT_LT((normalAt(together[0], 58, 5) - Vector3f::UnitY()).norm(), kRounding);

    mesh.uvs[1] = kLower;
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
    EXPECT_EQ(report.normalMaps[0].image, "normals.png");
    EXPECT_EQ(report.normalMaps[0].bytes, asset.images[0].bytes.size());
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
        EXPECT_LT((normalAt(map, k, k).cast<double>() - n.normalized()).norm(), 1e-3 + double{kRounding}) << k;
    }
}

TEST(NormalMap, IsRefusedForTheLeastOverlapIfStrict)
{
    SourceMesh mesh = hill(96);
    mesh.uvs[0] = mesh.uvs[2]; // one of 18,432 triangles
    BakeOptions options;
    options.normalMap = 1024;
    options.strict = true;
    Progress progress;
    BakeReport report;
    try {
        bakeMesh(mesh, options, progress, report);
        ADD_FAILURE();
    } catch (const AssetError& error) {
        EXPECT_STREQ(error.what(), "hill.obj: not baked, as it is not sound: texture coordinates overlap in 0.005 % of their normal map");
    }
}

TEST(NormalMap, HasANameThatNothingElseHas)
{
    SourceMesh mesh = hill(16);
    mesh.materials.resize(2);
    mesh.materials[0].name = "oak/1";
    mesh.materials[0].textures.push_back({LodTexture::Role::Normal, "norm", "normals-oak_1.png"}); // a file
    mesh.materials[1].name = "oak 1";
    mesh.triangleMaterials.assign(mesh.triangles.size(), 0);
    std::fill(mesh.triangleMaterials.begin() + 256, mesh.triangleMaterials.end(), std::uint16_t{1});
    BakeOptions options;
    options.maxFactor = 4;
    options.normalMap = 64;
    Progress progress;
    BakeReport report;
    LodAsset asset = bakeMesh(mesh, options, progress, report);
    ASSERT_EQ(asset.images.size(), 2U);
    EXPECT_EQ(asset.images[0].name, "normals-oak_1_2.png");
    EXPECT_EQ(asset.images[1].name, "normals-oak_1_3.png");
    ASSERT_EQ(asset.materials[0].textures.size(), 2U);
    EXPECT_EQ(asset.imageOf(asset.materials[0].textures[0]), nullptr) << "the file is not ours";
    EXPECT_EQ(asset.imageOf(asset.materials[0].textures[1]), &asset.images[0]);
    EXPECT_EQ(asset.imageOf(asset.materials[1].textures[0]), &asset.images[1]);

    // Nor does a file, wherever the asset goes, or one that is put into it.
    setColorImage(asset, "normals-oak_1_2.png");
    EXPECT_EQ(asset.imageOf(asset.materials[1].textures[0]), nullptr);
    moveReferences(asset, "somewhere", "somewhere");
    EXPECT_EQ(asset.imageOf(asset.materials[1].textures[0]), nullptr);
    EXPECT_EQ(asset.imageOf(asset.materials[1].textures[1]), &asset.images[1]);
}

TEST(NormalMap, IsNotMistakenForAFileOfItsName)
{
    const TemporaryDirectory folder;
    std::ofstream(folder.file("normals.png")) << "something else";
    LodAsset asset;
    asset.images.push_back({folder.file("normals.png"), {1, 2, 3}}); // the name of a file that is there, as seen from here
    asset.materials.emplace_back().textures.push_back({LodTexture::Role::ObjectNormal, "normals", folder.file("normals.png")});
    embedImages(asset);
    ASSERT_EQ(asset.images.size(), 1U);
    EXPECT_EQ(asset.imageOf(asset.materials[0].textures[0])->bytes.size(), 3U);
}

TEST(NormalMap, IsTheSourcesWithABaseMesh)
{
    // A base of two triangles and two materials, which the source does not have.
    const TemporaryDirectory folder;
    std::ofstream(folder.file("base.mtl")) << "newmtl a\nnewmtl b\n";
    std::ofstream(folder.file("base.obj")) << "mtllib base.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                              "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
                                              "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n";
    BakeOptions options;
    options.maxFactor = 4;
    options.normalMap = 64;
    options.base = folder.file("base.obj");
    Progress progress;
    BakeReport report;
    const LodAsset asset = bakeMesh(hill(16), options, progress, report);
    ASSERT_EQ(asset.images.size(), 1U);
    ASSERT_EQ(asset.materials.size(), 2U);
    for (const LodMaterial& material : asset.materials) {
        ASSERT_EQ(material.textures.size(), 1U);
        EXPECT_EQ(asset.imageOf(material.textures[0]), &asset.images[0]);
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
    EXPECT_EQ(fault("a.obj", options), "the size of a normal map must be a power of two from 64 to 8192, not 100");
    options.normalMap = 32;
    EXPECT_EQ(fault("a.obj", options), "the size of a normal map must be a power of two from 64 to 8192, not 32");
    options.normalMap = 16384;
    EXPECT_EQ(fault("a.obj", options), "the size of a normal map must be a power of two from 64 to 8192, not 16384");
}

} // namespace
} // namespace osgTessLOD::bake
