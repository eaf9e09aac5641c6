// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/TerrainMap.h>
#include <support/TemporaryDirectory.h>

#include <Eigen/Geometry>
#include <OpenImageIO/imageio.h>
#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

/// Heights z(column, row), one unit apart.
template <typename Function> HeightField fieldOf(std::uint32_t columns, std::uint32_t rows, const Function& z)
{
    HeightField field;
    field.name = "field";
    field.columns = columns;
    field.rows = rows;
    for (std::uint32_t row = 0; row < rows; ++row) {
        for (std::uint32_t column = 0; column < columns; ++column) {
            field.heights.push_back(static_cast<float>(z(column, row)));
        }
    }
    return field;
}

void writeImage(const std::string& path, int width, int height, OIIO::TypeDesc format, const std::vector<float>& pixels)
{
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(output);
    ASSERT_TRUE(output->open(path, OIIO::ImageSpec(width, height, 1, format)));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    ASSERT_TRUE(output->close());
}

/// Two by two heights with a georeference: the sample (0, 0) at `corner`.
void writeGeoTiff(const std::string& path, bool inDegrees, const std::array<double, 2>& spacing,
                  const std::array<double, 2>& corner, const std::vector<std::int16_t>& heights)
{
    TIFF* tiff = XTIFFOpen(path.c_str(), "w");
    ASSERT_NE(tiff, nullptr);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 2);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 2);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_INT);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 2);
    const std::array<double, 3> scale{spacing[0], spacing[1], 0.0};
    const std::array<double, 6> tie{0.0, 0.0, 0.0, corner[0], corner[1], 0.0};
    TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale.data());
    TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, tie.data());
    GTIF* keys = GTIFNew(tiff);
    GTIFKeySet(keys, GTModelTypeGeoKey, TYPE_SHORT, 1, inDegrees ? ModelTypeGeographic : ModelTypeProjected);
    GTIFWriteKeys(keys);
    GTIFFree(keys);
    std::vector<std::int16_t> copy = heights;
    for (std::uint32_t row = 0; row < 2; ++row) { TIFFWriteScanline(tiff, copy.data() + 2 * row, row, 0); }
    XTIFFClose(tiff);
}

std::string messageOf(const std::string& path, const HeightOptions& options = {})
{
    try {
        readHeightField(path, options);
    } catch (const AssetError& error) {
        return error.what();
    }
    return "";
}

