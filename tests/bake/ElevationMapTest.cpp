// SPDX-License-Identifier: MIT
// Elevation-preserving control meshes: rays and points of the source meet one to one.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/bake/ElevationMap.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/bake/VertexNormals.h>
#include <support/RayHits.h>

#include <gtest/gtest.h>

#include <tbb/global_control.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

struct Surface {
    const char* name;
    SourceMesh (*make)();
    std::size_t patches;     ///< asked for
    std::size_t mostPatches; ///< that may be left
};

std::ostream& operator<<(std::ostream& stream, const Surface& surface)
{
    return stream << surface.name;
}

const Surface kSurfaces[] = {
    {"Sphere", [] { return sphere(5); }, 8, 40},
    {"NoisySphere", [] { return noisy(sphere(5), 0.003, 1); }, 12, 400},
    {"SpikySphere", [] { return spikySphere(5); }, 8, 800},
    {"Torus", [] { return torus(60, 24); }, 24, 200},
    {"TwoHoles", [] { return blockWithTwoHoles(5); }, 120, 400},
    {"NoisyCube", [] { return noisy(cube(12), 0.002, 4); }, 24, 400},
    {"OpenGrid", [] { return openGrid(30); }, 8, 300},
    {"FlatGrid", [] { return flatGrid(24); }, 2, 200},
    {"Annulus", [] { return annulus(60, 10); }, 16, 300},
    {"TwoComponents", [] { return besideEachOther(sphere(3), torus(40, 16)); }, 40, 200},
};

class ElevationMapOf : public testing::TestWithParam<Surface> {
protected:
    static ControlMeshOptions options()
    {
        ControlMeshOptions options;
        options.patches = GetParam().patches;
        return options;
    }
};

TEST_P(ElevationMapOf, EveryRayMeetsThePatchOnce)
{
    Progress progress;
    const ElevationMap map(GetParam().make(), options(), progress);
    const std::size_t patches = map.topology().patches.size();
    RecordProperty("patches", std::to_string(patches));
    EXPECT_GE(patches, std::min<std::size_t>(GetParam().patches, map.source().triangles.size()));
    EXPECT_LE(patches, GetParam().mostPatches);
    std::mt19937 random(1);
    for (std::uint32_t p = 0; p < patches; ++p) {
        for (int i = 0; i < 50; ++i) {
            const Vector3d b = randomWeights(random);
            const SurfacePoint point = map.evaluate(p, b);
            const RayPrism& prism = map.prism(p);
            const bool isOwn = map.trianglesOf(p).size() == 1 && (point.position - prism.pointAt(b)).norm() < 1e-15;
            if (isOwn) { continue; } // a triangle of the source: there is no ray
            EXPECT_EQ(rayHits(map, p, map.trianglesOf(p), b), 1U) << "patch " << p << " at " << b.transpose();
            // On the ray, to rounding.
            EXPECT_LT((point.position - prism.pointAt(b)).cross(prism.rayAt(b).normalized()).norm(), 1e-12);
        }
    }
}

TEST_P(ElevationMapOf, EveryPointOfTheSourceIsMet)
{
    Progress progress;
    const ElevationMap map(GetParam().make(), options(), progress);
    std::vector<char> isMet(map.source().triangles.size(), 0);
    for (std::uint32_t v = 0; v < map.source().positions.size(); ++v) {
        const FacePoint& at = map.patchPointOf(v);
        const SurfacePoint point = map.evaluate(at.face, at.barycentric);
        EXPECT_LT((point.position - map.source().positions[v]).norm(), 1e-9) << "vertex " << v;
    }
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (const std::uint32_t t : map.trianglesOf(p)) { isMet[t] = 1; }
    }
    EXPECT_EQ(std::count(isMet.begin(), isMet.end(), 0), 0);
}

TEST_P(ElevationMapOf, BothSidesOfABorderAgree)
{
    Progress progress;
    const ElevationMap map(GetParam().make(), options(), progress);
    for (const PatchTopology::Edge& edge : map.topology().edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        for (const double share : {0.0, 0.13, 0.5, 0.77}) {
            std::array<Vector3d, 2> found;
            for (std::size_t which = 0; which < 2; ++which) {
                Vector3d b = Vector3d::Zero();
                b[edge.sides[which]] = which == 0 ? 1.0 - share : share;
                b[(edge.sides[which] + 1) % 3] = 1.0 - b[edge.sides[which]];
                found[which] = map.evaluate(edge.patches[which], b).position;
            }
            EXPECT_LT((found[0] - found[1]).norm(), 1e-9);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(, ElevationMapOf, testing::ValuesIn(kSurfaces),
                         [](const auto& surface) { return std::string(surface.param.name); });

} // namespace
} // namespace osgTessLOD::bake
