// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/TexelBuffer.h>

#include <osg/BoundingBox>
#include <osg/Matrixd>
#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/Vec3d>
#include <osg/Vec3f>
#include <osg/ref_ptr>

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

namespace osg {
class State;
}

namespace osgTessLOD {

class GpuAsset;
class PatchSelector;
struct AffineMap;

/// A pose of an asset's control mesh: an affine transform per base vertex. A point of the surface with corner weights w in its
/// patch goes to Σ wᵢ (Aᵢ p + tᵢ) of the patch's three base vertices (linear blend skinning; Bauman §5.3). What neighbours share
/// depends on the two base vertices at its ends alone, and stays the same bits.
///
/// Immutable but for OSG's own per-context GL objects and for what selection needs, which is made when it is first asked for: any
/// number of views and threads may share it, and what was selected of it can still be drawn when the next one is set.
///
/// Transforms act in the space of the asset, which the drawable draws in. Where Lattice::origin is not 0 (placeAtOrigin), a matrix M
/// of the source's space is translate(origin) · M · translate(−origin) there.
class OSGTESSLOD_EXPORT ControlMeshDeformation : public osg::Referenced {
public:
    /// Texture unit of the buffer: one that nothing else uses, as those of AssetPages.
    static constexpr unsigned kUnit = 17;
    static constexpr std::size_t kTexels = 3;

    /// Where base vertices are when nothing is deformed, in the space of the asset: what transforms are made for.
    static std::vector<osg::Vec3d> baseVertices(const LodAsset& asset);

    /// `transforms`: matrices as OSG has them, row vectors, one per base vertex; they reach the GPU in single precision. Base vertices
    /// without one stay where they are, and so do those whose matrix is not affine, or takes the surface beyond single
    /// precision. `asset`: not null; see TessLODDrawable::getGpuAsset().
    ControlMeshDeformation(const GpuAsset* asset, const std::vector<osg::Matrixd>& transforms);

    const GpuAsset& asset() const { return *_asset; }
    /// Around all of the deformed surface.
    const osg::BoundingBox& bounds() const { return _bounds; }
    /// What each base vertex's matrix does, as the GPU has it.
    const std::vector<AffineMap>& maps() const { return _maps; }
    /// Selects for the deformed surface. Made when first asked for, in a time proportional to the number of patches; any thread.
    const PatchSelector& selector() const;

    /// Twin of the shaders' function, to the bit: where a point of a patch with these corner weights is drawn.
    osg::Vec3f tessLodDeformed(const osg::Vec3f& position, const MorphedSurface::Vec3& weights,
                               std::uint32_t patch) const;

    /// The buffer, and the define that has the shaders read it.
    osg::StateSet* state() const { return _state.get(); }
    /// Has the context of `state`, which must be current, room for the buffer? If not, says so, once.
    bool fits(osg::State& state) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize) const;

protected:
    ~ControlMeshDeformation() override;

private:
    const osg::Vec4Array& texels() const { return static_cast<const osg::Vec4Array&>(*_buffer.data); }

    osg::ref_ptr<const GpuAsset> _asset;
    std::vector<AffineMap> _maps;
    osg::BoundingBox _bounds;
    osg::ref_ptr<osg::StateSet> _state;
    TexelBuffer _buffer;
    mutable std::once_flag _selectorOnce;
    mutable std::unique_ptr<const PatchSelector> _selector;
    mutable std::atomic<bool> _warned{false};
};

} // namespace osgTessLOD
