// SPDX-License-Identifier: MIT
// Stars of edges, and where their ends merge.
#include <bake/BumpyMap.h>
#include <bake/SmallTopologies.h>
#include <bake/StripEdges.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/ChartRelayout.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/VertexPlacement.h>

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Kind = CollapseStar::Kind;
using Point = StripLattice::Point;

constexpr double kUnit = 1.0 / ChartPoint::kUnits;
constexpr PlacementMethod kMethods[] = {PlacementMethod::VolumeUv, PlacementMethod::Quadric,
                                        PlacementMethod::LindstromTurk};

// Meshes refer to their topologies.
const PatchTopology kTetrahedron = tetrahedron();
const PatchTopology kTriangle = PatchTopology::build(3, {{0, 1, 2}});

/// A mesh with positions given by patch and parameters from 0 to 1.
StripMesh shaped(const PatchTopology& topology, unsigned factor,
                 const std::function<Vector3d(std::uint32_t, const Vector2d&)>& shape)
{
    StripMesh mesh(topology, factor);
    for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) {
        const StripLattice lattice = mesh.patch(p).lattice;
        for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
            if (!lattice.contains(lattice.point(i))) { continue; }
            const ChartPoint c = mesh.parameter({p, lattice.point(i)});
            mesh.placeAlone({p, lattice.point(i)}, shape(p, kUnit * Vector2d(c.u, c.v)), c);
        }
    }
    return mesh;
}

StripMesh bumpy(const PatchTopology& topology, unsigned factor)
{
    const BumpyMap map(topology);
    StripMesh mesh = shaped(topology, factor, [&](std::uint32_t p, const Vector2d& c) {
        return map.evaluate(p, {1.0 - c.x() - c.y(), c.x(), c.y()}).position;
    });
    for (const auto& edge : topology.edges) { // bit-identical
        for (unsigned step = 1; step < factor && edge.patches[1] != kNoPatch; ++step) {
            const StripMesh::Site own{edge.patches[0], mesh.patch(0).lattice.border(edge.sides[0], step)};
            mesh.place(own, mesh.position(own), mesh.parameter(own));
        }
    }
    return mesh;
}

/// Shifts interior and border vertices by up to a third of the way to their neighbours.
void jitter(StripMesh& mesh, unsigned seed)
{
    std::mt19937 random(seed);
    const auto factor = static_cast<int>(mesh.patch(0).lattice.factor());
    const int most = ChartPoint::kUnits / factor / 4;
    const auto shift = [&] { return std::uniform_int_distribution<>(-most, most)(random); };
    for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) {
        const StripLattice lattice = mesh.patch(p).lattice;
        for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
            const StripMesh::Site site{p, lattice.point(i)};
            unsigned step = 0;
            if (!lattice.contains(site.point) || lattice.isCorner(site.point)) { continue; }
            const unsigned side = lattice.sideOf(site.point, step);
            ChartPoint c = mesh.parameter(site);
            c = side == 3 ? ChartPoint{c.u + shift() / 2, c.v + shift() / 2}
                          : borderParameter(side, alongBorder(side, c) + shift() / 2);
            mesh.place(site, mesh.position(site), c);
        }
    }
    ASSERT_NO_THROW(mesh.check());
}

double directObjective(const CollapseStar& star, const Vector3d& position, ChartPoint parameter)
{
    double sum = 0.0;
    for (const auto& t : star.triangles) {
        const ChartPoint merged = star.patches[1] == kNoPatch ? parameter : star.inPart(t.part, parameter);
        for (int axis = 0; axis < 3; ++axis) {
            const auto point = [&](ChartPoint c, const Vector3d& x) {
                return Vector3d(c.u * kUnit, c.v * kUnit, x[axis]);
            };
            std::array<Vector3d, 3> corner;
            for (std::size_t k = 0; k < 3; ++k) {
                corner[k] = point(star.vertices[t.vertices[k]].parameter, star.vertices[t.vertices[k]].position);
            }
            const Vector3d n = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
            const double volume = n.dot(point(merged, position) - corner[0]);
            sum += volume * volume;
        }
    }
    return sum;
}

