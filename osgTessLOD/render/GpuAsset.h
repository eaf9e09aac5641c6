// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/SurfaceProxy.h>

#include <osg/Array>
#include <osg/BoundingBox>
#include <osg/Referenced>
#include <osg/StateSet>
#include <osg/TextureBuffer>
#include <osg/observer_ptr>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace osgTessLOD {

/// An asset made ready for drawing: what all drawables, copies and selections of it share. Holds the asset, its texture
/// buffers with the state that draws with them, and its selector. Immutable but for OSG's own per-context GL objects.
class OSGTESSLOD_EXPORT GpuAsset : public osg::Referenced {
public:
    /// Texture units of the buffers: out of the way of units that applications use. The first is used by assets with normals
    /// and parameters only, the last by those with normals.
    static constexpr unsigned kParametersUnit = 12;
    static constexpr unsigned kVerticesUnit = 13;
    static constexpr unsigned kPatchTableUnit = 14;
    static constexpr unsigned kNormalsUnit = 15;

    /// The asset must be valid; not null.
    explicit GpuAsset(std::shared_ptr<const LodAsset> asset);

    const LodAsset& asset() const { return *_asset; }
    const PatchSelector& selector() const { return _selector; }
    const MorphedSurface& surface() const { return _surface; }
    const osg::BoundingBox& bounds() const { return _bounds; }

    /// Program, patch size, texture buffers and uniforms; the second is for PatchSelection::capture.
    osg::StateSet* drawState() const { return _drawState.get(); }
    osg::StateSet* captureState() const { return _captureState.get(); }

    /// True if the context of `state`, which must be current, can draw the asset. Says why not, once per asset.
    bool canDraw(osg::State& state) const;

    /// The surface at one level as triangles. Made when first asked for, kept as long as somebody holds it; any thread.
    osg::ref_ptr<SurfaceProxy> proxy(const PickingOptions& options) const;

    void compileGLObjects(osg::State& state) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~GpuAsset() override;

private:
    osg::ref_ptr<osg::StateSet> makeState(osg::StateAttribute* program) const;
    void addBuffer(osg::Array* array, GLenum format, unsigned unit, std::int64_t texels);
    void addParameters();
    void warnOnce(const std::string& why) const;

    std::shared_ptr<const LodAsset> _asset;
    PatchSelector _selector;
    MorphedSurface _surface;
    osg::BoundingBox _bounds;
    struct Buffer {
        unsigned unit;
        osg::ref_ptr<osg::Array> data;
        osg::ref_ptr<osg::TextureBuffer> texture;
    };
    std::vector<Buffer> _buffers;               ///< vertices, patch table; normals and parameters if there are
    std::vector<std::int32_t> _parameterShifts; ///< per level, tessLodParameterShifts; empty: no buffer of them
    std::int64_t _largestBufferTexels = 0;
    osg::ref_ptr<osg::Referenced> _programs; ///< shared by all assets
    osg::ref_ptr<osg::StateSet> _drawState;
    osg::ref_ptr<osg::StateSet> _captureState;
    mutable std::atomic<bool> _warned{false};
    mutable std::mutex _proxyMutex;
    mutable std::map<unsigned, osg::observer_ptr<SurfaceProxy>> _proxies; ///< by level
};

} // namespace osgTessLOD
