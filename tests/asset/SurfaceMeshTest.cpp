// SPDX-License-Identifier: MIT
#include "SyntheticAsset.h"

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <map>
#include <cmath>
#include <set>
#include <sstream>

namespace osgTessLOD {
namespace {

/// Number of directed edges without their opposite; fails on an edge that two faces use the same way.
std::size_t openEdges(const SurfaceMesh& mesh)
{
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            EXPECT_LT(t[k], mesh.positions.size());
            EXPECT_NE(t[k], t[(k + 1) % 3]);
            EXPECT_TRUE(edges.insert({t[k], t[(k + 1) % 3]}).second);
        }
    }
    std::size_t open = 0;
    for (const auto& [a, b] : edges) { open += edges.count({b, a}) == 0 ? 1 : 0; }
    return open;
}

/// V − E + F, every vertex used.
long long eulerCharacteristic(const SurfaceMesh& mesh)
{
    std::set<std::uint32_t> used;
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            used.insert(t[k]);
            edges.insert({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
        }
    }
    return static_cast<long long>(used.size()) - static_cast<long long>(edges.size()) +
           static_cast<long long>(mesh.triangles.size());
}

double volume(const SurfaceMesh& mesh)
{
    double sum = 0.0;
    for (const auto& t : mesh.triangles) {
        sum += synthetic::dot(mesh.positions[t[0]], synthetic::cross(mesh.positions[t[1]], mesh.positions[t[2]])) / 6.0;
    }
    return sum;
}

TEST(SurfaceMesh, isClosedAtEveryFactorWithTheCountsOfItsPattern)
{
    const LodAsset asset = makeSyntheticAsset(16);
    for (const unsigned f : asset.ladder) {
        const SurfaceMesh mesh = extractSurface(asset, f);
        EXPECT_EQ(mesh.triangles.size(), 8U * TessellationPattern::triangleCount(f));
        const std::size_t inner = TessellationPattern::vertexCount(f) - TessellationPattern::borderVertexCount(f);
        EXPECT_EQ(mesh.positions.size(), 6 + 12 * (f - 1) + 8 * inner) << f;
        EXPECT_EQ(openEdges(mesh), 0U) << f;
        EXPECT_EQ(eulerCharacteristic(mesh), 2) << f;
    }
    // The octahedron of radius 0.95 … 1.05 has a volume of 4/3 ± 16 %, the fine surface nearly the sphere's.
    EXPECT_NEAR(volume(extractSurface(asset, 1)), 4.0 / 3.0, 0.22);
    EXPECT_NEAR(volume(extractSurface(asset, 16)), 4.0 / 3.0 * 3.14159, 0.2);
}

TEST(SurfaceMesh, isClosedWhereFinestLevelsDiffer)
{
    const LodAsset asset = makeSyntheticMixedAsset(16);
    std::set<int> steps; // between neighbours: the test means something only if there are several
    for (const LodEdge& edge : asset.edges) {
        steps.insert(std::abs(asset.patches[edge.patches[0]].finestLevel - asset.patches[edge.patches[1]].finestLevel));
    }
    ASSERT_GE(steps.size(), 3U);
    for (const unsigned f : asset.ladder) {
        const SurfaceMesh mesh = extractSurface(asset, f);
        EXPECT_EQ(openEdges(mesh), 0U) << f;
        EXPECT_EQ(eulerCharacteristic(mesh), 2) << f;
    }
    EXPECT_GT(extractSurface(asset, 16).triangles.size(), extractSurface(asset, 4).triangles.size());
}

TEST(SurfaceMesh, aLaggingBorderIsItsNeighboursBorder)
{
    // One patch of factor 4 beside single triangles: of its 24 triangles the 9 with two vertices on one half of a border go.
    const LodAsset asset = synthetic::build(synthetic::bumpySphere(), {1, 2, 4}, false, {2, 0, 0, 0, 0, 0, 0, 0});
    ASSERT_NO_THROW(asset.validate());
    const SurfaceMesh mesh = extractSurface(asset, 4);
    EXPECT_EQ(mesh.positions.size(), 6U + 7U); // base vertices and the inner ring: no vertex of a border is left
    EXPECT_EQ(mesh.triangles.size(), 7U + 24U - 9U);
    EXPECT_EQ(openEdges(mesh), 0U);
}

