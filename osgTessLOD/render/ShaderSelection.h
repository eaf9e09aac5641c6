// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/Placements.h>
#include <osgTessLOD/render/SelectionOptions.h>
#include <osgTessLOD/render/SelectionView.h>
#include <osgTessLOD/render/TexelBuffer.h>

#include <osg/Array>
#include <osg/Plane>
#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/ref_ptr>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD {

/// What PatchSelector::select() is asked.
struct SelectionRequest {
    SelectionView view;
    SelectionOptions options;
    std::vector<osg::Plane> frustum;
    PatchSelector::CulledFaces faces = PatchSelector::CulledFaces::None;
};

/// What the control shader selects from (tesslod_need.glsl): of one asset's patches a texture buffer with what their needs are
/// computed from, and a vertex buffer with their numbers. It gives every border the level that PatchSelector gives it, but for the
/// driver's rounding, and so needs the tessellation backend, an asset drawn in one page, and room for the texture buffer.
/// Immutable but for OSG's own per-context GL objects.
///
/// The shader reads 5 + 2 · levels texels of four 32-bit words per patch, in the units of PatchBlocks: the bounding sphere; for each
/// side 3 · patch + side of what lies on the other side of it, and in four bits each the finest and the coarsest level of the sides,
/// then the largest finest one; the middles of the sides; per level the quadratic error q[0 … 5], the isotropic error and 0.
class ShaderSelection : public osg::Referenced {
public:
    /// Texture unit of the buffer. Placements, which have theirs there, are selected for on the CPU.
    static constexpr unsigned kUnit = Placements::kUnit;
    /// Most planes of a frustum that the shader culls by.
    static constexpr std::size_t kMostPlanes = 8;

    /// The asset's pages must be a single one, and outlive the selection.
    ShaderSelection(const PatchBlocks& blocks, const AssetPages& pages);

    static std::int64_t texelCount(const PatchBlocks& blocks);

    const AssetPages& pages() const { return _pages; }
    /// All of it: what the shader will need is not known.
    const std::shared_ptr<const AssetPage>& page() const { return _page; }
    /// The texture buffer, and the define that has the shader select.
    osg::StateSet* state() const { return _state.get(); }
    /// The uniforms of one view.
    static osg::ref_ptr<osg::StateSet> viewState(const PatchSelector& selector, const SelectionRequest& request);
    /// A number per patch, coarsest reach first: as the patches of PatchSelector::uniformRecords() are grouped, whatever their level.
    const osg::UIntArray& patches() const { return *_patches; }

    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize) const;

protected:
    ~ShaderSelection() override;

private:
    const AssetPages& _pages;
    std::shared_ptr<const AssetPage> _page;
    osg::ref_ptr<osg::StateSet> _state;
    TexelBuffer _needs;
    osg::ref_ptr<osg::UIntArray> _patches;
};

} // namespace osgTessLOD
