// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Vec3d>

#include <algorithm>
#include <array>
#include <cmath>

namespace osgTessLOD {

/// A 3 × 3 matrix, by rows, that is multiplied with column vectors.
struct Matrix3 {
    std::array<osg::Vec3d, 3> rows;

    osg::Vec3d operator*(const osg::Vec3d& v) const { return {rows[0] * v, rows[1] * v, rows[2] * v}; }
    Matrix3 operator+(const Matrix3& o) const
    {
        return {{rows[0] + o.rows[0], rows[1] + o.rows[1], rows[2] + o.rows[2]}};
    }
    Matrix3 operator-(const Matrix3& o) const
    {
        return {{rows[0] - o.rows[0], rows[1] - o.rows[1], rows[2] - o.rows[2]}};
    }
    Matrix3 operator*(double f) const { return {{rows[0] * f, rows[1] * f, rows[2] * f}}; }
    /// Those of the inverse transpose times the determinant.
    Matrix3 cofactors() const { return {{rows[1] ^ rows[2], rows[2] ^ rows[0], rows[0] ^ rows[1]}}; }
    double determinant() const { return rows[0] * (rows[1] ^ rows[2]); }

    /// The largest and the second largest singular value, rounded up. Smith, "Eigenvalues of a symmetric 3 × 3 matrix", 1961.
    std::array<double, 2> largestSingularValues() const
    {
        std::array<double, 3> d{rows[0].length2(), rows[1].length2(), rows[2].length2()}; // of M Mᵀ
        const double xy = rows[0] * rows[1];
        const double xz = rows[0] * rows[2];
        const double yz = rows[1] * rows[2];
        const double mean = (d[0] + d[1] + d[2]) / 3.0;
        for (double& number : d) { number -= mean; }
        const double scale =
            std::sqrt((d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0);
        if (!(scale > 1e-14 * mean)) { return {std::sqrt(mean + 3.0 * scale), std::sqrt(mean + 3.0 * scale)}; }
        const double determinant =
            d[0] * (d[1] * d[2] - yz * yz) - xy * (xy * d[2] - yz * xz) + xz * (xy * yz - d[1] * xz);
        const double angle = std::acos(std::clamp(determinant / (2.0 * scale * scale * scale), -1.0, 1.0)) / 3.0;
        constexpr double kThirdOfCircle = 2.0943951023931953;
        constexpr double kRounding = 1e-7; // acos loses half the digits where two values meet
        const double first = mean + scale * (2.0 * std::cos(angle) + kRounding);
        const double second = mean + scale * (2.0 * std::cos(angle - kThirdOfCircle) + kRounding);
        return {std::sqrt(first), std::sqrt(std::max(second, 0.0))};
    }
};

/// p ↦ linear · p + move.
struct AffineMap {
    Matrix3 linear;
    osg::Vec3d move;
    double stretch = 1.0; ///< the largest singular value of `linear`, or a little more

    osg::Vec3d operator()(const osg::Vec3d& p) const { return linear * p + move; }
};

} // namespace osgTessLOD
