// SPDX-License-Identifier: MIT
// María-Cecilia Rivara, "Algorithms for refining triangular grids suitable for adaptive and multigrid techniques", IJNME
// 1984: to bisect a triangle's longest edge, first bisect the neighbour's, if that is longer still.
#include <osgTessLOD/bake/BisectionForest.h>

#include <algorithm>
#include <utility>

namespace osgTessLOD::bake {

namespace {

/// Coordinates in child `which` of a node bisected at edge k, and back.
Eigen::Vector3d toChild(const Eigen::Vector3d& b, unsigned k, unsigned which)
{
    const double first = b[k];
    const double second = b[(k + 1) % 3];
    const double apex = b[(k + 2) % 3];
    return which == 0 ? Eigen::Vector3d(first - second, 2.0 * second, apex)
                      : Eigen::Vector3d(2.0 * first, second - first, apex);
}

Eigen::Vector3d toParent(const Eigen::Vector3d& c, unsigned k, unsigned which)
{
    Eigen::Vector3d b;
    b[k] = which == 0 ? c[0] + 0.5 * c[1] : 0.5 * c[0];
    b[(k + 1) % 3] = which == 0 ? 0.5 * c[1] : 0.5 * c[0] + c[1];
    b[(k + 2) % 3] = c[2];
    return b;
}

} // namespace

struct BisectionForest::Builder {
    BisectionForest& forest;
    const Surface& surface;
    const Limits& limits;
    std::vector<std::uint32_t> firstPoint;         // per node: chain of the points in it
    std::vector<std::uint32_t> nextPoint;          // per point
    std::vector<Eigen::Vector3d> pointCoordinates; // per point: in its leaf
    std::vector<std::uint32_t> pointCount;         // per node

    std::vector<Node>& nodes() { return forest._nodes; }

    void plant(const PatchTopology& topology, const std::vector<FacePoint>& points)
    {
        forest._vertices.resize(topology.vertexCount);
        for (std::uint32_t p = 0; p < topology.patches.size(); ++p) {
            Node node{};
            node.corners = topology.patches[p];
            node.patch = p;
            for (unsigned k = 0; k < 3; ++k) {
                const PatchTopology::Edge& edge = topology.edges[topology.patchEdges[p][k]];
                const unsigned own = edge.patches[0] == p && edge.sides[0] == k ? 0 : 1;
                node.neighbours[k] = edge.patches[1 - own];
                forest._vertices[node.corners[k]] = surface(p, Eigen::Vector3d::Unit(k));
            }
            nodes().push_back(node);
        }
        firstPoint.assign(nodes().size(), kNone);
        pointCount.assign(nodes().size(), 0);
        nextPoint.resize(points.size());
        for (std::uint32_t i = 0; i < points.size(); ++i) {
            pointCoordinates.push_back(points[i].barycentric);
            nextPoint[i] = firstPoint[points[i].face];
            firstPoint[points[i].face] = i;
            ++pointCount[points[i].face];
        }
    }

    /// Length of an edge, with its vertices to break ties the same way from both sides.
    struct Length {
        double squared;
        std::uint32_t low;
        std::uint32_t high;
        bool operator<(const Length& o) const
        {
            if (squared != o.squared) { return squared < o.squared; }
            return low != o.low ? low < o.low : high < o.high;
        }
    };
    Length length(const Node& node, unsigned k) const
    {
        const std::uint32_t a = node.corners[k];
        const std::uint32_t b = node.corners[(k + 1) % 3];
        return {(forest._vertices[a] - forest._vertices[b]).squaredNorm(), std::min(a, b), std::max(a, b)};
    }
    unsigned longestEdge(const Node& node) const
    {
        unsigned longest = 0;
        for (unsigned k = 1; k < 3; ++k) {
            if (length(node, longest) < length(node, k)) { longest = k; }
        }
        return longest;
    }
    bool exceeds(std::uint32_t n) const
    {
        const Node& node = forest._nodes[n];
        if (node.depth >= limits.mostDepth) { return false; }
        return pointCount[n] > limits.mostPoints ||
               length(node, longestEdge(node)).squared > limits.longestEdge * limits.longestEdge;
    }

    unsigned sideTowards(std::uint32_t n, std::uint32_t neighbour, std::uint32_t from) const
    {
        const Node& node = forest._nodes[n];
        // Two leaves may share two edges: the one that starts where the neighbour's ends is meant.
        for (unsigned k = 0; k < 3; ++k) {
            if (node.neighbours[k] == neighbour && node.corners[(k + 1) % 3] == from) { return k; }
        }
        return 3;
    }

    void replaceNeighbour(std::uint32_t n, std::uint32_t old, std::uint32_t from, std::uint32_t replacement)
    {
        if (n == kNone) { return; }
        const unsigned k = sideTowards(n, old, from);
        if (k < 3) { nodes()[n].neighbours[k] = replacement; }
    }

