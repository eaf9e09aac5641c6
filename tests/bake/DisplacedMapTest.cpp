// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/DisplacedMap.h>
#include <support/TemporaryDirectory.h>

#include <Eigen/Geometry>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTurn = 6.28318530717958647692;

void writeImage(const std::string& path, int width, int height, int channels, OIIO::TypeDesc format,
                const std::vector<float>& pixels)
{
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(output);
    ASSERT_TRUE(output->open(path, OIIO::ImageSpec(width, height, channels, format)));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    ASSERT_TRUE(output->close());
}

std::string messageOf(const std::string& path, unsigned channels)
{
    try {
        DisplacementImage::read(path, channels);
    } catch (const AssetError& error) {
        return error.what();
    }
    return "";
}

/// Samples of z(u, v) at the middles of pixels.
template <typename Function> DisplacementImage imageOf(std::uint32_t size, unsigned channels, const Function& function)
{
    std::vector<float> pixels;
    for (std::uint32_t row = 0; row < size; ++row) {
        for (std::uint32_t column = 0; column < size; ++column) {
            const Vector3d value = function((column + 0.5) / size, 1.0 - (row + 0.5) / size);
            for (unsigned c = 0; c < channels; ++c) { pixels.push_back(static_cast<float>(value[c])); }
        }
    }
    return DisplacementImage(size, size, channels, std::move(pixels));
}

