// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// Vertices of an asset at continuous levels, on the CPU: twin of shaders/tesslod_surface.glsl, to the bit; weights to 10⁻⁷ where
/// nothing is deformed. Keeps a reference to the asset, which must outlive it; levels need not be there before points of theirs, or of
/// the next finer one, are asked for.
class OSGTESSLOD_EXPORT MorphedSurface {
public:
    using Vec3 = std::array<float, 3>;
    using Vec4 = std::array<float, 4>;

    /// A point of the surface.
    struct TessLodPoint {
        Vec3 position; ///< asset frame
        Vec3 weights;  ///< of the patch's corners, sum 1: where its normal is looked up
        Vec3 texCoord; ///< u, v, and how much of it has texture coordinates (0 without)
        Vec4 color;    ///< 0 … 1; white without
    };

    explicit MorphedSurface(const LodAsset& asset);

    /// Per patch 3 + levelCount numbers: lattice origin x, y, z, then for each level the index of its first vertex among
    /// all levels' vertices one after the other, −1 where the patch does not reach the level.
    const std::vector<std::int32_t>& patchTable() const { return _patchTable; }
    /// Vertices of all levels; the patch table is usable only if this fits 31 bits.
    std::uint64_t vertexCount() const { return _levelStarts.back(); }
    /// Index of the first vertex of each level; one more entry than levels.
    const std::vector<std::uint64_t>& levelStarts() const { return _levelStarts; }

    /// Vertex `index` of the pattern that `patch` is drawn with when its sides are at these continuous levels: the pattern of
    /// level ⌈largest⌉. Each level must be ≤ the finest of its edge (so that both sides have it).
    TessLodPoint tessLodSurfacePoint(std::uint32_t patch, const std::array<float, 3>& edgeLevels,
                                     std::uint32_t index) const;

    /// The level whose pattern these sides are drawn with.
    static unsigned drawnLevel(const std::array<float, 3>& edgeLevels);

private:
    std::size_t vertexNumber(std::uint32_t patch, unsigned level, std::uint32_t index) const;
    LodVertex vertex(std::uint32_t patch, unsigned level, std::uint32_t index) const;
    Vec3 tessLodVertexTexCoord(std::uint32_t patch, unsigned level, std::uint32_t index) const;
    Vec4 tessLodVertexColor(std::uint32_t patch, unsigned level, std::uint32_t index) const;
    Vec3 tessLodVertexWeights(std::uint32_t patch, unsigned level, std::uint32_t index) const;
    TessLodPoint tessLodVertexPoint(std::uint32_t patch, unsigned level, std::uint32_t index) const;
    TessLodPoint tessLodBorderPoint(std::uint32_t patch, unsigned level, std::uint32_t index, float edgeLevel) const;

    const LodAsset& _asset;
    std::vector<std::int32_t> _patchTable;
    std::vector<std::uint64_t> _levelStarts;
};

} // namespace osgTessLOD
