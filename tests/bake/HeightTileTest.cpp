// SPDX-License-Identifier: MIT
// Tiles of terrain: what they read, how their seams are drawn, and that tiles baked apart fit together.
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/HeightTile.h>
#include <osgTessLOD/bake/SeamLevels.h>
#include <osgTessLOD/bake/TerrainMap.h>
#include <support/TemporaryDirectory.h>

#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();
constexpr int kColumns = 62; // thirds and halves of its cells differ
constexpr int kRows = 51;

/// Hills with a cliff, steep on one side of a cut and not on the other.
std::vector<float> heights()
{
    std::vector<float> result;
    for (int r = 0; r < kRows; ++r) {
        for (int c = 0; c < kColumns; ++c) {
            const double hill = 6.0 * std::sin(0.09 * c) * std::cos(0.07 * r);
            result.push_back(static_cast<float>(hill + (c > 33 && c < 37 && r % 7 < 4 ? 9.0 : 0.0)));
        }
    }
    return result;
}

/// 0: by scanlines.
void writeImage(const std::string& path, OIIO::TypeDesc format, const std::vector<float>& pixels, int tile = 0,
                int columns = kColumns, int rows = kRows)
{
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path);
    ASSERT_TRUE(output);
    OIIO::ImageSpec spec(columns, rows, 1, format);
    spec.tile_width = spec.tile_height = tile;
    ASSERT_TRUE(output->open(path, spec));
    ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    ASSERT_TRUE(output->close());
}

/// Of one square side.
void writeHgt(const std::string& path, int side)
{
    std::ofstream file(path, std::ios::binary);
    for (int r = 0; r < side; ++r) {
        for (int c = 0; c < side; ++c) { file << static_cast<char>(r) << static_cast<char>(c); }
    }
}

bool sameBits(float a, float b)
{
    return std::memcmp(&a, &b, sizeof a) == 0;
}

void expectWindow(const HeightField& part, const HeightField& whole)
{
    for (std::uint32_t r = 0; r < part.rows; ++r) {
        for (std::uint32_t c = 0; c < part.columns; ++c) {
            ASSERT_TRUE(sameBits(part.at(c, r), whole.at(part.first[0] + c, part.first[1] + r))) << c << ", " << r;
            ASSERT_EQ(part.position(c, r).x(), whole.position(part.first[0] + c, part.first[1] + r).x());
            ASSERT_EQ(part.position(c, r).y(), whole.position(part.first[0] + c, part.first[1] + r).y());
        }
    }
}

TEST(HeightTile, AreWindowsOfTheWholeThatShareTheirBorders)
{
    const TemporaryDirectory folder;
    std::vector<float> parts = heights();
    for (float& part : parts) { part = std::fabs(part) / 40.0F; }
    writeImage(folder.file("scanlines.exr"), OIIO::TypeDesc::FLOAT, heights());
    writeImage(folder.file("tiles.exr"), OIIO::TypeDesc::FLOAT, heights(), 16);
    writeImage(folder.file("tiles.tif"), OIIO::TypeDesc::FLOAT, heights(), 16);
    writeImage(folder.file("16.png"), OIIO::TypeDesc::UINT16, parts);
    writeHgt(folder.file("N10E020.hgt"), 61);
    HeightOptions options;
    options.scale = 1.5;
    options.largestFilledVoid = 3;
    for (const char* name : {"scanlines.exr", "tiles.exr", "tiles.tif", "16.png", "N10E020.hgt"}) {
        SCOPED_TRACE(name);
        const HeightField whole = readHeightField(folder.file(name), options);
        for (std::uint32_t n : {1U, 2U, 3U, 7U}) {
            for (std::uint32_t j = 0; j < n; ++j) {
                for (std::uint32_t i = 0; i < n; ++i) {
                    const HeightTile tile = readHeightTile(folder.file(name), options, {i, j, n});
                    expectWindow(tile.field, whole);
                    expectWindow(tile.around, whole);
                    EXPECT_EQ(tile.field.first[0], (whole.columns - 1) * i / n);
                    EXPECT_EQ(tile.field.first[0] + tile.field.columns - 1, (whole.columns - 1) * (i + 1) / n);
                    EXPECT_EQ(tile.field.first[1] + tile.field.rows - 1, (whole.rows - 1) * (j + 1) / n);
                    EXPECT_EQ(tile.isSeam, (std::array<bool, 4>{i > 0, j > 0, i + 1 < n, j + 1 < n}));
                    EXPECT_EQ(tile.around.first[0] < tile.field.first[0], tile.isSeam[HeightTile::West]);
                }
            }
        }
    }
}