TEST(CollapseStar, HoldsTheTrianglesAroundEveryEdge)
{
    for (const auto& [name, topology] : smallTopologies()) {
        SCOPED_TRACE(name);
        const StripMesh mesh = bumpy(topology, 8);
        std::map<Kind, unsigned> seen;
        forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
            const CollapseStar star = collapseStar(mesh, from, k);
            ++seen[star.kind];
            EXPECT_TRUE(isPositive(star));
            std::size_t vanishing = 0;
            for (const auto& t : star.triangles) {
                vanishing += t.survives ? 0U : 1U;
                EXPECT_TRUE(mesh.patch(star.patches[t.part]).lattice.hasTriangle(t.index));
            }
            const bool isBorderEdge =
                mesh.patch(from.patch).lattice.rows(k) - 1 == mesh.patch(from.patch).lattice.place(k, from.point).row ||
                mesh.patch(from.patch).lattice.place(k, from.point).row == 0;
            if (star.kind != Kind::BorderEnd) {
                EXPECT_EQ(vanishing, isBorderEdge && star.patches[1] == kNoPatch ? 1U : 2U);
            }
            if (star.kind == Kind::Interior) { EXPECT_EQ(star.triangles.size(), 10U); }
            if (star.onBorder()) {
                EXPECT_EQ(star.isOpen, star.patches[1] == kNoPatch);
                EXPECT_LT(star.beside[0], alongBorder(star.sides[0], star.ends[0].parameter));
                EXPECT_GT(star.beside[1], alongBorder(star.sides[0], star.ends[0].parameter));
            }
        });
        EXPECT_EQ(seen.size(), 4U);
    }
}

TEST(CollapseStar, IsValidAsExactOrientationsSay)
{
    const StripMesh mesh(kTriangle, 8);
    const CollapseStar star = collapseStar(mesh, {0, {4, 4}}, 1);
    ASSERT_EQ(star.kind, Kind::Interior);
    const ChartPoint a = star.ends[0].parameter, b = star.ends[1].parameter;
    EXPECT_TRUE(isValid(star, {(a.u + b.u) / 2, (a.v + b.v) / 2}));
    EXPECT_FALSE(isValid(star, {0, 0}));
    for (const auto& v : star.vertices) {
        if (v.parameter != a && v.parameter != b) { EXPECT_FALSE(isValid(star, v.parameter)) << "degenerate"; }
    }
}

TEST(VertexPlacement, IsValidWhereverItSaysSoAndExistsOnThePattern)
{
    for (const auto& [name, topology] : smallTopologies()) {
        SCOPED_TRACE(name);
        for (const unsigned seed : {0U, 1U, 2U}) {
            StripMesh mesh = bumpy(topology, 8);
            if (seed > 0) { jitter(mesh, seed); }
            std::size_t valid = 0, invalid = 0;
            forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
                const CollapseStar star = collapseStar(mesh, from, k);
                for (const PlacementMethod method : kMethods) {
                    const Placement placement = placeVertex(star, method);
                    ++(placement.isValid ? valid : invalid);
                    if (!placement.isValid) { continue; }
                    EXPECT_TRUE(isValid(star, placement.parameter));
                    EXPECT_TRUE(placement.position.allFinite());
                    EXPECT_GE(placement.residual, 0.0);
                    if (star.kind == Kind::Corner) {
                        EXPECT_EQ(placement.parameter, star.ends[0].parameter);
                        EXPECT_EQ(placement.position, star.ends[0].position);
                    }
                    if (star.onBorder()) {
                        const std::int32_t along = alongBorder(star.sides[0], placement.parameter);
                        EXPECT_EQ(borderParameter(star.sides[0], along), placement.parameter);
                        EXPECT_GT(along, star.beside[0]);
                        EXPECT_LT(along, star.beside[1]);
                    }
                }
            });
            EXPECT_LE(invalid, seed == 0 ? 0 : valid / 50) << "seed " << seed;
        }
    }
}

TEST(VertexPlacement, ObjectiveIsTheSumOfSquaredVolumes)
{
    StripMesh mesh = bumpy(kTetrahedron, 8);
    jitter(mesh, 3);
    forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
        const CollapseStar star = collapseStar(mesh, from, k);
        const Placement placement = placeVertex(star, PlacementMethod::VolumeUv);
        const double expected = directObjective(star, placement.position, placement.parameter);
        EXPECT_NEAR(placement.residual, expected, 1e-9 * expected + 1e-22);
        const Vector3d other = placement.position + Vector3d(0.1, -0.2, 0.05);
        const double there = directObjective(star, other, placement.parameter);
        EXPECT_NEAR(volumeUvObjective(star, other, placement.parameter), there, 1e-9 * there);
    });
}

