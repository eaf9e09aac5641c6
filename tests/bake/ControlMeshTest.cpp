// SPDX-License-Identifier: MIT
// The control mesh over a suite of surfaces, by what must hold of every one: the map is a bijection that keeps topology,
// boundaries and creases.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/bake/ControlMesh.h>

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <string>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

/// Round trips, as a share of the size: the working frame's diagonal is 1.
constexpr double kRoundTrip = 1e-9;

struct Surface {
    const char* name;
    SourceMesh (*make)();
    std::size_t patches;
    long components;
    long loops;
    long genus; ///< of the first component that is not a sphere
};

std::ostream& operator<<(std::ostream& stream, const Surface& surface)
{
    return stream << surface.name;
}

const Surface kSurfaces[] = {
    {"Sphere", [] { return sphere(4); }, 8, 1, 0, 0},
    {"NoisySphere", [] { return noisy(sphere(4), 0.01, 1); }, 12, 1, 0, 0},
    {"SpikySphere", [] { return spikySphere(5); }, 8, 1, 0, 0},
    {"Torus", [] { return torus(60, 24); }, 24, 1, 0, 1},
    {"NoisyTorus", [] { return noisy(torus(60, 24), 0.004, 2); }, 24, 1, 0, 1},
    {"TwoHoles", [] { return blockWithTwoHoles(5); }, 120, 1, 0, 2},
    {"NoisyTwoHoles", [] { return noisy(blockWithTwoHoles(5), 0.008, 3); }, 60, 1, 0, 2},
    {"Cube", [] { return cube(12); }, 24, 1, 0, 0},
    {"NoisyCube", [] { return noisy(cube(12), 0.004, 4); }, 24, 1, 0, 0},
    {"OpenGrid", [] { return openGrid(30); }, 8, 1, 1, 0},
    {"FlatGrid", [] { return flatGrid(24); }, 2, 1, 1, 0},
    {"NoisyGrid", [] { return noisy(openGrid(30), 0.01, 5); }, 8, 1, 1, 0},
    {"Annulus", [] { return annulus(60, 10); }, 16, 1, 2, 0},
    {"TwoComponents", [] { return besideEachOther(sphere(3), torus(40, 16)); }, 40, 2, 0, 1},
    {"SphereAndAnnulus", [] { return besideEachOther(sphere(3), annulus(40, 8)); }, 24, 2, 2, 0},
};

ControlMeshOptions optionsFor(std::size_t patches)
{
    ControlMeshOptions options;
    options.patches = patches;
    return options;
}

ControlMesh makeControlMesh(const SourceMesh& source, std::size_t patches)
{
    Progress progress;
    return {source, optionsFor(patches), progress};
}

/// Every source vertex, as a corner of each face that has it.
void expectVerticesToReturn(const ControlMesh& map)
{
    const SourceMesh& source = map.source();
    double worst = 0.0;
    for (std::uint32_t t = 0; t < source.triangles.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const FacePoint inPatch = map.toPatch({t, Vector3d::Unit(static_cast<Eigen::Index>(k))});
            ASSERT_LT(inPatch.face, map.topology().patches.size());
            ASSERT_GE(inPatch.barycentric.minCoeff(), 0.0);
            ASSERT_NEAR(inPatch.barycentric.sum(), 1.0, 1e-12);
            const Vector3d back = map.evaluate(inPatch.face, inPatch.barycentric).position;
            worst = std::max(worst, (back - source.positions[source.triangles[t][k]]).norm());
        }
    }
    EXPECT_LE(worst, kRoundTrip);
}

void expectSourcePointsToReturn(const ControlMesh& map, int count)
{
    const SourceMesh& source = map.source();
    std::mt19937 random(11);
    std::uniform_int_distribution<std::uint32_t> anyFace(0, static_cast<std::uint32_t>(source.triangles.size() - 1));
    double worst = 0.0;
    for (int i = 0; i < count; ++i) {
        const FacePoint point{anyFace(random), randomWeights(random)};
        const FacePoint inPatch = map.toPatch(point);
        const FacePoint back = map.toSource(inPatch);
        worst = std::max(worst, (map.position(back) - map.position(point)).norm());
    }
    EXPECT_LE(worst, kRoundTrip);
}

