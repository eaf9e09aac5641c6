// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.2.
#include <osgTessLOD/bake/ErrorFit.h>

#include <osgTessLOD/bake/SemidefiniteFit.h>
#include <osgTessLOD/bake/SymmetricHull.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::ArrayXd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 6>;

constexpr Eigen::Index kFitDirections = 600;
/// How far below zero a constraint may end, relative to Ẽ_iso²; made up for afterwards.
constexpr double kFitTolerance = 1e-7;
/// Least certificate: what symmetricHull may leave out, and the rounding of the certificate itself.
constexpr double kLeastCertificate = 10.0 * kSymmetricHullTolerance;

/// The directions of the least squares problem: the same for every set of vectors.
struct FitDirections {
    Directions directions = sphericalFibonacci(kFitDirections);
    Rows rows; ///< rows · coefficients = dᵀXd
    FitDirections()
        : rows(kFitDirections, 6)
    {
        for (Eigen::Index i = 0; i < kFitDirections; ++i) { rows.row(i) = quadraticRow(directions.row(i)); }
    }
};

const FitDirections& fitDirections()
{
    static const FitDirections instance;
    return instance;
}

/// A set of vectors brought to its hull and to Ẽ_iso = 1.
struct NormalizedSet {
    std::vector<Vector3d> hull;
    double offset = 0.0;
    double scale = 0.0;
};

NormalizedSet normalize(const std::vector<Vector3d>& vectors, double offset)
{
    NormalizedSet set;
    set.hull = symmetricHull(vectors);
    double longest = 0.0;
    for (const Vector3d& v : set.hull) { longest = std::max(longest, v.stableNorm()); }
    set.scale = longest + offset;
    if (!(set.scale > 0.0)) { return set; }
    for (Vector3d& v : set.hull) { v /= set.scale; }
    set.offset = offset / set.scale;
    return set;
}

/// The matrices that Q must be above.
std::vector<Matrix3d> lowerBounds(const NormalizedSet& set)
{
    std::vector<Matrix3d> lower;
    for (const Vector3d& v : set.hull) {
        const double length = v.norm();
        Matrix3d b = length * length * Matrix3d::Identity() - v * v.transpose();
        if (set.offset > 0.0) {
            b *= 1.0 + set.offset / length;
            b.diagonal().array() += set.offset * (set.offset + length);
        }
        lower.push_back(b);
    }
    if (lower.empty()) { lower.push_back(set.offset * set.offset * Matrix3d::Identity()); }
    return lower;
}

Matrix3d matrixOf(const ViewError& error)
{
    SymmetricCoefficients q;
    for (std::size_t k = 0; k < 6; ++k) { q[static_cast<Eigen::Index>(k)] = static_cast<double>(error.q[k]); }
    return bake::matrixOf(q);
}

/// Least squares above all bounds. The first pass is eq. 2.10. The others weight its directions by 1 / (Ẽ + E)², which makes
/// differences of squares into differences of errors, and by the overestimation of the pass before, which brings the largest
/// down (as C. L. Lawson's algorithm for minimax approximation does, 1961).
SemidefiniteFit fitReweighted(const ArrayXd& errors, const std::vector<Matrix3d>& lower)
{
    constexpr unsigned kPasses = 4;
    constexpr double kSmallExcess = 1e-3;
    constexpr double kLeastWeight = 0.02;
    const Rows& rows = fitDirections().rows;
    ArrayXd weights = ArrayXd::Constant(kFitDirections, 1.0 / static_cast<double>(kFitDirections));
    SemidefiniteFit fit;
    for (unsigned pass = 0;; ++pass) {
        const Rows weighted = weights.matrix().asDiagonal() * rows;
        fit = fitAbove(rows.transpose() * weighted, weighted.transpose() * errors.square().matrix(), lower, kFitTolerance);
        if (pass + 1 == kPasses) { return fit; }
        const ArrayXd fitted = (rows * coefficientsOf(fit.x)).array().max(0.0).sqrt();
        const ArrayXd excess = (fitted - errors).max(0.0);
        if (!(excess.maxCoeff() > kSmallExcess)) { return fit; }
        weights = (kLeastWeight + excess / excess.maxCoeff()) / (kLeastWeight + fitted + errors).square();
        weights /= weights.sum();
    }
}

