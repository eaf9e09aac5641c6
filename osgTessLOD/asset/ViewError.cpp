// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/ViewError.h>

#include <algorithm>
#include <cmath>

namespace osgTessLOD {

ViewError ViewError::isotropic(float error)
{
    const float squared = error * error;
    return ViewError{{squared, squared, squared, 0.0F, 0.0F, 0.0F}};
}

double ViewError::evaluate(const std::array<double, 3>& d) const
{
    const double squared = q[0] * d[0] * d[0] + q[1] * d[1] * d[1] + q[2] * d[2] * d[2] +
                           2.0 * (q[3] * d[0] * d[1] + q[4] * d[0] * d[2] + q[5] * d[1] * d[2]);
    return std::sqrt(std::max(0.0, squared));
}

double ViewError::leastEigenvalue() const
{
    // Smith, "Eigenvalues of a symmetric 3 × 3 matrix", 1961: those of (Q − mean I) / scale are 2 cos of angles 120° apart.
    const double mean = (double{q[0]} + q[1] + q[2]) / 3.0;
    const double a = q[0] - mean;
    const double b = q[1] - mean;
    const double c = q[2] - mean;
    const double offDiagonal = double{q[3]} * q[3] + double{q[4]} * q[4] + double{q[5]} * q[5];
    const double scale = std::sqrt((a * a + b * b + c * c + 2.0 * offDiagonal) / 6.0);
    if (!(scale > 0.0)) { return mean; }
    const double determinant = a * (b * c - double{q[5]} * q[5]) - q[3] * (q[3] * c - double{q[5]} * q[4]) +
                               q[4] * (double{q[3]} * q[5] - b * q[4]);
    const double halfDeterminant = std::clamp(determinant / (2.0 * scale * scale * scale), -1.0, 1.0);
    constexpr double kThirdOfCircle = 2.0943951023931953;
    const double least = mean + 2.0 * scale * std::cos(std::acos(halfDeterminant) / 3.0 + kThirdOfCircle);
    // acos is uneven where two eigenvalues meet: half the digits are lost there, and no more.
    constexpr double kRounding = 1e-7;
    return least - kRounding * (std::fabs(mean) + scale);
}

double ViewError::smallest() const
{
    return std::sqrt(std::max(0.0, leastEigenvalue()));
}

} // namespace osgTessLOD
