// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.4, and what makes a bound of it:
//
// Let p be a point of what is drawn of a patch and p + v the one that it stands for. All that LevelErrors covers has |v| ≤ m,
// the isotropic error, and |v × d| ≤ E(d) for every direction d. On screen the two are (SelectionView.h)
//
//   f |v × d_p| / (cos φ_p · depth of p + v)   pixels apart.
//
// p lies in the patch's sphere, at the distance D of its centre c and of radius R: further than D − R from the eye, along a
// direction d_p within θ of the centre's, sin θ = R / D. Of all v that |v| ≤ m and |v × d_c| ≤ E(d_c) allow,
//
//   |v × d_p| ≤ E(d_c) cos θ + √(m² − E(d_c)²) sin θ   while E(d_c) < m cos θ, else m                 (widening)
//
// as sin(a + θ) = sin a cos θ + cos a sin θ for the angle a between v and d_c; it is below E(d_c) + m sin θ. φ_p is at most
// φ_c + θ, and at most that of a corner of the view, or p is not on screen: C = cos φ_p at least. The depth of p is at least
// h = max(D cos φ_c − R, (D − R) C), that of p + v at least h − m. So the error is at most `a` pixels where
//
//   widened + m C a/f  ≤  C h a/f,                                                                      (tolerance)
//
// both sides in object units. With the eye in the sphere the tolerance is 0, which only exact levels keep. Orthographic views
// have one direction and no depth: E(axis) ≤ a/f.
#include <osgTessLOD/render/LevelNeed.h>

#include <osgTessLOD/asset/LodAsset.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace osgTessLOD {

namespace {

/// Bounds of several patches are widened by this, relatively: more than rounding makes a patch's own need leave them.
constexpr double kRounding = 1e-9;

using LevelArray = std::array<double, LodAsset::kMaxLevels>;

/// How much of the way from a coarser level to the next finer one is to be gone: 0 where errors of up to `enough` are allowed,
/// all of it where only `tooMuch` or less are.
double progress(double tolerance, double enough, double tooMuch)
{
    if (!(enough > tolerance)) { return 0.0; } // NaN too
    return tolerance > tooMuch ? (enough - tolerance) / (enough - tooMuch) : 1.0;
}

} // namespace

/// How a sphere is seen.
struct LevelNeed::Sight {
    osg::Vec3d direction; ///< unit, to its centre
    double distance;      ///< of the centre from the eye
    double nearest;       ///< of any point from the eye; 0 with the eye inside
    double leastDepth;    ///< of whatever of it may be on screen
    double sine;          ///< of half the angle that it takes up; 1 with the eye inside
    double leastCosine;   ///< of the angle to the axis of whatever of it may be on screen
    double largestCosine;
};

LevelNeed::LevelNeed(const SelectionView& view, const SelectionOptions& options, std::size_t levelCount,
                     unsigned finestAllowed)
    : _view(view)
    , _conservative(options.bound == SelectionOptions::Bound::Conservative)
    , _isotropic(options.metric == SelectionOptions::Metric::Isotropic)
    , _levelCount(levelCount)
    , _most(static_cast<float>(finestAllowed + 1))
    , _slope(std::max(options.errorPixels, 0.0) / view.pixelScale)
{
}

LevelNeed::Sight LevelNeed::sightOf(const osg::Vec3f& center, double radius) const
{
    if (_view.orthographic) { return {_view.axis, 1.0, 1.0, 1.0, 0.0, 1.0, 1.0}; }
    const osg::Vec3d toCenter = osg::Vec3d(center) - _view.eye;
    const double distance = toCenter.length();
    if (distance <= radius) { return {_view.axis, distance, 0.0, 0.0, 1.0, _view.leastCosine, 1.0}; }
    const osg::Vec3d direction = toCenter / distance;
    const double sine = radius / distance;
    const double cosine = std::sqrt(1.0 - sine * sine);
    const double axial = std::clamp(direction * _view.axis, -1.0, 1.0);
    const double across = std::sqrt(1.0 - axial * axial);
    const double leastCosine = std::max(axial * cosine - across * sine, _view.leastCosine);
    return {direction,
            distance,
            distance - radius,
            std::max(distance * axial - radius, (distance - radius) * leastCosine),
            sine,
            leastCosine,
            axial < cosine ? std::max(axial * cosine + across * sine, _view.leastCosine) : 1.0};
}

