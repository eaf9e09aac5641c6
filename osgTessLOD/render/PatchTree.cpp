// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchTree.h>

#include <osg/BoundingBox>

#include <algorithm>
#include <array>
#include <numeric>

namespace osgTessLOD {

namespace {

constexpr float kRounding = 1e-6F; ///< relative to the sizes of numbers: some units in the last place

/// About the centre of the spheres' box.
BoundSphere enclosing(const std::vector<BoundSphere>& patches, const std::uint32_t* first, const std::uint32_t* end)
{
    osg::BoundingBox box;
    for (const std::uint32_t* p = first; p != end; ++p) {
        const BoundSphere& s = patches[*p];
        const osg::Vec3f corner(s.radius, s.radius, s.radius);
        box.expandBy(s.center - corner);
        box.expandBy(s.center + corner);
    }
    BoundSphere sphere{box.center(), 0.0F};
    for (const std::uint32_t* p = first; p != end; ++p) {
        const BoundSphere& s = patches[*p];
        sphere.radius = std::max(sphere.radius, (s.center - sphere.center).length() + s.radius);
    }
    sphere.radius += kRounding * (sphere.radius + sphere.center.length());
    return sphere;
}

/// The axis along which the centres lie furthest apart.
int widestAxis(const std::vector<BoundSphere>& patches, const std::uint32_t* first, const std::uint32_t* end)
{
    osg::BoundingBox centers;
    for (const std::uint32_t* p = first; p != end; ++p) { centers.expandBy(patches[*p].center); }
    const osg::Vec3f size = centers._max - centers._min;
    return size.x() >= size.y() && size.x() >= size.z() ? 0 : size.y() >= size.z() ? 1 : 2;
}

} // namespace

PatchTree::PatchTree(const std::vector<BoundSphere>& patches)
    : _order(patches.size())
{
    std::iota(_order.begin(), _order.end(), 0U);
    if (!patches.empty()) { build(patches, 0, static_cast<std::uint32_t>(patches.size())); }
}

PatchTree::PatchTree(const PatchTree& tree, const std::vector<BoundSphere>& patches)
    : _nodes(tree._nodes)
    , _order(tree._order)
{
    std::vector<BoundSphere> spheres(_nodes.size());
    const std::array<std::uint32_t, 2> both{0, 1};
    for (std::size_t n = _nodes.size(); n-- > 0;) { // children before parents
        const Node& node = _nodes[n];
        const std::uint32_t* first = _order.data() + node.first;
        spheres[n] = node.right == 0 ? enclosing(patches, first, first + node.count)
                                     : enclosing({spheres[n + 1], spheres[node.right]}, both.begin(), both.end());
        _nodes[n].sphere = spheres[n];
    }
}

void PatchTree::build(const std::vector<BoundSphere>& patches, std::uint32_t first, std::uint32_t count)
{
    std::uint32_t* begin = _order.data() + first;
    const std::size_t node = _nodes.size();
    _nodes.push_back({enclosing(patches, begin, begin + count), first, count, 0});
    if (count <= kLeafPatches) {
        std::sort(begin, begin + count);
        return;
    }
    const int axis = widestAxis(patches, begin, begin + count);
    // Leaves begin at multiples of their size.
    const std::uint32_t half = (count / 2 + kLeafPatches / 2) / kLeafPatches * kLeafPatches;
    std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
        const float atA = patches[a].center[axis];
        const float atB = patches[b].center[axis];
        return atA != atB ? atA < atB : a < b; // one order only, whatever the library
    });
    build(patches, first, half);
    _nodes[node].right = static_cast<std::uint32_t>(_nodes.size());
    build(patches, first + half, count - half);
}

} // namespace osgTessLOD
