// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/PatchBlocks.h>

#include <cstdint>
#include <vector>

namespace osgTessLOD {

/// A binary tree of bounding spheres over patches. The patches of a node are consecutive in the tree's order, and begin at a
/// multiple of kLeafPatches: as many are in every leaf but the last.
class PatchTree {
public:
    static constexpr std::uint32_t kLeafPatches = PatchBlocks::kLanes;

    struct Node {
        BoundSphere sphere;  ///< holds those of its patches, rounding included
        std::uint32_t first; ///< in order()
        std::uint32_t count;
        std::uint32_t right; ///< its second child; the first is the next node. 0: a leaf
    };

    explicit PatchTree(const std::vector<BoundSphere>& patches);
    /// The nodes of `tree` around patches that have moved: as many.
    PatchTree(const PatchTree& tree, const std::vector<BoundSphere>& patches);

    /// Parents before children; the first is the root. Empty without patches.
    const std::vector<Node>& nodes() const { return _nodes; }
    /// Number of the patch at each position.
    const std::vector<std::uint32_t>& order() const { return _order; }

private:
    void build(const std::vector<BoundSphere>& patches, std::uint32_t first, std::uint32_t count);

    std::vector<Node> _nodes;
    std::vector<std::uint32_t> _order;
};

} // namespace osgTessLOD
