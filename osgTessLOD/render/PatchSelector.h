// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Plane>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// Chooses the continuous level of every patch border for a view (Lambert §2.4, with the isotropic error), and from them
/// the patches to draw. Immutable after construction: any number of cull traversals may select at once.
///
/// A border's level depends on the border and the view alone, never on what is culled, and is a continuous function of
/// the view. For that its errors must fall strictly from level to level: where a finer level is no better than a coarser
/// one, the level would jump from k to k + 1 in the moment the coarse one no longer suffices. So the coarser error is
/// taken to be at least 1.1 times the finer: never less than the true one, so the bound is kept.
///
/// Where patches have different finest levels their border ends with the coarser one's. What the finer patch needs there
/// beyond is given to another of its borders, one that reaches as far as it does: so that its inside gets there. A
/// patch is drawn at the largest of its borders' levels; levels finer than all of them are never drawn.
class OSGTESSLOD_EXPORT PatchSelector {
public:
    /// Largest factor that OpenGL lets a tessellator have everywhere.
    static constexpr unsigned kMaxDrawnFactor = 64;

    explicit PatchSelector(const LodAsset& asset);

    struct Result {
        std::vector<PatchRecord> records; ///< grouped by level, coarse first; patch order within a group
        SelectionStatistics statistics;
    };
    /// `frustum`: planes in the drawable's local space, inside positive, any length; a patch whose bounding sphere lies
    /// outside of one is left out, unless options.cullPatches is false. Any view is safe: one that gives no finite
    /// tolerance (no viewport, NaN) selects level 0 everywhere.
    Result select(const SelectionView& view, const SelectionOptions& options,
                  const std::vector<osg::Plane>& frustum) const;

    struct EdgeLevel {
        float level;    ///< continuous, 0 … the edge's finest
        bool saturated; ///< the error asked needs more than one of its patches has or may have
    };
    /// Level of one edge, as select() sees it.
    EdgeLevel edgeLevel(std::uint32_t edge, const SelectionView& view, const SelectionOptions& options) const;

    /// Sums up hand-made records: everything but culled and saturated patches.
    SelectionStatistics statisticsOf(const std::vector<PatchRecord>& records) const;

    /// Records of all patches with all edges at one level, or at their finest where that is coarser.
    std::vector<PatchRecord> uniformRecords(unsigned level) const;

private:
    unsigned capOf(const SelectionOptions& options) const;
    std::vector<EdgeLevel> edgeLevels(const SelectionView& view, const SelectionOptions& options) const;
    EdgeLevel neededLevel(std::uint32_t edge, const SelectionView& view, double errorPixels, unsigned cap) const;
    void addEdge(const LodAsset& asset, std::uint32_t edge, const std::vector<float>& patchErrors);
    void addRelays(const LodPatch& patch);
    void cullPatches(const std::vector<osg::Plane>& frustum, std::vector<std::uint8_t>& visible) const;

    std::vector<std::uint16_t> _ladder;
    // Per edge.
    std::vector<std::array<float, 3>> _edgeCenters;
    std::vector<std::uint8_t> _edgeFinest;
    std::vector<std::uint8_t> _edgeReach; ///< finest level that either patch is drawn at
    std::vector<float> _edgeErrors;       ///< ladder.size() per edge, falling up to that level; object units
    std::vector<float> _edgeEndErrors;    ///< of the patches that are drawn no finer than the edge, at its finest level
    /// What a patch needs at an edge that ends before it goes to the carrier.
    struct Relay {
        std::uint32_t ended;
        std::uint32_t carrier;
    };
    std::vector<Relay> _relays;
    // Per patch.
    std::vector<std::array<std::uint32_t, 3>> _patchEdges;
    std::vector<std::array<float, 4>> _patchSpheres;
};

} // namespace osgTessLOD
