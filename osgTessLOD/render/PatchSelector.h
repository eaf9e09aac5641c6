// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/PatchTree.h>
#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Plane>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// Chooses the continuous level of every patch border for a view (Lambert §2.4), and from them the patches to draw. Immutable
/// after construction: any number of cull traversals may select at once.
///
/// A border's level is the larger of its two patches' needs (LevelNeed), even of one that is culled, but at most its finest. It
/// depends on the border, its patches and the view alone, never on what is culled, and is a continuous function of the view. No
/// border of a patch is then below what the patch needs, except those that end before: that is what the stored errors are about.
/// What a patch needs at a border that ends before it, it gets from the border that goes on farthest.
///
/// A tree of bounding spheres spares what is out of view, or needs the same level wherever in a sphere it lies: a model of
/// which all is, costs a test of its root and the copying of its records.
class OSGTESSLOD_EXPORT PatchSelector {
public:
    /// Largest factor that OpenGL lets a tessellator have everywhere.
    static constexpr unsigned kMaxDrawnFactor = 64;

    explicit PatchSelector(const LodAsset& asset);

    struct Result {
        std::vector<PatchRecord> records; ///< grouped by level, coarse first; neighbours near each other
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
    /// Level of one edge, as select() sees it, by itself.
    EdgeLevel edgeLevel(std::uint32_t edge, const SelectionView& view, const SelectionOptions& options) const;

    /// Sums up hand-made records: everything but culled and saturated patches.
    SelectionStatistics statisticsOf(const std::vector<PatchRecord>& records) const;

    /// Records of all patches with all edges at one level, or at their finest where that is coarser.
    std::vector<PatchRecord> uniformRecords(unsigned level) const;

private:
    class Visit;

    /// A patch, at its position in the tree's order. Its side s has the number 3 · position + s among all sides.
    struct Patch {
        std::uint32_t number;               ///< in the asset
        std::array<std::uint32_t, 3> twins; ///< the sides on the other side of its borders; its own at open ones
        std::array<osg::Vec3f, 3> borderMiddles;
        std::array<std::uint8_t, 3> borderFinest;
        BoundSphere sphere;

        /// The side whose border goes on farthest, the first one.
        std::size_t carrier() const
        {
            return static_cast<std::size_t>(std::max_element(borderFinest.begin(), borderFinest.end()) - borderFinest.begin());
        }
        /// The finest level that the patch is drawn at.
        unsigned reach() const { return borderFinest[carrier()]; }
    };

    unsigned capOf(const SelectionOptions& options) const;
    std::array<float, 3> needsOf(std::uint32_t position, const LevelNeed& need) const;
    bool isSaturated(std::uint32_t position, const LevelNeed& need, unsigned cap) const;
    void addPatches(const LodAsset& asset);
    void linkSides(const LodAsset& asset);
    void boundNodes();

    std::vector<std::uint16_t> _ladder;
    PatchTree _tree;
    std::vector<Patch> _patches;
    std::vector<float> _errors;            ///< per patch LevelNeed::kErrorRows rows
    std::vector<float> _nodeBounds;        ///< per node LevelNeed::kBoundRows rows
    std::vector<std::uint32_t> _edgeSides; ///< one side of each edge; kNoPatch if no patch has it
};

} // namespace osgTessLOD