void expectPatchPointsToReturn(const ControlMesh& map, int count)
{
    std::mt19937 random(12);
    std::uniform_int_distribution<std::uint32_t> anyPatch(
        0, static_cast<std::uint32_t>(map.topology().patches.size() - 1));
    double worst = 0.0;
    for (int i = 0; i < count; ++i) {
        const FacePoint point{anyPatch(random), randomWeights(random)};
        const FacePoint onSource = map.toSource(point);
        const FacePoint back = map.toPatch(onSource);
        worst = std::max(worst, (map.position(map.toSource(back)) - map.position(onSource)).norm());
    }
    EXPECT_LE(worst, kRoundTrip);
}

/// Directed edges that no triangle runs the other way.
std::vector<std::pair<std::uint32_t, std::uint32_t>> boundaryEdges(const SourceMesh& mesh)
{
    std::set<std::pair<std::uint32_t, std::uint32_t>> directed;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) { directed.insert({t[k], t[(k + 1) % 3]}); }
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& [a, b] : directed) {
        if (directed.count({b, a}) == 0) { edges.emplace_back(a, b); }
    }
    return edges;
}

double distanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b)
{
    const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
    return (p - a - t * (b - a)).norm();
}

bool isOpen(const ControlMesh& map, std::uint32_t patch, unsigned side)
{
    return map.topology().edges[map.topology().patchEdges[patch][side]].patches[1] == kNoPatch;
}

/// Boundary vertices lie on open sides, or on a corner that is one's end. A weight of theirs is zero up to rounding: a point
/// of an edge that no collapse lays on its straight line is an interpolated one.
void expectBoundaryOnOpenBorders(const ControlMesh& map)
{
    constexpr double kOnSide = 1e-12;
    std::set<std::uint32_t> openCorners; // base vertices
    for (const auto& edge : map.topology().edges) {
        if (edge.patches[1] == kNoPatch) { openCorners.insert(edge.vertices.begin(), edge.vertices.end()); }
    }
    for (const auto& [v, ignored] : boundaryEdges(map.source())) {
        const FacePoint p = map.patchPointOf(v);
        double nearest = 1.0;
        for (unsigned k = 0; k < 3; ++k) {
            if (isOpen(map, p.face, k)) { nearest = std::min(nearest, p.barycentric[(k + 2) % 3]); }
            if (openCorners.count(map.topology().patches[p.face][k]) != 0) {
                nearest = std::min(nearest, 1.0 - p.barycentric[k]);
            }
        }
        EXPECT_LE(nearest, kOnSide) << "source vertex " << v;
    }
}

/// The other way: open sides map to the source's boundary.
void expectOpenBordersOnBoundary(const ControlMesh& map)
{
    const auto boundary = boundaryEdges(map.source());
    const auto& positions = map.source().positions;
    for (const auto& edge : map.topology().edges) {
        if (edge.patches[1] != kNoPatch) { continue; }
        for (int i = 0; i <= 40; ++i) {
            Vector3d b = Vector3d::Zero();
            b[edge.sides[0]] = 1.0 - i / 40.0;
            b[(edge.sides[0] + 1) % 3] = i / 40.0;
            const Vector3d at = map.evaluate(edge.patches[0], b).position;
            double nearest = 1.0;
            for (const auto& [from, to] : boundary) {
                nearest = std::min(nearest, distanceToSegment(at, positions[from], positions[to]));
            }
            EXPECT_LE(nearest, kRoundTrip) << "patch " << edge.patches[0];
        }
    }
}

