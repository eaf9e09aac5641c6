// SPDX-License-Identifier: MIT
// Aaron Lee, Wim Sweldens, Peter Schröder, Lawrence Cowsar, David Dobkin, "MAPS: Multiresolution Adaptive
// Parameterization of Surfaces", SIGGRAPH 1998.
// Hsueh-Ti Derek Liu, Vladimir Kim, Siddhartha Chaudhuri, Noam Aigerman, Alec Jacobson, "Neural Subdivision",
// SIGGRAPH 2020 (successive self-parameterization).
#include <osgTessLOD/bake/CollapseHistory.h>

#include <osgTessLOD/bake/PlaneTriangle.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Points on the side of two triangles are the first one's, whatever rounding says.
constexpr double kTie = 1e-11;

/// A triangle of a step's plane that may hold a point, with the point's weights in it.
struct Candidate {
    double inside = -std::numeric_limits<double>::infinity(); ///< smallest weight
    unsigned index = 0;
    Vector3d weights = Vector3d::Zero();

    void offer(unsigned triangle, const Vector2d& p, const Vector2d& a, const Vector2d& b, const Vector2d& c)
    {
        const Vector3d w = weightsOf(p, a, b, c);
        if (w.minCoeff() > inside + kTie) {
            inside = w.minCoeff();
            index = triangle;
            weights = w;
        }
    }
    /// The weights, with what rounding made negative put to zero.
    Vector3d clamped() const
    {
        const Vector3d w = weights.cwiseMax(0.0);
        return w / w.sum();
    }
};

/// first … last − 1 of the sectors around v, or of the new faces.
struct Side {
    unsigned first;
    unsigned last;
};

/// The new faces on the same side of the crease as a sector, and the other way round.
Side newFacesBeside(unsigned sector, unsigned ringSize, unsigned crease)
{
    if (crease == 0) { return {0, ringSize - 2}; }
    return sector < crease ? Side{0, crease - 1} : Side{crease - 1, ringSize - 2};
}

Side sectorsBeside(unsigned newFace, unsigned ringSize, unsigned crease)
{
    if (crease == 0) { return {0, ringSize}; }
    return newFace + 1 < crease ? Side{0, crease} : Side{crease, ringSize};
}

/// The triangle (0, j+1, j+2) of a polygon that holds p, among those on its side.
template <typename Polygon> FacePoint locateInFan(Side side, const Polygon& at, const Vector2d& p)
{
    Candidate best;
    for (unsigned j = side.first; j < side.last; ++j) { best.offer(j, p, at(0), at(j + 1), at(j + 2)); }
    return {best.index, best.clamped()};
}

} // namespace

double CollapseHistory::Step::quality() const
{
    double smallest = std::numeric_limits<double>::infinity();
    double total = 0.0;
    unsigned count = 0;
    const auto at = [&](unsigned i) -> Vector2d { return ring[i % ringSize].cast<double>(); };
    const auto take = [&](double area) {
        smallest = std::min(smallest, area);
        total += area;
        ++count;
    };
    for (unsigned i = 0; i < ringSize; ++i) {
        if (i != gap) { take(twiceArea(center.cast<double>(), at(i), at(i + 1))); }
    }
    for (unsigned j = 0; j + 2 < ringSize; ++j) { take(twiceArea(at(0), at(j + 1), at(j + 2))); }
    return total > 0.0 ? smallest * count / total : -1.0;
}

FacePoint CollapseHistory::Step::carry(unsigned sector, const Vector3d& weights) const
{
    const auto at = [&](unsigned i) -> Vector2d { return ring[i % ringSize].cast<double>(); };
    return locateInFan(newFacesBeside(sector, ringSize, crease), at,
                       weights[0] * center.cast<double>() + weights[1] * at(sector) + weights[2] * at(sector + 1));
}

CollapseHistory::CollapseHistory(std::uint32_t sourceFaces)
    : _sourceFaces(sourceFaces)
    , _replacedBy(sourceFaces, kNone)
{
}

