// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

namespace osgTessLOD::bake {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Triangle = std::array<std::uint32_t, 3>;

SourceMesh meshOf(std::vector<Vector3d> positions, std::vector<Triangle> triangles)
{
    SourceMesh mesh;
    mesh.name = "test";
    mesh.positions = std::move(positions);
    mesh.triangles = std::move(triangles);
    return mesh;
}

const std::vector<Vector3d> kTetraPoints{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
const std::vector<Triangle> kTetraFaces{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

long eulerNumber(const SourceMesh& mesh, const CleaningReport& report)
{
    const auto faces = static_cast<long>(mesh.triangles.size());
    const auto edges = (3 * faces + static_cast<long>(report.boundaryEdges)) / 2;
    return static_cast<long>(mesh.positions.size()) - edges + faces;
}

// -------------------------------------------------------------------------------------------------------- cleaning ---

TEST(CleanMesh, LeavesASoundMeshAlone)
{
    SourceMesh mesh = meshOf(kTetraPoints, kTetraFaces);
    EXPECT_TRUE(isOrientedManifold(mesh));
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(mesh.positions, kTetraPoints);
    EXPECT_EQ(mesh.triangles, kTetraFaces);
    EXPECT_EQ(r.weldedVertices + r.unreferencedVertices + r.degenerateFaces + r.duplicateFaces + r.flippedFaces, 0U);
    EXPECT_EQ(r.nonManifoldEdges + r.nonManifoldVertices + r.boundaryEdges, 0U);
    EXPECT_EQ(r.components, 1U);
}

TEST(CleanMesh, WeldsEqualPositionsAndTakesMinusZeroForZero)
{
    SourceMesh mesh =
        meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, -0.0, 0}, {1, 1, 0}, {0, 1, -0.0}}, {{0, 1, 2}, {3, 4, 5}});
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.weldedVertices, 2U);
    EXPECT_EQ(r.unreferencedVertices, 0U);
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
    EXPECT_EQ(r.boundaryEdges, 4U);
}

TEST(CleanMesh, DoesNotWeldWhatIsMerelyNear)
{
    const double next = std::nextafter(1.0, 2.0);
    SourceMesh mesh =
        meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {next, 0, 0}, {1, 1, 0}, {0, next, 0}}, {{0, 1, 2}, {3, 4, 5}});
    EXPECT_EQ(cleanMesh(mesh).weldedVertices, 0U);
}

TEST(CleanMesh, DropsFacesWithoutArea)
{
    SourceMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}}, {{0, 1, 2}, {0, 1, 1}, {0, 1, 3}});
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.degenerateFaces, 2U) << "two equal corners; three in a line";
    EXPECT_EQ(r.unreferencedVertices, 1U) << "of the second of them";
    EXPECT_EQ(mesh.triangles.size(), 1U);
}

TEST(CleanMesh, KeepsSliversAndHugeCoordinates)
{
    SourceMesh sliver = meshOf({{0, 0, 0}, {1, 0, 0}, {0.5, 1e-12, 0}}, {{0, 1, 2}});
    EXPECT_EQ(cleanMesh(sliver).degenerateFaces, 0U);
    SourceMesh huge = meshOf({{0, 0, 0}, {1e150, 0, 0}, {0, -1e150, 0}}, {{0, 1, 2}});
    EXPECT_EQ(cleanMesh(huge).degenerateFaces, 0U);
    SourceMesh tiny = meshOf({{0, 0, 0}, {1e-300, 0, 0}, {0, 1e-300, 0}}, {{0, 1, 2}});
    EXPECT_EQ(cleanMesh(tiny).degenerateFaces, 0U);
}

TEST(CleanMesh, KeepsTheFirstOfDuplicatesInEitherOrientation)
{
    SourceMesh mesh = meshOf(kTetraPoints, {{0, 2, 1}, {0, 1, 3}, {2, 1, 0}, {1, 2, 3}, {3, 1, 0}, {2, 0, 3}});
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.duplicateFaces, 2U);
    EXPECT_EQ(mesh.triangles, kTetraFaces);
    EXPECT_EQ(r.boundaryEdges, 0U);
}

TEST(CleanMesh, TurnsTheMinority)
{
    std::vector<Triangle> faces = kTetraFaces;
    std::swap(faces[0][1], faces[0][2]); // the first face, where the search starts, is the odd one
    SourceMesh mesh = meshOf(kTetraPoints, faces);
    EXPECT_FALSE(isOrientedManifold(mesh));
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.flippedFaces, 1U);
    EXPECT_EQ(r.boundaryEdges, 0U);
    EXPECT_EQ(mesh.triangles, kTetraFaces);
}

TEST(CleanMesh, OrientsEachComponentForItself)
{
    // Two open pairs of triangles, far apart, the second pair all turned over: nothing to do.
    SourceMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {6, 1, 0}, {5, 1, 0}},
                             {{0, 1, 2}, {0, 2, 3}, {4, 6, 5}, {4, 7, 6}});
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.flippedFaces, 0U);
    EXPECT_EQ(r.components, 2U);
    EXPECT_EQ(r.boundaryEdges, 8U);
}