void expectContinuousBorders(const ControlMesh& map)
{
    double worst = 0.0;
    for (const auto& edge : map.topology().edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        for (const double t : {0.0, 1e-6, 0.03125, 0.1, 1.0 / 3.0, 0.5, 0.62, 0.9, 0.99999, 1.0}) {
            std::array<Vector3d, 2> position;
            for (unsigned which = 0; which < 2; ++which) {
                const double along = which == 0 ? t : 1.0 - t;
                Vector3d b = Vector3d::Zero();
                b[edge.sides[which]] = 1.0 - along;
                b[(edge.sides[which] + 1) % 3] = along;
                position[which] = map.evaluate(edge.patches[which], b).position;
            }
            worst = std::max(worst, (position[0] - position[1]).norm());
        }
    }
    EXPECT_LE(worst, kRoundTrip);
}

void expectCornersAtBaseVertices(const ControlMesh& map)
{
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (Eigen::Index k = 0; k < 3; ++k) {
            const std::uint32_t vertex = map.baseVertices()[map.topology().patches[p][static_cast<std::size_t>(k)]];
            EXPECT_LE((map.evaluate(p, Vector3d::Unit(k)).position - map.source().positions[vertex]).norm(), 1e-12);
        }
    }
}

class ControlMeshOf : public testing::TestWithParam<Surface> {
protected:
    SourceMesh source() const { return GetParam().make(); }
    ControlMesh map() const { return makeControlMesh(source(), GetParam().patches); }
};

TEST_P(ControlMeshOf, SourceIsWhatItIsMeantToBe)
{
    const SourceMesh mesh = source();
    EXPECT_TRUE(isOrientedManifold(mesh));
    const auto components = topologyOf(mesh.positions.size(), mesh.triangles);
    EXPECT_EQ(static_cast<long>(components.size()), GetParam().components);
    long loops = 0;
    long genus = 0;
    for (const auto& component : components) {
        loops += component.boundaryLoops;
        genus += component.genus();
    }
    EXPECT_EQ(loops, GetParam().loops);
    EXPECT_EQ(genus, GetParam().genus);
}

TEST_P(ControlMeshOf, TopologyIsKept)
{
    const ControlMesh map = this->map();
    SourceMesh base;
    base.triangles = map.topology().patches;
    for (const std::uint32_t v : map.baseVertices()) { base.positions.push_back(map.source().positions[v]); }
    EXPECT_TRUE(isOrientedManifold(base));
    EXPECT_EQ(topologyOf(base.positions.size(), base.triangles),
              topologyOf(map.source().positions.size(), map.source().triangles));
    EXPECT_LT(base.triangles.size(), map.source().triangles.size() / 4) << "it did collapse";
    EXPECT_GE(base.triangles.size() + 1, GetParam().patches) << "and not too far";
    expectCornersAtBaseVertices(map);
}

TEST_P(ControlMeshOf, EveryLocalMapIsABijection)
{
    const ControlMesh map = this->map();
    EXPECT_NO_THROW(map.history().validate());
    EXPECT_NO_THROW(map.stretchMap().validate());
    EXPECT_EQ(map.stretchMap().keptPatches(), 0U);
}

TEST_P(ControlMeshOf, SourceVerticesReturn)
{
    expectVerticesToReturn(map());
}
TEST_P(ControlMeshOf, SourcePointsReturn)
{
    expectSourcePointsToReturn(map(), 10000);
}
TEST_P(ControlMeshOf, PatchPointsReturn)
{
    expectPatchPointsToReturn(map(), 10000);
}
TEST_P(ControlMeshOf, BordersAreContinuous)
{
    expectContinuousBorders(map());
}

TEST_P(ControlMeshOf, BoundaryMapsToOpenBorders)
{
    const ControlMesh map = this->map();
    EXPECT_EQ(boundaryEdges(map.source()).empty(), GetParam().loops == 0);
    expectBoundaryOnOpenBorders(map);
    expectOpenBordersOnBoundary(map);
}

