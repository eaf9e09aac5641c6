// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/TexelBuffer.h>

#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/ref_ptr>

#include <cstdint>
#include <mutex>
#include <vector>

namespace osgTessLOD {

/// Consecutive patches of an asset and the texture buffers with all that the shaders read of them. Numbers within a page
/// count from its first patch and its first vertex: the shaders subtract tessLodFirstPatch and know nothing of pages.
struct AssetPage {
    std::uint32_t firstPatch;
    std::uint32_t patchCount;
    std::vector<TexelBuffer> buffers;
    osg::ref_ptr<osg::StateSet> state; ///< the buffers, and the uniforms and defines that go with them
};

/// An asset in pages none of whose buffers has more texels than a context allows. What neighbours on two pages share, both
/// have, with the same bits: borders stay closed. Immutable but for OSG's own per-context GL objects.
class OSGTESSLOD_EXPORT AssetPages : public osg::Referenced {
public:
    /// Texture units of the buffers: out of the way of units that applications use. Each is used by assets that have what it
    /// is for; parameters only where there are normals or a deformation.
    static constexpr unsigned kColorsUnit = 10;
    static constexpr unsigned kUvsUnit = 11;
    static constexpr unsigned kParametersUnit = 12;
    static constexpr unsigned kVerticesUnit = 13;
    static constexpr unsigned kPatchTableUnit = 14;
    static constexpr unsigned kNormalsUnit = 15;
    static constexpr unsigned kDeformedPatchesUnit = 16; ///< with a deformation
    /// Most levels that the shaders know: factors 1, 2, 4, 6 … 64.
    static constexpr std::size_t kMaxLevels = 33;

    /// The asset must be valid, and outlive the pages. A page has one patch at least: without normals, any fits the 65,536 texels that every context
    /// allows. Where one patch's normals would need more than `maxTexels`, their finest resolutions are left out.
    AssetPages(const LodAsset& asset, std::int64_t maxTexels);

    const std::vector<AssetPage>& pages() const { return _pages; }
    /// For each page what the shaders read of it beside, where there is a deformation (tesslod_deformation.glsl): base vertices, and
    /// parameters where there are no normals. Made when first asked for; any thread.
    const std::vector<AssetPage>& deformedPages() const;
    /// Index of the page that has the patch.
    std::size_t pageOf(std::uint32_t patch) const;

    void compileGLObjects(osg::State& state) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~AssetPages() override;

private:
    template <typename Visit> void forEachMade(const Visit& visit) const;

    const LodAsset& _asset;
    std::int64_t _maxTexels;
    std::vector<AssetPage> _pages;
    mutable std::mutex _mutex; ///< of what follows
    mutable std::vector<AssetPage> _deformedPages;
};

} // namespace osgTessLOD