TEST(CleanMesh, SplitsAVertexThatTwoFansShare)
{
    std::vector<Vector3d> points = kTetraPoints;
    for (const Vector3d& p : kTetraPoints) { points.push_back(-p); }
    std::vector<Triangle> faces = kTetraFaces;
    for (const Triangle& f : kTetraFaces) { faces.push_back({f[0] + 4, f[2] + 4, f[1] + 4}); }
    SourceMesh mesh = meshOf(points, faces); // two tetrahedra tip to tip at the origin
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.weldedVertices, 1U);
    EXPECT_EQ(r.nonManifoldVertices, 1U);
    EXPECT_EQ(r.nonManifoldEdges, 0U);
    EXPECT_EQ(mesh.positions.size(), 8U);
    EXPECT_EQ(r.components, 2U);
    EXPECT_TRUE(isOrientedManifold(mesh));
}

TEST(CleanMesh, CutsAnEdgeOfThreeFacesAndClosesWhatFits)
{
    // A tetrahedron with a fin on edge 0-1. Its two faces there run in opposite directions and share their fans, so they
    // join again; the fin comes off.
    std::vector<Vector3d> points = kTetraPoints;
    points.push_back({0.5, -1, -1});
    std::vector<Triangle> faces = kTetraFaces;
    faces.push_back({0, 1, 4});
    SourceMesh mesh = meshOf(points, faces);
    EXPECT_FALSE(isOrientedManifold(mesh));
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.nonManifoldEdges, 1U);
    EXPECT_EQ(r.nonManifoldVertices, 2U);
    EXPECT_EQ(r.boundaryEdges, 3U) << "those of the fin";
    EXPECT_EQ(r.components, 2U);
    EXPECT_EQ(mesh.positions.size(), 7U);
    EXPECT_TRUE(isOrientedManifold(mesh));
}

TEST(CleanMesh, PartsAStarOfThreeFaces)
{
    SourceMesh mesh =
        meshOf({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}});
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.nonManifoldEdges, 1U);
    EXPECT_EQ(r.components, 3U);
    EXPECT_EQ(r.boundaryEdges, 9U);
    EXPECT_EQ(mesh.positions.size(), 9U);
    EXPECT_TRUE(isOrientedManifold(mesh));
}

TEST(CleanMesh, CutsAMoebiusStripOnce)
{
    // The minimal strip: five vertices, faces i, i + 1, i + 2 (mod 5).
    std::vector<Vector3d> points;
    for (int i = 0; i < 5; ++i) { points.emplace_back(std::cos(2.5 * i), std::sin(2.5 * i), 0.3 * i * i); }
    SourceMesh mesh = meshOf(points, {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}, {3, 4, 0}, {4, 0, 1}});
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.nonManifoldEdges, 1U);
    EXPECT_EQ(r.components, 1U);
    EXPECT_EQ(r.boundaryEdges, 7U) << "of a strip of five triangles";
    EXPECT_EQ(mesh.positions.size(), 7U);
    EXPECT_TRUE(isOrientedManifold(mesh));
}

TEST(CleanMesh, CopesWithEverythingAtOnce)
{
    std::vector<Vector3d> points = kTetraPoints;
    points.push_back({9, 9, 9});     // 4: unreferenced
    points.push_back({1, -0.0, 0});  // 5: vertex 1 again
    points.push_back({0.5, -1, -1}); // 6: fin
    points.push_back({2, 0, 0});     // 7: in line with 0 and 1
    SourceMesh mesh = meshOf(points, {{0, 2, 1},
                                      {0, 1, 3},
                                      {5, 3, 2},
                                      {2, 0, 3}, // the third is turned over
                                      {5, 0, 2}, // duplicate of the first
                                      {0, 5, 6}, // fin
                                      {0, 1, 7},
                                      {1, 5, 2}}); // in a line, collapsed
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.weldedVertices, 1U);
    EXPECT_EQ(r.degenerateFaces, 2U);
    EXPECT_EQ(r.duplicateFaces, 1U);
    EXPECT_EQ(r.unreferencedVertices, 2U);
    EXPECT_EQ(r.flippedFaces, 1U);
    EXPECT_EQ(r.nonManifoldEdges, 1U);
    EXPECT_EQ(r.boundaryEdges, 3U);
    EXPECT_EQ(r.components, 2U);
    EXPECT_TRUE(isOrientedManifold(mesh));
}

TEST(CleanMesh, NeedsAFaceToBeLeft)
{
    SourceMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {0, 0, 1}});
    EXPECT_THROW(cleanMesh(mesh), AssetError);
    SourceMesh point = meshOf({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}});
    EXPECT_THROW(cleanMesh(point), AssetError);
}

TEST(IsOrientedManifold, SeesEachFault)
{
    EXPECT_FALSE(isOrientedManifold(meshOf(kTetraPoints, {{0, 1, 4}}))) << "index";
    EXPECT_FALSE(isOrientedManifold(meshOf(kTetraPoints, {{0, 1, 1}}))) << "equal corners";
    EXPECT_FALSE(isOrientedManifold(meshOf(kTetraPoints, {{0, 1, 2}, {0, 1, 3}}))) << "same direction";
    EXPECT_FALSE(isOrientedManifold(meshOf(std::vector<Vector3d>(5), {{0, 1, 2}, {0, 3, 4}}))) << "two fans";
    EXPECT_TRUE(isOrientedManifold(meshOf(kTetraPoints, {{0, 1, 2}, {1, 0, 3}})));
}

