// SPDX-License-Identifier: MIT
// Lambert §3.2, §3.3; kept line by line like shaders/tesslod_surface.glsl.
#include <osgTessLOD/render/MorphedSurface.h>

#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace osgTessLOD {

namespace {

using Vec3 = MorphedSurface::Vec3;
using Vec4 = MorphedSurface::Vec4;
using TessLodPoint = MorphedSurface::TessLodPoint;

/// t of the way from `from` to `to`; exactly `to` at t = 1.
TessLodPoint tessLodMix(const TessLodPoint& from, const TessLodPoint& to, float t)
{
    if (t >= 1.0F) { return to; }
    const auto mix = [t](auto a, const auto& b) {
        for (std::size_t k = 0; k < a.size(); ++k) { a[k] = a[k] + (b[k] - a[k]) * t; }
        return a;
    };
    return {mix(from.position, to.position), mix(from.weights, to.weights), mix(from.texCoord, to.texCoord),
            mix(from.color, to.color)};
}

/// `weights` times scale / (divisor · 2²³), to the nearest multiple of 2⁻²³.
Vec3 tessLodExactWeights(const std::array<std::uint32_t, 3>& weights, std::uint32_t scale, std::uint32_t divisor)
{
    const auto exact = [&](std::uint32_t w) {
        return static_cast<float>((w * scale + divisor / 2) / divisor) / 8388608.0F;
    };
    return {exact(weights[0]), exact(weights[1]), exact(weights[2])};
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
        std::uint64_t end = _levelStarts.back();
        for (std::size_t p = 0; p < slots.size(); ++p) {
            if (slots[p] == kNoPatch) { continue; }
            _patchTable[p * stride + 3 + level] = static_cast<std::int32_t>(end);
            end += count;
        }
        _levelStarts.push_back(end);
    }
}

unsigned MorphedSurface::drawnLevel(const std::array<float, 3>& edgeLevels)
{
    return static_cast<unsigned>(std::ceil(largest(edgeLevels)));
}

/// Of a vertex among those of its level.
std::size_t MorphedSurface::vertexNumber(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    const std::size_t row = patch * (3 + _asset.levels.size());
    const std::int32_t first = _patchTable[row + 3 + level];
    assert(first >= 0);
    return static_cast<std::uint64_t>(first) - _levelStarts[level] + index;
}

LodVertex MorphedSurface::vertex(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    return _asset.levels[level].vertices[vertexNumber(patch, level, index)];
}

Vec3 MorphedSurface::tessLodVertexWeights(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    const std::vector<std::uint32_t>& parameters = _asset.levels[level].parameters;
    if (!parameters.empty()) {
        const ChartPoint at = ChartPoint::fromBits(parameters[vertexNumber(patch, level, index)]);
        const auto units = [](std::int32_t weight) { return static_cast<std::uint32_t>(weight); };
        return tessLodExactWeights({units(ChartPoint::kUnits - at.u - at.v), units(at.u), units(at.v)}, 512, 3);
    }
    const unsigned factor = _asset.ladder[level];
    return tessLodExactWeights(TessellationPattern::barycentric(factor, index), 1U << 23, 3 * factor);
}

Vec3 MorphedSurface::tessLodVertexTexCoord(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    if (!_asset.hasUvs()) { return {}; }
    return _asset.uvLattice.decode(_asset.levels[level].uvs[vertexNumber(patch, level, index)]);
}

Vec4 MorphedSurface::tessLodVertexColor(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    if (!_asset.hasColors()) { return {1.0F, 1.0F, 1.0F, 1.0F}; }
    const std::uint32_t bits = _asset.levels[level].colors[vertexNumber(patch, level, index)];
    const auto channel = [bits](unsigned shift) { return static_cast<float>(bits >> shift & 0xFFU) * 0.003921569F; };
    return {channel(0), channel(8), channel(16), channel(24)};
}

TessLodPoint MorphedSurface::tessLodVertexPoint(std::uint32_t patch, unsigned level, std::uint32_t index) const
{
    return {_asset.position(_asset.patches[patch], vertex(patch, level, index)), tessLodVertexWeights(patch, level, index),
            tessLodVertexTexCoord(patch, level, index), tessLodVertexColor(patch, level, index)};
}

TessLodPoint MorphedSurface::tessLodBorderPoint(std::uint32_t patch, unsigned level, std::uint32_t index,
                                                float edgeLevel) const
{
    const auto reached = static_cast<unsigned>(std::ceil(edgeLevel));
    for (; level > reached; --level) { index = vertex(patch, level, index).parent(); }
    const TessLodPoint own = tessLodVertexPoint(patch, level, index);
    const float t = edgeLevel - (static_cast<float>(level) - 1.0F);
    if (level == 0 || t >= 1.0F) { return own; }
    const std::uint32_t parent = vertex(patch, level, index).parent();
    return tessLodMix(tessLodVertexPoint(patch, level - 1, parent), own, t);
}

TessLodPoint MorphedSurface::tessLodSurfacePoint(std::uint32_t patch, const std::array<float, 3>& edgeLevels,
                                                 std::uint32_t index) const
{
    const float patchLevel = largest(edgeLevels);
    const unsigned level = drawnLevel(edgeLevels);
    const std::uint32_t factor = _asset.ladder[level];
    if (index < 3 * factor) {
        return tessLodBorderPoint(patch, level, index, tessLodBorderLevel(factor, index, edgeLevels));
    }
    const TessLodPoint own = tessLodVertexPoint(patch, level, index);
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
