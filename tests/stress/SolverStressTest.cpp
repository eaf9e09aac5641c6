// SPDX-License-Identifier: MIT
// The small optimization problems of a bake with next to no solution: quadratics of vectors that hardly span anything, quadrics of
// stars that are flat, folded or points, of any magnitude.
#include <bake/BumpyMap.h>
#include <bake/SmallTopologies.h>
#include <bake/StripEdges.h>
#include <stress/RandomSource.h>
#include <stress/Stress.h>

#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/Refit.h>
#include <osgTessLOD/bake/SemidefiniteFit.h>
#include <osgTessLOD/bake/StarFlattening.h>
#include <osgTessLOD/bake/UniformLevels.h>
#include <osgTessLOD/bake/VertexPlacement.h>

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace osgTessLOD::stress {
namespace {

using namespace bake;
using Eigen::Matrix3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Vectors of lengths that differ by up to 10¹², along three directions that may nearly be one or two; some twice, some opposite,
/// some 0.
std::vector<Vector3d> nearlyDependentVectors(SourceRandom& random)
{
    const Vector3d a = random.direction();
    const Vector3d b = (a + random.magnitude(1e-15, 1.0) * random.direction()).normalized();
    const Vector3d c = (b + random.magnitude(1e-15, 1.0) * random.direction()).normalized();
    const double scale = random.magnitude(1e-12, 1e12);
    const double range = random.magnitude(1e-12, 1.0);
    std::vector<Vector3d> vectors;
    const std::uint32_t count = 1 + random.below(40);
    for (std::uint32_t k = 0; k < count; ++k) {
        const Vector3d direction =
            random.between(-1.0, 1.0) * a + random.between(-1.0, 1.0) * b + random.between(-1.0, 1.0) * c;
        vectors.push_back(scale * random.magnitude(range, 1.0) * direction);
        if (random.chance(0.1)) { vectors.push_back(-vectors.back()); }
        if (random.chance(0.1)) {
            vectors.push_back(vectors[random.below(static_cast<std::uint32_t>(vectors.size()))]);
        }
        if (random.chance(0.05)) { vectors.push_back(Vector3d::Zero()); }
    }
    return vectors;
}

/// The largest error over all directions.
double largestOf(const ViewError& error)
{
    SymmetricCoefficients q;
    for (std::size_t k = 0; k < 6; ++k) { q[static_cast<Eigen::Index>(k)] = double{error.q[k]}; }
    return std::sqrt(Eigen::SelfAdjointEigenSolver<Matrix3d>(matrixOf(q)).eigenvalues()[2]);
}

TEST(SolverStress, QuadraticsAreBoundsOfNearlyDependentVectors)
{
    Worst worst;
    Worst largest;
    for (unsigned k = 0; k < trials(300); ++k) {
        SourceRandom random(k);
        const std::vector<Vector3d> vectors = nearlyDependentVectors(random);
        double longest = 0.0;
        for (const Vector3d& v : vectors) { longest = std::max(longest, v.norm()); }
        const double offset = random.chance(0.5) ? 0.0 : longest * random.magnitude(1e-12, 10.0);
        SCOPED_TRACE(k);
        const QuadraticFit fit = fitQuadratic(vectors, offset);
        for (const float q : fit.error.q) { ASSERT_TRUE(std::isfinite(q)); }
        ASSERT_GT(fit.certificate, 0.0);
        // Where the certificate looks least: along the vectors, and across them.
        for (const Vector3d& v : vectors) {
            const Vector3d along = v.norm() > 0.0 ? v.normalized() : random.direction();
            for (const Vector3d& d : {along, Vector3d(along.unitOrthogonal()), random.direction()}) {
                const double error = v.cross(d).norm() + offset;
                // Both sides are off by some 10⁻¹⁶ of the longest vector.
                const double fitted = fit.error.evaluate({d.x(), d.y(), d.z()});
                ASSERT_GE(fitted, error - 1e-12 * (longest + offset));
                worst.add((error - fitted) / (longest + offset));
            }
        }
        // What the fit lacks where it gives up is added in all directions: 1.13 times the isotropic error in 40,000 trials. Squares
        // of errors below 10⁻¹⁹ are no normal numbers of single precision, and rounded up to what there is.
        const double isotropic = longest + offset + std::sqrt(double{std::numeric_limits<float>::min()});
        largest.add(largestOf(fit.error) / isotropic);
        ASSERT_LE(largest.value(), 1.25) << "hardly better than the isotropic error";
    }
    report("error above the quadratic, part of the longest vector", worst.value());
    report("largest error of a quadratic, parts of the isotropic one", largest.value());
}

TEST(SolverStress, SemidefiniteFitsOfNearlySingularHessians)
{
    Worst worst;
    unsigned givenUp = 0;
    for (unsigned k = 0; k < trials(300); ++k) {
        SourceRandom random(k);
        // Eigenvalues from 1 down to 10⁻¹²; those of fitQuadratic, with its least weights, are above 10⁻⁶.
        Matrix6d basis = Matrix6d::NullaryExpr([&] { return random.between(-1.0, 1.0); });
        const Matrix6d q = Eigen::HouseholderQR<Matrix6d>(basis).householderQ();
        SymmetricCoefficients eigenvalues =
            SymmetricCoefficients::NullaryExpr([&] { return random.magnitude(1e-12, 1.0); });
        const Matrix6d hessian = q * eigenvalues.asDiagonal() * q.transpose();
        const SymmetricCoefficients gradient =
            hessian * SymmetricCoefficients::NullaryExpr([&] { return random.between(-1.0, 1.0); });
        std::vector<Matrix3d> lower;
        const std::uint32_t count = 1 + random.below(20);
        for (std::uint32_t i = 0; i < count; ++i) {
            const Vector3d v = random.magnitude(1e-6, 1.0) * random.direction();
            lower.push_back(v.squaredNorm() * Matrix3d::Identity() - v * v.transpose());
        }
        const SemidefiniteFit fit = fitAbove(hessian, gradient, lower, 1e-7);
        ASSERT_TRUE(fit.x.allFinite()) << k;
        // The margin is what callers raise the result by: it has to be the true one even where the search was given up.
        ASSERT_NEAR(fit.margin, smallestMargin(fit.x, lower), 1e-9 * (1.0 + fit.x.norm())) << k;
        givenUp += fit.margin < -1e-7 ? 1 : 0;
        worst.add(-fit.margin);
    }
    report("searches given up", givenUp);
    report("worst margin below zero", worst.value());
}

/// A mesh over a small topology, its places distorted: pressed flat, drawn to a line or a point, some moved by themselves.
StripMesh degenerateMesh(const PatchTopology& topology, SourceRandom& random)
{
    StripMesh mesh(topology, 8);
    const BumpyMap map(topology, random.magnitude(1e-9, 0.3));
    Matrix3d press = random.rotation();
    press.row(0) *= random.chance(0.3) ? 0.0 : random.magnitude(1e-15, 1.0);
    press.row(1) *= random.chance(0.2) ? 0.0 : random.magnitude(1e-15, 1.0);
    press *= random.magnitude(1e-12, 1e12);
    const Vector3d far = random.chance(0.5) ? Vector3d::Zero()
                                            : Vector3d(press.norm() * random.magnitude(1.0, 1e9) * random.direction());
    for (std::uint32_t p = 0; p < mesh.patchCount(); ++p) {
        const StripLattice lattice = mesh.patch(p).lattice;
        for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
            const StripMesh::Site site{p, lattice.point(i)};
            if (!lattice.contains(site.point)) { continue; }
            const ChartPoint c = mesh.parameter(site);
            const Vector3d b = Vector3d(ChartPoint::kUnits - c.u - c.v, c.u, c.v) / ChartPoint::kUnits;
            mesh.placeAlone(site, press * map.evaluate(p, b).position + far, c);
        }
    }
    return mesh;
}

double sizeOf(const CollapseStar& star)
{
    Eigen::AlignedBox3d box;
    for (const CollapseStar::Vertex& v : star.vertices) { box.extend(v.position); }
    return box.diagonal().norm();
}

TEST(SolverStress, VerticesArePlacedInDegenerateStars)
{
    const auto topologies = smallTopologies();
    std::size_t placed = 0;
    Worst away;
    for (unsigned k = 0; k < trials(40); ++k) {
        SourceRandom random(k);
        const auto& [name, topology] = topologies[k % topologies.size()];
        SCOPED_TRACE(name + ", trial " + std::to_string(k));
        const StripMesh mesh = degenerateMesh(topology, random);
        forEachEdge(mesh, [&](StripMesh::Site from, unsigned direction) {
            const CollapseStar star = collapseStar(mesh, from, direction);
            for (const auto method :
                 {PlacementMethod::VolumeUv, PlacementMethod::Quadric, PlacementMethod::LindstromTurk}) {
                const Placement placement = placeVertex(star, method);
                if (!placement.isValid) { continue; }
                ++placed;
                ASSERT_TRUE(placement.position.allFinite());
                ASSERT_TRUE(std::isfinite(placement.residual));
                ASSERT_GE(placement.residual, 0.0);
                ASSERT_TRUE(isValid(star, placement.parameter));
                const double size = sizeOf(star);
                const double rounding = 1e-14 * star.ends[0].position.norm();
                if (method != PlacementMethod::VolumeUv) { continue; }
                // The pull to the middle keeps it near, whatever the volumes say.
                const double distance = (placement.position - star.ends[0].position).norm();
                ASSERT_LE(distance, 3.0 * size + rounding);
                if (size > rounding) { away.add(distance / size); }
            }
        });
        if (testing::Test::HasFatalFailure()) { return; }
    }
    EXPECT_GT(placed, 1000U);
    report("farthest placement from an end, sizes of the star", away.value());
}

TEST(SolverStress, RefitsOfDegenerateChartsAreNoWorse)
{
    const auto topologies = smallTopologies();
    for (unsigned k = 0; k < trials(12); ++k) {
        SourceRandom random(k);
        const auto& [name, topology] = topologies[k % topologies.size()];
        SCOPED_TRACE(name + ", trial " + std::to_string(k));
        const BumpyMap map(topology, random.magnitude(1e-12, 0.3));
        Progress progress;
        ChartSet charts = makeCharts(map, 8, progress);
        Matrix3d press = random.rotation();
        for (int row = 0; row < 2; ++row) { press.row(row) *= random.chance(0.3) ? 0.0 : random.magnitude(1e-15, 1.0); }
        press *= random.magnitude(1e-12, 1e12);
        for (PatchChart& chart : charts.charts) {
            for (Vector3d& p : chart.positions) { p = press * p; }
        }
        const LevelHierarchy levels = makeUniformLevels(topology, charts, {1, 2, 4}, progress);
        std::vector<std::vector<Vector3d>> positions;
        for (const PatchLevels& patch : levels.patches) { positions.push_back(patch.positions[2]); }
        const RefitResult result =
            refit(topology, charts, 4, std::vector<std::vector<ChartPoint>>(positions.size()), {}, positions);
        ASSERT_TRUE(std::isfinite(result.errorAfter));
        ASSERT_LE(result.errorAfter, result.errorBefore);
        for (const auto& patch : positions) {
            for (const Vector3d& p : patch) { ASSERT_TRUE(p.allFinite()); }
        }
    }
}

} // namespace
} // namespace osgTessLOD::stress