TEST(VertexPlacement, NoPlaceNearbyIsMuchBetter)
{
    StripMesh mesh = bumpy(kTetrahedron, 8);
    jitter(mesh, 4);
    std::size_t checked = 0;
    forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
        const CollapseStar star = collapseStar(mesh, from, k);
        const Placement placement = placeVertex(star, PlacementMethod::VolumeUv);
        const double middle =
            directObjective(star, 0.5 * (star.ends[0].position + star.ends[1].position), placement.parameter);
        for (int axis = 0; axis < 3 && star.kind != Kind::Corner; ++axis) {
            for (const double step : {-0.01, 0.01}) {
                const Vector3d near = placement.position + step * Vector3d::Unit(axis);
                EXPECT_GT(directObjective(star, near, placement.parameter), 0.9 * placement.residual);
            }
        }
        for (const int step : {-300, 300}) {
            if (star.kind != Kind::Interior) { continue; }
            for (const ChartPoint d : {ChartPoint{step, 0}, ChartPoint{0, step}}) {
                const ChartPoint near{placement.parameter.u + d.u, placement.parameter.v + d.v};
                if (!isValid(star, near)) { continue; }
                ++checked;
                // The best position there; the pull to the middle may cost a little.
                EXPECT_GT(directObjective(star, placement.position, near), 0.8 * placement.residual - 1e-3 * middle);
            }
        }
    });
    EXPECT_GT(checked, 500U);
}

TEST(VertexPlacement, KeepsFlatPatchesFlatForNothing)
{
    StripMesh flat = shaped(kTetrahedron, 8, [](std::uint32_t, const Vector2d&) { return Vector3d::Zero(); });
    forEachEdge(flat, [&](StripMesh::Site from, unsigned k) {
        const Placement placement = placeVertex(collapseStar(flat, from, k), PlacementMethod::VolumeUv);
        EXPECT_TRUE(placement.position.norm() < 1e-12);
        EXPECT_LT(placement.residual, 1e-24);
    });
    const StripMesh single = shaped(kTriangle, 8, [](std::uint32_t, const Vector2d& c) {
        return Vector3d(c.x() + 0.3 * c.y(), 2.0 * c.y(), 0.5 * c.x() - c.y());
    });
    forEachEdge(single, [&](StripMesh::Site from, unsigned k) {
        const CollapseStar star = collapseStar(single, from, k);
        const Placement placement = placeVertex(star, PlacementMethod::VolumeUv);
        const Vector2d c = kUnit * Vector2d(placement.parameter.u, placement.parameter.v);
        const Vector3d expected(c.x() + 0.3 * c.y(), 2.0 * c.y(), 0.5 * c.x() - c.y());
        EXPECT_LT((placement.position - expected).norm(), 1e-4);
        EXPECT_LT(placement.residual, 1e-12);
    });
}

TEST(VertexPlacement, DoesNotDependOnTheScale)
{
    const StripMesh mesh = bumpy(kTetrahedron, 8);
    const double scale = 1024.0 * 1024.0;
    StripMesh large = bumpy(kTetrahedron, 8);
    for (std::uint32_t p = 0; p < large.patchCount(); ++p) {
        const StripLattice lattice = large.patch(p).lattice;
        for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
            const StripMesh::Site site{p, lattice.point(i)};
            if (lattice.contains(site.point)) {
                large.placeAlone(site, scale * mesh.position(site), mesh.parameter(site));
            }
        }
    }
    forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
        const Placement a = placeVertex(collapseStar(mesh, from, k), PlacementMethod::VolumeUv);
        const Placement b = placeVertex(collapseStar(large, from, k), PlacementMethod::VolumeUv);
        EXPECT_EQ(a.parameter, b.parameter);
        EXPECT_LT((scale * a.position - b.position).norm(), 1e-9 * scale);
        EXPECT_NEAR(b.residual, scale * scale * a.residual, 1e-6 * b.residual);
    });
}

