// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <Eigen/Core>
#include <vector>

namespace osgTessLOD::bake {

/// A symmetric 3 × 3 matrix as xx, yy, zz, xy, xz, yz.
using SymmetricCoefficients = Eigen::Matrix<double, 6, 1>;

SymmetricCoefficients coefficientsOf(const Eigen::Matrix3d& matrix);
Eigen::Matrix3d matrixOf(const SymmetricCoefficients& coefficients);
/// The row r with r · coefficientsOf(X) = dᵀXd.
SymmetricCoefficients quadraticRow(const Eigen::Vector3d& d);

/// The smallest of the smallest eigenvalues of X − Bₖ over all matrices Bₖ; +infinity without any.
double smallestMargin(const Eigen::Matrix3d& x, const std::vector<Eigen::Matrix3d>& lower);

/// Minimizes ½ xᵀHx − gᵀx over the coefficients x of symmetric matrices X with X − Bₖ positive semidefinite for all k.
struct SemidefiniteFit {
    Eigen::Matrix3d x = Eigen::Matrix3d::Zero();
    double margin = 0.0;   ///< smallestMargin(x, B); ≥ −tolerance unless the search was given up
    unsigned cuts = 0;     ///< directions d with dᵀXd ≥ max dᵀBₖd that were asked for
};

/// By cutting planes: a dual active set method for the directions found so far, to which the eigenvectors of the most
/// violated X − Bₖ are added. `hessian` is positive definite; the matrices should be about one in size, as `tolerance` is
/// absolute. Deterministic.
SemidefiniteFit fitAbove(const Eigen::Matrix<double, 6, 6>& hessian, const SymmetricCoefficients& gradient,
                         const std::vector<Eigen::Matrix3d>& lower, double tolerance);

} // namespace osgTessLOD::bake
