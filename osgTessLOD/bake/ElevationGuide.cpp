// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ElevationGuide.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

ElevationGuide::ElevationGuide(const SourceMesh& source, double leastCosine)
    : _source(source)
    , _leastCosine(leastCosine)
    , _first(source.positions.size() + 1, 0)
    , _around(3 * source.triangles.size())
    , _largestWeight(source.positions.size(), std::numeric_limits<double>::infinity())
{
    for (const auto& t : source.triangles) {
        const Vector3d& a = source.positions[t[0]];
        const Vector3d n = (source.positions[t[1]] - a).cross(source.positions[t[2]] - a);
        _normals.push_back(n.norm() > 0.0 ? n.normalized() : Vector3d::Zero().eval());
        for (const std::uint32_t v : t) { ++_first[v + 1]; }
    }
    for (std::size_t v = 0; v + 1 < _first.size(); ++v) { _first[v + 1] += _first[v]; }
    std::vector<std::uint32_t> next(_first.begin(), _first.end() - 1);
    for (std::uint32_t t = 0; t < source.triangles.size(); ++t) {
        for (const std::uint32_t v : source.triangles[t]) { _around[next[v]++] = t; }
    }
}

bool ElevationGuide::isOpen(const RayPrism& prism, const Reach& reach)
{
    constexpr double kLeastOpening = 0.2;
    return prism.opening(reach.low, reach.high) >= kLeastOpening;
}

bool ElevationGuide::faces(const RayPrism& prism, std::uint32_t vertex, const Vector3d& barycentric, Reach& reach) const
{
    const Vector3d ray = prism.rayAt(barycentric);
    const double square = ray.squaredNorm();
    if (!(square > 0.0)) { return false; }
    const double least = _leastCosine * std::sqrt(square);
    for (std::uint32_t i = _first[vertex]; i < _first[vertex + 1]; ++i) {
        if (_normals[_around[i]].dot(ray) < least) { return false; }
    }
    const double height = ray.dot(_source.positions[vertex] - prism.pointAt(barycentric)) / square;
    reach.low = std::min(reach.low, height);
    reach.high = std::max(reach.high, height);
    return true;
}

void ElevationGuide::tighten(std::uint32_t vertex, double weight)
{
    constexpr double kShrink = 0.5;
    constexpr double kLeast = 8.0; // source triangles: below, none is collapsed
    const double limit = std::min(kShrink * weight, _largestWeight[vertex]);
    _largestWeight[vertex] = limit < kLeast ? 0.0 : limit;
}

} // namespace osgTessLOD::bake