TEST(SurfaceMesh, attributesAreTheVertices)
{
    for (const LodAsset& asset : {withAttributes(makeSyntheticAsset(8)), withAttributes(makeSyntheticMixedAsset(8))}) {
        const SurfaceMesh mesh = extractSurface(asset, 8);
        ASSERT_EQ(mesh.uvs.size(), mesh.triangles.size());
        ASSERT_EQ(mesh.colors.size(), mesh.positions.size());
        EXPECT_EQ(openEdges(mesh), 0U) << "seams do not part it";
        // The synthetic colours are a function of the place: what each stored vertex has says what its position has.
        std::map<std::array<double, 3>, std::uint32_t> colorAt;
        std::map<std::array<double, 3>, std::set<std::array<float, 2>>> uvsAt;
        for (std::size_t l = 0; l < asset.levels.size(); ++l) {
            const auto slots = asset.levelSlots(l);
            const std::size_t count = TessellationPattern::vertexCount(asset.ladder[l]);
            for (std::size_t p = 0; p < slots.size(); ++p) {
                for (std::size_t v = 0; slots[p] != kNoPatch && v < count; ++v) {
                    const std::size_t at = slots[p] * count + v;
                    const auto local = asset.position(asset.patches[p], asset.levels[l].vertices[at]);
                    const std::array<double, 3> place{local[0], local[1], local[2]};
                    colorAt[place] = asset.levels[l].colors[at];
                    const auto uv = asset.uvLattice.decode(asset.levels[l].uvs[at]);
                    if (uv[2] > 0.0F) { uvsAt[place].insert({uv[0], uv[1]}); }
                }
            }
        }
        for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
            std::uint32_t bits = 0;
            for (std::size_t k = 0; k < 4; ++k) { bits |= std::uint32_t{mesh.colors[v][k]} << 8 * k; }
            ASSERT_EQ(bits, colorAt.at(mesh.positions[v]));
        }
        std::size_t without = 0;
        for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
            for (std::size_t k = 0; k < 3; ++k) {
                without += std::isnan(mesh.uvs[t][k][0]) ? 1 : 0;
                if (std::isnan(mesh.uvs[t][k][0])) { continue; }
                ASSERT_EQ(uvsAt[mesh.positions[mesh.triangles[t][k]]].count(mesh.uvs[t][k]), 1U);
            }
        }
        EXPECT_GT(without, 0U);
    }
}

TEST(SurfaceMesh, anOpenSheetHasItsBoundaryOnly)
{
    const LodAsset asset = makeSyntheticSheet(8);
    for (const unsigned f : asset.ladder) {
        const SurfaceMesh mesh = extractSurface(asset, f);
        EXPECT_EQ(openEdges(mesh), 8 * f);
        EXPECT_EQ(eulerCharacteristic(mesh), 1);
    }
}

TEST(SurfaceMesh, seamsAreTheSameAtEveryFactor)
{
    const LodAsset asset = withSeams(makeSyntheticSheet(8));
    std::size_t segments = 0;
    for (const LodEdge& edge : asset.edges) {
        segments += edge.patches[1] == kNoPatch ? asset.ladder[edge.coarsestLevel] : 0;
    }
    for (const unsigned f : asset.ladder) {
        const SurfaceMesh mesh = extractSurface(asset, f);
        EXPECT_EQ(openEdges(mesh), segments);
        EXPECT_EQ(eulerCharacteristic(mesh), 1);
    }
}

TEST(SurfaceMesh, positionsAreTheAssetsInTheSourcesSpace)
{
    LodAsset asset = makeSyntheticAsset(4);
    const SurfaceMesh atZero = extractSurface(asset, 4);
    asset.lattice.origin = {1e7, -2e7, 0.5};
    const SurfaceMesh moved = extractSurface(asset, 4);
    ASSERT_EQ(moved.positions.size(), atZero.positions.size());
    std::set<std::array<float, 3>> known;
    const std::size_t count = TessellationPattern::vertexCount(4);
    for (std::size_t v = 0; v < asset.levels[2].vertices.size(); ++v) {
        known.insert(asset.position(asset.patches[v / count], asset.levels[2].vertices[v]));
    }
    EXPECT_EQ(known.size(), atZero.positions.size());
    for (std::size_t v = 0; v < moved.positions.size(); ++v) {
        std::array<float, 3> local{};
        for (std::size_t k = 0; k < 3; ++k) {
            local[k] = static_cast<float>(atZero.positions[v][k]);
            EXPECT_EQ(moved.positions[v][k], asset.lattice.origin[k] + atZero.positions[v][k]);
        }
        EXPECT_EQ(known.count(local), 1U);
    }
}

