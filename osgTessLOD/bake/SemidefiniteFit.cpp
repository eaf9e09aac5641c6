// SPDX-License-Identifier: MIT
// D. Goldfarb, A. Idnani, "A numerically stable dual method for solving strictly convex quadratic programs", 1983, in
// coordinates where the Hessian is the identity; constraints by cutting planes, J. E. Kelley 1960.
#include <osgTessLOD/bake/SemidefiniteFit.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector6d = SymmetricCoefficients;

constexpr unsigned kMostRounds = 60;
constexpr unsigned kMostSteps = 200;       // of the active set, per cut
constexpr std::size_t kCutsPerRound = 6;
/// Closed-form eigenvalues of matrices of size about one are this exact at the least.
constexpr double kClosedFormError = 1e-6;

/// The point nearest to a given one in an intersection of half-spaces a · y ≥ b, as these are added one by one.
class NearestPoint {
public:
    explicit NearestPoint(const Vector6d& start) : _y(start) {}

    const Vector6d& point() const { return _y; }

    /// False if rounding stopped it.
    bool add(const Vector6d& a, double b)
    {
        double multiplier = 0.0;
        for (unsigned step = 0; step < kMostSteps; ++step) {
            const double missing = b - a.dot(_y);
            if (missing <= 0.0) { return true; }
            const auto active = static_cast<Eigen::Index>(_active.size());
            Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> dual(active);
            Vector6d primal = a;
            if (active > 0) {
                Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> normals(6, active);
                for (Eigen::Index k = 0; k < active; ++k) { normals.col(k) = _active[static_cast<std::size_t>(k)].normal; }
                dual = normals.colPivHouseholderQr().solve(a);
                primal -= normals * dual;
            }
            const bool movable = active < 6 && primal.squaredNorm() > kParallel * a.squaredNorm();
            const double full = movable ? missing / primal.dot(a) : std::numeric_limits<double>::infinity();
            double partial = std::numeric_limits<double>::infinity();
            std::size_t blocking = 0;
            for (std::size_t k = 0; k < _active.size(); ++k) {
                const double rate = dual[static_cast<Eigen::Index>(k)];
                if (rate > 0.0 && _active[k].multiplier / rate < partial) {
                    partial = _active[k].multiplier / rate;
                    blocking = k;
                }
            }
            const double length = std::min(full, partial);
            if (!std::isfinite(length)) { return false; }
            if (movable) { _y += length * primal; }
            for (std::size_t k = 0; k < _active.size(); ++k) {
                _active[k].multiplier = std::max(0.0, _active[k].multiplier - length * dual[static_cast<Eigen::Index>(k)]);
            }
            multiplier += length;
            if (full <= partial) {
                _active.push_back({a, b, multiplier});
                return true;
            }
            _active.erase(_active.begin() + static_cast<std::ptrdiff_t>(blocking));
        }
        return false;
    }

private:
    static constexpr double kParallel = 1e-20;
    struct Constraint {
        Vector6d normal;
        double bound;
        double multiplier;
    };
    Vector6d _y;
    std::vector<Constraint> _active;
};

/// By the trigonometric formula, see kClosedFormError.
double smallestEigenvalue(const Matrix3d& m)
{
    const double mean = m.trace() / 3.0;
    const double off = m(0, 1) * m(0, 1) + m(0, 2) * m(0, 2) + m(1, 2) * m(1, 2);
    const double dx = m(0, 0) - mean;
    const double dy = m(1, 1) - mean;
    const double dz = m(2, 2) - mean;
    const double spread = std::sqrt((dx * dx + dy * dy + dz * dz + 2.0 * off) / 6.0);
    if (!(spread > 0.0)) { return mean; }
    const double determinant = dx * (dy * dz - m(1, 2) * m(1, 2)) - m(0, 1) * (m(0, 1) * dz - m(1, 2) * m(0, 2)) +
                               m(0, 2) * (m(0, 1) * m(1, 2) - dy * m(0, 2));
    const double cosine = std::clamp(determinant / (2.0 * spread * spread * spread), -1.0, 1.0);
    constexpr double kThirdOfTurn = 2.0943951023931954923;
    return mean + 2.0 * spread * std::cos(std::acos(cosine) / 3.0 + kThirdOfTurn);
}

