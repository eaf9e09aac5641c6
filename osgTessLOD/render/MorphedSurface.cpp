// SPDX-License-Identifier: MIT
// Lambert §3.2, §3.3; kept line by line like shaders/tesslod_surface.glsl.
#include <osgTessLOD/render/MorphedSurface.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace osgTessLOD {

namespace {

using Vec3 = MorphedSurface::Vec3;

/// t of the way from `from` to `to`; exactly `to` at t = 1.
Vec3 tessLodMix(const Vec3& from, const Vec3& to, float t)
{
    if (t >= 1.0F) { return to; }
    Vec3 result{};
    for (std::size_t k = 0; k < 3; ++k) { result[k] = from[k] + (to[k] - from[k]) * t; }
    return result;
}

float tessLodBorderLevel(std::uint32_t factor, std::uint32_t index, const std::array<float, 3>& edgeLevels)
{
    return edgeLevels[index / factor];
}

float largest(const std::array<float, 3>& levels)
{
    return std::max(levels[0], std::max(levels[1], levels[2]));
}

} // namespace

MorphedSurface::MorphedSurface(const LodAsset& asset)
    : _asset(asset)
    , _levelStarts{0}
{
    const std::size_t levelCount = asset.levels.size();
    const std::size_t stride = 3 + levelCount;
    _patchTable.assign(asset.patches.size() * stride, -1);
    for (std::size_t p = 0; p < asset.patches.size(); ++p) {
        std::copy_n(asset.patches[p].latticeOrigin.begin(), 3, &_patchTable[p * stride]);
    }
    for (std::size_t level = 0; level < levelCount; ++level) {
        const std::vector<std::uint32_t> slots = asset.levelSlots(level);
        const std::uint64_t count = TessellationPattern::vertexCount(asset.ladder[level]);
        for (std::size_t p = 0; p < slots.size(); ++p) {
            if (slots[p] == kNoPatch) { continue; }
            _patchTable[p * stride + 3 + level] = static_cast<std::int32_t>(_levelStarts.back() + slots[p] * count);
        }
        _levelStarts.push_back(_levelStarts.back() + asset.levels[level].vertices.size());
    }
}

unsigned MorphedSurface::drawnLevel(const std::array<float, 3>& edgeLevels)
{
    return static_cast<unsigned>(std::ceil(largest(edgeLevels)));
}

LodVertex MorphedSurface::vertex(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    const std::size_t row = patch * (3 + _asset.levels.size());
    const std::int32_t first = _patchTable[row + 3 + level];
    assert(first >= 0);
    return _asset.levels[level].vertices[static_cast<std::uint64_t>(first) - _levelStarts[level] + index];
}

Vec3 MorphedSurface::tessLodVertexPoint(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    return _asset.position(_asset.patches[patch], vertex(patch, level, index));
}

Vec3 MorphedSurface::tessLodBorderPoint(std::uint32_t patch, unsigned level, std::uint32_t index, float edgeLevel) const
{
    const auto reached = static_cast<unsigned>(std::ceil(edgeLevel));
    for (; level > reached; --level) { index = vertex(patch, level, index).parent(); }
    const Vec3 own = tessLodVertexPoint(patch, level, index);
    const float t = edgeLevel - (static_cast<float>(level) - 1.0F);
    if (level == 0 || t >= 1.0F) { return own; }
    const std::uint32_t parent = vertex(patch, level, index).parent();
    return tessLodMix(tessLodVertexPoint(patch, level - 1, parent), own, t);
}

Vec3 MorphedSurface::tessLodSurfacePoint(std::uint32_t patch, const std::array<float, 3>& edgeLevels,
                                         std::uint32_t index) const
{
    const float patchLevel = largest(edgeLevels);
    const unsigned level = drawnLevel(edgeLevels);
    const std::uint32_t factor = _asset.ladder[level];
    if (index < 3 * factor) {
        return tessLodBorderPoint(patch, level, index, tessLodBorderLevel(factor, index, edgeLevels));
    }
    const Vec3 own = tessLodVertexPoint(patch, level, index);
    const float t = patchLevel - (static_cast<float>(level) - 1.0F);
    if (level == 0 || t >= 1.0F) { return own; }
    const std::uint32_t parent = vertex(patch, level, index).parent();
    const std::uint32_t parentFactor = _asset.ladder[level - 1];
    if (parent >= 3 * parentFactor) { return tessLodMix(tessLodVertexPoint(patch, level - 1, parent), own, t); }
    const float borderLevel =
        std::min(tessLodBorderLevel(parentFactor, parent, edgeLevels), static_cast<float>(level - 1));
    return tessLodMix(tessLodBorderPoint(patch, level - 1, parent, borderLevel), own, t);
}

} // namespace osgTessLOD
