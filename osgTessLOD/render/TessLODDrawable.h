// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/SelectionOptions.h>
#include <osgTessLOD/render/SurfaceProxy.h>

#include <osg/Drawable>
#include <osg/StateSet>
#include <osg/ref_ptr>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace osgTessLOD {

struct LodAsset;
class StreamedAsset;
class ControlMeshDeformation;
class CullView;
class GpuAsset;
class PatchSelection;
class PatchSelector;
class SelectionObserver;

/// Draws a LodAsset: in every cull visit its PatchCullCallback selects, per patch border, the level whose error on
/// screen is at most options().errorPixels, and adds an immutable PatchSelection drawable of what is visible. Or it leaves
/// that to the control shader: SelectionOptions::Selector.
///
/// Sharing: copies (shallow or deep) and several parents share the asset, its deformation and their GL objects. Options belong to each
/// drawable; change them between frames (in update or event traversal), never while cull traversals run.
class OSGTESSLOD_EXPORT TessLODDrawable : public osg::Drawable {
public:
    TessLODDrawable();
    explicit TessLODDrawable(std::shared_ptr<const LodAsset> asset);
    TessLODDrawable(const TessLODDrawable& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
    META_Object(osgTessLOD, TessLODDrawable)

    /// The asset must be valid (LodAsset::validate); it is shared and never changed. Null: nothing is drawn. The file name,
    /// the deformation and states of materials are forgotten.
    void setAsset(std::shared_ptr<const LodAsset> asset);
    /// The same with an asset that is read as it is needed. Throws AssetError if its beginning cannot be.
    void setStreamedAsset(std::shared_ptr<const StreamedAsset> asset);
    /// The whole asset; null without one. Reads what of it was not: throws AssetError if that cannot be. See getGpuAsset()->asset()
    /// for what one need not wait for.
    std::shared_ptr<const LodAsset> getAsset() const;
    /// Asset, GL objects, deformation, states of materials and file name are `other`'s from now on, too.
    void shareAsset(const TessLODDrawable& other);

    /// State that patches of one of the asset's materials are drawn with, within the drawable's own; null: none. Made by
    /// addMaterialStates (MaterialState.h). Change between frames, as options.
    void setMaterialState(std::size_t material, osg::StateSet* state);
    osg::StateSet* getMaterialState(std::size_t material) const;

    /// The .tlod file that the asset is read from, by which scene files refer to it; empty where there is none.
    void setFileName(const std::string& fileName) { _fileName = fileName; }
    const std::string& getFileName() const { return _fileName; }

    /// How the control mesh is posed; null: as the asset is, at no cost. Change it between frames, as options: what was selected
    /// of the last one can still be drawn. One of another asset shows nothing deformed, and a warning says so. With one, patches
    /// are selected on the CPU, whatever SelectionOptions::selector, and none is left out for its faces. Scene files do not have
    /// it: poses are made while an application runs.
    void setDeformation(osg::ref_ptr<const ControlMeshDeformation> deformation);
    const ControlMeshDeformation* getDeformation() const { return _deformation.get(); }

    void setOptions(const SelectionOptions& options) { _options = options; }
    const SelectionOptions& getOptions() const { return _options; }

    /// Which level stands for the surface in intersections and functors. Change between frames, as options.
    void setPickingOptions(const PickingOptions& options);
    const PickingOptions& getPickingOptions() const { return _pickingOptions; }
    /// The surface at that level, made when first asked for and then kept; null without an asset. Any thread.
    osg::ref_ptr<SurfaceProxy> getPickingSurface() const;

    /// Told of every selection made for this drawable; null: nobody. Called from cull traversals, so from any thread.
    void setSelectionObserver(SelectionObserver* observer);
    SelectionObserver* getSelectionObserver() const;

    /// Null without an asset.
    GpuAsset* getGpuAsset() const;

    /// Around the surface, deformed or not, in the asset's space. There is an asset.
    const osg::BoundingBox& surfaceBounds() const;

    /// What is drawn in a cull visit. There is an asset.
    virtual osg::ref_ptr<PatchSelection> select(const CullView& view) const;

    osg::BoundingBox computeBoundingBox() const override;
    void drawImplementation(osg::RenderInfo& renderInfo) const override;
    using osg::Drawable::accept;
    /// Gives intersection visitors that come near a KdTree of the picking surface first, as the drawable's Shape, unless it
    /// has a Shape already.
    void accept(osg::NodeVisitor& visitor) override;
    /// The picking surface. Attributes are its vertices, which are not to be changed.
    void accept(osg::PrimitiveFunctor& functor) const override;
    void accept(osg::PrimitiveIndexFunctor& functor) const override;
    void accept(ConstAttributeFunctor& functor) const override;
    bool supports(const osg::PrimitiveFunctor&) const override { return true; }
    bool supports(const osg::PrimitiveIndexFunctor&) const override { return true; }
    bool supports(const ConstAttributeFunctor&) const override { return true; }
    void compileGLObjects(osg::RenderInfo& renderInfo) const override;
    void releaseGLObjects(osg::State* state = nullptr) const override;
    void resizeGLObjectBuffers(unsigned int maxSize) override;

protected:
    ~TessLODDrawable() override;

    /// Selects for the deformation, if there is one. There is an asset.
    const PatchSelector& selector() const;
    /// The picking surface of the asset as it is deformed. There is an asset.
    osg::ref_ptr<SurfaceProxy> makeProxy(const PickingOptions& options) const;
    /// Everything at one level, or at its finest where that is coarser. There is an asset.
    virtual osg::ref_ptr<PatchSelection> selectUniform(unsigned level) const;
    /// There is an asset.
    virtual osg::ref_ptr<SurfaceProxy> makePickingSurface() const;
    /// Called when the asset, or what is shown of it, is another. Extend it.
    virtual void surfaceChanged();
    virtual void dropPickingSurface();
    /// What selections are drawn with in the context of `state`, which is current, beside the asset's own state. There is an asset.
    virtual std::vector<const osg::StateSet*> moreStates(osg::State& state) const;

private:
    bool selectsWhenDrawn() const;

    osg::ref_ptr<GpuAsset> _gpuAsset;
    std::vector<osg::ref_ptr<osg::StateSet>> _materialStates; ///< those that are set, up to the last
    osg::ref_ptr<const ControlMeshDeformation> _deformation;
    osg::ref_ptr<SelectionObserver> _observer;
    SelectionOptions _options;
    PickingOptions _pickingOptions;
    mutable std::mutex _pickingMutex; ///< of what follows and of the Shape made of it
    mutable osg::ref_ptr<SurfaceProxy> _pickingSurface;
    std::string _fileName;
};

} // namespace osgTessLOD