TEST_P(ControlMeshOf, NormalsAreOfTheSurface)
{
    // Unit, and on the side of the face they belong to; noise may turn them far, but not over.
    const ControlMesh map = this->map();
    std::mt19937 random(13);
    std::uniform_int_distribution<std::uint32_t> anyPatch(
        0, static_cast<std::uint32_t>(map.topology().patches.size() - 1));
    for (int i = 0; i < 1000; ++i) {
        const FacePoint point{anyPatch(random), randomWeights(random)};
        const auto& t = map.source().triangles[map.toSource(point).face];
        const auto& p = map.source().positions;
        const Vector3d face = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).normalized();
        const Vector3d normal = map.evaluate(point.face, point.barycentric).normal;
        EXPECT_NEAR(normal.norm(), 1.0, 1e-12);
        EXPECT_GT(normal.dot(face), 0.0);
    }
}

TEST_P(ControlMeshOf, SameInputSameMapWhateverTheThreads)
{
    const ControlMesh first = map();
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const ControlMesh second = map();
    ASSERT_EQ(first.topology().patches, second.topology().patches);
    ASSERT_EQ(first.baseVertices(), second.baseVertices());
    std::mt19937 random(14);
    std::uniform_int_distribution<std::uint32_t> anyPatch(
        0, static_cast<std::uint32_t>(first.topology().patches.size() - 1));
    for (int i = 0; i < 2000; ++i) {
        const FacePoint point{anyPatch(random), randomWeights(random)};
        const SurfacePoint a = first.evaluate(point.face, point.barycentric);
        const SurfacePoint b = second.evaluate(point.face, point.barycentric);
        ASSERT_EQ(a.position, b.position);
        ASSERT_EQ(a.normal, b.normal);
    }
}

INSTANTIATE_TEST_SUITE_P(Suite, ControlMeshOf, testing::ValuesIn(kSurfaces),
                         [](const auto& test) { return std::string(test.param.name); });

// --------------------------------------------------------------------------------------------------------- creases ---

TEST(ControlMeshCreases, NoPatchOfACubeSpansTwoSides)
{
    const ControlMesh map = makeControlMesh(cube(10), 24);
    const double half = map.source().positions[0].cwiseAbs().maxCoeff();
    std::mt19937 random(15);
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        // Planes x, y, z = ±half that still hold all points so far.
        std::array<bool, 6> holds{true, true, true, true, true, true};
        for (int i = 0; i < 200; ++i) {
            const Vector3d at = map.evaluate(p, randomWeights(random)).position;
            for (std::size_t side = 0; side < 6; ++side) {
                const double coordinate = at[static_cast<Eigen::Index>(side / 2)];
                holds[side] = holds[side] && std::fabs(coordinate - (side % 2 == 0 ? half : -half)) < 1e-9;
            }
        }
        EXPECT_EQ(std::count(holds.begin(), holds.end(), true), 1) << "patch " << p;
    }
}

TEST(ControlMeshCreases, CreaseVerticesLieOnPatchBordersAndCornersOnCorners)
{
    const ControlMesh map = makeControlMesh(cube(10), 24);
    const auto& positions = map.source().positions;
    const double half = positions[0].cwiseAbs().maxCoeff();
    std::size_t creases = 0;
    std::size_t corners = 0;
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
        const auto extremes = (positions[v].array().abs() > half - 1e-9).count();
        if (extremes < 2) { continue; }
        const FacePoint p = map.patchPointOf(v);
        if (extremes == 2) {
            ++creases;
            EXPECT_LE(p.barycentric.minCoeff(), 1e-12);
        } else {
            ++corners;
            EXPECT_GE(p.barycentric.maxCoeff(), 1.0 - 1e-12);
        }
    }
    EXPECT_EQ(creases, 12U * 9U);
    EXPECT_EQ(corners, 8U);
}

TEST(ControlMeshCreases, NormalsAreSharpAtThem)
{
    const ControlMesh map = makeControlMesh(cube(10), 24);
    std::mt19937 random(16);
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (int i = 0; i < 50; ++i) {
            EXPECT_NEAR(map.evaluate(p, randomWeights(random)).normal.cwiseAbs().maxCoeff(), 1.0, 1e-6);
        }
    }
}

// ---------------------------------------------------------------------------------------------------------- limits ---

