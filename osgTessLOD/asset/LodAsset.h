// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodMaterial.h>
#include <osgTessLOD/asset/ViewError.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD {

constexpr std::uint32_t kNoPatch = 0xFFFFFFFFU;

/// The integer grid that all positions of an asset lie on. A vertex's lattice position is its patch's integer origin
/// plus a 17-bit offset; its position in the asset's frame is step · float(lattice position), one multiplication after
/// the exact integer sum, so that what two patches share decodes to the same bits. The frame's origin in the source's
/// space is `origin`: (0,0,0) unless the source lies far from it compared with its size.
struct Lattice {
    std::array<double, 3> origin{};
    float step = 1.0F;

    static constexpr int kOffsetBits = 17;
    static constexpr std::int32_t kMaxOffset = (1 << kOffsetBits) - 1;
};

/// One vertex of the hierarchy as it goes to the GPU: three 17-bit lattice offsets and the 13-bit index of its parent in
/// the same patch's pattern one level coarser (0 at level 0). Bits 0–16 x, 17–33 y, 34–50 z, 51–63 parent.
struct LodVertex {
    std::uint64_t bits = 0;

    static constexpr std::uint32_t kMaxParent = (1U << 13) - 1;

    static LodVertex pack(const std::array<std::int32_t, 3>& offset, std::uint32_t parent)
    {
        const auto part = [&](int axis) { return static_cast<std::uint64_t>(offset[static_cast<std::size_t>(axis)]); };
        return LodVertex{part(0) | part(1) << 17 | part(2) << 34 | static_cast<std::uint64_t>(parent) << 51};
    }
    std::array<std::int32_t, 3> offset() const
    {
        const auto part = [&](int shift) { return static_cast<std::int32_t>(bits >> shift & 0x1FFFF); };
        return {part(0), part(17), part(34)};
    }
    std::uint32_t parent() const { return static_cast<std::uint32_t>(bits >> 51); }
    bool operator==(const LodVertex& o) const { return bits == o.bits; }
};

/// The grid that the texture coordinates of an asset's vertices lie on: two 16-bit numbers per vertex, u in the low half, over
/// the box around all of them. They are off by half a step at most; a step is 1/65,534 of the box's side.
struct OSGTESSLOD_EXPORT UvLattice {
    static constexpr std::uint32_t kUnits = 65534;        ///< the largest number
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;   ///< of a vertex without texture coordinates

    std::array<float, 2> origin{};
    std::array<float, 2> step{};

    std::uint32_t encode(float u, float v) const;         ///< kNone for what is not a number
    /// u, v and 1; 0, 0, 0 without. Exactly as the GPU computes it.
    std::array<float, 3> decode(std::uint32_t bits) const
    {
        if (bits == kNone) { return {}; }
        return {origin[0] + static_cast<float>(bits & 0xFFFFU) * step[0], origin[1] + static_cast<float>(bits >> 16) * step[1],
                1.0F};
    }
};

/// A triangular patch of the control mesh. Edge s joins corner s to corner s + 1 (mod 3).
struct LodPatch {
    std::array<std::uint32_t, 3> baseVertices{};
    std::array<std::uint32_t, 3> edges{};
    std::array<std::int32_t, 3> latticeOrigin{};
    std::array<float, 3> boundCenter{};  ///< sphere around every level's surface, morphs included; asset frame
    float boundRadius = 0.0F;
    std::array<float, 3> coneAxis{0.0F, 0.0F, 1.0F}; ///< unit, of the cones of the patch's normals: LevelError::coneCosine
    float chartError = 0.0F;             ///< two-sided distance chart ↔ source, contained in every level's error
    std::uint8_t finestLevel = 0;        ///< index into LodAsset::ladder
};

/// A border between two patches, or an open border (patches[1] == kNoPatch).
/// patches[0] runs along it from baseVertices[0] to baseVertices[1], patches[1] the other way.
struct LodEdge {
    std::array<std::uint32_t, 2> baseVertices{};
    std::array<std::uint32_t, 2> patches{kNoPatch, kNoPatch};
    /// The smaller of its patches' finest levels; an open border may end before its patch.
    std::uint8_t finestLevel = 0;
    /// It is drawn no coarser than this, whatever the view and the largest factor asked for: 0, or finestLevel of a seam, an open
    /// border along which another asset is to meet this one.
    std::uint8_t coarsestLevel = 0;
};

/// Error of one patch at one level against the source, object units; and how it may be seen from behind.
struct LevelError {
    ViewError quadratic;
    float isotropic = 0.0F;
    /// Cosine of the angle that the normals of the level's triangles, and of all coarser levels', which its borders may be at,
    /// are within of LodPatch::coneAxis; −1: of any. Slivers that turn over in a morph from one of these to the next do not count.
    float coneCosine = -1.0F;
};

