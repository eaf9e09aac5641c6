// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/PatchBlocks.h>
#include <osgTessLOD/render/PatchRecords.h>
#include <osgTessLOD/render/PatchTree.h>
#include <osgTessLOD/render/RecordPool.h>
#include <osgTessLOD/render/SelectionOptions.h>
#include <osgTessLOD/render/SelectionStatistics.h>
#include <osgTessLOD/render/SelectionView.h>

#include <osg/Plane>

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD {

class ControlMeshDeformation;
class LevelNeed;

/// Chooses the continuous level of every patch border for a view (Lambert §2.4), and from them the patches to draw. Immutable
/// after construction: any number of cull traversals may select at once.
///
/// A border's level is the larger of its two patches' needs (LevelNeed), even of one that is culled, but at most its finest. It
/// depends on the border, its patches and the view alone, never on what is culled, and is a continuous function of the view. No
/// border of a patch is then below what the patch needs, except those that end before: that is what the stored errors are about.
/// What a patch needs at a border that ends before it, it gets from the border that goes on farthest.
///
/// A tree of bounding spheres spares what is out of view, or needs the same level wherever in a sphere it lies; the rest is
/// computed eight patches at a time (PatchBlocks). A model all in view of which all needs the same level, costs a test of the
/// tree's root: its records are shared.
class OSGTESSLOD_EXPORT PatchSelector {
public:
    /// Largest factor that OpenGL lets a tessellator have everywhere.
    static constexpr unsigned kMaxDrawnFactor = 64;

    explicit PatchSelector(const LodAsset& asset);
    /// For the patches of `undeformed`'s asset where a deformation has them. Patches are then never culled by their faces.
    PatchSelector(const PatchSelector& undeformed, const ControlMeshDeformation& deformation);
    ~PatchSelector();

    /// Sides of triangles that are not drawn: GL's face culling, seen from local space.
    enum class CulledFaces { None, Back, Front };

    struct Result {
        PatchRecords records; ///< grouped by level, coarse first; neighbours near each other
        SelectionStatistics statistics;
    };
    /// `frustum`: planes in the drawable's local space, inside positive, any length; a patch whose bounding sphere lies
    /// outside of one is left out, and so is one of which all triangles show the culled face, unless options.cullPatches is
    /// false. Any view is safe: one that gives no finite tolerance (no viewport, NaN) selects level 0 everywhere.
    Result select(const SelectionView& view, const SelectionOptions& options, const std::vector<osg::Plane>& frustum,
                  CulledFaces faces = CulledFaces::None) const;

    struct EdgeLevel {
        float level;    ///< continuous, 0 … the edge's finest
        bool saturated; ///< the error asked needs more than one of its patches has or may have
    };
    /// Level of one edge, as select() sees it, by itself.
    EdgeLevel edgeLevel(std::uint32_t edge, const SelectionView& view, const SelectionOptions& options) const;

    /// Sums up hand-made records: everything but culled and saturated patches.
    SelectionStatistics statisticsOf(const PatchRecords& records) const;

    /// Around a patch where the deformation has it, by its number. Only with one.
    const BoundSphere& deformedSphere(std::uint32_t patch) const { return _deformedSpheres[patch]; }

    /// What selections compute with.
    const PatchBlocks& blocks() const { return _blocks; }
    kernel::View kernelView(const SelectionView& view, const SelectionOptions& options) const;

    /// Records of all patches with all edges at one level, or at their finest where that is coarser, but for seams.
    /// Made when first asked for.
    PatchRecords uniformRecords(unsigned level) const;
    /// Of these.
    SelectionStatistics uniformStatistics(unsigned level) const;

private:
    class Visit;
    struct Workspace;
    class Workspaces;
    struct UniformRecords;

    unsigned capOf(const SelectionOptions& options) const;
    void scaleNodes();
    void boundNodes();
    void boundDeformedNodes();

    std::vector<std::uint16_t> _ladder;
    std::vector<BoundSphere> _deformedSpheres; ///< by the patches' numbers; empty without a deformation
    PatchTree _tree;
    PatchBlocks _blocks;
    std::vector<BoundSphere> _nodeSpheres; ///< in the blocks' units
    std::vector<float> _nodeBounds;        ///< per node LevelNeed::kBoundRows rows
    std::shared_ptr<UniformRecords> _uniform; ///< this and what follows: shared by all deformations
    std::shared_ptr<Workspaces> _workspaces;
    mutable RecordPool _recordPool;
};

} // namespace osgTessLOD