TEST(ControlMeshLimits, TheSmallestMeshesStayAsTheyAre)
{
    SourceMesh triangle;
    triangle.name = "triangle";
    triangle.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    triangle.triangles = {{0, 1, 2}};
    normalizeFrame(triangle);
    const ControlMesh one = makeControlMesh(triangle, 0);
    EXPECT_EQ(one.topology().patches.size(), 1U);
    EXPECT_EQ(one.history().stepCount(), 0U);
    expectVerticesToReturn(one);
    expectSourcePointsToReturn(one, 100);

    SourceMesh tetrahedron;
    tetrahedron.name = "tetrahedron";
    tetrahedron.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tetrahedron.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    normalizeFrame(tetrahedron);
    const ControlMesh four = makeControlMesh(tetrahedron, 4);
    EXPECT_EQ(four.topology().patches.size(), 4U);
    EXPECT_EQ(four.history().stepCount(), 0U);
    expectVerticesToReturn(four);
}

TEST_P(ControlMeshOf, AskedForOnePatchItStopsWhereTopologyEnds)
{
    const ControlMesh map = makeControlMesh(source(), 1);
    EXPECT_EQ(topologyOf(map.baseVertices().size(), map.topology().patches),
              topologyOf(map.source().positions.size(), map.source().triangles));
    EXPECT_NO_THROW(map.history().validate());
    EXPECT_NO_THROW(map.stretchMap().validate());
    EXPECT_EQ(map.stretchMap().keptPatches(), 0U);
    expectContinuousBorders(map);
}

TEST(ControlMeshLimits, PatchCountFollowsTheSourceUnlessAskedFor)
{
    ControlMeshOptions options;
    options.trianglesPerPatch = 100.0;
    Progress progress;
    const ControlMesh map(sphere(5), options, progress); // 8192 triangles
    EXPECT_GE(map.topology().patches.size(), 80U);
    EXPECT_LE(map.topology().patches.size(), 83U);
}

TEST(ControlMeshLimits, ValenceIsBounded)
{
    const ControlMesh map = makeControlMesh(sphere(5), 100);
    std::vector<unsigned> valence(map.baseVertices().size(), 0);
    for (const auto& patch : map.topology().patches) {
        for (const std::uint32_t v : patch) { ++valence[v]; }
    }
    EXPECT_LE(*std::max_element(valence.begin(), valence.end()), ControlMeshOptions{}.maxValence);
}

// ----------------------------------------------------------------------------------------------------- real models ---

class ControlMeshOfScan : public testing::TestWithParam<const char*> {};

TEST_P(ControlMeshOfScan, KeepsEveryInvariant)
{
    const char* folder = std::getenv("OSGTESSLOD_DATA");
    if (folder == nullptr) { GTEST_SKIP() << "OSGTESSLOD_DATA is not set"; }
    SourceMesh source = importMesh(std::string(folder) + "/" + GetParam());
    cleanMesh(source);
    normalizeFrame(source);
    const ControlMesh map = makeControlMesh(source, 0);
    EXPECT_NO_THROW(map.history().validate());
    EXPECT_NO_THROW(map.stretchMap().validate());
    EXPECT_EQ(map.stretchMap().keptPatches(), 0U);
    EXPECT_EQ(topologyOf(map.baseVertices().size(), map.topology().patches),
              topologyOf(source.positions.size(), source.triangles));
    expectCornersAtBaseVertices(map);
    expectVerticesToReturn(map);
    expectSourcePointsToReturn(map, 10000);
    expectPatchPointsToReturn(map, 10000);
    expectContinuousBorders(map);
    expectBoundaryOnOpenBorders(map);
}

INSTANTIATE_TEST_SUITE_P(Scans, ControlMeshOfScan, testing::Values("scans/bunny_69k.ply", "scans/armadillo_86k.obj"),
                         [](const auto& test) {
                             return std::string(test.param).find("bunny") != std::string::npos ? "Bunny" : "Armadillo";
                         });

} // namespace
} // namespace osgTessLOD::bake