/// Rounds scale² Q to single precision, raised by as much as keeps it above all bounds.
QuadraticFit roundToSingle(const Matrix3d& q, const std::vector<Matrix3d>& lower, double scale)
{
    const double squaredScale = scale * scale;
    QuadraticFit fit;
    const auto isFinite = [](float value) { return std::isfinite(value); };
    for (double raise = q.norm() * std::numeric_limits<float>::epsilon() / 2.0;; raise *= 2.0) {
        const SymmetricCoefficients coefficients = squaredScale * coefficientsOf(q + raise * Matrix3d::Identity());
        // g++ 12 takes doubles for the floats that it has just rounded them to, unless it has to read those from memory.
        volatile float single = 0.0F;
        for (std::size_t k = 0; k < 6; ++k) {
            single = static_cast<float>(coefficients[static_cast<Eigen::Index>(k)]);
            fit.error.q[k] = single;
        }
        if (!std::all_of(fit.error.q.begin(), fit.error.q.end(), isFinite)) { return fit; }
        fit.certificate = smallestMargin(matrixOf(fit.error) / squaredScale, lower);
        if (fit.certificate >= kLeastCertificate) { return fit; }
    }
}

ArrayXd projections(const Matrix3d& m, const Directions& d)
{
    return ((d * m).array() * d.array()).rowwise().sum();
}

/// Khachiyan's algorithm for ±points that span space: the ellipsoid's shape up to the factor that makes it hold them.
Matrix3d khachiyan(const std::vector<Vector3d>& points)
{
    constexpr unsigned kMostSteps = 5000;
    constexpr double kRelativeError = 1e-3;
    std::vector<double> weights(points.size(), 1.0 / static_cast<double>(points.size()));
    Matrix3d moments = Matrix3d::Zero();
    for (std::size_t k = 0; k < points.size(); ++k) { moments += weights[k] * points[k] * points[k].transpose(); }
    for (unsigned step = 0; step < kMostSteps; ++step) {
        const Eigen::LLT<Matrix3d> cholesky(moments);
        std::size_t furthest = 0;
        double distance = -1.0;
        for (std::size_t k = 0; k < points.size(); ++k) {
            const double d = cholesky.matrixL().solve(points[k]).squaredNorm();
            if (d > distance) {
                distance = d;
                furthest = k;
            }
        }
        if (distance <= 3.0 * (1.0 + kRelativeError)) { break; }
        const double share = (distance - 3.0) / (3.0 * (distance - 1.0));
        moments = (1.0 - share) * moments + share * points[furthest] * points[furthest].transpose();
    }
    return 3.0 * moments;
}

/// The least multiple of the shape that holds all vectors, and a little more for rounding.
Matrix3d inflated(const Matrix3d& shape, const std::vector<Vector3d>& vectors)
{
    const Eigen::LLT<Matrix3d> cholesky(shape);
    double largest = 0.0;
    for (const Vector3d& v : vectors) { largest = std::max(largest, cholesky.matrixL().solve(v).squaredNorm()); }
    return shape * largest * (1.0 + 1e-8);
}

/// Of the unit set.
Matrix3d minimumVolumeShape(const std::vector<Vector3d>& hull)
{
    constexpr double kThickness = 1e-3;
    std::vector<Vector3d> points = hull;
    for (int axis = 0; axis < 3; ++axis) { points.emplace_back(kThickness * Vector3d::Unit(axis)); }
    return inflated(khachiyan(points), hull);
}

/// For each direction the unit vector across it along which the ellipsoid's shadow is longest.
Directions longestAcross(const Matrix3d& shape, const Directions& directions)
{
    Directions across(directions.rows(), 3);
    for (Eigen::Index i = 0; i < directions.rows(); ++i) {
        const Vector3d d = directions.row(i).transpose();
        const Vector3d a = d.unitOrthogonal();
        const Vector3d b = d.cross(a);
        const double aa = a.dot(shape * a);
        const double ab = a.dot(shape * b);
        const double bb = b.dot(shape * b);
        const double angle = 0.5 * std::atan2(2.0 * ab, aa - bb);
        across.row(i) = (std::cos(angle) * a + std::sin(angle) * b).transpose();
    }
    return across;
}

double meanSquaredExcess(const Matrix3d& shape, const ArrayXd& errors, const Directions& directions)
{
    return (squaredErrors(EllipsoidError{shape}, directions).sqrt() - errors).square().mean();
}

} // namespace

Directions sphericalFibonacci(Eigen::Index count)
{
    constexpr double kGoldenAngle = 2.3999632297286533222;
    Directions directions(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
        const double z = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
        const double radius = std::sqrt(1.0 - z * z);
        const double angle = kGoldenAngle * static_cast<double>(i);
        directions.row(i) << radius * std::cos(angle), radius * std::sin(angle), z;
    }
    return directions;
}

ArrayXd squaredErrors(const std::vector<Vector3d>& vectors, const Directions& d)
{
    // |v × d|² = |v|² − (v · d)²
    ArrayXd squared = ArrayXd::Zero(d.rows());
    for (const Vector3d& v : vectors) {
        squared = squared.max(v.squaredNorm() -
                              (v.x() * d.col(0).array() + v.y() * d.col(1).array() + v.z() * d.col(2).array()).square());
    }
    return squared;
}