/// The square (0, 0) … (2, 2) in the plane z = 1 of two triangles, texture coordinates half the position.
SourceMesh square()
{
    SourceMesh mesh;
    mesh.name = "square";
    mesh.positions = {{0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    for (const auto& t : mesh.triangles) {
        std::array<Eigen::Vector2f, 3> uvs;
        for (std::size_t k = 0; k < 3; ++k) { uvs[k] = (0.5 * mesh.positions[t[k]].head<2>()).cast<float>(); }
        mesh.uvs.push_back(uvs);
    }
    return mesh;
}

/// In the base mesh's space.
SurfacePoint pointOf(const DisplacedMap& map, std::uint32_t patch, const Vector3d& barycentric)
{
    SurfacePoint point = map.evaluate(patch, barycentric);
    point.position = map.frame().center + map.frame().scale * point.position;
    return point;
}

/// Of the square, seen as one: patch 0 is below the diagonal.
SurfacePoint pointAt(const DisplacedMap& map, double x, double y)
{
    const double u = x / 2.0;
    const double v = y / 2.0;
    return v <= u ? pointOf(map, 0, {1.0 - u, u - v, v}) : pointOf(map, 1, {1.0 - v, u, v - u});
}

TEST(DisplacementImage, TextureCoordinatesStartLowerLeftAndPixelsHaveMiddles)
{
    const DisplacementImage image(2, 2, 1, {1.0F, 2.0F, 3.0F, 4.0F}); // rows from the top
    EXPECT_EQ(image.scalarAt({0.25, 0.75}), 1.0);
    EXPECT_EQ(image.scalarAt({0.75, 0.75}), 2.0);
    EXPECT_EQ(image.scalarAt({0.25, 0.25}), 3.0);
    EXPECT_EQ(image.scalarAt({0.75, 0.25}), 4.0);
    EXPECT_EQ(image.scalarAt({0.5, 0.5}), 2.5);
    EXPECT_EQ(image.scalarAt({0.0, 0.75}), 1.5); // repeats: half pixel 1, half pixel 2
    EXPECT_EQ(image.scalarAt({-3.75, 7.75}), 1.0);
    EXPECT_EQ(image.vectorAt({0.25, 0.75}), Vector3d(1.0, 1.0, 1.0));
}

TEST(DisplacementImage, FarTextureCoordinatesStayInside)
{
    const DisplacementImage image(3, 1, 1, {1.0F, 2.0F, 3.0F});
    for (const double far : {1e6, -1e6, 123456.789, -1e-18, 1.0 - 1e-17}) {
        const double value = image.scalarAt({far, far});
        EXPECT_GE(value, 1.0);
        EXPECT_LE(value, 3.0);
    }
}

TEST(DisplacementImage, ReadsIntegersAsZeroToOneAndFloatsAsTheyAre)
{
    const TemporaryDirectory folder;
    const std::vector<float> values{0.0F, 1.0F, 0.25F, 0.75F};
    struct Format {
        const char* name;
        OIIO::TypeDesc type;
        double step; ///< of what the format can hold
    };
    for (const Format& format :
         {Format{"8.png", OIIO::TypeDesc::UINT8, 1.0 / 255.0}, Format{"16.png", OIIO::TypeDesc::UINT16, 1.0 / 65535.0},
          Format{"16.tif", OIIO::TypeDesc::UINT16, 1.0 / 65535.0}, Format{"32.tif", OIIO::TypeDesc::FLOAT, 0.0},
          Format{"32.exr", OIIO::TypeDesc::FLOAT, 0.0}}) {
        const std::string path = folder.file(format.name);
        writeImage(path, 2, 2, 1, format.type, values);
        const DisplacementImage image = DisplacementImage::read(path, 1);
        EXPECT_EQ(image.width(), 2U);
        EXPECT_NEAR(image.scalarAt({0.25, 0.75}), 0.0, 0.5 * format.step) << format.name;
        EXPECT_NEAR(image.scalarAt({0.75, 0.75}), 1.0, 0.5 * format.step) << format.name;
        EXPECT_NEAR(image.scalarAt({0.25, 0.25}), 0.25, 0.5 * format.step) << format.name;
        EXPECT_NEAR(image.scalarAt({0.75, 0.25}), 0.75, 0.5 * format.step) << format.name;
    }
}

TEST(DisplacementImage, SaysWhatIsWrongWithAFile)
{
    const TemporaryDirectory folder;
    const std::string absent = folder.file("absent.png");
    EXPECT_NE(messageOf(absent, 1).find(absent), std::string::npos);

    const std::string text = folder.file("text.png");
    std::ofstream(text) << "no image";
    EXPECT_NE(messageOf(text, 1).find(text), std::string::npos);

    const std::string gray = folder.file("gray.png");
    writeImage(gray, 2, 2, 1, OIIO::TypeDesc::UINT8, {0, 0, 0, 0});
    EXPECT_EQ(messageOf(gray, 1), "");
    EXPECT_EQ(messageOf(gray, 3), gray + ": has 1 channels where 3 are needed");

    const std::string hole = folder.file("hole.exr");
    writeImage(hole, 2, 2, 1, OIIO::TypeDesc::FLOAT, {0, 0, std::numeric_limits<float>::quiet_NaN(), 0});
    EXPECT_EQ(messageOf(hole, 1), hole + ": pixel (0, 1) is not a finite number");

    const std::string cut = folder.file("cut.tif");
    writeImage(cut, 64, 64, 1, OIIO::TypeDesc::FLOAT, std::vector<float>(64 * 64, 0.5F));
    std::ifstream whole(cut, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(whole)), std::istreambuf_iterator<char>());
    std::ofstream(cut, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
    EXPECT_NE(messageOf(cut, 1).find(cut), std::string::npos);
}

TEST(DisplacedMap, HeightsAreScaledFromTheMiddleLevelAlongTheNormal)
{
    const auto ramp = [](double u, double v) { return Vector3d::Constant(u + 2.0 * v); };
    const DisplacedMap map(square(), imageOf(64, 1, ramp), {DisplacementOptions::Kind::Scalar, 3.0, 0.5});
    for (const auto& [x, y] : {std::pair{1.0, 1.0}, {0.4, 0.6}, {1.5, 0.3}, {0.9, 1.7}}) {
        const SurfacePoint point = pointAt(map, x, y);
        const Vector3d expected(x, y, 1.0 + 3.0 * (x / 2.0 + y - 0.5));
        EXPECT_LT((point.position - expected).norm(), 1e-6); // the map's numbers are single precision
        EXPECT_LT((point.normal - Vector3d(-1.5, -3.0, 1.0).normalized()).norm(), 1e-5);
    }
}

TEST(DisplacedMap, NormalsAreThoseOfTheSurface)
{
    const auto waves = [](double u, double v) {
        return Vector3d::Constant(std::sin(kTurn * u) * std::cos(2.0 * kTurn * v));
    };
    const DisplacedMap map(square(), imageOf(512, 1, waves), {DisplacementOptions::Kind::Scalar, 0.2, 0.0});
    for (const auto& [x, y] : {std::pair{0.3, 0.2}, {1.1, 0.7}, {1.9, 1.2}, {0.2, 1.6}}) {
        const double u = x / 2.0;
        const double v = y / 2.0;
        const double du = 0.2 * kTurn * std::cos(kTurn * u) * std::cos(2.0 * kTurn * v) / 2.0;
        const double dv = -0.2 * 2.0 * kTurn * std::sin(kTurn * u) * std::sin(2.0 * kTurn * v) / 2.0;
        // Slopes are those between texels, linear in between: off by (2π / 256)² / 6 of 1.3, the steepest, at most.
        EXPECT_LT((pointAt(map, x, y).normal - Vector3d(-du, -dv, 1.0).normalized()).norm(), 2e-4);
    }
}

TEST(DisplacedMap, VectorsFoldTheSurface)
{
    // x goes back and forth: the surface is folded over itself, which no height can do.
    const auto fold = [](double u, double) { return Vector3d(std::sin(kTurn * u), 0.0, std::cos(kTurn * u)); };
    const DisplacedMap map(square(), imageOf(512, 3, fold), {DisplacementOptions::Kind::ObjectVector, 0.8, 0.0});
    for (const double x : {0.25, 0.5, 1.0, 1.6}) {
        const double angle = kTurn * x / 2.0;
        const Vector3d expected(x + 0.8 * std::sin(angle), 0.5, 1.0 + 0.8 * std::cos(angle));
        EXPECT_LT((pointAt(map, x, 0.5).position - expected).norm(),
                  0.8 * 2e-5); // lines between samples: (2π / 512)² / 8
        const Vector3d along(1.0 + 0.8 * kTurn / 2.0 * std::cos(angle), 0.0, -0.8 * kTurn / 2.0 * std::sin(angle));
        EXPECT_LT((pointAt(map, x, 0.5).normal - along.cross(Vector3d::UnitY()).normalized()).norm(), 1e-4);
    }
    EXPECT_LT(pointAt(map, 1.0, 0.5).normal.z(), 0.0) << "upside down half way through the fold";
}

TEST(DisplacedMap, TangentVectorsFollowTextureCoordinates)
{
    const auto constant = [](double, double) { return Vector3d(0.1, 0.2, 0.3); };
    SourceMesh mesh = square();
    const DisplacementOptions options{DisplacementOptions::Kind::TangentVector, 1.0, 0.0};
    const DisplacedMap plain(mesh, imageOf(4, 3, constant), options);
    EXPECT_LT((pointAt(plain, 0.6, 0.4).position - Vector3d(0.7, 0.6, 1.3)).norm(), 1e-6);

    for (auto& uvs : mesh.uvs) { // turned by a quarter: u grows along y, v along −x
        for (auto& uv : uvs) { uv = Eigen::Vector2f(uv.y(), -uv.x()); }
    }
    const DisplacedMap turned(mesh, imageOf(4, 3, constant), options);
    EXPECT_LT((pointAt(turned, 0.6, 0.4).position - Vector3d(0.4, 0.5, 1.3)).norm(), 1e-6);

    mesh = square();
    for (auto& uvs : mesh.uvs) { // mirrored: v grows along −y
        for (auto& uv : uvs) { uv.y() = -uv.y(); }
    }
    const DisplacedMap mirrored(mesh, imageOf(4, 3, constant), options);
    EXPECT_LT((pointAt(mirrored, 0.6, 0.4).position - Vector3d(0.7, 0.2, 1.3)).norm(), 1e-6);
}

TEST(DisplacedMap, BothSidesOfABorderAgree)
{
    const auto waves = [](double u, double v) { return Vector3d::Constant(std::sin(9.0 * u + 5.0 * v)); };
    SourceMesh mesh = square();
    mesh.positions[2].z() = 1.5; // bent along the diagonal
    const DisplacedMap map(mesh, imageOf(32, 1, waves), {DisplacementOptions::Kind::Scalar, 0.3, 0.1});
    for (const double t : {0.0, 0.2, 0.5, 0.77, 1.0}) {
        const SurfacePoint one = map.evaluate(0, {1.0 - t, 0.0, t});
        const SurfacePoint other = map.evaluate(1, {1.0 - t, t, 0.0});
        EXPECT_LT((one.position - other.position).norm(), 1e-14);
    }
}

TEST(DisplacedMap, PatchesAreAsFineAsTheirTexels)
{
    const auto flat = [](double, double) { return Vector3d::Zero(); };
    const DisplacementOptions options;
    // The diagonal of the square is √2 times as many texels long as the image.
    EXPECT_EQ(DisplacedMap(square(), imageOf(2, 1, flat), options).finestFactor(), 4U);
    EXPECT_EQ(DisplacedMap(square(), imageOf(22, 1, flat), options).finestFactor(), 32U);
    EXPECT_EQ(DisplacedMap(square(), imageOf(512, 1, flat), options).finestFactor(), 64U);
    EXPECT_EQ(DisplacedMap(square(), imageOf(22, 1, flat), options).sourceTriangles(), 2U * 22U * 22U);
}

TEST(DisplacedMap, TrianglesWithoutTextureCoordinatesAreNamed)
{
    SourceMesh mesh = square();
    mesh.uvs[1].fill(Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN()));
    const DisplacementImage image(1, 1, 1, {0.0F});
    try {
        const DisplacedMap map(mesh, image, {});
        FAIL() << "no error";
    } catch (const AssetError& error) {
        EXPECT_EQ(std::string(error.what()),
                  "square: triangle 1 (counted from 0) has no texture coordinates to look up a displacement map by");
    }
}

} // namespace
} // namespace osgTessLOD::bake
