// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <array>

namespace osgTessLOD {

/// The error of one patch at one level as a function of the view direction d (unit, object space):
/// E(d)² = dᵀQd, six numbers (Lambert eq. 2.9). The value is the length, in object units, of the largest difference
/// between the level and the reference surface as seen along d.
struct OSGTESSLOD_EXPORT ViewError {
    /// Q as xx, yy, zz, xy, xz, yz: E² = xx·x² + yy·y² + zz·z² + 2(xy·xy + xz·xz + yz·yz).
    std::array<float, 6> q{};

    /// The quadratic that gives `error` (object units, ≥ 0) in every direction.
    static ViewError isotropic(float error);

    /// E(direction) in object units; `direction` has unit length. A form that is negative there, by rounding, gives 0.
    double evaluate(const std::array<double, 3>& direction) const;

    /// Of Q, rounded down: the least E² of any direction, object units squared.
    double leastEigenvalue() const;

    /// The least E of any direction, object units, rounded down: √ of the least eigenvalue, and 0 where that is negative.
    double smallest() const;

    bool operator==(const ViewError& other) const { return q == other.q; }
};

} // namespace osgTessLOD
