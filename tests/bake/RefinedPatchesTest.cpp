// SPDX-License-Identifier: MIT
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/RefinedPatches.h>

#include <gtest/gtest.h>

#include <memory>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

std::unique_ptr<ControlMesh> controlMesh(SourceMesh source, std::size_t patches)
{
    ControlMeshOptions options;
    options.patches = patches;
    Progress progress;
    return std::make_unique<ControlMesh>(std::move(source), options, progress);
}

/// Both maps, the refined one owning the other.
struct Refined {
    const ControlMesh* base;
    std::unique_ptr<RefinedPatches> map;
};

constexpr unsigned kFactor = 8;

Refined refine(std::unique_ptr<ControlMesh> base, double tolerance)
{
    Progress progress;
    Refined refined{base.get(), nullptr};
    refined.map = std::make_unique<RefinedPatches>(std::move(base), kFactor, tolerance, progress);
    return refined;
}

/// Whatever was bisected, the surface and its topology are the base map's.
void expectSameSurface(const Refined& refined)
{
    const PatchTopology& topology = refined.map->topology();
    const PatchTopology& before = refined.base->topology();
    EXPECT_GE(topology.patches.size(), before.patches.size());
    EXPECT_EQ(static_cast<long>(topology.vertexCount) - static_cast<long>(topology.edges.size()) +
                  static_cast<long>(topology.patches.size()),
              static_cast<long>(before.vertexCount) - static_cast<long>(before.edges.size()) +
                  static_cast<long>(before.patches.size()));
    std::mt19937 random(61);
    std::uniform_int_distribution<std::uint32_t> anyPatch(0, static_cast<std::uint32_t>(before.patches.size() - 1));
    for (int i = 0; i < 5000; ++i) {
        const FacePoint point{anyPatch(random), randomWeights(random)};
        const FacePoint moved = refined.map->fromBase(point);
        ASSERT_LT(moved.face, topology.patches.size());
        const FacePoint back = refined.map->toBase(moved);
        ASSERT_LT((refined.base->evaluate(back.face, back.barycentric).position -
                   refined.base->evaluate(point.face, point.barycentric).position)
                      .norm(),
                  1e-9);
        const Vector3d expected = refined.base->evaluate(point.face, point.barycentric).position;
        ASSERT_LT((refined.map->evaluate(moved.face, moved.barycentric).position - expected).norm(), 1e-9);
    }
    for (const auto& edge : topology.edges) {
        for (int i = 0; i <= 8 && edge.patches[1] != kNoPatch; ++i) {
            std::array<Vector3d, 2> position;
            for (unsigned which = 0; which < 2; ++which) {
                const double along = which == 0 ? i / 8.0 : 1.0 - i / 8.0;
                Vector3d b = Vector3d::Zero();
                b[edge.sides[which]] = 1.0 - along;
                b[(edge.sides[which] + 1) % 3] = along;
                position[which] = refined.map->evaluate(edge.patches[which], b).position;
            }
            ASSERT_LT((position[0] - position[1]).norm(), 1e-9) << "a crack";
        }
    }
}

TEST(RefinedPatches, LeavesAloneWhatIsNearEnough)
{
    const Refined refined = refine(controlMesh(sphere(4), 8), 1.0);
    EXPECT_EQ(refined.map->topology().patches, refined.base->topology().patches);
    expectSameSurface(refined);
}

TEST(RefinedPatches, BisectsWhatIsNot)
{
    const Refined coarse = refine(controlMesh(spikySphere(5), 8), 1e-2);
    const Refined fine = refine(controlMesh(spikySphere(5), 8), 4e-3);
    EXPECT_GT(coarse.map->topology().patches.size(), coarse.base->topology().patches.size());
    EXPECT_GT(fine.map->topology().patches.size(), coarse.map->topology().patches.size());
    expectSameSurface(coarse);
    expectSameSurface(fine);
}

TEST(RefinedPatches, PiecesOfARoughSurfaceAreNearEnough)
{
    constexpr double kTolerance = 0.004;
    const Refined refined = refine(controlMesh(spikySphere(5), 8), kTolerance);
    const SourceMesh& source = refined.base->source();
    Progress progress;
    ChartSet charts = makeCharts(*refined.map, kFactor, progress);
    measureChartErrors(source, refined.map->sourceSamples(), charts, progress);
    for (std::size_t p = 0; p < charts.charts.size(); ++p) {
        // Borders are sampled in one of their patches: its rounding is all that differs.
        EXPECT_LE(charts.charts[p].chartError, kTolerance + 1e-9) << "patch " << p;
    }
}

TEST(RefinedPatches, KnowsThePatchOfEachSourceVertex)
{
    const Refined refined = refine(controlMesh(spikySphere(5), 8), 1e-2);
    const auto& patches = refined.map->sourceSamples().patches;
    const std::size_t vertices = refined.base->source().positions.size();
    // A closed mesh of V vertices, E edges and F faces has all as samples.
    ASSERT_EQ(patches.size(), vertices + 5 * refined.base->source().triangles.size() / 2);
    std::size_t same = 0;
    for (std::uint32_t v = 0; v < vertices; ++v) {
        // On a border either side will do.
        same += patches[v] == refined.map->fromBase(refined.base->patchPointOf(v)).face ? 1 : 0;
    }
    EXPECT_EQ(same, vertices);
}

TEST(RefinedPatches, KeepsBoundaries)
{
    const Refined refined = refine(controlMesh(noisy(annulus(60, 10), 0.004, 62), 16), 1e-3);
    EXPECT_GT(refined.map->topology().patches.size(), refined.base->topology().patches.size());
    expectSameSurface(refined);
}

TEST(RefinedPatches, SphereOfFewestPatchesCanBeBisected)
{
    // As few patches as topology allows: neighbours share more than one edge.
    for (const std::size_t patches : {1U, 2U, 4U}) {
        auto base = controlMesh(sphere(4), patches);
        ASSERT_NO_THROW(expectSameSurface(refine(std::move(base), 2e-3))) << "asked for " << patches;
    }
}

} // namespace
} // namespace osgTessLOD::bake