TEST(VertexPlacement, MovesOntoACrease)
{
    // A roof whose ridge runs between two columns of vertices, along v: contracting an edge across it must find it.
    const double ridge = 0.4;
    const StripMesh mesh = shaped(kTriangle, 16, [&](std::uint32_t, const Vector2d& c) {
        return Vector3d(c.x(), c.y(), -std::fabs(c.x() - ridge));
    });
    std::size_t crossing = 0;
    forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
        const CollapseStar star = collapseStar(mesh, from, k);
        const auto& [a, b] = star.ends;
        if (star.kind != Kind::Interior || (a.position.x() - ridge) * (b.position.x() - ridge) >= 0.0) { return; }
        if (std::fabs(a.position.y() - b.position.y()) > 0.3 * std::fabs(a.position.x() - b.position.x())) { return; }
        ++crossing;
        const Placement placement = placeVertex(star, PlacementMethod::VolumeUv);
        const double fromRidge = std::fabs(placement.position.x() - ridge);
        EXPECT_LE(fromRidge, std::max(std::fabs(a.position.x() - ridge), std::fabs(b.position.x() - ridge)));
        const double middle =
            directObjective(star, 0.5 * (a.position + b.position),
                            {(a.parameter.u + b.parameter.u) / 2, (a.parameter.v + b.parameter.v) / 2});
        EXPECT_LT(placement.residual, middle);
    });
    EXPECT_GT(crossing, 4U);
}

TEST(VertexPlacement, OfABorderIsTheSameFromBothPatches)
{
    StripMesh mesh = bumpy(kTetrahedron, 8);
    jitter(mesh, 6);
    std::size_t compared = 0;
    forEachEdge(mesh, [&](StripMesh::Site from, unsigned k) {
        const CollapseStar star = collapseStar(mesh, from, k);
        if (star.kind != Kind::BorderEdge) { return; }
        const StripLattice& lattice = mesh.patch(from.patch).lattice;
        unsigned step = 0, otherStep = 0;
        const unsigned side = lattice.sideOf(from.point, step);
        lattice.sideOf(from.point + StripLattice::direction(k), otherStep);
        const StripMesh::Site a = mesh.twin(from.patch, side, step), b = mesh.twin(from.patch, side, otherStep);
        for (unsigned j = 0; j < 3; ++j) {
            for (const auto& [start, end] : {std::pair{a, b}, std::pair{b, a}}) {
                if (start.point + StripLattice::direction(j) != end.point) { continue; }
                ++compared;
                const CollapseStar other = collapseStar(mesh, start, j);
                const Placement one = placeVertex(star, PlacementMethod::VolumeUv);
                const Placement two = placeVertex(other, PlacementMethod::VolumeUv);
                EXPECT_NEAR(alongBorder(star.sides[0], one.parameter),
                            ChartPoint::kUnits - alongBorder(other.sides[0], two.parameter), 1);
                EXPECT_LT((one.position - two.position).norm(), 1e-4);
            }
        }
    });
    EXPECT_GT(compared, 10U);
}

TEST(ChartRelayout, RepairsWhatIsTurnedOverAndLeavesTheRest)
{
    const BumpyMap map(PatchTopology::build(3, {{0, 1, 2}}));
    Progress progress;
    const ChartSet charts = makeCharts(map, 32, progress);
    const TessellationPattern pattern(32);
    StripMesh mesh = bumpy(map.topology(), 16);
    jitter(mesh, 7);
    const StripMesh before = mesh;
    const StripMesh::Site moved{0, {3, 3}}, fixed{0, {13, 13}};
    mesh.placeAlone(moved, mesh.position(moved), mesh.parameter({0, {6, 6}}));
    EXPECT_THROW(mesh.check(), std::logic_error);
    relayout(mesh, 0, pattern, charts.charts[0]);
    EXPECT_NO_THROW(mesh.check());
    for (unsigned side = 0; side < 3; ++side) {
        for (unsigned step = 0; step < 16; ++step) {
            const StripMesh::Site s{0, mesh.patch(0).lattice.border(side, step)};
            EXPECT_EQ(mesh.parameter(s), before.parameter(s));
            EXPECT_EQ(mesh.position(s), before.position(s));
        }
    }
    const ChartPoint a = mesh.parameter(fixed), b = before.parameter(fixed);
    EXPECT_LT(std::hypot(a.u - b.u, a.v - b.v), ChartPoint::kUnits / 100.0) << "far away";
    EXPECT_LT((mesh.position(fixed) - before.position(fixed)).norm(), 0.05);
}

} // namespace
} // namespace osgTessLOD::bake