TEST(HeightTile, VoidsAcrossACutAreFilledAlike)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("voids.exr");
    std::vector<float> pixels = heights();
    for (int r = 20; r < 30; ++r) { // across the middle, where four tiles meet
        for (int c = 27; c < 34; ++c) { pixels[static_cast<std::size_t>(r * kColumns + c)] = kVoid; }
    }
    writeImage(path, OIIO::TypeDesc::FLOAT, pixels);
    HeightField whole = readHeightField(path, {});
    ASSERT_EQ(fillVoids(whole, 256), 70U);
    std::uint64_t filled = 0;
    for (std::uint32_t k = 0; k < 4; ++k) {
        const HeightTile tile = readHeightTile(path, {}, {k % 2, k / 2, 2});
        EXPECT_EQ(tile.field.voids(), 0U);
        expectWindow(tile.field, whole);
        filled += tile.filledVoids;
    }
    EXPECT_GT(filled, 70U) << "what is on the cut, twice";
    HeightOptions few;
    few.largestFilledVoid = 69;
    EXPECT_GT(readHeightTile(path, few, {0, 0, 2}).field.voids(), 0U);
}

TEST(HeightTile, TakesMemoryForTheTileAlone)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("large.hgt");
    std::ofstream(path).close();
    constexpr std::uintmax_t kSide = 8001;
    std::filesystem::resize_file(path, 2 * kSide * kSide); // zeros that take no space
    const auto peak = [] {
        rusage usage{};
        getrusage(RUSAGE_SELF, &usage);
        return static_cast<std::uintmax_t>(usage.ru_maxrss) * 1024;
    };
    const std::uintmax_t before = peak();
    const HeightTile tile = readHeightTile(path, {}, {3, 5, 16});
    EXPECT_EQ(tile.field.columns, 501U);
    EXPECT_LT(peak() - before, kSide * kSide * sizeof(float) / 4) << "about 30 MB of 256";
}

std::string messageOf(const std::string& path, const TileChoice& choice)
{
    try {
        readHeightTile(path, {}, choice);
    } catch (const AssetError& error) {
        return error.what();
    }
    return "";
}

TEST(HeightTile, SaysWhichTilesThereAreNot)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("heights.exr");
    writeImage(path, OIIO::TypeDesc::FLOAT, heights());
    EXPECT_EQ(messageOf(path, {1, 1, 2}), "");
    EXPECT_EQ(messageOf(path, {49, 49, 50}), "");
    EXPECT_EQ(messageOf(path, {2, 0, 2}), path + ": there is no tile 2,0 of 2 x 2: they are counted from 0");
    EXPECT_EQ(messageOf(path, {0, 7, 2}), path + ": there is no tile 0,7 of 2 x 2: they are counted from 0");
    EXPECT_EQ(messageOf(path, {0, 0, 0}), path + ": there is no tile 0,0 of 0 x 0: they are counted from 0");
    EXPECT_EQ(messageOf(path, {0, 0, 51}), path + ": 62 x 51 heights cannot be cut into 51 x 51 tiles");
    writeImage(folder.file("empty.exr"), OIIO::TypeDesc::FLOAT, {kVoid, kVoid, kVoid, kVoid}, 0, 2, 2);
    EXPECT_EQ(messageOf(folder.file("empty.exr"), {0, 0, 1}), folder.file("empty.exr") + ": has no height at all");
}

/// Heights of a seam: flat, then rough.
SeamLine lineOf(std::size_t samples, unsigned roots)
{
    SeamLine line;
    line.roots = roots;
    for (std::size_t i = 0; i < samples; ++i) {
        const double rough = i > samples / 2 ? 1.0 : 0.0;
        line.heights.push_back(static_cast<float>(rough * std::sin(0.4 * static_cast<double>(i))));
    }
    return line;
}