/// One level of every patch that reaches it, in patch order: pattern vertices in index order.
struct LodLevel {
    std::vector<LodVertex> vertices;
    std::vector<LevelError> errors;      ///< one per patch that reaches the level
    /// Where in its patch each vertex lies, as ChartPoint::bits: what its normal is looked up by. In the order of `vertices`;
    /// empty when all lie where the pattern has them. Levels may differ in this, patches of a level not.
    std::vector<std::uint32_t> parameters;
    std::vector<std::uint32_t> uvs;      ///< texture coordinates of each vertex, in UvLattice; in all levels or none
    /// One per patch that reaches the level, if there are uvs: how far those of the level's mesh are from the source's at most,
    /// taken at the same point of the patch. Units of the texture: its width and height are 1.
    std::vector<float> uvErrors;
    std::vector<std::uint32_t> colors;   ///< of each vertex: red in the low byte, green, blue, alpha; in all levels or none
};

/// Normals of the source on each patch's regular triangular grid, as a chain of halved resolutions.
/// Grid point (i, j) of resolution r, 0 ≤ i, j, i + j ≤ r, has corner weights ((r−i−j)/r, i/r, j/r) and index
/// j·(2r + 3 − j)/2 + i. A normal is octahedral, two 16-bit signed normalized numbers (x in the low half).
struct NormalTexture {
    static constexpr std::uint32_t kMaxResolution = 1024;

    std::uint32_t resolution = 0;                    ///< of the finest, a power of two; 0: the asset has no normals
    std::vector<std::vector<std::uint32_t>> levels;  ///< resolution 1, 2, 4 …: patchCount · texelCount(r) values each

    static std::uint32_t texelCount(std::uint32_t resolution) { return (resolution + 1) * (resolution + 2) / 2; }
    /// Of the chain down to resolution 1.
    std::size_t resolutionCount() const
    {
        std::size_t count = 0;
        while (resolution >> count != 0) { ++count; }
        return count;
    }
};

/// What a bake produces and a renderer consumes.
struct OSGTESSLOD_EXPORT LodAsset {
    static constexpr std::size_t kMaxLevels = 16;
    static constexpr std::size_t kMaxMaterials = 65536;

    std::string technique;               ///< how the levels were made: "uniform", …
    std::string source;                  ///< what they were made from, for people
    std::uint64_t sourceTriangles = 0;
    std::vector<std::uint16_t> ladder;   ///< tessellation factor of each level, rising: 1, 2, 4 … 64
    Lattice lattice;
    std::vector<std::array<std::int32_t, 3>> baseVertices; ///< lattice positions
    std::vector<LodEdge> edges;
    std::vector<LodPatch> patches;
    std::vector<LodLevel> levels;        ///< one per ladder entry
    NormalTexture normals;
    UvLattice uvLattice;                 ///< of the levels' uvs
    std::vector<LodMaterial> materials;  ///< empty: the scene's state is all there is
    /// Of each patch, an index into materials; empty where there is no choice. Borders between materials are borders of patches.
    std::vector<std::uint16_t> patchMaterials;
    std::vector<LodImage> images;        ///< that textures of materials refer to by name; the others are files
    std::array<float, 3> boundsMin{};    ///< box around every level's surface, asset frame
    std::array<float, 3> boundsMax{};

    bool hasUvs() const { return !levels.empty() && !levels.front().uvs.empty(); }
    /// The image in the asset that a texture refers to; null: it is a file.
    const LodImage* imageOf(const LodTexture& texture) const;
    /// Is there an edge with a coarsestLevel above 0?
    bool hasSeams() const;
    bool hasColors() const { return !levels.empty() && !levels.front().colors.empty(); }

    /// How many levels have factors up to this one; level 0 at least.
    unsigned levelsUpTo(unsigned factor) const;

    /// Position of each patch within level `level`, kNoPatch for those that do not reach it. Its vertices start at
    /// slot · vertexCount(ladder[level]), its error is errors[slot].
    std::vector<std::uint32_t> levelSlots(std::size_t level) const;

    /// Position in the asset's frame, exactly as the GPU computes it.
    std::array<float, 3> position(const LodPatch& patch, LodVertex vertex) const;

    /// Throws AssetError naming the fault unless every count, index and bound is consistent: ladder valid and rising,
    /// patches and edges referring to each other, vertices as many as the levels need, parents in range and on the border
    /// where their child is and along it without gaps, shared border vertices and corners equal on both sides, parameters
    /// inside the patch or on its sides as their vertices are and alike from both, texture coordinates and colours at every
    /// vertex or none and colours alike from both sides of a border, materials in range, numbers finite. That bounds hold what they say they hold is not checked.
    void validate() const;
    /// The same of all but what is in validateLevel and validateNormals.
    void validateFrame() const;
    /// Of what a level has for each of its vertices; the rest is valid, and level 0 is there.
    void validateLevel(std::size_t level) const;
    /// Of the normals of resolution 2^level; the rest is valid.
    void validateNormals(std::size_t level) const;
};

} // namespace osgTessLOD
