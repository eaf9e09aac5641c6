// SPDX-License-Identifier: MIT
// A point p of what is drawn of a patch and the one that it stands for, p + v, have the same weights w. So the deformation,
// A(w) = Σ wᵢ Aᵢ, takes v to A(w) v; and triangles are flat between their corners, where what they stand for is bent
// (DeformableAsset.cpp), by δ s at most. δ is the largest |Aᵢ − A|, A the mean of the three; so |A(w) − A| ≤ δ, and for |v| ≤ m,
// |v × d|² ≤ dᵀQd in every direction d
//
//   |drawn × d| ≤ |A v × d| + δ (m + s),      |A v × d|² = |cof(A) (v × A⁻¹d)|² ≤ σ² dᵀ A⁻ᵀ Q A⁻¹ d,
//
// σ the largest singular value of cof(A). This is the error itself where A turns, and where it scales all alike. As a quadratic,
// (√q + c)² ≤ (1 + t) q + (1 + 1/t) c² for every t > 0; with one t for all levels errors that fell from level to level still do.
// In any direction it is at most max σ(Aᵢ) m + δ s.
#include <osgTessLOD/render/DeformedPatch.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace osgTessLOD {

namespace {

struct Ball {
    osg::Vec3d center;
    double radius;
};

/// The least ball around two.
Ball around(const Ball& a, const Ball& b)
{
    const osg::Vec3d between = b.center - a.center;
    const double distance = between.length();
    if (distance + b.radius <= a.radius) { return a; }
    if (distance + a.radius <= b.radius) { return b; }
    const double radius = 0.5 * (distance + a.radius + b.radius);
    return {a.center + between * ((radius - a.radius) / distance), radius};
}

float roundedUp(double x)
{
    const auto rounded = static_cast<float>(x);
    return static_cast<double>(rounded) < x ? std::nextafter(rounded, std::numeric_limits<float>::max()) : rounded;
}

/// Packed as ViewError::q.
constexpr std::array<std::pair<int, int>, 6> kPlaces{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}}};

double trace(const std::array<double, 6>& q)
{
    return q[0] + q[1] + q[2];
}

} // namespace

DeformedPatch::DeformedPatch(const LodPatch& patch, const std::vector<AffineMap>& maps)
    : _corners{&maps[patch.baseVertices[0]], &maps[patch.baseVertices[1]], &maps[patch.baseVertices[2]]}
    , _stretch(std::max({_corners[0]->stretch, _corners[1]->stretch, _corners[2]->stretch}))
{
    const Matrix3 mean = (_corners[0]->linear + _corners[1]->linear + _corners[2]->linear) * (1.0 / 3.0);
    for (const AffineMap* corner : _corners) {
        _bend = std::max(_bend, (corner->linear - mean).largestSingularValues()[0]);
    }
    setQuadraticMap(mean);
}

void DeformedPatch::setQuadraticMap(const Matrix3& mean)
{
    const std::array<double, 2> singular = mean.largestSingularValues();
    const double determinant = mean.determinant();
    constexpr double kLeast = 1e-3; // of the smallest singular value to the largest
    _isFlat = !(std::fabs(determinant) > kLeast * singular[0] * singular[0] * singular[1]);
    if (_isFlat) { return; }
    const Matrix3 b = mean.cofactors() * (singular[0] * singular[1] / determinant); // σ A⁻ᵀ
    for (std::size_t to = 0; to < 6; ++to) {
        const osg::Vec3d& r = b.rows[static_cast<std::size_t>(kPlaces[to].first)];
        const osg::Vec3d& s = b.rows[static_cast<std::size_t>(kPlaces[to].second)];
        for (std::size_t from = 0; from < 6; ++from) {
            const auto [k, l] = kPlaces[from];
            _quadraticMap[to][from] = k == l ? r[k] * s[k] : r[k] * s[l] + r[l] * s[k];
        }
    }
}

BoundSphere DeformedPatch::sphere(const LodPatch& patch, const std::vector<AffineMap>& maps,
                                  const BoundSphere& undeformed)
{
    std::array<Ball, 3> balls; // what is between what the three make of it, is in any ball around these
    for (std::size_t k = 0; k < 3; ++k) {
        const AffineMap& map = maps[patch.baseVertices[k]];
        balls[k] = {map(undeformed.center), map.stretch * double{undeformed.radius}};
    }
    const Ball ball = around(around(balls[0], balls[1]), balls[2]);
    constexpr double kRounding = 1e-6;
    return {ball.center, roundedUp(ball.radius + kRounding * (ball.radius + ball.center.length()))};
}

osg::Vec3d DeformedPatch::middle(const osg::Vec3d& undeformed, std::size_t side) const
{
    return ((*_corners[side])(undeformed) + (*_corners[(side + 1) % 3])(undeformed)) * 0.5;
}

DeformedPatch::Quadratic DeformedPatch::mapped(const Quadratic& q) const
{
    Quadratic result{};
    for (std::size_t to = 0; to < 6; ++to) {
        for (std::size_t from = 0; from < 6; ++from) { result[to] += _quadraticMap[to][from] * q[from]; }
    }
    return result;
}

void DeformedPatch::deform(LevelError* errors, const double* chords, std::size_t count) const
{
    std::array<Quadratic, LodAsset::kMaxLevels> quadratics;
    const auto onTop = [&](std::size_t level) { return _bend * (double{errors[level].isotropic} + chords[level]); };
    const auto part = [&](std::size_t level) { // c / √q, on average
        return onTop(level) / std::sqrt(std::max(trace(quadratics[level]) / 3.0, 1e-300));
    };
    for (std::size_t level = 0; level < count; ++level) {
        Quadratic q{};
        for (std::size_t k = 0; k < 6; ++k) { q[k] = errors[level].quadratic.q[k]; }
        quadratics[level] = _isFlat ? Quadratic{} : mapped(q);
    }
    const double t = std::clamp(std::sqrt(part(0) * part(count - 1)), 1e-8, 1e3);
    for (std::size_t level = 0; level < count; ++level) {
        const Quadratic& q = quadratics[level];
        const double isotropic = _stretch * double{errors[level].isotropic} + _bend * chords[level];
        constexpr double kRounding = 1e-7; // of the numbers beside the diagonal
        const double added = _isFlat ? isotropic * isotropic
                                     : (1.0 + 1.0 / t) * onTop(level) * onTop(level) + kRounding * (1.0 + t) * trace(q);
        for (std::size_t k = 0; k < 6; ++k) {
            errors[level].quadratic.q[k] =
                k < 3 ? roundedUp((1.0 + t) * q[k] + added) : static_cast<float>((1.0 + t) * q[k]);
        }
        errors[level].isotropic = roundedUp(isotropic);
        errors[level].coneCosine = -1.0F;
    }
}

} // namespace osgTessLOD