/// The errors as seen from the eye, as the asset has them at `sight.sine` 0 and widened otherwise.
void LevelNeed::errorsAlong(const Sight& sight, const float* errors, double* seen) const
{
    const std::size_t n = _levelCount;
    const float* isotropic = errors + 6 * n;
    if (_isotropic) {
        std::copy(isotropic, isotropic + n, seen);
        return;
    }
    const double x = sight.direction.x();
    const double y = sight.direction.y();
    const double z = sight.direction.z();
    const double sine = sight.sine;
    const double squaredCosine = 1.0 - sine * sine;
    const double cosine = std::sqrt(squaredCosine);
    for (std::size_t k = 0; k < n; ++k) {
        const double m = isotropic[k];
        const double form = errors[k] * x * x + errors[n + k] * y * y + errors[2 * n + k] * z * z +
                            2.0 * (errors[3 * n + k] * x * y + errors[4 * n + k] * x * z + errors[5 * n + k] * y * z);
        const double positive = form > 0.0 ? form : 0.0;
        const double most = m * m * squaredCosine; // from there on the whole length m is seen from somewhere
        const double squared = positive < most ? positive : most;
        seen[k] = std::sqrt(squared) * cosine + std::sqrt(m * m - squared) * sine;
    }
}

/// FirstOrder interpolates linearly in the error (Lambert eq. 2.11). There the surface half way between two levels may be as far
/// off as the coarser one. Conservative is at the finer level as soon as the coarser does not do, and starts from the
/// coarser a little before: while a patch has needs between k and k + 1, level k is good enough.
float LevelNeed::needFor(const double* errors, double tolerance) const
{
    double need = 0.0;
    double finer = 0.0;
    for (std::size_t k = _levelCount; k-- > 0;) {
        const double error = std::max(errors[k], kErrorRatio * finer);
        const double part =
            _conservative ? progress(tolerance, kErrorRatio * error, error) : progress(tolerance, error, finer);
        need += part;
        if (part >= 1.0) { // as of all coarser levels
            need += static_cast<double>(k);
            break;
        }
        finer = error;
    }
    return std::min(static_cast<float>(need), _most);
}

float LevelNeed::ofPatch(const BoundSphere& sphere, const float* errors) const
{
    const Sight sight = sightOf(sphere.center, sphere.radius);
    LevelArray seen;
    errorsAlong(sight, errors, seen.data());
    if (_view.orthographic) { return needFor(seen.data(), _slope); }
    const float* isotropic = errors + 6 * _levelCount;
    const double perDepth = _slope * sight.leastCosine;
    for (std::size_t k = 0; k < _levelCount; ++k) { seen[k] += isotropic[k] * perDepth; }
    return needFor(seen.data(), perDepth * sight.leastDepth);
}

float LevelNeed::atBorder(const osg::Vec3f& middle, const float* errors) const
{
    const Sight sight = sightOf(middle, 0.0);
    LevelArray seen;
    errorsAlong(sight, errors, seen.data());
    return needFor(seen.data(), _slope * sight.distance);
}

LevelNeed::Range LevelNeed::ofPatches(const BoundSphere& sphere, const float* bounds) const
{
    const Sight sight = sightOf(sphere.center, sphere.radius);
    const auto row = [&](BoundRow which) { return bounds + which * _levelCount; };
    const float* least = row(_isotropic ? kLeastIsotropic : kLeastSeen);
    const float* largest = row(kLargestIsotropic);
    double lowTolerance = _slope * sight.nearest;
    double highTolerance = _slope * (_view.orthographic ? 1.0 : sight.distance + sphere.radius);
    double loss = 0.0;
    if (_conservative && !_view.orthographic) {
        lowTolerance = _slope * sight.leastCosine * sight.leastDepth;
        highTolerance *= sight.largestCosine;
        loss = _slope * sight.largestCosine;
    }
    LevelArray low;
    LevelArray high;
    for (std::size_t k = 0; k < _levelCount; ++k) {
        low[k] = least[k] * (1.0 - kRounding);
        high[k] = largest[k] * (1.0 + loss) * (1.0 + kRounding);
    }
    return {needFor(low.data(), highTolerance * (1.0 + kRounding)),
            needFor(high.data(), lowTolerance * (1.0 - kRounding))};
}

bool LevelNeed::isSaturated(float need, unsigned finest) const
{
    const auto level = static_cast<float>(finest);
    return _conservative ? need >= level + 1.0F : need > level;
}

} // namespace osgTessLOD
