// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/CullView.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/IntersectionAccess.h>
#include <osgTessLOD/render/PatchCullCallback.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/ShaderSelection.h>

#include <osg/Notify>
#include <osg/State>

#include <utility>

namespace osgTessLOD {

namespace {

/// Copies and files bring the callback along: one is enough.
void ensureCullCallback(osg::Drawable& drawable)
{
    for (osg::Callback* c = drawable.getCullCallback(); c != nullptr; c = c->getNestedCallback()) {
        if (dynamic_cast<PatchCullCallback*>(c) != nullptr) { return; }
    }
    const osg::ref_ptr<osg::Callback> others = drawable.getCullCallback();
    const osg::ref_ptr<PatchCullCallback> callback = new PatchCullCallback;
    callback->setNestedCallback(others.get());
    drawable.setCullCallback(callback.get());
}

/// Does what is looked for meet the drawable's bounding sphere?
bool comesNear(osgUtil::IntersectionVisitor* visitor, const osg::Drawable& drawable)
{
    return visitor != nullptr && !visitor->getDoDummyTraversal() && IntersectionAccess::enters(*visitor, drawable);
}

} // namespace

TessLODDrawable::TessLODDrawable()
{
    setUseDisplayList(false);
    setUseVertexBufferObjects(true); // or compileGLObjects would not be called
    ensureCullCallback(*this);
}

TessLODDrawable::TessLODDrawable(std::shared_ptr<const LodAsset> asset)
    : TessLODDrawable()
{
    setAsset(std::move(asset));
}

TessLODDrawable::TessLODDrawable(const TessLODDrawable& other, const osg::CopyOp& copyop)
    : osg::Drawable(other, copyop)
    , _gpuAsset(other._gpuAsset)
    , _materialStates(other._materialStates)
    , _deformation(other._deformation)
    , _observer(other._observer)
    , _options(other._options)
    , _pickingOptions(other._pickingOptions)
    , _fileName(other._fileName)
{
    ensureCullCallback(*this);
    TessLODDrawable::surfaceChanged(); // a tree of one's own is made when needed, of the same surface
}

TessLODDrawable::~TessLODDrawable() = default;

void TessLODDrawable::setAsset(std::shared_ptr<const LodAsset> asset)
{
    setStreamedAsset(asset != nullptr ? std::make_shared<const StreamedAsset>(std::move(asset)) : nullptr);
}

void TessLODDrawable::setStreamedAsset(std::shared_ptr<const StreamedAsset> asset)
{
    _gpuAsset = asset != nullptr ? new GpuAsset(std::move(asset)) : nullptr;
    _materialStates.clear();
    _deformation = nullptr;
    _fileName.clear();
    surfaceChanged();
}

std::shared_ptr<const LodAsset> TessLODDrawable::getAsset() const
{
    return _gpuAsset.valid() ? _gpuAsset->source().whole() : nullptr;
}

void TessLODDrawable::shareAsset(const TessLODDrawable& other)
{
    _gpuAsset = other._gpuAsset;
    _materialStates = other._materialStates;
    _deformation = other._deformation;
    _fileName = other._fileName;
    surfaceChanged();
}

void TessLODDrawable::setMaterialState(std::size_t material, osg::StateSet* state)
{
    if (material >= _materialStates.size()) { _materialStates.resize(material + 1); }
    _materialStates[material] = state;
}

osg::StateSet* TessLODDrawable::getMaterialState(std::size_t material) const
{
    return material < _materialStates.size() ? _materialStates[material].get() : nullptr;
}

void TessLODDrawable::setDeformation(osg::ref_ptr<const ControlMeshDeformation> deformation)
{
    const LodAsset* const own = _gpuAsset.valid() ? &_gpuAsset->asset() : nullptr;
    if (deformation.valid() && &deformation->asset().asset() != own) {
        OSG_WARN << "TessLODDrawable::setDeformation: the deformation is another asset's" << std::endl;
        deformation = nullptr;
    }
    if (deformation == _deformation) { return; }
    _deformation = std::move(deformation);
    surfaceChanged();
}

const PatchSelector& TessLODDrawable::selector() const
{
    return _deformation.valid() ? _deformation->selector() : _gpuAsset->selector();
}

const osg::BoundingBox& TessLODDrawable::surfaceBounds() const
{
    return _deformation.valid() ? _deformation->bounds() : _gpuAsset->bounds();
}

void TessLODDrawable::surfaceChanged()
{
    dropPickingSurface();
    dirtyBound();
    getBoundingBox(); // now: cull traversals, possibly several at once, must find it computed
}

void TessLODDrawable::setSelectionObserver(SelectionObserver* observer)
{
    _observer = observer;
}

SelectionObserver* TessLODDrawable::getSelectionObserver() const
{
    return _observer.get();
}

GpuAsset* TessLODDrawable::getGpuAsset() const
{
    return _gpuAsset.get();
}

osg::BoundingBox TessLODDrawable::computeBoundingBox() const
{
    return _gpuAsset.valid() ? surfaceBounds() : osg::BoundingBox();
}

void TessLODDrawable::drawImplementation(osg::RenderInfo& renderInfo) const
{
    if (_gpuAsset.valid()) { selectUniform(0)->drawImplementation(renderInfo); }
}

bool TessLODDrawable::selectsWhenDrawn() const
{
    // What is of several materials is drawn in parts, for which it has to be known.
    return _options.selector == SelectionOptions::Selector::Gpu && _options.backend != Backend::Instanced &&
           _gpuAsset->asset().patchMaterials.empty() && !_deformation.valid();
}

std::vector<const osg::StateSet*> TessLODDrawable::moreStates(osg::State& state) const
{
    std::vector<const osg::StateSet*> states;
    const ShaderSelection* selection = selectsWhenDrawn() ? _gpuAsset->shaderSelectionFor(state) : nullptr;
    if (selection != nullptr) {
        states.push_back(selection->page()->state.get());
        states.push_back(selection->state());
    }
    const AssetPages* pages = _deformation.valid() ? _gpuAsset->pagesFor(state) : nullptr;
    if (pages != nullptr && _deformation->fits(state)) {
        states.push_back(_deformation->state());
        for (const AssetPage& page : pages->deformedPages()) { states.push_back(page.state.get()); }
    }
    return states;
}

osg::ref_ptr<PatchSelection> TessLODDrawable::select(const CullView& view) const
{
    const SelectionView selectionView = view.view();
    if (selectsWhenDrawn()) {
        return new PatchSelection(_gpuAsset.get(),
                                  {selectionView, _options, view.frustum(), view.culledFaces(selectionView)});
    }
    PatchSelector::Result selected =
        selector().select(selectionView, _options, view.frustum(), view.culledFaces(selectionView));
    return new PatchSelection(_gpuAsset.get(), std::move(selected.records), std::move(selected.statistics),
                              selectionView, _options.backend, {}, _deformation);
}

osg::ref_ptr<PatchSelection> TessLODDrawable::selectUniform(unsigned level) const
{
    const PatchSelector& selector = _gpuAsset->selector();
    PatchRecords records = selector.uniformRecords(level);
    SelectionStatistics statistics = selector.statisticsOf(records);
    return new PatchSelection(_gpuAsset.get(), std::move(records), std::move(statistics), SelectionView(),
                              _options.backend, {}, _deformation);
}

void TessLODDrawable::setPickingOptions(const PickingOptions& options)
{
    if (options == _pickingOptions) { return; }
    _pickingOptions = options;
    dropPickingSurface();
}

void TessLODDrawable::dropPickingSurface()
{
    const std::lock_guard<std::mutex> lock(_pickingMutex);
    _pickingSurface = nullptr;
    if (dynamic_cast<SurfaceTree*>(getShape()) != nullptr) { setShape(nullptr); }
}

osg::ref_ptr<SurfaceProxy> TessLODDrawable::getPickingSurface() const
{
    if (!_gpuAsset.valid()) { return nullptr; }
    const std::lock_guard<std::mutex> lock(_pickingMutex);
    if (!_pickingSurface) { _pickingSurface = makePickingSurface(); }
    return _pickingSurface;
}

osg::ref_ptr<SurfaceProxy> TessLODDrawable::makePickingSurface() const
{
    return makeProxy(_pickingOptions);
}

osg::ref_ptr<SurfaceProxy> TessLODDrawable::makeProxy(const PickingOptions& options) const
{
    const osg::ref_ptr<SurfaceProxy> undeformed = _gpuAsset->proxy(options);
    if (!_deformation.valid()) { return undeformed; }
    return new SurfaceProxy(*undeformed, *_gpuAsset, *_deformation);
}

void TessLODDrawable::accept(osg::NodeVisitor& visitor)
{
    if (visitor.getVisitorType() == osg::NodeVisitor::INTERSECTION_VISITOR && _gpuAsset.valid() &&
        comesNear(dynamic_cast<osgUtil::IntersectionVisitor*>(&visitor), *this)) {
        const osg::ref_ptr<SurfaceProxy> surface = getPickingSurface();
        const std::lock_guard<std::mutex> lock(_pickingMutex);
        if (getShape() == nullptr) { setShape(surface->tree()); }
    }
    osg::Drawable::accept(visitor);
}

void TessLODDrawable::accept(osg::PrimitiveFunctor& functor) const
{
    const osg::ref_ptr<SurfaceProxy> surface = getPickingSurface();
    if (!surface || surface->vertices().empty()) { return; }
    functor.setVertexArray(static_cast<unsigned>(surface->vertices().size()), &surface->vertices().front());
    surface->triangles().accept(functor);
}

void TessLODDrawable::accept(osg::PrimitiveIndexFunctor& functor) const
{
    const osg::ref_ptr<SurfaceProxy> surface = getPickingSurface();
    if (!surface || surface->vertices().empty()) { return; }
    functor.setVertexArray(static_cast<unsigned>(surface->vertices().size()), &surface->vertices().front());
    surface->triangles().accept(functor);
}

void TessLODDrawable::accept(ConstAttributeFunctor& functor) const
{
    const osg::ref_ptr<SurfaceProxy> surface = getPickingSurface();
    if (!surface || surface->vertices().empty()) { return; }
    functor.apply(VERTICES, static_cast<unsigned>(surface->vertices().size()), &surface->vertices().front());
}

void TessLODDrawable::compileGLObjects(osg::RenderInfo& renderInfo) const
{
    osg::Drawable::compileGLObjects(renderInfo);
    if (!_gpuAsset.valid()) { return; }
    osg::State& state = *renderInfo.getState();
    _gpuAsset->compileGLObjects(state, moreStates(state));
    for (const auto& material : _materialStates) {
        if (material.valid()) { material->compileGLObjects(state); }
    }
}

void TessLODDrawable::releaseGLObjects(osg::State* state) const
{
    osg::Drawable::releaseGLObjects(state);
    if (_gpuAsset.valid()) { _gpuAsset->releaseGLObjects(state); }
    for (const auto& material : _materialStates) {
        if (material.valid()) { material->releaseGLObjects(state); }
    }
    if (_deformation.valid()) { _deformation->releaseGLObjects(state); }
}

void TessLODDrawable::resizeGLObjectBuffers(unsigned int maxSize)
{
    osg::Drawable::resizeGLObjectBuffers(maxSize);
    if (_gpuAsset.valid()) { _gpuAsset->resizeGLObjectBuffers(maxSize); }
    for (const auto& material : _materialStates) {
        if (material.valid()) { material->resizeGLObjectBuffers(maxSize); }
    }
    if (_deformation.valid()) { _deformation->resizeGLObjectBuffers(maxSize); }
}

} // namespace osgTessLOD