TEST(SurfaceMesh, anUnknownFactorIsAnErrorThatTellsTheLadder)
{
    try {
        extractSurface(makeSyntheticAsset(4), 3);
        FAIL();
    } catch (const AssetError& error) {
        EXPECT_STREQ(error.what(), "factor 3 is not in the ladder 1, 2, 4");
    }
}

class PlyFile : public ::testing::Test {
protected:
    std::string written(const SurfaceMesh& mesh)
    {
        writePly(_directory.file("a.ply"), mesh);
        std::ifstream stream(_directory.file("a.ply"), std::ios::binary);
        std::ostringstream all;
        all << stream.rdbuf();
        return all.str();
    }
    TemporaryDirectory _directory;
};

TEST_F(PlyFile, hasAHeaderAndItsNumbers)
{
    SurfaceMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, -2.5}, {1, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {1, 3, 2}};
    const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\n"
                               "property float y\nproperty float z\nelement face 2\n"
                               "property list uchar uint vertex_indices\nend_header\n";
    const std::string bytes = written(mesh);
    ASSERT_EQ(bytes.size(), header.size() + 4 * 12 + 2 * 13);
    EXPECT_EQ(bytes.substr(0, header.size()), header);
    EXPECT_EQ(bytes.substr(header.size() + 2 * 12 + 8, 4), std::string("\x00\x00\x20\xC0", 4)); // −2.5
    EXPECT_EQ(bytes.substr(header.size() + 4 * 12 + 13), std::string("\3\1\0\0\0\3\0\0\0\2\0\0\0", 13));
}

TEST_F(PlyFile, hasColoursOfVerticesAndUvsOfFaces)
{
    SurfaceMesh mesh;
    mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.uvs = {{{{0.0F, 0.0F}, {1.0F, 0.0F}, {0.0F, -2.5F}}}};
    mesh.colors = {{1, 2, 3, 4}, {5, 6, 7, 8}, {9, 10, 11, 12}};
    const std::string header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
                               "property float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
                               "property uchar blue\nproperty uchar alpha\nelement face 1\n"
                               "property list uchar uint vertex_indices\nproperty list uchar float texcoord\nend_header\n";
    const std::string bytes = written(mesh);
    ASSERT_EQ(bytes.size(), header.size() + 3 * 16 + 13 + 25);
    EXPECT_EQ(bytes.substr(0, header.size()), header);
    EXPECT_EQ(bytes.substr(header.size() + 16 + 12, 4), "\5\6\7\10");
    EXPECT_EQ(bytes[header.size() + 3 * 16 + 13], '\6');
    EXPECT_EQ(bytes.substr(bytes.size() - 4), std::string("\x00\x00\x20\xC0", 4)); // −2.5
}

TEST_F(PlyFile, isDoubleWhereFloatWouldLose)
{
    SurfaceMesh mesh;
    mesh.positions = {{1e7 + 0.125, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    const std::string bytes = written(mesh);
    EXPECT_NE(bytes.find("property double x"), std::string::npos);
    const std::size_t body = bytes.find("end_header\n") + 11;
    ASSERT_EQ(bytes.size(), body + 3 * 24 + 13);
    double x = 0.0;
    std::memcpy(&x, bytes.data() + body, 8);
    EXPECT_EQ(x, 1e7 + 0.125);
}

TEST_F(PlyFile, ofALargeMeshIsComplete)
{
    const SurfaceMesh mesh = extractSurface(makeSyntheticAsset(64), 64);
    const std::string bytes = written(mesh);
    const std::size_t body = bytes.find("end_header\n") + 11;
    EXPECT_EQ(bytes.size(), body + 12 * mesh.positions.size() + 13 * mesh.triangles.size());
}

TEST_F(PlyFile, thatCannotBeWrittenIsAnErrorWithItsPath)
{
    const std::string path = _directory.file("missing/x.ply");
    try {
        writePly(path, SurfaceMesh{});
        FAIL();
    } catch (const AssetError& error) {
        EXPECT_EQ(std::string(error.what()).find(path + ": "), 0U) << error.what();
    }
}

} // namespace
} // namespace osgTessLOD
