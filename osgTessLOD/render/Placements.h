// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/PatchTree.h>
#include <osgTessLOD/render/TexelBuffer.h>

#include <osg/BoundingBox>
#include <osg/BoundingSphere>
#include <osg/Matrixd>
#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/Vec3f>
#include <osg/ref_ptr>

#include <atomic>
#include <cstdint>
#include <vector>

namespace osg {
class State;
}

namespace osgTessLOD {

/// Where an asset is shown many times, ready for culling and drawing. Immutable but for OSG's own per-context GL objects, so that
/// what was selected of it can be drawn while the next set is already selected from.
///
/// The shaders (tesslod_placement.glsl) read six texels of four floats per placement: three rows of the matrix, of which the
/// fourth numbers translate, and three of the one that takes normals along, whose first has −1 as fourth number where the matrix
/// mirrors.
class OSGTESSLOD_EXPORT Placements : public osg::Referenced {
public:
    /// Texture unit of the buffer: one that nothing else uses, as those of AssetPages.
    static constexpr unsigned kUnit = 8;
    static constexpr std::size_t kTexels = 6;

    /// Matrices as OSG has them, row vectors, from the space of `bounds`, the asset's, to the drawable's. Those that are not affine
    /// or not finite are never drawn; none is where `bounds` is not valid.
    Placements(std::vector<osg::Matrixd> matrices, const osg::BoundingBox& bounds);

    const std::vector<osg::Matrixd>& matrices() const { return _matrices; }
    /// Of all that can be drawn.
    const osg::BoundingBox& bounds() const { return _bounds; }

    /// Calls visit(number) for each placement that can be drawn and whose sphere, as those of the groups it is in,
    /// enters(osg::BoundingSphere) lets pass.
    template <class Enters, class Visit> void forEach(const Enters& enters, const Visit& visit) const;

    /// Twin of the shaders' function: where a point of the asset is drawn, to the bit.
    osg::Vec3f tessLodPlaced(const osg::Vec3f& position, std::uint32_t number) const;
    bool mirrors(std::uint32_t number) const;

    /// The buffer, and the define that has the shaders read it.
    osg::StateSet* state() const { return _state.get(); }
    /// Has the context of `state`, which must be current, room for the buffer? If not, says so, once.
    bool fits(osg::State& state) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize) const;

protected:
    ~Placements() override;

private:
    osg::Vec4Array& texels() const { return static_cast<osg::Vec4Array&>(*_buffer.data); }

    std::vector<osg::Matrixd> _matrices;
    std::vector<std::uint32_t> _drawn; ///< numbers of those that can be
    std::vector<BoundSphere> _spheres; ///< theirs
    PatchTree _tree;                   ///< over these
    osg::BoundingBox _bounds;
    osg::ref_ptr<osg::StateSet> _state;
    TexelBuffer _buffer;
    mutable std::atomic<bool> _warned{false};
};

template <class Enters, class Visit> void Placements::forEach(const Enters& enters, const Visit& visit) const
{
    const auto passes = [&](const BoundSphere& s) { return enters(osg::BoundingSphere(s.center, s.radius)); };
    std::vector<std::uint32_t> open;
    if (!_tree.nodes().empty()) { open.push_back(0); }
    while (!open.empty()) {
        const std::uint32_t number = open.back();
        const PatchTree::Node& node = _tree.nodes()[number];
        open.pop_back();
        if (!passes(node.sphere)) { continue; }
        if (node.right != 0) {
            open.push_back(node.right);
            open.push_back(number + 1);
            continue;
        }
        for (std::uint32_t k = node.first; k < node.first + node.count; ++k) {
            const std::uint32_t position = _tree.order()[k];
            if (passes(_spheres[position])) { visit(_drawn[position]); }
        }
    }
}

} // namespace osgTessLOD