// ----------------------------------------------------------------------------------------------------------- frame ---

TEST(NormalizeFrame, CentresAndScalesToDiagonalOne)
{
    SourceMesh mesh = meshOf({{10, 20, 30}, {12, 23, 36}, {10, 23, 30}}, {{0, 1, 2}}); // diagonal √(4 + 9 + 36) = 7
    normalizeFrame(mesh);
    EXPECT_EQ(mesh.frame.center, Vector3d(11, 21.5, 33));
    EXPECT_EQ(mesh.frame.scale, 7.0);
    EXPECT_NEAR((mesh.positions[1] - mesh.positions[0]).norm(), 1.0, 1e-15);
    EXPECT_LT((mesh.frame.center + mesh.frame.scale * mesh.positions[2] - Vector3d(10, 23, 30)).norm(), 1e-14);
    normalizeFrame(mesh); // again: the transform to the source stays the same
    EXPECT_NEAR(mesh.frame.scale, 7.0, 1e-14);
    EXPECT_LT((mesh.frame.center - Vector3d(11, 21.5, 33)).norm(), 1e-14);
}

TEST(NormalizeFrame, TakesAnyScaleButNoPoint)
{
    for (const double size : {1e-300, 1e-6, 1e9, 1e150}) {
        SourceMesh mesh = meshOf({{-size, 0, 0}, {size, 0, 0}, {0, size, 0}}, {{0, 1, 2}});
        normalizeFrame(mesh);
        EXPECT_NEAR(mesh.frame.scale / size, std::sqrt(5.0), 1e-12);
        EXPECT_NEAR((mesh.positions[1] - mesh.positions[0]).x(), 2.0 / std::sqrt(5.0), 1e-12);
    }
    SourceMesh point = meshOf({{3, 3, 3}, {3, 3, 3}}, {});
    EXPECT_THROW(normalizeFrame(point), AssetError);
    SourceMesh empty = meshOf({}, {});
    EXPECT_THROW(normalizeFrame(empty), AssetError);
}

// ------------------------------------------------------------------------------------------------------ attributes ---

using Uvs = std::vector<std::array<Eigen::Vector2f, 3>>;

/// Texture coordinates that tell corners apart: (triangle, corner).
Uvs numbered(std::size_t triangles)
{
    Uvs uvs;
    for (std::size_t t = 0; t < triangles; ++t) {
        const auto n = static_cast<float>(t);
        uvs.push_back({Eigen::Vector2f(n, 0.0F), Eigen::Vector2f(n, 1.0F), Eigen::Vector2f(n, 2.0F)});
    }
    return uvs;
}

TEST(CleanMesh, CornersKeepTheirUvsWhenVerticesAreWelded)
{
    SourceMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2}, {3, 4, 5}});
    mesh.uvs = numbered(2);
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.weldedVertices, 2U);
    EXPECT_EQ(r.facesWithoutUvs, 0U);
    EXPECT_EQ(mesh.uvs, numbered(2));
}

TEST(CleanMesh, UvsGoWithTheirFaces)
{
    // The first face has no area, the third is the second once more, the last is turned.
    SourceMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {2, 0, 0}},
                             {{0, 1, 1}, {0, 1, 2}, {2, 0, 1}, {1, 3, 2}, {1, 4, 3}, {1, 4, 5}});
    mesh.uvs = numbered(6);
    const CleaningReport r = cleanMesh(mesh);
    EXPECT_EQ(r.flippedFaces, 1U);
    const Uvs all = numbered(6);
    const Uvs expected{all[1], all[3], all[4], {all[5][0], all[5][2], all[5][1]}};
    EXPECT_EQ(mesh.uvs, expected);
}

TEST(CleanMesh, WeldedVerticesGetTheMeanOfTheirColours)
{
    SourceMesh mesh = meshOf({{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{1, 2, 3}, {4, 5, 6}});
    mesh.colors = {{9, 9, 9, 9}, {1, 2, 3, 4}, {10, 0, 0, 255}, {5, 5, 5, 5}, {20, 255, 0, 255}, {6, 7, 8, 9}, {5, 5, 5, 5}};
    cleanMesh(mesh);
    EXPECT_EQ(mesh.colors, (std::vector<Rgba>{{1, 2, 3, 4}, {15, 128, 0, 255}, {5, 5, 5, 5}, {6, 7, 8, 9}}));
}

TEST(CleanMesh, SplitVerticesKeepTheirColour)
{
    SourceMesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2}, {0, 3, 4}});
    mesh.colors = {{1, 1, 1, 1}, {2, 2, 2, 2}, {3, 3, 3, 3}, {4, 4, 4, 4}, {5, 5, 5, 5}};
    EXPECT_EQ(cleanMesh(mesh).nonManifoldVertices, 1U);
    ASSERT_EQ(mesh.colors.size(), 6U);
    for (std::size_t v = 0; v < 6; ++v) {
        if (mesh.positions[v].isZero()) { EXPECT_EQ(mesh.colors[v][0], 1); }
    }
}

// ---------------------------------------------------------------------------------------------------------- import ---

class ImportMesh : public testing::Test {
protected:
    std::string file(const std::string& name, const std::string& content) const
    {
        std::string path = _folder.file(name);
        writeBytes(path, content);
        return path;
    }
    SourceMesh import(const std::string& name, const std::string& content) const
    {
        return importMesh(file(name, content));
    }

