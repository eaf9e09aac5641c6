// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/UvLocator.h>

#include <osgTessLOD/bake/PlaneTriangle.h>
#include <osgTessLOD/bake/SourceSurface.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::AlignedBox2d;
using Eigen::Vector2d;
using Eigen::Vector2i;
using Eigen::Vector3d;

/// Weights that are negative by less than this are rounding's: single precision texture coordinates in double.
constexpr double kOnBorder = 1e-9;

using Corners = std::array<Vector2d, 3>;

Corners cornersOf(const SourceMesh& mesh, std::uint32_t face)
{
    const auto& uvs = mesh.uvs[face];
    return {uvs[0].cast<double>(), uvs[1].cast<double>(), uvs[2].cast<double>()};
}

AlignedBox2d boxOf(const Corners& c)
{
    AlignedBox2d box(c[0]);
    box.extend(c[1]);
    box.extend(c[2]);
    return box;
}

/// Weights of the point of a triangle's border that is nearest to p.
Vector3d nearestOnBorder(const Corners& c, const Vector2d& p)
{
    Vector3d best = Vector3d::UnitX();
    double bestDistance = std::numeric_limits<double>::infinity();
    for (unsigned k = 0; k < 3; ++k) {
        const unsigned next = (k + 1) % 3;
        const Vector2d side = c[next] - c[k];
        const double length = side.squaredNorm();
        const double along = length > 0.0 ? std::clamp(side.dot(p - c[k]) / length, 0.0, 1.0) : 0.0;
        const double distance = (c[k] + along * side - p).squaredNorm();
        if (distance >= bestDistance) { continue; }
        bestDistance = distance;
        best.setZero();
        best[k] = 1.0 - along;
        best[next] = along;
    }
    return best;
}

} // namespace

/// The best so far: nearest in the texture plane, then in space, then of the lowest number.
struct UvLocator::Found {
    double planeDistance = std::numeric_limits<double>::infinity();
    double spaceDistance = std::numeric_limits<double>::infinity();
    FacePoint point{CollapseHistory::kNone, Vector3d::Zero()};

    void offer(double inPlane, double inSpace, const FacePoint& at)
    {
        const bool alike = inPlane == planeDistance && inSpace == spaceDistance;
        const bool nearer = inPlane < planeDistance || (inPlane == planeDistance && inSpace < spaceDistance);
        if (nearer || (alike && at.face < point.face)) { *this = {inPlane, inSpace, at}; }
    }
};

UvLocator::UvLocator(const SourceMesh& mesh)
    : _mesh(mesh)
{
    std::size_t count = 0;
    for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f) {
        if (!mesh.hasUvs(f)) { continue; }
        _box.extend(boxOf(cornersOf(mesh, f)));
        ++count;
    }
    // About as many cells as triangles, as square as can be.
    const Vector2d sizes = _box.sizes().cwiseMax(1e-9 * std::max(_box.sizes().maxCoeff(), 1e-30));
    const double perUnit = std::sqrt(static_cast<double>(count) / (sizes.x() * sizes.y()));
    constexpr double kMostCells = 8192;
    for (Eigen::Index k = 0; k < 2; ++k) {
        _cells[k] = static_cast<int>(std::clamp(std::ceil(sizes[k] * perUnit), 1.0, kMostCells));
    }
    build();
}

void UvLocator::build()
{
    const auto forEachFace = [&](auto&& visit) {
        for (std::uint32_t f = 0; f < _mesh.triangles.size(); ++f) {
            if (!_mesh.hasUvs(f)) { continue; }
            const AlignedBox2d box = boxOf(cornersOf(_mesh, f));
            const Vector2i low = cellAt(box.min());
            const Vector2i high = cellAt(box.max());
            for (int y = low.y(); y <= high.y(); ++y) {
                for (int x = low.x(); x <= high.x(); ++x) { visit(static_cast<std::size_t>(y) * _cells.x() + x, f); }
            }
        }
    };
    _firstInCell.assign(static_cast<std::size_t>(_cells.x()) * _cells.y() + 1, 0);
    forEachFace([&](std::size_t cell, std::uint32_t) { ++_firstInCell[cell + 1]; });
    for (std::size_t i = 1; i < _firstInCell.size(); ++i) { _firstInCell[i] += _firstInCell[i - 1]; }
    std::vector<std::uint32_t> next(_firstInCell.begin(), _firstInCell.end() - 1);
    _faces.resize(_firstInCell.back());
    forEachFace([&](std::size_t cell, std::uint32_t f) { _faces[next[cell]++] = f; });
}

Vector2i UvLocator::cellAt(const Vector2d& uv) const
{
    Vector2i cell = Vector2i::Zero();
    for (Eigen::Index k = 0; k < 2; ++k) {
        const double size = _box.sizes()[k];
        const double at = size > 0.0 ? (uv[k] - _box.min()[k]) / size * _cells[k] : 0.0;
        cell[k] = static_cast<int>(std::clamp(std::floor(at), 0.0, _cells[k] - 1.0));
    }
    return cell;
}

template <typename Visit> void UvLocator::forEachIn(const AlignedBox2d& box, Visit visit) const
{
    const Vector2i low = cellAt(box.min());
    const Vector2i high = cellAt(box.max());
    for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
            const std::size_t cell = static_cast<std::size_t>(y) * _cells.x() + x;
            for (std::uint32_t i = _firstInCell[cell]; i < _firstInCell[cell + 1]; ++i) { visit(_faces[i]); }
        }
    }
}

std::optional<FacePoint> UvLocator::find(const Vector2d& uv, double tolerance, const Vector3d& near) const
{
    Found found;
    const auto inSpace = [&](const FacePoint& point) { return (positionAt(_mesh, point) - near).squaredNorm(); };
    forEachIn(AlignedBox2d(uv), [&](std::uint32_t f) {
        const Corners c = cornersOf(_mesh, f);
        const Vector3d weights = weightsOf(uv, c[0], c[1], c[2]);
        if (!(weights.minCoeff() >= -kOnBorder)) { return; } // also where the triangle has no area
        const Vector3d clamped = weights.cwiseMax(0.0);
        const FacePoint point{f, clamped / clamped.sum()};
        found.offer(0.0, inSpace(point), point);
    });
    if (found.point.face != CollapseHistory::kNone) { return found.point; }
    const Vector2d reach = Vector2d::Constant(tolerance);
    forEachIn(AlignedBox2d(uv - reach, uv + reach), [&](std::uint32_t f) {
        const Corners c = cornersOf(_mesh, f);
        const FacePoint point{f, nearestOnBorder(c, uv)};
        const Vector3d& w = point.barycentric;
        const double inPlane = (w[0] * c[0] + w[1] * c[1] + w[2] * c[2] - uv).norm();
        if (inPlane <= tolerance) { found.offer(inPlane, inSpace(point), point); }
    });
    if (found.point.face == CollapseHistory::kNone) { return std::nullopt; }
    return found.point;
}

} // namespace osgTessLOD::bake
