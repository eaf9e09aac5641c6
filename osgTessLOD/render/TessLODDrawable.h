// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Drawable>

#include <memory>

namespace osgTessLOD {

struct LodAsset;
class GpuAsset;
class SelectionObserver;

/// Draws a LodAsset: in every cull visit its PatchCullCallback selects, per patch border, the level whose error on
/// screen is at most options().errorPixels, and adds an immutable PatchSelection drawable of what is visible.
///
/// Sharing: copies (shallow or deep) and several parents share the asset and its GL objects. Options belong to each
/// drawable; change them between frames (in update or event traversal), never while cull traversals run.
class OSGTESSLOD_EXPORT TessLODDrawable : public osg::Drawable {
public:
    TessLODDrawable();
    explicit TessLODDrawable(std::shared_ptr<const LodAsset> asset);
    TessLODDrawable(const TessLODDrawable& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
    META_Object(osgTessLOD, TessLODDrawable)

        /// The asset must be valid (LodAsset::validate); it is shared and never changed. Null: nothing is drawn.
        void setAsset(std::shared_ptr<const LodAsset> asset);
    const std::shared_ptr<const LodAsset>& getAsset() const { return _asset; }

    void setOptions(const SelectionOptions& options) { _options = options; }
    const SelectionOptions& getOptions() const { return _options; }

    /// Told of every selection made for this drawable; null: nobody. Called from cull traversals, so from any thread.
    void setSelectionObserver(SelectionObserver* observer);
    SelectionObserver* getSelectionObserver() const;

    GpuAsset* getGpuAsset() const;

    osg::BoundingBox computeBoundingBox() const override;
    void drawImplementation(osg::RenderInfo& renderInfo) const override;
    using osg::Drawable::accept;
    void accept(osg::PrimitiveFunctor& functor) const override;
    bool supports(const osg::PrimitiveFunctor&) const override { return true; }
    void compileGLObjects(osg::RenderInfo& renderInfo) const override;
    void releaseGLObjects(osg::State* state = nullptr) const override;
    void resizeGLObjectBuffers(unsigned int maxSize) override;

protected:
    ~TessLODDrawable() override;

private:
    std::shared_ptr<const LodAsset> _asset;
    osg::ref_ptr<GpuAsset> _gpuAsset;
    osg::ref_ptr<SelectionObserver> _observer;
    SelectionOptions _options;
};

} // namespace osgTessLOD
