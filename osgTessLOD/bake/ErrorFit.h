// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ViewError.h>

#include <Eigen/Core>
#include <vector>

namespace osgTessLOD::bake {

// Approximations of E(d) = max |v × d| over a set of difference vectors, d any unit direction (Lambert §2.2). None is
// below E for any direction. All leave out what symmetricHull does by themselves and scale with the vectors.

/// Unit directions, one per row.
using Directions = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// Evenly spread over the hemisphere z > 0, which is enough, as E(d) = E(−d) (Keinert et al. 2015).
OSGTESSLOD_EXPORT Directions sphericalFibonacci(Eigen::Index count);

/// E(d)² for each direction; 0 without vectors.
OSGTESSLOD_EXPORT Eigen::ArrayXd squaredErrors(const std::vector<Eigen::Vector3d>& vectors, const Directions& directions);

/// E_iso = max |v| + offset (Lambert §2.3), rounded up.
OSGTESSLOD_EXPORT float fitIsotropic(const std::vector<Eigen::Vector3d>& vectors, double offset = 0.0);

/// A quadratic Ẽ(d)² = dᵀQd, and how it was found.
struct QuadraticFit {
    ViewError error;
    /// The smallest eigenvalue of any Q − Aₖ, with Q as `error` holds it in single precision, over the largest Ẽ_iso²:
    /// positive means that no direction at all is underestimated.
    double certificate = 0.0;
    unsigned cuts = 0; ///< directions that had to be asked for, last time
};

/// The default: least squares of Ẽ² − E² over all directions (eq. 2.10), re-weighted a few times so that Ẽ − E is small, also
/// at its largest, such that Ẽ(d) ≥ E(d) + offset for all directions, not for samples: with Aₖ = |vₖ|²I − vₖvₖᵀ, which gives dᵀAₖd = |vₖ × d|², that is Q − Aₖ positive semidefinite for
/// each vector. With an offset c ≥ 0, an error of unknown direction on top of the vectors, (√(dᵀAₖd) + c)² is bounded by
/// the quadratic (1 + t)Aₖ + (1 + 1/t)c²I, t = c / |vₖ|, which is exact where |vₖ × d| = |vₖ|.
OSGTESSLOD_EXPORT QuadraticFit fitQuadratic(const std::vector<Eigen::Vector3d>& vectors, double offset = 0.0);

/// Ẽ(d)² for each direction.
OSGTESSLOD_EXPORT Eigen::ArrayXd squaredErrors(const ViewError& error, const Directions& directions);

/// An ellipsoid about the origin that holds all vectors: E(d) is half the longest axis of its shadow along d.
struct EllipsoidError {
    /// A⁻¹ of eq. 2.4, positive semidefinite: the ellipsoid reaches √(wᵀ shape w) along a unit vector w.
    Eigen::Matrix3d shape = Eigen::Matrix3d::Zero();
};

/// The one of least volume (eq. 2.7; Khachiyan 1996, Moshtagh 2005), up to a thousandth. Sets that are flat get an
/// ellipsoid 10⁻³ of their length thick.
OSGTESSLOD_EXPORT EllipsoidError fitMinimumVolumeEllipsoid(const std::vector<Eigen::Vector3d>& vectors);

/// The one that makes Σ(Ẽ − E)² over all directions least, as far as sequential quadratic programming from the one of
/// least volume finds it (eq. 2.8). Stricter than there: it holds all vectors, which is known for all directions.
OSGTESSLOD_EXPORT EllipsoidError fitLeastSquaresEllipsoid(const std::vector<Eigen::Vector3d>& vectors);

/// Ẽ(d)² for each direction (eq. 2.5).
OSGTESSLOD_EXPORT Eigen::ArrayXd squaredErrors(const EllipsoidError& error, const Directions& directions);

} // namespace osgTessLOD::bake
