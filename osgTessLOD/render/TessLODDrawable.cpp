// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchCullCallback.h>
#include <osgTessLOD/render/PatchSelection.h>

#include <osg/State>

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
    , _asset(other._asset)
    , _gpuAsset(other._gpuAsset)
    , _observer(other._observer)
    , _options(other._options)
{
    ensureCullCallback(*this);
    dirtyBound();
    getBoundingBox();
}

TessLODDrawable::~TessLODDrawable() = default;

void TessLODDrawable::setAsset(std::shared_ptr<const LodAsset> asset)
{
    _asset = std::move(asset);
    _gpuAsset = _asset != nullptr ? new GpuAsset(_asset) : nullptr;
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
    return _gpuAsset.valid() ? _gpuAsset->bounds() : osg::BoundingBox();
}

void TessLODDrawable::drawImplementation(osg::RenderInfo& renderInfo) const
{
    if (!_gpuAsset.valid()) { return; }
    const PatchSelector& selector = _gpuAsset->selector();
    std::vector<PatchRecord> records = selector.uniformRecords(0);
    SelectionStatistics statistics = selector.statisticsOf(records);
    const osg::ref_ptr<PatchSelection> coarsest =
        new PatchSelection(_gpuAsset.get(), std::move(records), std::move(statistics), SelectionView());
    osg::State& state = *renderInfo.getState();
    state.pushStateSet(_gpuAsset->drawState());
    state.apply();
    coarsest->drawImplementation(renderInfo);
    state.popStateSet();
    state.apply();
}

void TessLODDrawable::accept(osg::PrimitiveFunctor& functor) const
{
    if (!_gpuAsset.valid()) { return; }
    const GpuAsset::Proxy& proxy = _gpuAsset->proxy();
    functor.setVertexArray(static_cast<unsigned>(proxy.vertices.size()), proxy.vertices.data());
    functor.drawElements(GL_TRIANGLES, static_cast<GLsizei>(proxy.indices.size()), proxy.indices.data());
}

void TessLODDrawable::compileGLObjects(osg::RenderInfo& renderInfo) const
{
    osg::Drawable::compileGLObjects(renderInfo);
    if (_gpuAsset.valid()) { _gpuAsset->compileGLObjects(*renderInfo.getState()); }
}

void TessLODDrawable::releaseGLObjects(osg::State* state) const
{
    osg::Drawable::releaseGLObjects(state);
    if (_gpuAsset.valid()) { _gpuAsset->releaseGLObjects(state); }
}

void TessLODDrawable::resizeGLObjectBuffers(unsigned int maxSize)
{
    osg::Drawable::resizeGLObjectBuffers(maxSize);
    if (_gpuAsset.valid()) { _gpuAsset->resizeGLObjectBuffers(maxSize); }
}

} // namespace osgTessLOD
