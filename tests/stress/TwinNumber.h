// SPDX-License-Identifier: MIT
// Nicholas Higham, "Accuracy and Stability of Numerical Algorithms", 2002, §3.3 (running error analysis).
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD::stress {

/// A number of a shader, computed in single and in double precision side by side, with a bound on how far the two can be
/// apart. Decisions are those of single precision. The bound allows what GLSL 4.60 §4.7.1 allows a GPU: sums and products to half a
/// unit in the last place, quotients to 2.5, square roots to 4.5 (1 / inversesqrt), logarithms to 3, powers by exp2 and log2; so it
/// holds of what any driver makes of the same text.
class Twin {
public:
    Twin() = default;
    /// A literal: rounded to single precision, exact in double.
    Twin(double value)
        : _single(static_cast<float>(value))
        , _exact(value)
        , _bound(std::fabs(value - double{_single}))
        , _summand(std::fabs(value))
    {
    }
    /// What is given to both alike.
    static Twin given(float value) { return Twin(double{value}); }

    float single() const { return _single; }
    double exact() const { return _exact; }
    double bound() const { return _bound; }
    /// Of the largest number in the sum that this is: what its roundings are relative to where summands cancel.
    double summand() const { return _summand; }
    double error() const { return std::fabs(double{_single} - _exact); }
    /// The same with what another processor computed in single precision.
    Twin computedAs(float single) const { return {single, _exact, _bound, _summand}; }

    explicit operator int() const { return static_cast<int>(_single); }

    friend Twin operator-(const Twin& a) { return {-a._single, -a._exact, a._bound, a._summand}; }
    friend Twin operator+(const Twin& a, const Twin& b)
    {
        return rounded(a._single + b._single, a._exact + b._exact, a._bound + b._bound,
                       std::max(a._summand, b._summand));
    }
    friend Twin operator-(const Twin& a, const Twin& b) { return a + -b; }
    friend Twin operator*(const Twin& a, const Twin& b)
    {
        const double inherited = size(a) * b._bound + size(b) * a._bound + a._bound * b._bound;
        return rounded(a._single * b._single, a._exact * b._exact, inherited, a._summand * b._summand);
    }
    friend Twin operator/(const Twin& a, const Twin& b)
    {
        const double inherited = (size(a) * b._bound + size(b) * a._bound) / (size(b) * least(b));
        return rounded(a._single / b._single, a._exact / b._exact, inherited,
                       a._summand * b._summand / (size(b) * least(b)), 5.0);
    }
    Twin& operator+=(const Twin& b) { return *this = *this + b; }
    Twin& operator*=(const Twin& b) { return *this = *this * b; }

    friend bool operator<(const Twin& a, const Twin& b) { return a._single < b._single; }
    friend bool operator>(const Twin& a, const Twin& b) { return a._single > b._single; }
    friend bool operator<=(const Twin& a, const Twin& b) { return a._single <= b._single; }
    friend bool operator>=(const Twin& a, const Twin& b) { return a._single >= b._single; }
    friend bool operator==(const Twin& a, const Twin& b) { return a._single == b._single; }
    friend bool operator!=(const Twin& a, const Twin& b) { return a._single != b._single; }

    friend Twin floor(const Twin& a) { return given(std::floor(a._single)); }
    friend Twin ceil(const Twin& a) { return given(std::ceil(a._single)); }
    // Of neighbouring numbers the other one may be chosen, which is as near.
    friend Twin abs(const Twin& a) { return {std::fabs(a._single), std::fabs(a._exact), a._bound, a._summand}; }
    friend Twin min(const Twin& a, const Twin& b)
    {
        return {std::min(a._single, b._single), std::min(a._exact, b._exact), std::max(a._bound, b._bound),
                std::max(a._summand, b._summand)};
    }
    friend Twin max(const Twin& a, const Twin& b) { return -min(-a, -b); }
    friend Twin clamp(const Twin& a, const Twin& low, const Twin& high) { return min(max(a, low), high); }
    friend Twin sqrt(const Twin& a)
    {
        const double root = std::sqrt(size(a)) + std::sqrt(std::max(a._exact, 0.0));
        const double inherited = a._bound > 0.0 ? std::min(a._bound / root, std::sqrt(a._bound)) : 0.0;
        return rounded(std::sqrt(a._single), std::sqrt(std::max(a._exact, 0.0)), inherited, std::sqrt(a._summand), 9.0);
    }
    friend Twin inversesqrt(const Twin& a)
    {
        const Twin root = sqrt(a);
        return Twin(1.0) / root;
    }
    friend Twin log2(const Twin& a)
    {
        // Within 0.5 … 2 absolutely, to 2⁻²¹.
        const double inherited = a._bound / (least(a) * kLn2) + std::ldexp(1.0, -21);
        return rounded(std::log2(a._single), std::log2(a._exact), inherited, 1.0, 6.0);
    }
    friend Twin exp(const Twin& a)
    {
        const double inherited = std::exp(std::max(double{a._single}, a._exact)) * std::expm1(a._bound);
        return rounded(std::exp(a._single), std::exp(a._exact), inherited, 0.0, 6.0 + 4.0 * size(a));
    }
    friend Twin pow(const Twin& a, const Twin& b)
    {
        const Twin exponent = b * log2(a);
        const double most = std::exp2(std::max(double{exponent._single}, exponent._exact));
        return rounded(std::pow(a._single, b._single), std::pow(a._exact, b._exact),
                       most * std::expm1(exponent._bound * kLn2), 0.0, 6.0 + 4.0 * size(exponent));
    }

private:
    static constexpr double kLn2 = 0.69314718055994530942;

    Twin(float single, double exact, double bound, double summand)
        : _single(single)
        , _exact(exact)
        , _bound(bound)
        , _summand(std::max(summand, std::fabs(exact)))
    {
    }
    /// With `halves` half units in the last place on top, and what is lost below normal numbers.
    static Twin rounded(float single, double exact, double inherited, double summand, double halves = 1.0)
    {
        const double size = std::max(std::fabs(double{single}), std::fabs(exact) + inherited);
        const double unit = std::ldexp(size, -24) * (1.0 + 1e-6);
        return {single, exact, inherited * (1.0 + 1e-12) + halves * unit + double{std::numeric_limits<float>::min()},
                summand};
    }
    static double size(const Twin& a) { return std::fabs(double{a._single}); }
    /// What the divisor is at least.
    static double least(const Twin& a) { return std::max(size(a) - a._bound, 1e-300); }

    float _single;
    double _exact;
    double _bound;
    double _summand;
};

} // namespace osgTessLOD::stress
