// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/SemidefiniteFit.h>
#include <osgTessLOD/bake/SymmetricHull.h>

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>

namespace osgTessLOD::bake {
namespace {

using Eigen::ArrayXd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vectors = std::vector<Vector3d>;

Vectors gaussian(std::size_t count, const Vector3d& widths, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Vectors vectors(count);
    for (Vector3d& v : vectors) {
        const double x = normal(random);
        const double y = normal(random);
        const double z = normal(random);
        v = widths.cwiseProduct(Vector3d(x, y, z));
    }
    return vectors;
}

Vectors rotated(Vectors vectors)
{
    const Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1.0, 2.0, -0.5).normalized()).toRotationMatrix();
    for (Vector3d& v : vectors) { v = turn * v; }
    return vectors;
}

Vectors unit(Vectors vectors)
{
    for (Vector3d& v : vectors) { v.normalize(); }
    return vectors;
}

Vectors joined(Vectors a, const Vectors& b)
{
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

Vectors grid(int across, const std::function<Vector3d(double, double)>& at)
{
    Vectors vectors;
    for (int i = -across; i <= across; ++i) {
        for (int j = -across; j <= across; ++j) { vectors.push_back(at(i / double(across), j / double(across))); }
    }
    return vectors;
}

struct NamedSet {
    std::string name;
    Vectors vectors;
};

/// What patches give (flat, folded, isotropic) and what breaks geometry code.
std::vector<NamedSet> vectorSets()
{
    const Vector3d ones = Vector3d::Ones();
    return {
        {"one", {{0.3, -0.2, 0.5}}},
        {"one along an axis", {{0.0, 0.0, 2.0}}},
        {"two", {{1.0, 0.0, 0.0}, {0.2, 0.9, 0.1}}},
        {"three", {{1.0, 0.1, 0.0}, {0.2, 0.9, 0.1}, {0.0, -0.3, 1.1}}},
        {"axes", {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}},
        {"equal, opposite and zero", {{1.0, 2.0, 3.0}, {-1.0, -2.0, -3.0}, {0.0, 0.0, 0.0}, {1.0, 2.0, 3.0}}},
        {"parallel", rotated(gaussian(500, {0.0, 0.0, 1.0}, 1))},
        {"nearly parallel", rotated(gaussian(500, {1e-12, 1e-15, 1.0}, 2))},
        {"coplanar", rotated(gaussian(500, {0.5, 0.0, 1.0}, 3))},
        {"coplanar along an axis", gaussian(500, {0.5, 0.0, 1.0}, 4)},
        {"nearly coplanar", rotated(gaussian(500, {0.5, 1e-9, 1.0}, 5))},
        {"coplanar grid", rotated(grid(20, [](double x, double y) { return Vector3d(x, y, 0.0); }))},
        {"box", rotated(joined(grid(12, [](double x, double y) { return Vector3d(x, y, 1.0); }),
                               grid(12, [](double x, double y) { return Vector3d(1.0, x, y); })))},
        {"flat", rotated(gaussian(10000, {0.01, 0.02, 1.0}, 6))},
        {"folded", joined(rotated(gaussian(5000, {0.01, 0.02, 1.0}, 7)), gaussian(5000, {1.0, 0.05, 0.02}, 8))},
        {"isotropic", gaussian(10000, ones, 9)},
        {"sphere", unit(gaussian(3000, ones, 10))},
        {"disc", rotated(unit(gaussian(3000, {1.0, 1.0, 0.0}, 11)))},
        {"many", gaussian(100000, {1.0, 0.3, 0.1}, 12)},
    };
}

Directions randomDirections(Eigen::Index count, unsigned seed)
{
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Directions directions(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
        for (Eigen::Index k = 0; k < 3; ++k) { directions(i, k) = normal(random); }
        directions.row(i).normalize();
    }
    return directions;
}

/// Random ones, and those where errors vanish.
Directions testDirections(const Vectors& hull)
{
    Directions directions = randomDirections(20000, 77);
    Eigen::Index i = 0;
    for (const Vector3d& v : hull) {
        if (i < 1000) { directions.row(i++) = v.normalized().transpose(); }
    }
    return directions;
}

double largestNorm(const Vectors& vectors)
{
    double largest = 0.0;
    for (const Vector3d& v : vectors) { largest = std::max(largest, v.norm()); }
    return largest;
}

TEST(SymmetricHull, OfNothingIsNothing)
{
    EXPECT_TRUE(symmetricHull({}).empty());
    EXPECT_TRUE(symmetricHull({Vector3d::Zero(), Vector3d::Zero()}).empty());
}

TEST(SymmetricHull, KeepsCornersOnly)
{
    // Corners of a box, its negatives, and points on its faces, edges and inside: four pairs of corners remain.
    const Vectors box = grid(4, [](double x, double y) { return Vector3d(2.0 * x, y, 0.5); });
    Vectors hull = symmetricHull(box);
    ASSERT_EQ(hull.size(), 4U);
    for (const Vector3d& v : hull) { EXPECT_EQ(v.cwiseAbs(), Vector3d(2.0, 1.0, 0.5)); }

    hull = symmetricHull({{3.0, 0.0, 0.0}, {-1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {-3.0, 0.0, 0.0}});
    ASSERT_EQ(hull.size(), 1U);
    EXPECT_EQ(hull[0].cwiseAbs(), Vector3d(3.0, 0.0, 0.0));

    hull = symmetricHull(grid(4, [](double x, double y) { return Vector3d(x, 0.0, y); }));
    ASSERT_EQ(hull.size(), 2U);
    for (const Vector3d& v : hull) { EXPECT_EQ(v.cwiseAbs(), Vector3d(1.0, 0.0, 1.0)); }
}

TEST(SymmetricHull, KeepsEveryCornerOfASphere)
{
    const Vectors sphere = unit(gaussian(500, Vector3d::Ones(), 20));
    EXPECT_EQ(symmetricHull(sphere).size(), sphere.size());
    Vectors withInner = sphere;
    for (const Vector3d& v : sphere) { withInner.push_back(0.7 * v); }
    EXPECT_EQ(symmetricHull(withInner), sphere);
}

TEST(SymmetricHull, KeepsTheErrorInAllDirections)
{
    for (const NamedSet& set : vectorSets()) {
        const Vectors hull = symmetricHull(set.vectors);
        const Directions directions = testDirections(hull).topRows(set.vectors.size() > 20000 ? 300 : 3000);
        const double largest = largestNorm(set.vectors);
        const ArrayXd missing = squaredErrors(set.vectors, directions) - squaredErrors(hull, directions);
        EXPECT_LE(missing.maxCoeff(), 2.0 * kSymmetricHullTolerance * largest * largest) << set.name;
        for (const Vector3d& v : hull) {
            EXPECT_NE(std::find(set.vectors.begin(), set.vectors.end(), v), set.vectors.end()) << set.name;
        }
    }
}

TEST(SymmetricHull, LeavesOutWhatIsInside)
{
    for (const NamedSet& set : vectorSets()) {
        const std::size_t kept = symmetricHull(set.vectors).size();
        if (set.name == "coplanar grid") { EXPECT_LE(kept, 2U + 4U * 20U); } // rounding lifts some off the edges
        if (set.name == "flat" || set.name == "folded" || set.name == "isotropic") { EXPECT_LE(kept, 300U) << set.name; }
        if (set.name == "many") { EXPECT_LE(kept, 500U); }
        if (set.name == "coplanar" || set.name == "coplanar along an axis") { EXPECT_LE(kept, 30U); }
        if (set.name == "parallel") { EXPECT_EQ(kept, 1U); }
    }
}

TEST(SymmetricHull, DoesNotDependOnScale)
{
    const Vectors vectors = gaussian(3000, {1.0, 0.2, 0.05}, 21);
    const std::size_t kept = symmetricHull(vectors).size();
    for (const double scale : {std::ldexp(1.0, -300), 1e-12, 1e12, std::ldexp(1.0, 300)}) {
        Vectors scaled = vectors;
        for (Vector3d& v : scaled) { v *= scale; }
        EXPECT_EQ(symmetricHull(scaled).size(), kept) << scale;
    }
}

TEST(SemidefiniteFit, LeavesAMinimumThatIsAbove)
{
    const SemidefiniteFit fit = fitAbove(Eigen::Matrix<double, 6, 6>::Identity(),
                                         coefficientsOf(2.0 * Matrix3d::Identity()), {Matrix3d::Identity()}, 1e-9);
    EXPECT_EQ(fit.cuts, 0U);
    EXPECT_LT((fit.x - 2.0 * Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(fit.margin, 1.0, 1e-14);
}

TEST(SemidefiniteFit, ProjectsOntoTheConeOfMatricesAbove)
{
    // With the Frobenius norm (off-diagonals count twice) the nearest matrix above 0 has the negative eigenvalues cut off.
    Eigen::Matrix<double, 6, 6> hessian = Eigen::Matrix<double, 6, 6>::Identity();
    hessian.diagonal().tail<3>().setConstant(2.0);
    std::mt19937 random(30);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 50; ++trial) {
        SymmetricCoefficients start;
        for (Eigen::Index k = 0; k < 6; ++k) { start[k] = normal(random); }
        const SemidefiniteFit fit = fitAbove(hessian, hessian * start, {Matrix3d::Zero()}, 1e-9);
        const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(matrixOf(start));
        const Matrix3d expected = solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).asDiagonal() *
                                  solver.eigenvectors().transpose();
        EXPECT_GE(fit.margin, -1e-9);
        EXPECT_LT((fit.x - expected).norm(), 1e-4);
    }
}

TEST(ErrorFit, DirectionsAreUnitAndEven)
{
    const Directions directions = sphericalFibonacci(1000);
    EXPECT_LT((directions.rowwise().norm().array() - 1.0).abs().maxCoeff(), 1e-14);
    // Second moments of the sphere: one third each.
    const Matrix3d moments = directions.transpose() * directions / 1000.0;
    EXPECT_LT((moments - Matrix3d::Identity() / 3.0).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(ErrorFit, QuadraticOfOneVectorIsItsError)
{
    const Vector3d v(0.3, -0.2, 0.5);
    const QuadraticFit fit = fitQuadratic({v});
    const Directions directions = randomDirections(1000, 40);
    const ArrayXd excess = squaredErrors(fit.error, directions) - squaredErrors(Vectors{v}, directions);
    EXPECT_GE(excess.minCoeff(), 0.0);
    EXPECT_LT(excess.maxCoeff(), 1e-6 * v.squaredNorm());
    EXPECT_LT(fit.error.evaluate({v.normalized().x(), v.normalized().y(), v.normalized().z()}), 1e-3 * v.norm());
}

TEST(ErrorFit, NothingHasNoError)
{
    EXPECT_EQ(fitQuadratic({}).error, ViewError{});
    EXPECT_EQ(fitQuadratic({Vector3d::Zero()}).error, ViewError{});
    EXPECT_LT(fitIsotropic({}), 1e-40F);
    EXPECT_EQ(squaredErrors(fitMinimumVolumeEllipsoid({}), sphericalFibonacci(10)).maxCoeff(), 0.0);
    EXPECT_EQ(squaredErrors(fitLeastSquaresEllipsoid({}), sphericalFibonacci(10)).maxCoeff(), 0.0);
}

TEST(ErrorFit, NoDirectionIsUnderestimated)
{
    for (const NamedSet& set : vectorSets()) {
        const Vectors hull = symmetricHull(set.vectors);
        const Directions directions = testDirections(hull);
        const ArrayXd errors = squaredErrors(hull, directions);
        const double isotropic = fitIsotropic(set.vectors);
        EXPECT_GE(isotropic * isotropic - errors.maxCoeff(), 0.0) << set.name;
        EXPECT_GE((squaredErrors(fitQuadratic(set.vectors).error, directions) - errors).minCoeff(), 0.0) << set.name;
        if (hull.size() > 1000) { continue; } // the ellipsoids are for comparison, and slow
        const double rounding = 1e-14 * isotropic * isotropic;
        EXPECT_GE((squaredErrors(fitMinimumVolumeEllipsoid(hull), directions) - errors).minCoeff(), -rounding) << set.name;
        EXPECT_GE((squaredErrors(fitLeastSquaresEllipsoid(hull), directions) - errors).minCoeff(), -rounding) << set.name;
    }
}

/// The smallest eigenvalue of any Q − Aₖ, over the largest length squared, of all vectors, by another eigenvalue solver.
double certificateOf(const ViewError& error, const Vectors& vectors)
{
    SymmetricCoefficients q;
    for (std::size_t k = 0; k < 6; ++k) { q[static_cast<Eigen::Index>(k)] = error.q[k]; }
    double smallest = 1e300;
    for (const Vector3d& v : vectors) {
        const Matrix3d a = v.squaredNorm() * Matrix3d::Identity() - v * v.transpose();
        smallest = std::min(smallest, Eigen::SelfAdjointEigenSolver<Matrix3d>(matrixOf(q) - a).eigenvalues()[0]);
    }
    const double largest = largestNorm(vectors);
    return smallest / (largest * largest);
}

TEST(ErrorFit, NoDirectionOfManyIsUnderestimated)
{
    const Directions directions = randomDirections(200000, 78);
    for (const NamedSet& set : vectorSets()) {
        if (set.name != "flat" && set.name != "folded" && set.name != "isotropic" && set.name != "three") { continue; }
        const ArrayXd errors = squaredErrors(symmetricHull(set.vectors), directions);
        EXPECT_GE((squaredErrors(fitQuadratic(set.vectors).error, directions) - errors).minCoeff(), 0.0) << set.name;
    }
}

TEST(ErrorFit, CertificateHoldsForAllVectorsInSinglePrecision)
{
    for (const NamedSet& set : vectorSets()) {
        for (const double scale : {1e-12, 1.0, 3.7e5, 1e12}) {
            if (scale != 1.0 && set.vectors.size() > 20000) { continue; }
            Vectors vectors = set.vectors;
            for (Vector3d& v : vectors) { v *= scale; }
            const QuadraticFit fit = fitQuadratic(vectors);
            const double certificate = certificateOf(fit.error, vectors);
            EXPECT_GT(certificate, 0.0) << set.name << " times " << scale;
            EXPECT_NEAR(certificate, fit.certificate, 1e-9) << set.name << " times " << scale;
            EXPECT_LT(certificate, 1e-5) << set.name << ": could be smaller";
        }
    }
}

/// Mean and largest excess over E as a part of the largest E (Lambert §2.3).
std::array<double, 2> excessOf(const ArrayXd& squared, const ArrayXd& errors)
{
    const ArrayXd excess = squared.sqrt() - errors.max(0.0).sqrt();
    const double largest = std::sqrt(errors.maxCoeff());
    return {excess.mean() / largest, excess.maxCoeff() / largest};
}

TEST(ErrorFit, OverestimatesLittle)
{
    for (const NamedSet& set : vectorSets()) {
        const Vectors hull = symmetricHull(set.vectors);
        const Directions directions = testDirections(hull);
        const ArrayXd errors = squaredErrors(hull, directions);
        const double isotropic = fitIsotropic(hull);
        const auto constant = excessOf(ArrayXd::Constant(directions.rows(), isotropic * isotropic), errors);
        const auto quadratic = excessOf(squaredErrors(fitQuadratic(hull).error, directions), errors);
        EXPECT_LE(quadratic[0], 0.12) << set.name;
        EXPECT_LE(quadratic[1], 0.62) << set.name;
        EXPECT_LE(quadratic[0], constant[0] + 1e-3) << set.name;
        if (hull.size() > 1000) { continue; }
        const auto volume = excessOf(squaredErrors(fitMinimumVolumeEllipsoid(hull), directions), errors);
        const auto leastSquares = excessOf(squaredErrors(fitLeastSquaresEllipsoid(hull), directions), errors);
        EXPECT_LE(leastSquares[0], volume[0] * 1.05 + 1e-3) << set.name;
    }
}

TEST(ErrorFit, AnOffsetIsOnTopInEveryDirection)
{
    for (const NamedSet& set : vectorSets()) {
        if (set.vectors.size() > 20000) { continue; }
        const Directions directions = testDirections(symmetricHull(set.vectors)).topRows(5000);
        const double largest = largestNorm(set.vectors);
        for (const double part : {1e-6, 0.01, 0.3, 1.0, 100.0}) {
            const double offset = part * largest;
            const ArrayXd errors = squaredErrors(set.vectors, directions).max(0.0).sqrt() + offset;
            const ArrayXd fitted = squaredErrors(fitQuadratic(set.vectors, offset).error, directions).sqrt();
            EXPECT_GE((fitted - errors).minCoeff(), 0.0) << set.name << " + " << part;
            // Never more than what bounding each summand costs: √(c² + c|v|) − c at the worst, in direction of v.
            const ArrayXd bare = squaredErrors(fitQuadratic(set.vectors).error, directions).sqrt() + offset;
            EXPECT_LE((fitted - bare).mean(), std::sqrt(offset * offset + offset * largest) - offset) << set.name;
        }
    }
    const QuadraticFit alone = fitQuadratic({}, 0.25);
    EXPECT_NEAR(alone.error.evaluate({0.6, 0.0, 0.8}), 0.25, 1e-6);
    EXPECT_GE(alone.error.evaluate({0.6, 0.0, 0.8}), 0.25);
    EXPECT_GE(static_cast<double>(fitIsotropic({Vector3d(0.0, 0.0, 1.0)}, 0.1)), 1.1);
}

TEST(ErrorFit, ScalesWithTheVectors)
{
    const Vectors vectors = gaussian(2000, {1.0, 0.2, 0.05}, 50);
    const ViewError unitError = fitQuadratic(vectors).error;
    for (const int exponent : {-40, 40}) { // powers of two: to the bit
        Vectors scaled = vectors;
        for (Vector3d& v : scaled) { v *= std::ldexp(1.0, exponent); }
        const ViewError error = fitQuadratic(scaled).error;
        for (std::size_t k = 0; k < 6; ++k) { EXPECT_EQ(error.q[k], std::ldexp(unitError.q[k], 2 * exponent)); }
    }
    // Beyond what single precision can hold squared, still no underestimation.
    for (const double tiny : {1e-25, 1e-100, 1e-200}) {
        const Vector3d v(0.0, 0.0, tiny);
        EXPECT_GE(fitQuadratic({v}).error.evaluate({1.0, 0.0, 0.0}), tiny);
    }
}

TEST(ErrorFit, EllipsoidOfABallIsABall)
{
    const Vectors ball = unit(gaussian(400, Vector3d::Ones(), 60));
    EXPECT_LT((fitMinimumVolumeEllipsoid(ball).shape - Matrix3d::Identity()).norm(), 0.2);
    // The shadow of an ellipsoid with half axes 3, 2, 1 along its axes.
    const EllipsoidError axes{Vector3d(9.0, 4.0, 1.0).asDiagonal()};
    Directions directions(3, 3);
    directions.setIdentity();
    const ArrayXd squared = squaredErrors(axes, directions);
    EXPECT_NEAR(squared[0], 4.0, 1e-12);
    EXPECT_NEAR(squared[1], 9.0, 1e-12);
    EXPECT_NEAR(squared[2], 9.0, 1e-12);
}

} // namespace
} // namespace osgTessLOD::bake
