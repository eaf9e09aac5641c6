// SPDX-License-Identifier: MIT
// William Mitchell, "A comparison of adaptive refinement techniques for elliptic problems", ACM TOMS 1989: newest vertex
// bisection. (Bisecting the longest edge on the surface need not end: where a border bulges, the lengths of a triangle and of
// its descendants can take turns for ever.)
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
    std::vector<std::size_t> bisectionsLeft;       // per patch

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
        for (const PatchTopology::Edge& edge : topology.edges) {
            const unsigned side = edge.sides[0];
            const double arc =
                arcLength(edge.patches[0], Eigen::Vector3d::Unit(side), Eigen::Vector3d::Unit((side + 1) % 3));
            for (unsigned which = 0; which < 2; ++which) {
                if (edge.patches[which] != kNoPatch) { nodes()[edge.patches[which]].lengths[edge.sides[which]] = arc; }
            }
        }
        chooseFirstEdges(topology);
        firstPoint.assign(nodes().size(), kNone);
        pointCount.assign(nodes().size(), 0);
        nextPoint.resize(points.size());
        for (std::uint32_t i = 0; i < points.size(); ++i) {
            pointCoordinates.push_back(points[i].barycentric);
            nextPoint[i] = firstPoint[points[i].face];
            firstPoint[points[i].face] = i;
            ++pointCount[points[i].face];
        }
        bisectionsLeft.resize(nodes().size());
        for (std::size_t p = 0; p < bisectionsLeft.size(); ++p) {
            const std::size_t perPoint = limits.mostBisectionsPerPoint;
            const std::size_t shares = std::size_t{pointCount[p]} + 1;
            bisectionsLeft[p] = perPoint > std::numeric_limits<std::size_t>::max() / shares
                                    ? std::numeric_limits<std::size_t>::max()
                                    : perPoint * shares;
        }
    }

    /// Length on the surface of the straight line between two points of a patch, sampled.
    double arcLength(std::uint32_t patch, const Eigen::Vector3d& a, const Eigen::Vector3d& b) const
    {
        constexpr int kSegments = 4;
        double sum = 0.0;
        Eigen::Vector3d last = surface(patch, a);
        for (int i = 1; i <= kSegments; ++i) {
            const double t = static_cast<double>(i) / kSegments;
            const Eigen::Vector3d next = surface(patch, (1.0 - t) * a + t * b);
            sum += (next - last).norm();
            last = next;
        }
        return sum;
    }

    /// The same between two points of leaf n, whose positions on the surface are those of the given vertices. Deep in the
    /// tree the straight distance will do, which costs no evaluation.
    double length(std::uint32_t n, const Eigen::Vector3d& a, std::uint32_t vertexOfA, const Eigen::Vector3d& b,
                  std::uint32_t vertexOfB) const
    {
        if (forest._nodes[n].depth >= kStraightFrom) {
            return (forest._vertices[vertexOfB] - forest._vertices[vertexOfA]).norm();
        }
        const FacePoint from = inPatch(n, a);
        return arcLength(from.face, from.barycentric, inPatch(n, b).barycentric);
    }

    /// Roots bisect their longest edge first. As all roots go by one order of edges, following bisected edges from root to
    /// root ends.
    void chooseFirstEdges(const PatchTopology& topology)
    {
        const auto isLess = [&](std::uint32_t a, std::uint32_t b, double lengthOfA, double lengthOfB) {
            return lengthOfA != lengthOfB ? lengthOfA < lengthOfB : a < b;
        };
        for (std::uint32_t p = 0; p < topology.patches.size(); ++p) {
            Node& node = nodes()[p];
            for (std::uint8_t k = 1; k < 3; ++k) {
                if (isLess(topology.patchEdges[p][node.bisected], topology.patchEdges[p][k],
                           node.lengths[node.bisected], node.lengths[k])) {
                    node.bisected = k;
                }
            }
        }
    }
    bool exceeds(std::uint32_t n) const
    {
        const Node& node = forest._nodes[n];
        if (bisectionsLeft[node.patch] == 0 || node.depth >= kDeepest ||
            (!limits.isSpared.empty() && limits.isSpared[node.patch] != 0)) {
            return false;
        }
        return pointCount[n] > limits.mostPoints ||
               *std::max_element(node.lengths.begin(), node.lengths.end()) > limits.longestEdge;
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

    /// A point of leaf n in its patch.
    FacePoint inPatch(std::uint32_t n, const Eigen::Vector3d& barycentric) const
    {
        return forest.toPatch({n, barycentric});
    }

    static Eigen::Vector3d middleOf(unsigned k)
    {
        return 0.5 * (Eigen::Vector3d::Unit(k) + Eigen::Vector3d::Unit((k + 1) % 3));
    }

    /// Makes the two children of leaf n at edge k, around the vertex `middle`, which halves it into these lengths (as n
    /// runs along it); edges onto the edge's other side are left open.
    void makeChildren(std::uint32_t n, unsigned k, std::uint32_t middle, const std::array<double, 2>& halves)
    {
        const unsigned apex = (k + 2) % 3;
        const double across = length(n, middleOf(k), middle, Eigen::Vector3d::Unit(apex), nodes()[n].corners[apex]);
        const auto child = static_cast<std::uint32_t>(nodes().size());
        const Node node = nodes()[n];
        const unsigned k1 = (k + 1) % 3;
        const unsigned k2 = (k + 2) % 3;
        Node a{};
        Node b{};
        a.corners = {node.corners[k], middle, node.corners[k2]};
        b.corners = {middle, node.corners[k1], node.corners[k2]};
        a.lengths = {halves[0], across, node.lengths[k2]};
        b.lengths = {halves[1], node.lengths[k1], across};
        a.neighbours = {kNone, child + 1, node.neighbours[k2]};
        b.neighbours = {kNone, node.neighbours[k1], child};
        // The edge opposite the newest vertex is bisected next.
        a.bisected = 2;
        b.bisected = 1;
        a.parent = b.parent = n;
        a.patch = b.patch = node.patch;
        a.depth = b.depth = static_cast<std::uint8_t>(node.depth + 1);
        nodes().push_back(a);
        nodes().push_back(b);
        nodes()[n].firstChild = child;
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

    /// Bisects leaf n and its neighbour across edge k, which is to bisect it too (or is not there).
    void bisect(std::uint32_t n, unsigned k)
    {
        const std::uint32_t neighbour = nodes()[n].neighbours[k];
        const auto middle = static_cast<std::uint32_t>(forest._vertices.size());
        const FacePoint at = inPatch(n, middleOf(k));
        forest._vertices.push_back(surface(at.face, at.barycentric));
        const unsigned k1 = (k + 1) % 3;
        const std::uint32_t from = nodes()[n].corners[k];
        const double first = length(n, Eigen::Vector3d::Unit(k), from, middleOf(k), middle);
        const double second = length(n, middleOf(k), middle, Eigen::Vector3d::Unit(k1), nodes()[n].corners[k1]);
        const unsigned other = neighbour != kNone ? sideTowards(neighbour, n, from) : 3;
        makeChildren(n, k, middle, {first, second});
        if (neighbour == kNone) { return; }
        makeChildren(neighbour, other, middle, {second, first});
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
            // To a pair of leaves that are to bisect the edge they share.
            std::uint32_t n = leaf;
            while (nodes()[n].neighbours[nodes()[n].bisected] != kNone) {
                const Node& node = nodes()[n];
                const std::uint32_t neighbour = node.neighbours[node.bisected];
                if (nodes()[neighbour].bisected == sideTowards(neighbour, n, node.corners[node.bisected])) { break; }
                n = neighbour;
            }
            bisect(n, nodes()[n].bisected);
        }
    }
};

BisectionForest::BisectionForest(const PatchTopology& topology, const Surface& surface,
                                 const std::vector<FacePoint>& points, const Limits& limits)
{
    Builder builder{*this, surface, limits, {}, {}, {}, {}, {}};
    builder.plant(topology, points);
    for (std::uint32_t n = 0; n < _nodes.size(); ++n) {
        if (!isLeaf(n) || !builder.exceeds(n)) { continue; }
        --builder.bisectionsLeft[_nodes[n].patch];
        builder.refine(n);
    }
}

void BisectionForest::bisect(const std::vector<std::uint32_t>& leaves, const Surface& surface)
{
    const Limits none{};
    Builder builder{*this, surface, none, {}, {}, {}, {}, {}};
    builder.firstPoint.assign(_nodes.size(), kNone);
    builder.pointCount.assign(_nodes.size(), 0);
    for (const std::uint32_t leaf : leaves) { builder.refine(leaf); }
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
