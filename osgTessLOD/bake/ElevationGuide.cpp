// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/ElevationGuide.h>

#include <Eigen/Geometry>

#include <algorithm>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

ElevationGuide::ElevationGuide(const SourceMesh& source, double leastCosine)
    : _leastCosine(leastCosine)
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

bool ElevationGuide::faces(std::uint32_t vertex, const Vector3d& ray) const
{
    const double least = _leastCosine * ray.norm();
    return std::all_of(_around.begin() + _first[vertex], _around.begin() + _first[vertex + 1],
                       [&](std::uint32_t t) { return _normals[t].dot(ray) >= least; });
}

void ElevationGuide::tighten(std::uint32_t vertex, double weight)
{
    constexpr double kShrink = 0.25;
    constexpr double kLeast = 8.0; // source triangles: below, none is collapsed
    const double limit = kShrink * std::min(weight, _largestWeight[vertex]);
    _largestWeight[vertex] = limit < kLeast ? 0.0 : limit;
}

} // namespace osgTessLOD::bake