TEST(SeamLevels, PartsAreNearTheSamplesAndRefineAlike)
{
    constexpr std::int64_t kUnits = 1 << 18;
    constexpr double kTolerance = 0.02;
    const SeamLine line = lineOf(61, 2);
    const SeamLevels seam(line, {16, 0.1, kTolerance, kUnits, kUnits / 4});
    EXPECT_TRUE(seam.isDivided(0, 2 * kUnits)) << "of two roots";
    std::int64_t first = 0;
    std::set<unsigned> kinds;
    while (first < 2 * kUnits) {
        std::int64_t length = kUnits;
        while (seam.isDivided(first, first + length)) { length /= 2; }
        const unsigned segments = seam.segments(first, first + length);
        kinds.insert(segments);
        ASSERT_EQ(segments & (segments - 1), 0U);
        ASSERT_LE(segments, 8U);
        const double samplesPerUnit = 30.0 / kUnits;
        EXPECT_LE(static_cast<double>(length) * samplesPerUnit / segments, 8.0);
        // Half of a part has half of its segments, and so on, to less than one.
        EXPECT_EQ(seam.segments(first + length / 2, first + length), segments / 2);
        EXPECT_EQ(seam.segments(first, first + length / 2), segments / 2);
        if (segments < 8) { // it was enough
            for (unsigned s = 0; s < segments; ++s) {
                const double from =
                    (static_cast<double>(first) + static_cast<double>(length) * s / segments) * samplesPerUnit;
                const double to = from + static_cast<double>(length) * samplesPerUnit / segments;
                for (double at = std::ceil(from); at <= to; at += 1.0) {
                    const double t = (at - from) / (to - from);
                    const double drawn =
                        (1.0 - t) * heightOnSeam(line.heights, from) + t * heightOnSeam(line.heights, to);
                    EXPECT_NEAR(drawn, static_cast<double>(line.heights[static_cast<std::size_t>(at)]),
                                kTolerance + 1e-9);
                }
            }
        }
        first += length;
    }
    EXPECT_EQ(first, 2 * kUnits);
    EXPECT_GE(kinds.size(), 2U) << "flat parts have fewer segments";
}

using Point = std::array<double, 3>;

struct Baked {
    std::uint32_t count;
    std::vector<LodAsset> tiles; ///< row by row

    const LodAsset& at(std::uint32_t i, std::uint32_t j) const { return tiles[j * count + i]; }
};

Baked bakeTiles(const std::string& path, std::uint32_t count, BakeOptions options)
{
    Baked baked{count, {}};
    for (std::uint32_t k = 0; k < count * count; ++k) {
        Progress progress;
        BakeReport report;
        options.tile = TileChoice{k % count, k / count, count};
        baked.tiles.push_back(bakeSource(path, options, progress, report));
    }
    return baked;
}

/// The points of a surface that lie on a line x = at or y = at.
std::set<Point> pointsOn(const SurfaceMesh& mesh, std::size_t axis, double at)
{
    std::set<Point> points;
    for (const Point& p : mesh.positions) {
        if (p[axis] == at) { points.insert(p); }
    }
    return points;
}

std::vector<SurfaceMesh> surfacesOf(const LodAsset& asset)
{
    std::vector<SurfaceMesh> surfaces;
    for (const std::uint16_t factor : asset.ladder) { surfaces.push_back(extractSurface(asset, factor)); }
    return surfaces;
}

std::size_t seamEdges(const LodAsset& asset, std::size_t axis, double at)
{
    std::size_t count = 0;
    for (const LodEdge& edge : asset.edges) {
        const auto on = [&](std::uint32_t v) {
            return static_cast<double>(static_cast<float>(asset.baseVertices[v][axis]) * asset.lattice.step) +
                       asset.lattice.origin[axis] ==
                   at;
        };
        count += edge.patches[1] == kNoPatch && on(edge.baseVertices[0]) && on(edge.baseVertices[1]) ? 1 : 0;
    }
    return count;
}