std::uint32_t CollapseHistory::add(const Step& step)
{
    assert(step.ringSize >= 3 && step.ringSize <= kMaxRing);
    assert(step.crease == 0 || (step.crease > 1 && step.crease + 1 < step.ringSize));
    const auto number = static_cast<std::uint32_t>(_steps.size());
    const auto firstNew = static_cast<std::uint32_t>(_replacedBy.size());
    StoredStep stored{};
    stored.firstRing = _ring.size();
    stored.firstOldFace = _oldFaces.size();
    stored.firstNewFace = firstNew;
    stored.ringSize = static_cast<std::uint8_t>(step.ringSize);
    stored.gap = static_cast<std::uint8_t>(std::min<unsigned>(step.gap, kMaxRing));
    stored.crease = static_cast<std::uint8_t>(step.crease);
    _ring.push_back(step.center);
    for (unsigned i = 0; i < step.ringSize; ++i) {
        _ring.push_back(step.ring[i]);
        const bool isGap = i == step.gap;
        _oldFaces.push_back(isGap ? kNone : step.oldFace[i] * 4 + step.corner[i]);
        if (!isGap) { _replacedBy[step.oldFace[i]] = number; }
    }
    _replacedBy.resize(_replacedBy.size() + step.ringSize - 2, kNone);
    _createdBy.resize(_createdBy.size() + step.ringSize - 2, number);
    _steps.push_back(stored);
    return firstNew;
}

Eigen::Vector2d CollapseHistory::ringPoint(const StoredStep& step, unsigned i) const
{
    return _ring[step.firstRing + 1 + i % step.ringSize].cast<double>();
}

FacePoint CollapseHistory::toCoarse(FacePoint point) const
{
    while (_replacedBy[point.face] != kNone) {
        const StoredStep& step = _steps[_replacedBy[point.face]];
        const std::uint32_t* oldFaces = &_oldFaces[step.firstOldFace];
        unsigned sector = 0;
        while (sector == step.gap || oldFaces[sector] / 4 != point.face) { ++sector; }
        const unsigned corner = oldFaces[sector] % 4;
        const Vector2d p = point.barycentric[corner] * _ring[step.firstRing].cast<double>() +
                           point.barycentric[(corner + 1) % 3] * ringPoint(step, sector) +
                           point.barycentric[(corner + 2) % 3] * ringPoint(step, sector + 1);
        point = locateInFan(
            newFacesBeside(sector, step.ringSize, step.crease), [&](unsigned i) { return ringPoint(step, i); }, p);
        point.face += step.firstNewFace;
    }
    return point;
}

FacePoint CollapseHistory::toSource(FacePoint point) const
{
    while (point.face >= _sourceFaces) {
        const StoredStep& step = _steps[_createdBy[point.face - _sourceFaces]];
        const unsigned j = point.face - step.firstNewFace;
        const Vector2d p = point.barycentric[0] * ringPoint(step, 0) + point.barycentric[1] * ringPoint(step, j + 1) +
                           point.barycentric[2] * ringPoint(step, j + 2);
        const Vector2d center = _ring[step.firstRing].cast<double>();
        Candidate best;
        const Side side = sectorsBeside(j, step.ringSize, step.crease);
        for (unsigned i = side.first; i < side.last; ++i) {
            if (i != step.gap) { best.offer(i, p, center, ringPoint(step, i), ringPoint(step, i + 1)); }
        }
        const std::uint32_t entry = _oldFaces[step.firstOldFace + best.index];
        const Vector3d weights = best.clamped();
        const auto corner = static_cast<Eigen::Index>(entry % 4);
        point.face = entry / 4;
        for (Eigen::Index k = 0; k < 3; ++k) { point.barycentric[(corner + k) % 3] = weights[k]; }
    }
    return point;
}

void CollapseHistory::validate() const
{
    for (std::size_t s = 0; s < _steps.size(); ++s) {
        const StoredStep& step = _steps[s];
        const Vector2d center = _ring[step.firstRing].cast<double>();
        double before = 0.0;
        double after = 0.0;
        const auto take = [&](double& sum, double area) {
            if (!(area > 0.0)) {
                throw std::logic_error("collapse " + std::to_string(s) + " has a triangle turned over");
            }
            sum += area;
        };
        for (unsigned i = 0; i < step.ringSize; ++i) {
            if (i != step.gap) { take(before, twiceArea(center, ringPoint(step, i), ringPoint(step, i + 1))); }
        }
        for (unsigned j = 0; j + 2U < step.ringSize; ++j) {
            take(after, twiceArea(ringPoint(step, 0), ringPoint(step, j + 1), ringPoint(step, j + 2)));
        }
        // Both are the same polygon's area; a dozen double roundings of single precision coordinates stay below 1e-13.
        if (std::fabs(before - after) > 1e-13 * before) {
            throw std::logic_error("collapse " + std::to_string(s) + " does not cover its polygon");
        }
    }
}

} // namespace osgTessLOD::bake
