// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/SurfaceProxy.h>

#include <osg/BoundingBox>
#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/observer_ptr>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace osgTessLOD {

class AssetPages;
class DeformableAsset;
class PatchPrograms;
class ShaderSelection;

/// An asset made ready for drawing: what all drawables, copies and selections of it share. Holds the asset, its pages and the
/// programs that draw them, and its selector. Immutable but for OSG's own per-context GL objects and pages that are made when a
/// context first needs them.
class OSGTESSLOD_EXPORT GpuAsset : public osg::Referenced {
public:
    /// Most texels of a page's buffer: 8 MiB of vertices, 366 patches of factor 64.
    static constexpr std::int64_t kPageTexels = std::int64_t{1} << 20;
    /// The same where the control shader selects, which sees one page.
    static constexpr std::int64_t kSelectedPageTexels = std::int64_t{1} << 27;

    /// Not null. Throws AssetError where it has to read and cannot.
    explicit GpuAsset(std::shared_ptr<const StreamedAsset> asset);
    /// The asset must be valid; not null.
    explicit GpuAsset(std::shared_ptr<const LodAsset> asset);

    const StreamedAsset& source() const { return *_source; }
    /// Its frame: what is per vertex of a level is there only as far as it was read.
    const LodAsset& asset() const { return _source->frame(); }
    const PatchSelector& selector() const { return _selector; }
    const MorphedSurface& surface() const { return _surface; }
    const osg::BoundingBox& bounds() const { return _bounds; }

    /// What deformations have in common. Made when first asked for, in a time proportional to the number of vertices; any thread.
    /// Throws AssetError if the asset cannot be read in full.
    const DeformableAsset& deformable() const;

    /// Empty: brings together in the render bin what is drawn with the same buffers.
    osg::StateSet* sortState() const { return _sortState.get(); }
    const PatchPrograms& programs() const { return *_programs; }

    /// The pages that the context of `state`, which must be current, draws the asset with: those that it has room for. Null
    /// if it cannot draw the asset; says why not, once per asset.
    const AssetPages* pagesFor(osg::State& state) const;

    /// What the control shader selects from in the context of `state`, which must be current. Made when first asked for; null
    /// where it cannot select there.
    const ShaderSelection* shaderSelectionFor(osg::State& state) const;

    /// The surface at one level, or the finest that can be read, as triangles. Made when first asked for, kept as long as somebody holds it; any thread.
    osg::ref_ptr<SurfaceProxy> proxy(const PickingOptions& options) const;

    /// `more`: what is drawn with beside the asset's own state, which may ask for other variants of programs.
    void compileGLObjects(osg::State& state, const std::vector<const osg::StateSet*>& more = {}) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~GpuAsset() override;

private:
    const AssetPages& pagesWithin(std::int64_t maxTexels) const;
    void warnOnce(const std::string& why) const;

    std::shared_ptr<const StreamedAsset> _source;
    mutable std::once_flag _deformableOnce;
    mutable std::unique_ptr<const DeformableAsset> _deformable;
    PatchSelector _selector;
    MorphedSurface _surface;
    osg::BoundingBox _bounds;
    osg::ref_ptr<PatchPrograms> _programs;
    osg::ref_ptr<osg::StateSet> _sortState;
    mutable std::mutex _pagesMutex;                                  ///< of what follows
    mutable std::map<std::int64_t, osg::ref_ptr<AssetPages>> _pages; ///< by their limit
    mutable osg::ref_ptr<ShaderSelection> _shaderSelection;
    mutable std::atomic<bool> _warned{false};
    mutable std::mutex _proxyMutex;
    mutable std::map<unsigned, osg::observer_ptr<SurfaceProxy>> _proxies; ///< by level
};

} // namespace osgTessLOD