double extreme(const SurfaceMesh& mesh, std::size_t axis, bool greatest)
{
    double value = mesh.positions.front()[axis];
    for (const Point& p : mesh.positions) { value = greatest ? std::max(value, p[axis]) : std::min(value, p[axis]); }
    return value;
}

/// Edges of the triangles of all meshes that have no other side, points being the same if all their bits are.
std::vector<std::pair<Point, Point>> openEdges(const std::vector<const SurfaceMesh*>& meshes)
{
    std::map<std::pair<Point, Point>, int> balance;
    for (const SurfaceMesh* mesh : meshes) {
        for (const auto& t : mesh->triangles) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Point& a = mesh->positions[t[k]];
                const Point& b = mesh->positions[t[(k + 1) % 3]];
                if (a == b) { continue; }
                if (a < b) {
                    ++balance[{a, b}];
                } else {
                    --balance[{b, a}];
                }
            }
        }
    }
    std::vector<std::pair<Point, Point>> open;
    for (const auto& [edge, sum] : balance) {
        if (sum != 0) { open.push_back(edge); }
    }
    return open;
}

void expectSameBordersAtEveryPairOfLevels(const Baked& baked)
{
    std::size_t differentlyCut = 0;
    std::size_t finer = 0; // points on seams between base vertices
    const auto compare = [&](const LodAsset& a, const LodAsset& b, std::size_t axis) {
        EXPECT_EQ(a.lattice.step, b.lattice.step);
        EXPECT_EQ(a.lattice.origin, b.lattice.origin);
        const auto ofA = surfacesOf(a);
        const auto ofB = surfacesOf(b);
        const double at = extreme(ofA.front(), axis, axis == 0); // b lies to the east, or the south
        ASSERT_EQ(at, extreme(ofB.front(), axis, axis != 0));
        for (const SurfaceMesh& mesh : ofA) {
            const std::set<Point> points = pointsOn(mesh, axis, at);
            EXPECT_GT(points.size(), 2U);
            for (const SurfaceMesh& other : ofB) { ASSERT_EQ(points, pointsOn(other, axis, at)); }
            finer += points.size();
        }
        differentlyCut += seamEdges(a, axis, at) != seamEdges(b, axis, at) ? 1 : 0;
    };
    const std::uint32_t n = baked.count;
    for (std::uint32_t j = 0; j < n; ++j) {
        for (std::uint32_t i = 0; i < n; ++i) {
            ASSERT_NO_THROW(baked.at(i, j).validate());
            if (i + 1 < n) { compare(baked.at(i, j), baked.at(i + 1, j), 0); }
            if (j + 1 < n) { compare(baked.at(i, j), baked.at(i, j + 1), 1); }
        }
    }
    EXPECT_GT(finer, 0U);
    EXPECT_GT(differentlyCut, 0U) << "or the test shows little";
}

void expectNoOpenEdgesButTheRim(const Baked& baked)
{
    std::vector<std::vector<SurfaceMesh>> surfaces;
    for (const LodAsset& asset : baked.tiles) { surfaces.push_back(surfacesOf(asset)); }
    std::mt19937 random(1);
    double north = -1e30;
    double south = 1e30;
    double west = 1e30;
    double east = -1e30;
    for (const auto& ofTile : surfaces) {
        north = std::max(north, extreme(ofTile.front(), 1, true));
        south = std::min(south, extreme(ofTile.front(), 1, false));
        west = std::min(west, extreme(ofTile.front(), 0, false));
        east = std::max(east, extreme(ofTile.front(), 0, true));
    }
    for (int trial = 0; trial < 20; ++trial) {
        std::vector<const SurfaceMesh*> meshes;
        for (const auto& ofTile : surfaces) { meshes.push_back(&ofTile[random() % ofTile.size()]); }
        const auto open = openEdges(meshes);
        EXPECT_FALSE(open.empty());
        for (const auto& [a, b] : open) {
            const bool onRim = (a[0] == west && b[0] == west) || (a[0] == east && b[0] == east) ||
                               (a[1] == north && b[1] == north) || (a[1] == south && b[1] == south);
            ASSERT_TRUE(onRim) << a[0] << ", " << a[1] << " to " << b[0] << ", " << b[1];
        }
    }
}