    /// Imports and expects an AssetError that names the file and says `fault`.
    void expectFault(const std::string& name, const std::string& content, const std::string& fault) const
    {
        expectFaultAt(file(name, content), fault);
    }
    static void expectFaultAt(const std::string& path, const std::string& fault)
    {
        try {
            importMesh(path);
            ADD_FAILURE() << path << " was accepted";
        } catch (const AssetError& error) {
            const std::string what = error.what();
            EXPECT_NE(what.find(path), std::string::npos) << what;
            EXPECT_NE(what.find(fault), std::string::npos) << what;
        }
    }

    TemporaryDirectory _folder;
};

template <typename T> void put(std::string& bytes, T value, bool bigEndian = false)
{
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));
    for (std::size_t i = 0; i < sizeof(T); ++i) {
        bytes += raw[bigEndian ? sizeof(T) - 1 - i : i];
    } // little-endian host
}

std::string plyHeader(const std::string& format, const std::string& vertices, const std::string& faces,
                      const std::string& type = "float")
{
    return "ply\nformat " + format + " 1.0\ncomment made by a test\nelement vertex " + vertices + "\nproperty " + type +
           " x\nproperty " + type + " y\nproperty " + type + " z\nelement face " + faces +
           "\nproperty list uchar int vertex_indices\nend_header\n";
}

const std::string kQuadObj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
const std::vector<Vector3d> kQuadPoints{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const std::vector<Triangle> kQuadFaces{{0, 1, 2}, {0, 2, 3}};

TEST_F(ImportMesh, ReadsTheSameQuadInEveryFormat)
{
    const std::string points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    const SourceMesh obj =
        import("q.obj", "# quad\r\n" + kQuadObj + "vt 0 0\nvn 0 0 1\ng part\nf 1/1/1 2//1 3/1 \\\n 4\n");
    const SourceMesh ply = import("q.ply", plyHeader("ascii", "4", "1") + points + "4 0 1 2 3\n");
    const SourceMesh off = import("q.off", "OFF # quad\n\n4 1 0\n# points\n" + points + "4 0 1 2 3 255 0 0\n");
    for (const SourceMesh* mesh : {&obj, &ply, &off}) {
        EXPECT_EQ(mesh->positions, kQuadPoints) << mesh->name;
        EXPECT_EQ(mesh->triangles, kQuadFaces) << mesh->name;
    }
}

TEST_F(ImportMesh, ReadsBinaryPlyOfBothByteOrdersInFullPrecision)
{
    for (const bool big : {false, true}) {
        std::string content = plyHeader(big ? "binary_big_endian" : "binary_little_endian", "3", "1", "double");
        for (const double value : {0.0, 0.0, 0.0, 1.0 / 3.0, 0.0, 0.0, 0.0, 1e100, 0.0}) { put(content, value, big); }
        put(content, std::uint8_t{3});
        for (const std::int32_t index : {0, 1, 2}) { put(content, index, big); }
        const SourceMesh mesh = import("b.PLY", content);
        EXPECT_EQ(mesh.positions[1], Vector3d(1.0 / 3.0, 0, 0));
        EXPECT_EQ(mesh.positions[2], Vector3d(0, 1e100, 0));
        EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
    }
}

TEST_F(ImportMesh, SkipsPlyElementsAndPropertiesItDoesNotNeed)
{
    const SourceMesh mesh =
        import("extra.ply", "ply\r\nformat ascii 1.0\r\nobj_info some words\r\nelement camera 1\r\n"
                            "property float view\r\nelement vertex 3\r\nproperty float32 confidence\r\n"
                            "property float32 x\r\nproperty float32 y\r\nproperty float32 z\r\nelement face 1\r\n"
                            "property list uchar float texcoord\r\nproperty list uint8 uint32 vertex_index\r\n"
                            "property uchar flags\r\nelement nothing 4000000000\r\nend_header\r\n"
                            "7\r\n.5 0 0 0\r\n.5 1 0 0\r\n.5 0 1 0\r\n6 0 0 1 0 1 1 3 2 0 1 9\r\n");
    EXPECT_EQ(mesh.positions, (std::vector<Vector3d>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{2, 0, 1}}));
}

TEST_F(ImportMesh, ReadsObjIndicesThatCountBack)
{
    EXPECT_EQ(import("n.obj", kQuadObj + "f -4 -3 -2\nf -4/1 -2/1 -1/1\n").triangles, kQuadFaces);
    EXPECT_EQ(import("f.obj", "f 1 2 3\nf 1 3 4\n" + kQuadObj).triangles, kQuadFaces) << "vertices that follow";
    EXPECT_EQ(import("c.obj", "v 0 0 0 1 0 0\nv +1 0 0 1 0 0\nv 0 1 0 1 0 0\nf 1 2 3\n").positions[1],
              Vector3d(1, 0, 0));
}