TEST(HeightField, IsLinearOnTheTrianglesOfCells)
{
    const HeightField field = fieldOf(2, 2, [](auto c, auto r) { return 4.0 * c * r + 1.0 * c; }); // 0 1 / 0 5
    ASSERT_FALSE(field.isCutSouthEast(0, 0)) << "1 and 0 are nearer than 0 and 5";
    EXPECT_EQ(field.heightAt(0.0, 0.0), 0.0);
    EXPECT_EQ(field.heightAt(1.0, 1.0), 5.0);
    EXPECT_EQ(field.heightAt(0.5, 0.5), 0.5); // on the diagonal from 1 to 0
    EXPECT_EQ(field.heightAt(0.25, 0.25), 0.25);
    EXPECT_EQ(field.heightAt(0.75, 0.75), 2.75); // half way from 0.5 to 5
    const SourceMesh mesh = triangulate(field);
    ASSERT_EQ(mesh.triangles.size(), 2U);
    for (const auto& t : mesh.triangles) {
        const Vector3d normal =
            (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
        EXPECT_GT(normal.z(), 0.0) << "upside down";
    }
}

TEST(HeightField, SlopesPointUphill)
{
    HeightField field = fieldOf(5, 4, [](auto c, auto r) { return 3.0 * c - 2.0 * r; });
    field.spacing = {2.0, 4.0};
    // Rows go south: per unit to the north, the height grows by 2 / 4.
    for (const Vector2d& at : {Vector2d(0, 0), Vector2d(1.5, 2.25), Vector2d(4, 3)}) {
        EXPECT_TRUE(field.slopeAt(at.x(), at.y()).isApprox(Vector2d(1.5, 0.5), 1e-12));
    }
}

TEST(HeightField, FilledVoidsAreHarmonicAndLargeOnesStayOpen)
{
    const auto ramp = [](auto c, auto r) { return 3.0 * c + 5.0 * r; };
    HeightField field = fieldOf(12, 9, ramp);
    const auto erase = [&](std::uint32_t c, std::uint32_t r) { field.heights[r * 12 + c] = kVoid; };
    for (std::uint32_t r = 2; r < 5; ++r) {
        for (std::uint32_t c = 2; c < 4; ++c) { erase(c, r); } // six
    }
    for (std::uint32_t r = 2; r < 7; ++r) {
        for (std::uint32_t c = 6; c < 10; ++c) { erase(c, r); } // twenty
    }
    erase(0, 8); // at the edge
    EXPECT_EQ(field.voids(), 27U);
    EXPECT_EQ(fillVoids(field, 6), 6U);
    EXPECT_EQ(field.voids(), 21U);
    for (std::uint32_t r = 2; r < 5; ++r) {
        for (std::uint32_t c = 2; c < 4; ++c) {
            EXPECT_NEAR(field.at(c, r), ramp(c, r), 1e-4);
        } // planes are harmonic; float
    }
    EXPECT_EQ(fillVoids(field, 20), 20U);
    EXPECT_TRUE(field.isVoid(0, 8));
}

TEST(HeightField, VoidsAreHolesOfTheMesh)
{
    HeightField field = fieldOf(4, 4, [](auto, auto) { return 0.0; });
    field.heights[5] = kVoid; // (1, 1): of its four cells one triangle each is left
    const SourceMesh mesh = triangulate(field);
    EXPECT_EQ(mesh.positions.size(), 15U);
    EXPECT_EQ(mesh.triangles.size(), 2U * 5U + 4U);
    double area = 0.0;
    for (const auto& t : mesh.triangles) {
        const Vector3d normal =
            (mesh.positions[t[1]] - mesh.positions[t[0]]).cross(mesh.positions[t[2]] - mesh.positions[t[0]]);
        EXPECT_GT(normal.z(), 0.0);
        area += 0.5 * normal.z();
    }
    EXPECT_DOUBLE_EQ(area, 9.0 - 2.0);
}

TEST(HeightReader, KeepsTheUnitsOfImages)
{
    const TemporaryDirectory folder;
    const std::vector<float> heights{0.0F, 1000.0F, 65535.0F, 7.0F};
    std::vector<float> parts = heights;
    for (float& part : parts) { part /= 65535.0F; }
    writeImage(folder.file("16.png"), 2, 2, OIIO::TypeDesc::UINT16, parts);
    EXPECT_EQ(readHeightField(folder.file("16.png"), {}).heights, heights);

    writeImage(folder.file("32.exr"), 2, 2, OIIO::TypeDesc::FLOAT, {-8.5F, 0.25F, kVoid, 8848.0F});
    HeightOptions options;
    options.spacing = {{30.0, 20.0}};
    options.scale = 2.0;
    options.voidValue = 0.25;
    const HeightField field = readHeightField(folder.file("32.exr"), options);
    EXPECT_EQ(field.at(0, 0), -17.0F);
    EXPECT_TRUE(field.isVoid(1, 0));
    EXPECT_TRUE(field.isVoid(0, 1));
    EXPECT_EQ(field.position(1, 1), Vector3d(30.0, -20.0, 17696.0));
}

TEST(HeightReader, TakesTheGeoreference)
{
    const TemporaryDirectory folder;
    const std::vector<std::int16_t> heights{-5, 100, 200, 32000};
    const std::string projected = folder.file("projected.tif");
    writeGeoTiff(projected, false, {30.0, 25.0}, {376313.5, 3807917.75}, heights);
    const HeightField field = readHeightField(projected, {});
    EXPECT_EQ(field.position(0, 0), Vector3d(376313.5, 3807917.75, -5.0));
    EXPECT_EQ(field.position(1, 1), Vector3d(376343.5, 3807892.75, 32000.0));

    const std::string degrees = folder.file("degrees.tif");
    writeGeoTiff(degrees, true, {1.0, 1.0}, {86.0, 60.5}, heights); // the middle is at 60° north
    const HeightField metres = readHeightField(degrees, {});
    const double degree = 6371008.8 * 3.14159265358979323846 / 180.0;
    EXPECT_NEAR(metres.spacing[0], 0.5 * degree, 1e-6);
    EXPECT_NEAR(metres.spacing[1], degree, 1e-6);
}

TEST(HeightReader, ReadsRawTilesByTheirName)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("S01E030.hgt");
    std::ofstream(path, std::ios::binary)
        << std::string("\x00\x01\x80\x00\x7F\xFF\xFF\xFE\x00\x00\x00\x02\x00\x03\x00\x04\x00\x05", 18);
    const HeightField field = readHeightField(path, {});
    ASSERT_EQ(field.columns, 3U);
    EXPECT_EQ(field.at(0, 0), 1.0F);
    EXPECT_TRUE(field.isVoid(1, 0)); // −32,768
    EXPECT_EQ(field.at(2, 0), 32767.0F);
    EXPECT_EQ(field.at(0, 1), -2.0F);
    EXPECT_EQ(field.at(2, 2), 5.0F);
    const double degree = 6371008.8 * 3.14159265358979323846 / 180.0;
    EXPECT_NEAR(field.corner[1], 0.0, 1e-9); // its northern side is the equator
    EXPECT_NEAR(field.spacing[1], 0.5 * degree, 1e-6);
    EXPECT_NEAR(field.corner[0], 30.0 * degree * std::cos(0.5 * 3.14159265358979323846 / 180.0), 1e-3);
}