struct Violation {
    double eigenvalue;
    std::size_t matrix;
};

/// Approximate eigenvalues of all X − Bₖ, the smallest first.
std::vector<Violation> violations(const Matrix3d& x, const std::vector<Matrix3d>& lower)
{
    std::vector<Violation> found(lower.size());
    for (std::size_t k = 0; k < lower.size(); ++k) { found[k] = {smallestEigenvalue(x - lower[k]), k}; }
    std::sort(found.begin(), found.end(), [](const Violation& a, const Violation& b) {
        return a.eigenvalue != b.eigenvalue ? a.eigenvalue < b.eigenvalue : a.matrix < b.matrix;
    });
    return found;
}

double exactMargin(const Matrix3d& x, const std::vector<Matrix3d>& lower, const std::vector<Violation>& order)
{
    double margin = std::numeric_limits<double>::infinity();
    for (const Violation& v : order) {
        if (v.eigenvalue > margin + kClosedFormError) { break; }
        const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(x - lower[v.matrix], Eigen::EigenvaluesOnly);
        margin = std::min(margin, solver.eigenvalues()[0]);
    }
    return margin;
}

double largestQuadratic(const Vector3d& d, const std::vector<Matrix3d>& lower)
{
    double largest = -std::numeric_limits<double>::infinity();
    for (const Matrix3d& b : lower) { largest = std::max(largest, d.dot(b * d)); }
    return largest;
}

} // namespace

SymmetricCoefficients coefficientsOf(const Matrix3d& m)
{
    SymmetricCoefficients c;
    c << m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(0, 2), m(1, 2);
    return c;
}

Matrix3d matrixOf(const SymmetricCoefficients& c)
{
    Matrix3d m;
    m << c[0], c[3], c[4], c[3], c[1], c[5], c[4], c[5], c[2];
    return m;
}

SymmetricCoefficients quadraticRow(const Vector3d& d)
{
    SymmetricCoefficients row;
    row << d.x() * d.x(), d.y() * d.y(), d.z() * d.z(), 2.0 * d.x() * d.y(), 2.0 * d.x() * d.z(), 2.0 * d.y() * d.z();
    return row;
}

double smallestMargin(const Matrix3d& x, const std::vector<Matrix3d>& lower)
{
    return exactMargin(x, lower, violations(x, lower));
}

SemidefiniteFit fitAbove(const Eigen::Matrix<double, 6, 6>& hessian, const SymmetricCoefficients& gradient,
                         const std::vector<Matrix3d>& lower, double tolerance)
{
    // With H = LLᵀ and y = Lᵀx, the minimum without constraints is y = L⁻¹g, and a · x ≥ b is (L⁻¹a) · y ≥ b.
    const Eigen::LLT<Eigen::Matrix<double, 6, 6>> cholesky(hessian);
    assert(cholesky.info() == Eigen::Success);
    NearestPoint nearest(cholesky.matrixL().solve(gradient));
    SemidefiniteFit fit;
    for (unsigned round = 0; round < kMostRounds; ++round) {
        fit.x = matrixOf(cholesky.matrixU().solve(nearest.point()));
        const std::vector<Violation> order = violations(fit.x, lower);
        fit.margin = exactMargin(fit.x, lower, order);
        if (fit.margin >= -tolerance) { return fit; }
        for (std::size_t k = 0; k < std::min(kCutsPerRound, order.size()); ++k) {
            if (k > 0 && order[k].eigenvalue > -tolerance) { break; }
            const Eigen::SelfAdjointEigenSolver<Matrix3d> solver(fit.x - lower[order[k].matrix]);
            const Vector3d d = solver.eigenvectors().col(0);
            ++fit.cuts;
            if (!nearest.add(cholesky.matrixL().solve(quadraticRow(d)), largestQuadratic(d, lower))) {
                return fit;
            }
        }
    }
    fit.x = matrixOf(cholesky.matrixU().solve(nearest.point()));
    fit.margin = smallestMargin(fit.x, lower);
    return fit;
}

} // namespace osgTessLOD::bake