TEST_F(ImportMesh, CutsAConcaveQuadInside)
{
    // Reflex corner at 2, which 1-3 would pass by on the outside.
    const std::string dart = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\n";
    EXPECT_EQ(import("a.obj", dart + "f 1 2 3 4\n").triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
    EXPECT_EQ(import("b.obj", dart + "f 2 3 4 1\n").triangles, (std::vector<Triangle>{{1, 2, 0}, {2, 3, 0}}));
}

/// What the quad's two triangles have at their corners.
Uvs quadUvs(const std::array<Eigen::Vector2f, 4>& corners)
{
    return {{corners[0], corners[1], corners[2]}, {corners[0], corners[2], corners[3]}};
}
const Uvs kQuadUvs = quadUvs({Eigen::Vector2f(0, 0), {1, 0}, {1, 2}, {0, 2}});

TEST_F(ImportMesh, ReadsUvsFromObj)
{
    const std::string uvs = "vt 0 0\nvt 1 0 0.5\nvt 1 2\nvt 0 2\n";
    EXPECT_EQ(import("a.obj", kQuadObj + uvs + "f 1/1 2/2 3/3 4/4\n").uvs, kQuadUvs);
    EXPECT_EQ(import("b.obj", kQuadObj + uvs + "f 1/-4/7 2/-3/7 3/-2/7 4/-1/7\n").uvs, kQuadUvs);
    EXPECT_EQ(import("c.obj", kQuadObj + "f 1/1 2/2 3/3 4/4\n" + uvs).uvs, kQuadUvs) << "they may follow";
    EXPECT_TRUE(import("d.obj", kQuadObj + uvs + "f 1 2 3 4\n").uvs.empty());
    expectFault("e.obj", kQuadObj + uvs + "f 1/1 2/2 3/3 4/5\n", "texture coordinates 5, but there are only 4");
    expectFault("f.obj", kQuadObj + uvs + "f 1/1 2/2 3/3 4/x\n", "texture coordinates '4/x', which does not exist");
    expectFault("g.obj", kQuadObj + "vt one\nf 1 2 3\n", "texture coordinates 1 are no numbers");
}

TEST_F(ImportMesh, FacesWithoutUvsSayso)
{
    const std::string faces = "f 1 2 3\nf 1/1 3/2 4/3\nf 1/1 2 3/1\n";
    const SourceMesh mesh = import("a.obj", kQuadObj + "vt 0 0\nvt 1 0\nvt 1 2\n" + faces);
    ASSERT_EQ(mesh.uvs.size(), 3U);
    EXPECT_FALSE(mesh.hasUvs(0));
    EXPECT_TRUE(mesh.hasUvs(1));
    EXPECT_FALSE(mesh.hasUvs(2)) << "all corners or none";
}

TEST_F(ImportMesh, UnusableUvsAreNone)
{
    for (const char* bad : {"nan 0", "0 inf", "2e6 0", "0 -2e6"}) {
        const std::string uvs = "vt 0 0\nvt 1 0\nvt -1 -1\nvt " + std::string(bad) + "\n";
        const SourceMesh mesh = import("a.obj", kQuadObj + uvs + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 1/3 2/3 4/3\n");
        ASSERT_EQ(mesh.uvs.size(), 3U);
        EXPECT_TRUE(mesh.hasUvs(0));
        EXPECT_FALSE(mesh.hasUvs(1)) << bad;
        EXPECT_FALSE(mesh.hasUvs(2)) << "marked as untextured";
    }
}

TEST_F(ImportMesh, TheTurnedDiagonalTakesItsUvsAlong)
{
    const SourceMesh mesh =
        import("dart.obj", "v 0 0 0\nv 1 -1 0\nv 4 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 2 0\nvt 3 0\nf 2/2 3/3 4/4 1/1\n");
    for (std::size_t t = 0; t < 2; ++t) {
        for (std::size_t k = 0; k < 3; ++k) { EXPECT_EQ(mesh.uvs[t][k].x(), static_cast<float>(mesh.triangles[t][k])); }
    }
    const SourceMesh concave =
        import("arrow.obj", "v 0 0 0\nv 2 -2 0\nv 1 0 0\nv 2 2 0\nvt 0 0\nvt 1 0\nvt 2 0\nvt 3 0\nf 2/2 3/3 4/4 1/1\n");
    EXPECT_EQ(concave.triangles.front()[2], 0U) << "the diagonal is turned";
    for (std::size_t t = 0; t < 2; ++t) {
        for (std::size_t k = 0; k < 3; ++k) { EXPECT_EQ(concave.uvs[t][k].x(), static_cast<float>(concave.triangles[t][k])); }
    }
}

std::string quadPly(const std::string& vertexProperties, const std::string& faceProperties,
                    const std::array<std::string, 4>& ofVertices, const std::string& ofFace)
{
    std::string text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n" +
                       vertexProperties + "element face 1\nproperty list uchar int vertex_indices\n" + faceProperties +
                       "end_header\n";
    const std::array<const char*, 4> points{"0 0 0 ", "1 0 0 ", "1 1 0 ", "0 1 0 "};
    for (std::size_t v = 0; v < 4; ++v) { text += points[v] + ofVertices[v] + "\n"; }
    return text + "4 0 1 2 3 " + ofFace + "\n";
}

TEST_F(ImportMesh, ReadsUvsFromPly)
{
    using Names = std::pair<const char*, const char*>;
    for (const auto& [u, v] : {Names("s", "t"), Names("u", "v"), Names("texture_u", "texture_v"), Names("texture_s", "texture_t")}) {
        const std::string properties = std::string("property float ") + u + "\nproperty double " + v + "\n";
        EXPECT_EQ(import("a.ply", quadPly(properties, "", {"0 0", "1 0", "1 2", "0 2"}, "")).uvs, kQuadUvs) << u;
    }
    const std::string texcoord = "property list uchar float texcoord\n";
    EXPECT_EQ(import("b.ply", quadPly("", texcoord, {"", "", "", ""}, "8 0 0 1 0 1 2 0 2")).uvs, kQuadUvs);
    EXPECT_TRUE(import("c.ply", quadPly("", texcoord, {"", "", "", ""}, "0")).uvs.empty());
    EXPECT_TRUE(import("d.ply", quadPly("", texcoord, {"", "", "", ""}, "6 0 0 1 0 1 2")).uvs.empty());
    EXPECT_TRUE(import("e.ply", quadPly("property float s\n", "", {"0", "1", "1", "0"}, "")).uvs.empty());
    EXPECT_EQ(import("f.ply", quadPly("property float s\nproperty float t\n", texcoord, {"7 7", "7 7", "7 7", "7 7"},
                                      "8 0 0 1 0 1 2 0 2"))
                  .uvs,
              kQuadUvs)
        << "the faces' are the more exact ones";
}

TEST_F(ImportMesh, ReadsColours)
{
    const std::string bytes = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    const std::array<std::string, 4> ofVertices{"1 2 3", "255 0 0", "0 255 0", "0 0 255"};
    const std::vector<Rgba> opaque{{1, 2, 3, 255}, {255, 0, 0, 255}, {0, 255, 0, 255}, {0, 0, 255, 255}};
    EXPECT_EQ(import("a.ply", quadPly(bytes, "", ofVertices, "")).colors, opaque);
    const std::string floats =
        "property float red\nproperty float green\nproperty float blue\nproperty ushort alpha\n";
    const std::array<std::string, 4> precise{"0 0.5 1 0", "2 -1 nan 65535", "0 0 0 32768", "1 1 1 65535"};
    EXPECT_EQ(import("b.ply", quadPly(floats, "", precise, "")).colors,
              (std::vector<Rgba>{{0, 128, 255, 0}, {255, 0, 0, 255}, {0, 0, 0, 128}, {255, 255, 255, 255}}));
    const SourceMesh obj = import("c.obj", "v 0 0 0\nv 1 0 0 0 0.5 1\nv 1 1 0 1\nf 1 2 3\n");
    EXPECT_EQ(obj.colors, (std::vector<Rgba>{{255, 255, 255, 255}, {0, 128, 255, 255}, {255, 255, 255, 255}}));
    EXPECT_TRUE(import("d.obj", kQuadObj + "f 1 2 3\n").colors.empty());
}

TEST_F(ImportMesh, FansPolygonsAndKeepsShortOnesForTheCleaning)
{
    EXPECT_EQ(import("p.obj", kQuadObj + "v -1 .5 0\nf 1 2 3 4 5\n").triangles,
              (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
    SourceMesh mesh = import("s.obj", kQuadObj + "f 1 2\nf 1 2 3\nf 4\n");
    EXPECT_EQ(cleanMesh(mesh).degenerateFaces, 2U);
}

std::string binaryStl(std::uint32_t declared, int facets, const std::string& header = "made by a test")
{
    std::string content = header;
    content.resize(80, ' ');
    put(content, declared);
    for (int f = 0; f < facets; ++f) {
        const auto shift = static_cast<float>(f);
        for (const float v : {0.F, 0.F, 1.F, shift, 0.F, 0.F, shift + 1.F, 0.F, 0.F, shift, 1.F, 0.F}) {
            put(content, v);
        }
        put(content, std::uint16_t{0});
    }
    return content;
}

const std::string kFacet = "facet normal 0 0 1\n outer loop\n vertex 0 0 0\n vertex 1e-40 0 0\n vertex 0 1e-40 0\n"
                           " endloop\nendfacet\n";

TEST_F(ImportMesh, ReadsBothKindsOfStl)
{
    const SourceMesh binary = import("b.stl", binaryStl(2, 2));
    EXPECT_EQ(binary.triangles, (std::vector<Triangle>{{0, 1, 2}, {3, 4, 5}}));
    EXPECT_EQ(binary.positions[4], Vector3d(2, 0, 0));
    EXPECT_EQ(import("s.stl", binaryStl(2, 2, "solid facet")).triangles.size(), 2U)
        << "a binary file that calls itself solid";
    SourceMesh text =
        import("t.stl", "solid vertex facet\n" + kFacet + "endsolid vertex\nSOLID b\n" + kFacet + "endsolid\n");
    EXPECT_EQ(text.triangles.size(), 2U);
    EXPECT_EQ(text.positions[1], Vector3d(1e-40, 0, 0)) << "no welding of what is merely near";
    EXPECT_EQ(cleanMesh(text).duplicateFaces, 1U);
}

TEST_F(ImportMesh, NamesTheFaultOfFilesThatAreNone)
{
    expectFaultAt(_folder.file("missing.ply"), "no such file");
    std::string garbage;
    for (int i = 0; i < 5000; ++i) { garbage += static_cast<char>(i * 37 % 251); }
    for (const char* extension : {"ply", "obj", "off", "stl"}) {
        const std::string folder = _folder.file("folder.") + extension;
        fs::create_directory(folder);
        expectFaultAt(folder, "not a regular file");
        expectFault(std::string("empty.") + extension, "", "empty");
        expectFault(std::string("garbage.") + extension, garbage, "");
    }
    expectFault("mesh.gltf", "{}", "unknown format '.gltf' (known: meshes .ply, .obj, .off, .stl; heights .png, .tif, .exr, .hgt)");
    expectFault("none", "ply", "unknown format ''");
    expectFault("points.obj", kQuadObj, "no faces");
    expectFault("nothing.ply", plyHeader("ascii", "0", "0"), "no vertices");
}

TEST_F(ImportMesh, NoticesTruncationAtEveryByte)
{
    std::string binary = plyHeader("binary_little_endian", "3", "1");
    for (const float v : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, 1.F, 0.F}) { put(binary, v); }
    put(binary, std::uint8_t{3});
    for (const std::int32_t index : {0, 1, 2}) { put(binary, index); }
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
    const std::array<std::pair<const char*, std::string>, 5> files{
        {{"t.ply", binary},
         {"a.ply", plyHeader("ascii", "3", "1") + points + "3 0 1 2"},
         {"t.off", "OFF\n3 1 0\n" + points + "3 0 1 2"},
         {"t.stl", binaryStl(2, 2)},
         {"a.stl", "solid\n" + kFacet + "endsolid"}}};
    for (const auto& [name, content] : files) {
        EXPECT_NO_THROW(import(name, content)) << name;
        for (std::size_t bytes = 0; bytes < content.size(); ++bytes) {
            EXPECT_THROW(import(name, content.substr(0, bytes)), AssetError) << name << " cut to " << bytes;
        }
    }
}

TEST_F(ImportMesh, BelievesNoCountThatTheFileCannotHold)
{
    for (const char* format : {"ascii", "binary_little_endian"}) {
        expectFault("v.ply", plyHeader(format, "4000000000", "1") + "0 0 0\n", "declares 4000000000");
        expectFault("f.ply", plyHeader(format, "0", "4000000000") + "0 0 0\n", "declares 4000000000");
        expectFault("h.ply", plyHeader(format, "99999999999999999999", "1"), "bad number");
        expectFault("n.ply", plyHeader(format, "-3", "1"), "bad number");
    }
    expectFault("v.off", "OFF\n4000000000 1 0\n0 0 0\n", "declares 4000000000");
    expectFault("f.off", "OFF\n1 4000000000 0\n0 0 0\n", "declares 4000000000");
    expectFault("p.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n2000000000 0 1 2\n", "face 0");
    expectFault("s.stl", binaryStl(0xFFFFFFF0U, 1), "declares");
    expectFault("s.stl", binaryStl(5, 4), "declares 5");
    std::string list = plyHeader("binary_little_endian", "1", "1");
    list.replace(list.find("list uchar"), 10, "list uint");
    for (const float v : {0.F, 0.F, 0.F}) { put(list, v); }
    put(list, std::uint32_t{0xFFFFFFF0U});
    expectFault("l.ply", list, "truncated");
}

TEST_F(ImportMesh, TakesOneElementOfEachKind)
{
    // Indices would be checked against the second one's number, texture coordinates be those of another.
    const std::string ply = plyHeader("ascii", "3", "1");
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
    for (const std::string element : {"vertex", "face"}) {
        std::string twice = ply;
        twice.insert(twice.find("element face"), "element " + element + " 9\n" + (element == "face" ? "property list uchar int a\n" : ""));
        expectFault("twice.ply", twice + points + "3 0 1 8\n", "two elements '" + element + "'");
    }
}

TEST_F(ImportMesh, NamesTheVertexThatIsNoPosition)
{
    const auto ply = [](const std::string& y) {
        return plyHeader("ascii", "3", "1") + "0 0 0\n1 " + y + " 0\n0 1 0\n3 0 1 2\n";
    };
    expectFault("nan.ply", ply("nan"), "vertex 1 ");
    expectFault("inf.ply", ply("-inf"), "not finite");
    expectFault("over.ply", ply("1e400"), "not finite");
    expectFault("large.ply", ply("-1e151"), "larger than 1e150");
    expectFault("word.ply", ply("abc"), "'abc' is not a number");
    EXPECT_EQ(import("under.ply", ply("1e-400")).positions[1], Vector3d(1, 0, 0));
    expectFault("nan.obj", "v 0 0 0\nv 0 nan 0\nv 1 1 1\nf 1 2 3\n", "vertex 1 ");
    expectFault("short.obj", "v 0 0 0\nv 0 1\nv 1 1 1\nf 1 2 3\n", "line 2: vertex 2");
    expectFault("nan.off", "OFF\n3 1 0\n0 0 0\n0 nan 0\n1 1 1\n3 0 1 2\n", "vertex 1 ");
    std::string stl = binaryStl(1, 1);
    const float nan = std::numeric_limits<float>::quiet_NaN();
    std::memcpy(&stl[84 + 12 + 12], &nan, sizeof nan);
    expectFault("nan.stl", stl, "vertex 1 ");
}

TEST_F(ImportMesh, NamesTheFaceWhoseIndexIsOutOfRange)
{
    expectFault("o.obj", kQuadObj + "f 1 2 3\nf 1 2 9\nf 1 2 7\n", "line 6: face 2 refers to vertex 9");
    expectFault("z.obj", kQuadObj + "f 0 1 2\n", "face 1 refers to vertex '0'");
    expectFault("n.obj", kQuadObj + "f 1 2 3\nf 1 2 -5\n", "face 2 refers to vertex '-5'");
    expectFault("w.obj", kQuadObj + "f 1 x 3\n", "face 1 refers to vertex 'x'");
    const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
    expectFault("o.ply", plyHeader("ascii", "3", "2") + points + "3 0 1 2\n3 0 1 3\n", "face 1 refers to vertex 3");
    expectFault("n.ply", plyHeader("ascii", "3", "1") + points + "3 0 1 -1\n", "face 0 refers to vertex -1");
    expectFault("o.off", "OFF\n3 1 0\n" + points + "3 0 1 3\n", "face 0 refers to vertex 3");
}

// ----------------------------------------------------------------------------------------------------- real models ---

const char* dataFolder()
{
    return std::getenv("OSGTESSLOD_DATA");
}

struct Cleaned {
    SourceMesh mesh;
    CleaningReport report;
};

Cleaned clean(const std::string& file)
{
    Cleaned c{importMesh(std::string(dataFolder()) + "/" + file), {}};
    c.report = cleanMesh(c.mesh);
    return c;
}

TEST(RealModels, AllBecomeOrientedManifolds)
{
    if (!dataFolder()) { GTEST_SKIP() << "OSGTESSLOD_DATA is not set"; }
    int seen = 0;
    for (const char* folder : {"scans", "nasty", "textured"}) {
        for (const auto& entry : fs::directory_iterator(fs::path(dataFolder()) / folder)) {
            const std::string extension = entry.path().extension().string();
            if (extension != ".ply" && extension != ".obj" && extension != ".stl") { continue; }
            SourceMesh mesh = importMesh(entry.path().string());
            cleanMesh(mesh);
            EXPECT_TRUE(isOrientedManifold(mesh)) << entry.path();
            const CleaningReport again = cleanMesh(mesh);
            EXPECT_EQ(again.degenerateFaces + again.duplicateFaces + again.unreferencedVertices, 0U) << entry.path();
            ++seen;
        }
    }
    EXPECT_GE(seen, 17);
}

TEST(RealModels, ScansHaveTheirKnownTopology)
{
    if (!dataFolder()) { GTEST_SKIP() << "OSGTESSLOD_DATA is not set"; }
    const Cleaned bunny = clean("scans/bunny_69k.ply");
    EXPECT_EQ(bunny.report.boundaryEdges, 223U);
    EXPECT_EQ(bunny.report.unreferencedVertices, 1113U);
    EXPECT_EQ(eulerNumber(bunny.mesh, bunny.report), 2 - 5) << "a sphere with five holes";
    const Cleaned dragon = clean("scans/dragon_871k.ply");
    EXPECT_EQ(dragon.report.degenerateFaces, 4U);
    EXPECT_EQ(dragon.report.boundaryEdges, 0U);
    EXPECT_EQ(eulerNumber(dragon.mesh, dragon.report), 2 - 2 * 55);
    const Cleaned engine = clean("scans/engine_635k.ply");
    EXPECT_EQ(eulerNumber(engine.mesh, engine.report), 2 - 2 * 22);
    for (const char* file : {"scans/turbine_199k.ply", "scans/armadillo_86k.obj"}) {
        const Cleaned c = clean(file);
        EXPECT_EQ(eulerNumber(c.mesh, c.report), 2) << file;
        EXPECT_EQ(c.report.boundaryEdges, 0U) << file;
        EXPECT_EQ(c.report.components, 1U) << file;
    }
}

TEST(RealModels, NastyOnesHaveTheirKnownFaults)
{
    if (!dataFolder()) { GTEST_SKIP() << "OSGTESSLOD_DATA is not set"; }
    const Cleaned cow = clean("nasty/cow_nmvertex.obj");
    EXPECT_EQ(cow.report.nonManifoldVertices, 1U);
    EXPECT_EQ(cow.mesh.positions.size(), 2904U);
    const Cleaned capsule = clean("nasty/capsule.obj");
    EXPECT_EQ(capsule.report.degenerateFaces, 200U);
    EXPECT_EQ(capsule.mesh.positions.size(), 5002U);
    EXPECT_EQ(eulerNumber(capsule.mesh, capsule.report), 2);
    const Cleaned slivers = clean("nasty/sliver_tet.ply");
    EXPECT_EQ(slivers.mesh.triangles.size(), 4U);
    EXPECT_EQ(slivers.report.boundaryEdges, 0U);
    EXPECT_EQ(slivers.report.weldedVertices + slivers.report.unreferencedVertices, 5005U);
    EXPECT_EQ(clean("nasty/soup.stl").report.components, 100U);
    EXPECT_EQ(clean("nasty/dragon_vrip_res2.ply").report.duplicateFaces, 1489U);
    const Cleaned conrod = clean("nasty/conrod.stl");
    EXPECT_GT(conrod.report.flippedFaces, 1000U);
    const Cleaned cray = clean("nasty/Cray_right.obj");
    EXPECT_EQ(cray.mesh.triangles.size(), 12U);
    EXPECT_EQ(eulerNumber(cray.mesh, cray.report), 2);
}

} // namespace
} // namespace osgTessLOD::bake
