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
// both sides in lengths. With the eye in the sphere the tolerance is 0, which only exact levels keep. Orthographic views
// have one direction and no depth: E(axis) ≤ a/f.
#include <osgTessLOD/render/LevelNeed.h>

#include <osgTessLOD/asset/LodAsset.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

/// Bounds of several patches are widened by this, relatively: more than single precision makes a patch's own need leave them.
constexpr double kRounding = 1e-5;

using LevelArray = std::array<double, LodAsset::kMaxLevels>;

/// How much of the way from a coarser level to the next finer one is to be gone: 0 where errors of up to `enough` are allowed,
/// all of it where only `tooMuch` or less are.
double progress(double tolerance, double enough, double tooMuch)
{
    if (!(enough > tolerance)) { return 0.0; } // NaN too
    return tolerance > tooMuch ? (enough - tolerance) / (enough - tooMuch) : 1.0;
}

/// Infinite where single precision ends.
float toFloat(double x)
{
    constexpr double kMost = std::numeric_limits<float>::max();
    if (std::isnan(x) || std::fabs(x) <= kMost) { return static_cast<float>(x); }
    return std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(x > 0.0 ? 1 : -1));
}

} // namespace

/// How a sphere is seen.
struct LevelNeed::Sight {
    double distance;    ///< of the centre from the eye
    double nearest;     ///< of any point from the eye; 0 with the eye inside
    double leastDepth;  ///< of whatever of it may be on screen
    double leastCosine; ///< of the angle to the axis of whatever of it may be on screen
    double largestCosine;
};

LevelNeed::LevelNeed(const SelectionView& view, const SelectionOptions& options, std::size_t levelCount,
                     unsigned finestAllowed, double unitsPerLength)
    : _view(view)
    , _levelCount(levelCount)
    , _slope(std::max(options.errorPixels, 0.0) / view.pixelScale)
    , _kernelView()
{
    _view.eye *= unitsPerLength;
    if (view.orthographic) { _slope *= unitsPerLength; }
    for (int k = 0; k < 3; ++k) {
        const float rounded = toFloat(_view.eye[k]);
        _kernelView.eyeHigh[k] = rounded;
        _kernelView.eyeLow[k] = toFloat(_view.eye[k] - double{rounded});
        _kernelView.axis[k] = toFloat(view.axis[k]);
    }
    _kernelView.slope = toFloat(_slope);
    _kernelView.leastCosine = toFloat(view.leastCosine);
    _kernelView.most = static_cast<float>(finestAllowed + 1);
    _kernelView.top = static_cast<int>(finestAllowed);
    _kernelView.levelCount = static_cast<int>(levelCount);
    _kernelView.orthographic = view.orthographic;
    _kernelView.conservative = options.bound == SelectionOptions::Bound::Conservative;
    _kernelView.isotropic = options.metric == SelectionOptions::Metric::Isotropic;
}

LevelNeed::Sight LevelNeed::sightOf(const BoundSphere& sphere) const
{
    if (_view.orthographic) { return {1.0, 1.0, 1.0, 1.0, 1.0}; }
    const double radius = sphere.radius;
    const osg::Vec3d toCenter = osg::Vec3d(sphere.center) - _view.eye;
    const double distance = toCenter.length();
    if (distance <= radius) { return {distance, 0.0, 0.0, _view.leastCosine, 1.0}; }
    const double sine = radius / distance;
    const double cosine = std::sqrt(1.0 - sine * sine);
    const double axial = std::clamp(toCenter * _view.axis / distance, -1.0, 1.0);
    const double across = std::sqrt(1.0 - axial * axial);
    const double leastCosine = std::max(axial * cosine - across * sine, _view.leastCosine);
    const double leastDepth = std::max(distance * axial - radius, (distance - radius) * leastCosine);
    return {distance, distance - radius, std::max(leastDepth - kRounding * (distance + radius), 0.0), leastCosine,
            axial < cosine ? std::max(axial * cosine + across * sine, _view.leastCosine) : 1.0};
}

/// FirstOrder interpolates linearly in the error (Lambert eq. 2.11). There the surface half way between two levels may be as far
/// off as the coarser one. Conservative is at the finer level as soon as the coarser does not do, and starts from the
/// coarser a little before: while a patch has needs between k and k + 1, level k is good enough.
float LevelNeed::needFor(const double* errors, double tolerance) const
{
    double need = 0.0;
    double finer = 0.0;
    for (std::size_t k = _levelCount; k-- > 0;) {
        const double error = errors[k];
        const double part = _kernelView.conservative ? progress(tolerance, kErrorRatio * error, error)
                                                     : progress(tolerance, error, finer);
        need += part;
        if (part >= 1.0) { // as of all coarser levels
            need += static_cast<double>(k);
            break;
        }
        finer = error;
    }
    return std::min(static_cast<float>(need), _kernelView.most);
}

LevelNeed::Range LevelNeed::ofPatches(const BoundSphere& sphere, const float* bounds) const
{
    const Sight sight = sightOf(sphere);
    const auto row = [&](BoundRow which) { return bounds + which * _levelCount; };
    const float* least = row(_kernelView.isotropic ? kLeastIsotropic : kLeastSeen);
    const float* largest = row(kLargestIsotropic);
    double lowTolerance = _slope * sight.nearest;
    double highTolerance = _slope * (_view.orthographic ? 1.0 : sight.distance + double{sphere.radius});
    double loss = 0.0;
    if (_kernelView.conservative && !_view.orthographic) {
        lowTolerance = _slope * sight.leastCosine * sight.leastDepth;
        highTolerance *= sight.largestCosine;
        loss = _slope * sight.largestCosine;
    }
    LevelArray low;
    LevelArray high;
    for (std::size_t k = 0; k < _levelCount; ++k) {
        low[k] = double{least[k]} * (1.0 - kRounding);
        high[k] = double{largest[k]} * (1.0 + loss) * (1.0 + kRounding);
    }
    return {needFor(low.data(), highTolerance * (1.0 + kRounding)),
            needFor(high.data(), lowTolerance * (1.0 - kRounding))};
}

} // namespace osgTessLOD