void expectNearTo(const HeightField& whole, const Baked& baked)
{
    for (const LodAsset& asset : baked.tiles) {
        float error = 0.0F;
        for (const LodLevel& level : asset.levels) {
            error = level.errors.empty()
                        ? error
                        : std::max_element(level.errors.begin(), level.errors.end(), [](auto& a, auto& b) {
                              return a.isotropic < b.isotropic;
                          })->isotropic;
        }
        const SurfaceMesh mesh = extractSurface(asset, 8);
        for (const Point& p : mesh.positions) {
            const double height = whole.heightAt((p[0] - whole.corner[0]) / 30.0, (whole.corner[1] - p[1]) / 25.0);
            // Distance is less than the difference in height, by the slope: no more than 20 · 9 on 25.
            EXPECT_NEAR(p[2], height, 8.0 * static_cast<double>(error));
        }
    }
}

struct TileCase {
    const char* technique;
    std::uint32_t count;
    double tolerance;
};

class BakedTiles : public testing::TestWithParam<TileCase> {
protected:
    static BakeOptions options()
    {
        BakeOptions options;
        options.technique = GetParam().technique;
        options.tolerance = GetParam().tolerance;
        options.maxFactor = 8;
        options.patchTolerance = 0.005;
        options.normalResolution = 4;
        options.heights.spacing = {{30.0, 25.0}};
        options.heights.scale = 20.0;
        return options;
    }
    Baked bake() const
    {
        const std::string path = _folder.file("heights.exr");
        writeImage(path, OIIO::TypeDesc::FLOAT, heights());
        return bakeTiles(path, GetParam().count, options());
    }

    TemporaryDirectory _folder;
};

TEST_P(BakedTiles, FitTogether)
{
    const Baked baked = bake();
    expectSameBordersAtEveryPairOfLevels(baked);
    expectNoOpenEdgesButTheRim(baked);
    expectNearTo(readHeightField(_folder.file("heights.exr"), options().heights), baked);
}

INSTANTIATE_TEST_SUITE_P(OfEveryKind, BakedTiles,
                         testing::Values(TileCase{"uniform", 2, 0.02}, TileCase{"uniform", 3, 0.0},
                                         TileCase{"strips", 2, 0.002}),
                         [](const testing::TestParamInfo<TileCase>& which) {
                             return std::string(which.param.technique) + std::to_string(which.param.count) +
                                    (which.param.tolerance == 0.0 ? "WithAllLevels" : "");
                         });

TEST(BakedTile, OfWhatCannotBeCutIsAnError)
{
    const TemporaryDirectory folder;
    const std::string path = folder.file("heights.exr");
    const auto message = [](const std::string& source, const BakeOptions& options) -> std::string {
        Progress progress;
        BakeReport report;
        try {
            bakeSource(source, options, progress, report);
        } catch (const AssetError& error) {
            return error.what();
        }
        return "";
    };
    BakeOptions options;
    options.tile = TileChoice{0, 0, 2};
    options.maxFactor = 4;
    EXPECT_EQ(message("builtin:sphere", options), "builtin:sphere: only height images have tiles");
    EXPECT_EQ(message("mesh.obj", options), "mesh.obj: only height images have tiles");
    options.ladder = {1, 2, 6};
    options.maxFactor = 6;
    EXPECT_NE(message(path, options), "");
    options.ladder = {1, 4};
    options.maxFactor = 4;
    EXPECT_EQ(message(path, options), "levels of tiles are the powers of two");
    options.ladder.clear();
    std::vector<float> pixels = heights();
    for (std::size_t i = 0; i < 400; ++i) { pixels[i] = kVoid; } // at the rim: never filled
    writeImage(path, OIIO::TypeDesc::FLOAT, pixels);
    EXPECT_NE(message(path, options).find(path + ": tile 0,0 of 2 x 2 has "), std::string::npos);
    EXPECT_NE(message(path, options).find("samples without data that are not filled"), std::string::npos);
}

} // namespace
} // namespace osgTessLOD::bake