    /// Makes the two children of leaf n at edge k, around `middle`; edges onto the edge's other side are left open.
    void makeChildren(std::uint32_t n, unsigned k, std::uint32_t middle)
    {
        const auto child = static_cast<std::uint32_t>(nodes().size());
        const Node node = nodes()[n];
        const unsigned k1 = (k + 1) % 3;
        const unsigned k2 = (k + 2) % 3;
        Node a{};
        Node b{};
        a.corners = {node.corners[k], middle, node.corners[k2]};
        b.corners = {middle, node.corners[k1], node.corners[k2]};
        a.neighbours = {kNone, child + 1, node.neighbours[k2]};
        b.neighbours = {kNone, node.neighbours[k1], child};
        a.parent = b.parent = n;
        a.patch = b.patch = node.patch;
        a.depth = b.depth = static_cast<std::uint8_t>(node.depth + 1);
        nodes().push_back(a);
        nodes().push_back(b);
        nodes()[n].firstChild = child;
        nodes()[n].bisected = static_cast<std::uint8_t>(k);
        replaceNeighbour(node.neighbours[k2], n, node.corners[k2], child);
        replaceNeighbour(node.neighbours[k1], n, node.corners[k1], child + 1);

        firstPoint.resize(nodes().size(), kNone);
        pointCount.resize(nodes().size(), 0);
        for (std::uint32_t i = firstPoint[n]; i != kNone;) {
            const std::uint32_t next = nextPoint[i];
            Eigen::Vector3d& coordinates = pointCoordinates[i];
            const unsigned which = coordinates[k] >= coordinates[k1] ? 0 : 1;
            coordinates = toChild(coordinates, k, which);
            nextPoint[i] = firstPoint[child + which];
            firstPoint[child + which] = i;
            ++pointCount[child + which];
            i = next;
        }
        firstPoint[n] = kNone;
    }

    /// Bisects leaf n and its neighbour across edge k, whose longest edge it is too (or which is not there).
    void bisect(std::uint32_t n, unsigned k)
    {
        const std::uint32_t neighbour = nodes()[n].neighbours[k];
        const auto middle = static_cast<std::uint32_t>(forest._vertices.size());
        Eigen::Vector3d inLeaf = Eigen::Vector3d::Zero();
        inLeaf[k] = inLeaf[(k + 1) % 3] = 0.5;
        const FacePoint at = forest.toPatch({n, inLeaf});
        forest._vertices.push_back(surface(at.face, at.barycentric));
        const std::uint32_t from = nodes()[n].corners[k];
        const unsigned other = neighbour != kNone ? sideTowards(neighbour, n, from) : 3;
        makeChildren(n, k, middle);
        if (neighbour == kNone) { return; }
        makeChildren(neighbour, other, middle);
        // Child 0 of one lies opposite child 1 of the other.
        const std::uint32_t own = nodes()[n].firstChild;
        const std::uint32_t others = nodes()[neighbour].firstChild;
        nodes()[own].neighbours[0] = others + 1;
        nodes()[own + 1].neighbours[0] = others;
        nodes()[others].neighbours[0] = own + 1;
        nodes()[others + 1].neighbours[0] = own;
    }

    void refine(std::uint32_t leaf)
    {
        while (forest.isLeaf(leaf)) {
            // Along longer and longer edges to a pair of leaves that share their longest.
            std::uint32_t n = leaf;
            unsigned k = longestEdge(nodes()[n]);
            while (nodes()[n].neighbours[k] != kNone) {
                const std::uint32_t neighbour = nodes()[n].neighbours[k];
                const unsigned longest = longestEdge(nodes()[neighbour]);
                if (longest == sideTowards(neighbour, n, nodes()[n].corners[k])) { break; }
                n = neighbour;
                k = longest;
            }
            bisect(n, k);
        }
    }
};

BisectionForest::BisectionForest(const PatchTopology& topology, const Surface& surface,
                                 const std::vector<FacePoint>& points, const Limits& limits)
{
    Builder builder{*this, surface, limits, {}, {}, {}, {}};
    builder.plant(topology, points);
    for (std::uint32_t n = 0; n < _nodes.size(); ++n) {
        if (isLeaf(n) && builder.exceeds(n)) { builder.refine(n); }
    }
}

FacePoint BisectionForest::toLeaf(const FacePoint& patchPoint) const
{
    FacePoint point = patchPoint;
    while (!isLeaf(point.face)) {
        const Node& node = _nodes[point.face];
        const unsigned k = node.bisected;
        const unsigned which = point.barycentric[k] >= point.barycentric[(k + 1) % 3] ? 0 : 1;
        point = {node.firstChild + which, toChild(point.barycentric, k, which)};
    }
    return point;
}

FacePoint BisectionForest::toPatch(const FacePoint& leafPoint) const
{
    FacePoint point = leafPoint;
    while (_nodes[point.face].parent != kNone) {
        const std::uint32_t parent = _nodes[point.face].parent;
        const unsigned which = point.face - _nodes[parent].firstChild;
        point = {parent, toParent(point.barycentric, _nodes[parent].bisected, which)};
    }
    return point;
}

} // namespace osgTessLOD::bake