TEST(HeightReader, SaysWhatIsWrongWithAFile)
{
    const TemporaryDirectory folder;
    const std::string absent = folder.file("absent.tif");
    EXPECT_NE(messageOf(absent).find(absent), std::string::npos);
    const std::string odd = folder.file("odd.hgt");
    std::ofstream(odd) << "12345";
    EXPECT_EQ(messageOf(odd), odd + ": is not a square of 16-bit heights");
    const std::string row = folder.file("row.exr");
    writeImage(row, 5, 1, OIIO::TypeDesc::FLOAT, {0, 1, 2, 3, 4});
    EXPECT_EQ(messageOf(row), row + ": a height field has two columns and two rows at least");
    const std::string empty = folder.file("empty.exr");
    writeImage(empty, 2, 2, OIIO::TypeDesc::FLOAT, {kVoid, kVoid, kVoid, kVoid});
    EXPECT_EQ(messageOf(empty), empty + ": has no height at all");
    HeightOptions options;
    options.spacing = {{0.0, 1.0}};
    EXPECT_EQ(messageOf(empty, options), empty + ": the spacing of heights must be above 0");
}

TEST(HeightReader, RefusesPlacesThatAreNone)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("place.tif");
    const std::vector<std::int16_t> heights{1, 2, 3, 4};
    const double infinity = std::numeric_limits<double>::infinity();
    const auto messageAt = [&](bool inDegrees, const std::array<double, 2>& spacing, const std::array<double, 2>& corner) {
        writeGeoTiff(path, inDegrees, spacing, corner, heights);
        return messageOf(path);
    };
    EXPECT_EQ(messageAt(true, {1.0, 1.0}, {7.0, 45.0}), "");
    for (const std::string& message :
         {messageAt(true, {1.0, 1.0}, {7.0, 145.0}), // a degree of longitude is less than nothing there
          messageAt(false, {infinity, 1.0}, {0.0, 0.0}), messageAt(false, {1e-200, 1.0}, {0.0, 0.0}),
          messageAt(false, {1.0, 1.0}, {0.0, infinity}), messageAt(false, {1.0, 1.0}, {-1e200, 0.0})}) {
        EXPECT_EQ(message.find(path + ": its heights have no place"), 0U) << message;
    }
    const std::string tile = folder.file("N95E000.hgt");
    std::ofstream(tile) << "12345678";
    EXPECT_NE(messageOf(tile).find("no place"), std::string::npos);
}

TEST(HeightReader, HeightsThatTheScaleMakesInfiniteAreVoids)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("high.exr");
    writeImage(path, 2, 2, OIIO::TypeDesc::FLOAT, {1e38F, 1.0F, 2.0F, 3.0F});
    HeightOptions options;
    options.scale = 10.0;
    const HeightField field = readHeightField(path, options);
    EXPECT_TRUE(field.isVoid(0, 0));
    EXPECT_EQ(field.at(1, 0), 10.0F);
}

TEST(HeightReader, BelievesNoSizeThatTheFileCannotHold)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("huge.tif");
    TIFF* tiff = TIFFOpen(path.c_str(), "w");
    ASSERT_NE(tiff, nullptr);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 40000);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 40000);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 40000);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
    std::array<char, 4> strip{};
    TIFFWriteRawStrip(tiff, 0, strip.data(), static_cast<tmsize_t>(strip.size()));
    TIFFClose(tiff);
    EXPECT_EQ(messageOf(path), path + ": claims to hold more than 16384 times its size");
}

TEST(HeightReader, ReadsAFileAsItsExtensionSays)
{
    const TemporaryDirectory folder;
    const std::string picture = folder.file("a.png");
    writeImage(picture, 2, 2, OIIO::TypeDesc::UINT8, {0.0F, 0.1F, 0.2F, 0.3F});
    EXPECT_EQ(messageOf(picture), "");
    const std::string renamed = folder.file("a.tif");
    std::filesystem::rename(picture, renamed);
    EXPECT_EQ(messageOf(renamed).find(renamed + ": "), 0U);
}

