// SPDX-License-Identifier: MIT
// Lambert §3.2, §3.3; the functions are those of render/MorphedSurface and carry their names.
#include <osgTessLOD/bake/MorphedLevels.h>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Vertex {
    Vector3d position;
    Vector2d point; ///< lattice units, unrounded
};

Vertex mix(const Vertex& from, const Vertex& to, double t)
{
    return {from.position + (to.position - from.position) * t, from.point + (to.point - from.point) * t};
}

/// Nearest lattice point; what is on a side stays on it.
ChartPoint toLattice(const Vector2d& p)
{
    const auto u = std::min(static_cast<std::int32_t>(std::lround(p.x())), ChartPoint::kUnits);
    constexpr double kOnSide = 1e-6;
    const std::int32_t room = ChartPoint::kUnits - u;
    if (p.x() + p.y() > ChartPoint::kUnits - kOnSide) { return {u, room}; }
    return {u, std::min(static_cast<std::int32_t>(std::lround(p.y())), room)};
}

class Morph {
public:
    Morph(const PatchLevels& levels, const std::vector<std::uint16_t>& ladder,
          const std::vector<std::vector<ChartPoint>>& places, double patchLevel,
          const std::array<double, 3>& borderLevels)
        : _levels(levels)
        , _ladder(ladder)
        , _places(places)
        , _patchLevel(patchLevel)
        , _borderLevels(borderLevels)
    {
    }

    Vertex surfacePoint(std::uint32_t index) const
    {
        const auto level = static_cast<std::size_t>(std::ceil(_patchLevel));
        const std::uint32_t factor = _ladder[level];
        if (index < 3 * factor) { return borderPoint(level, index, _borderLevels[index / factor]); }
        const Vertex own = vertexPoint(level, index);
        const double t = _patchLevel - (static_cast<double>(level) - 1.0);
        if (level == 0 || t >= 1.0) { return own; }
        const std::uint32_t parent = _levels.parents[level][index];
        const std::uint32_t parentFactor = _ladder[level - 1];
        if (parent >= 3 * parentFactor) { return mix(vertexPoint(level - 1, parent), own, t); }
        const double borderLevel = std::min(_borderLevels[parent / parentFactor], static_cast<double>(level - 1));
        return mix(borderPoint(level - 1, parent, borderLevel), own, t);
    }

private:
    Vertex vertexPoint(std::size_t level, std::uint32_t index) const
    {
        const ChartPoint p = _levels.hasParameters(level) ? _levels.parameters[level][index] : _places[level][index];
        return {_levels.positions[level][index], Vector2d(p.u, p.v)};
    }

    Vertex borderPoint(std::size_t level, std::uint32_t index, double borderLevel) const
    {
        const auto reached = static_cast<std::size_t>(std::ceil(borderLevel));
        for (; level > reached; --level) { index = _levels.parents[level][index]; }
        const Vertex own = vertexPoint(level, index);
        const double t = borderLevel - (static_cast<double>(level) - 1.0);
        if (level == 0 || t >= 1.0) { return own; }
        return mix(vertexPoint(level - 1, _levels.parents[level][index]), own, t);
    }

    const PatchLevels& _levels;
    const std::vector<std::uint16_t>& _ladder;
    const std::vector<std::vector<ChartPoint>>& _places;
    double _patchLevel;
    std::array<double, 3> _borderLevels;
};

} // namespace

MorphedPatch morphPatch(const PatchLevels& levels, const std::vector<std::uint16_t>& ladder,
                        const std::vector<std::vector<ChartPoint>>& places, double patchLevel,
                        const std::array<double, 3>& borderLevels)
{
    const Morph morph(levels, ladder, places, patchLevel, borderLevels);
    const auto level = static_cast<std::size_t>(std::ceil(patchLevel));
    MorphedPatch result;
    for (std::uint32_t v = 0; v < levels.positions[level].size(); ++v) {
        const Vertex vertex = morph.surfacePoint(v);
        result.positions.push_back(vertex.position);
        result.points.push_back(toLattice(vertex.point));
    }
    return result;
}

} // namespace osgTessLOD::bake