ArrayXd squaredErrors(const ViewError& error, const Directions& directions)
{
    return projections(matrixOf(error), directions).max(0.0);
}

ArrayXd squaredErrors(const EllipsoidError& error, const Directions& directions)
{
    // Trace and determinant of the shadow's 2 × 2 matrix.
    const Matrix3d& m = error.shape;
    Matrix3d adjugate;
    adjugate.col(0) = m.col(1).cross(m.col(2));
    adjugate.col(1) = m.col(2).cross(m.col(0));
    adjugate.col(2) = m.col(0).cross(m.col(1));
    const ArrayXd half = 0.5 * (m.trace() - projections(m, directions));
    return half + (half.square() - projections(adjugate, directions)).max(0.0).sqrt();
}

float fitIsotropic(const std::vector<Vector3d>& vectors, double offset)
{
    double longest = 0.0;
    for (const Vector3d& v : vectors) { longest = std::max(longest, v.stableNorm()); }
    return std::nextafter(static_cast<float>(longest + offset), std::numeric_limits<float>::infinity());
}

QuadraticFit fitQuadratic(const std::vector<Vector3d>& vectors, double offset)
{
    const NormalizedSet set = normalize(vectors, offset);
    if (!(set.scale > std::sqrt(std::numeric_limits<double>::min()))) { // its square vanishes
        return {ViewError::isotropic(set.scale > 0.0 ? std::sqrt(std::numeric_limits<float>::min()) : 0.0F), 0.0, 0};
    }
    const std::vector<Matrix3d> lower = lowerBounds(set);
    const ArrayXd errors = squaredErrors(set.hull, fitDirections().directions).max(0.0).sqrt() + set.offset;
    const SemidefiniteFit solution = fitReweighted(errors, lower);
    const double missing = std::max(0.0, -solution.margin);
    QuadraticFit fit = roundToSingle(solution.x + missing * Matrix3d::Identity(), lower, set.scale);
    fit.cuts = solution.cuts;
    return fit;
}

EllipsoidError fitMinimumVolumeEllipsoid(const std::vector<Vector3d>& vectors)
{
    const NormalizedSet set = normalize(vectors, 0.0);
    if (set.hull.empty()) { return {}; }
    return {set.scale * set.scale * minimumVolumeShape(set.hull)};
}

EllipsoidError fitLeastSquaresEllipsoid(const std::vector<Vector3d>& vectors)
{
    constexpr unsigned kMostSteps = 30;
    constexpr double kRidge = 1e-6;
    constexpr double kLeastGain = 1e-4;
    const NormalizedSet set = normalize(vectors, 0.0);
    if (set.hull.empty()) { return {}; }
    const Directions& directions = fitDirections().directions;
    const ArrayXd errors = squaredErrors(set.hull, directions).max(0.0).sqrt();
    // The ellipsoid holds v if shape − v vᵀ is positive semidefinite.
    std::vector<Matrix3d> lower;
    for (const Vector3d& v : set.hull) { lower.emplace_back(v * v.transpose()); }

    Matrix3d shape = minimumVolumeShape(set.hull);
    double excess = meanSquaredExcess(shape, errors, directions);
    for (unsigned step = 0; step < kMostSteps; ++step) {
        // Ẽ(d) = √(wᵀ shape w) with the w of this shape, to first order.
        const Directions across = longestAcross(shape, directions);
        const ArrayXd current = projections(shape, across).max(kRidge).sqrt();
        Rows jacobian(directions.rows(), 6);
        for (Eigen::Index i = 0; i < directions.rows(); ++i) {
            jacobian.row(i) = quadraticRow(across.row(i)) / (2.0 * current[i]);
        }
        const double count = static_cast<double>(directions.rows());
        const SymmetricCoefficients here = coefficientsOf(shape);
        Matrix6d hessian = jacobian.transpose() * jacobian / count;
        hessian.diagonal().array() += kRidge * hessian.trace();
        const SymmetricCoefficients gradient =
            hessian * here - jacobian.transpose() * (current - errors).matrix() / count;
        const SemidefiniteFit next = fitAbove(hessian, gradient, lower, kFitTolerance);
        const Matrix3d target = next.x + std::max(0.0, kFitTolerance - next.margin) * Matrix3d::Identity();
        // Ellipsoids that hold the vectors form a convex set: every part of the step stays in it.
        double best = excess;
        for (double part = 1.0; part > 0.01; part *= 0.5) {
            const Matrix3d candidate = shape + part * (target - shape);
            const double candidateExcess = meanSquaredExcess(candidate, errors, directions);
            if (candidateExcess < best) {
                best = candidateExcess;
                shape = candidate;
                break;
            }
        }
        const bool stalled = best > excess * (1.0 - kLeastGain);
        excess = best;
        if (stalled) { break; }
    }
    return {set.scale * set.scale * shape};
}

} // namespace osgTessLOD::bake
