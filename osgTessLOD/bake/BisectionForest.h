// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/PatchTopology.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

namespace osgTessLOD::bake {

/// The patches of a control mesh, each bisected again and again where the surface needs it: a conforming triangulation
/// across all patches, whose triangles are the leaves of one binary tree per patch.
///
/// A node's edge k joins its corners k and k + 1 (mod 3). Bisecting edge k at its midpoint m gives two children,
/// (k, m, k+2) and (m, k+1, k+2), so barycentric coordinates pass exactly from parent to child and back.
class BisectionForest {
public:
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    /// The surface point at `barycentric` of `patch`.
    using Surface = std::function<Eigen::Vector3d(std::uint32_t patch, const Eigen::Vector3d& barycentric)>;

    struct Limits {
        double longestEdge;  ///< leaves' edges are bisected down to this length on the surface
        unsigned mostPoints; ///< leaves that hold more of the given points are bisected
        /// Leaves of a patch that are bisected because of themselves, per point in it (and one point more): where the
        /// surface is squeezed into next to nothing of the parameters, bisecting would hardly end.
        std::size_t mostBisectionsPerPoint = std::numeric_limits<std::size_t>::max();
        std::vector<char> isSpared =
            {}; ///< per patch: whether the limits do not hold there; empty: they hold everywhere
    };

    /// Starts with one node per patch, numbered as the patches, and bisects leaves that exceed the
    /// limits, and their neighbours, so that no vertex hangs. `points` are points of the patches (face =
    /// patch) that leaves shall separate.
    BisectionForest(const PatchTopology& topology, const Surface& surface, const std::vector<FacePoint>& points,
                    const Limits& limits);

    /// Bisects these leaves, and others as far as no vertex may hang. `surface` is the constructor's.
    void bisect(const std::vector<std::uint32_t>& leaves, const Surface& surface);

    std::size_t nodeCount() const { return _nodes.size(); }
    bool isLeaf(std::uint32_t node) const { return _nodes[node].firstChild == kNone; }
    std::uint32_t patchOf(std::uint32_t node) const { return _nodes[node].patch; }
    /// Vertices of the conforming triangulation; the first ones are the control mesh's.
    const std::vector<Eigen::Vector3d>& vertices() const { return _vertices; }
    const std::array<std::uint32_t, 3>& corners(std::uint32_t leaf) const { return _nodes[leaf].corners; }

    /// The leaf that holds a point of a patch (face = patch), and its coordinates in it; and the inverse.
    FacePoint toLeaf(const FacePoint& patchPoint) const;
    FacePoint toPatch(const FacePoint& leafPoint) const;

private:
    struct Node {
        std::array<std::uint32_t, 3> corners;
        std::array<double, 3> lengths;           ///< of its edges on the surface
        std::array<std::uint32_t, 3> neighbours; ///< leaf across each edge; stale in inner nodes
        std::uint32_t parent = kNone;
        std::uint32_t firstChild = kNone;
        std::uint32_t patch = 0;
        std::uint8_t bisected = 0; ///< which edge is or would be
        std::uint8_t depth = 0;
    };
    struct Builder;

    /// From this depth on, lengths on the surface are straight distances.
    static constexpr unsigned kStraightFrom = 4;
    /// Leaves this deep, of a 2⁴⁰th of their patch's size, are not bisected because of themselves.
    static constexpr unsigned kDeepest = 80;

    std::vector<Node> _nodes;
    std::vector<Eigen::Vector3d> _vertices;
};

} // namespace osgTessLOD::bake