double hills(double column, double row)
{
    return 6.0 * std::sin(0.11 * column) * std::cos(0.07 * row);
}

TEST(TerrainMap, PatchesCoverTheFieldOnceAndFitTogether)
{
    // Hills in one corner, a plain elsewhere: so that sizes differ.
    const HeightField field = fieldOf(1500, 700, [](auto c, auto r) {
        return c < 200 && r < 200 ? 20.0 * std::sin(0.9 * c) * std::cos(0.8 * r) : 0.0;
    });
    Progress progress;
    const TerrainMap map(field, 64, 0.0005, progress);
    const PatchTopology& topology = map.topology();
    double area = 0.0;
    double smallest = 1e30;
    double largest = 0.0;
    for (std::uint32_t p = 0; p < topology.patches.size(); ++p) {
        std::array<Vector3d, 3> corners;
        for (int k = 0; k < 3; ++k) {
            corners[static_cast<std::size_t>(k)] =
                map.frame().center + map.frame().scale * map.evaluate(p, Vector3d::Unit(k)).position;
        }
        const double doubled = (corners[1] - corners[0]).head<2>().x() * (corners[2] - corners[0]).y() -
                               (corners[1] - corners[0]).y() * (corners[2] - corners[0]).x();
        EXPECT_GT(doubled, 0.0) << "patch " << p << " is upside down";
        area += 0.5 * doubled;
        smallest = std::min(smallest, doubled);
        largest = std::max(largest, doubled);
    }
    EXPECT_NEAR(area, 1499.0 * 699.0, 1e-3);
    EXPECT_GE(largest, 64.0 * smallest) << "patches do not follow the heights";
    // The rim is the only border with one patch: no T-junctions.
    double rim = 0.0;
    for (const PatchTopology::Edge& edge : topology.edges) {
        if (edge.patches[1] != kNoPatch) { continue; }
        const auto& own = topology.patches[edge.patches[0]];
        std::array<Vector3d, 2> ends;
        for (std::size_t e = 0; e < 2; ++e) {
            const int corner = own[0] == edge.vertices[e] ? 0 : own[1] == edge.vertices[e] ? 1 : 2;
            ends[e] = map.frame().scale * map.evaluate(edge.patches[0], Vector3d::Unit(corner)).position;
        }
        rim += (ends[1] - ends[0]).head<2>().norm();
    }
    EXPECT_NEAR(rim, 2.0 * (1499.0 + 699.0), 1e-6);
}

TEST(TerrainMap, ItsSurfaceIsTheFields)
{
    HeightField field = fieldOf(300, 200, hills);
    field.spacing = {30.0, 25.0};
    field.corner = {376313.5, 3807917.75};
    Progress progress;
    const TerrainMap map(field, 16, 0.0005, progress);
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (const Vector3d& b : {Vector3d(0.2, 0.3, 0.5), Vector3d(0.0, 0.4, 0.6), Vector3d(1.0, 0.0, 0.0)}) {
            const SurfacePoint point = map.evaluate(p, b);
            const Vector3d at = map.frame().center + map.frame().scale * point.position;
            const double column = (at.x() - field.corner[0]) / 30.0;
            const double row = (field.corner[1] - at.y()) / 25.0;
            EXPECT_NEAR(at.z(), field.heightAt(column, row), 1e-6);
            EXPECT_GT(point.normal.z(), 0.0);
        }
    }
}

TEST(TerrainMap, ChartsAreWithinTheToleranceOfTheField)
{
    const HeightField field = fieldOf(400, 400, [](auto c, auto r) { return hills(3.0 * c, 4.0 * r); });
    Progress progress;
    constexpr double kTolerance = 0.002;
    const TerrainMap map(field, 8, kTolerance, progress);
    ChartSet charts = makeCharts(map, 8, progress);
    EXPECT_GE(map.sourceSamples().positions.size(), 400U * 400U);
    measureChartErrors(map.source(), map.sourceSamples(), charts, progress);
    for (const PatchChart& chart : charts.charts) {
        // Patches were tried on a regular grid of as many steps, and the tessellator's has sides √3 times as long at most.
        EXPECT_LE(chart.chartError, 3.0 * kTolerance);
    }
}

} // namespace
} // namespace osgTessLOD::bake
