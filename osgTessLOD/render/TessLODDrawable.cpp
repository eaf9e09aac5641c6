// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchCullCallback.h>
#include <osgTessLOD/render/PatchSelection.h>

#include <osg/State>
#include <osgUtil/IntersectionVisitor>

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

/// Does what is looked for meet the drawable's bounding sphere? enter() is protected; a pointer to it is not.
class IntersectionAccess : public osgUtil::IntersectionVisitor {
public:
    static bool enters(osgUtil::IntersectionVisitor& visitor, const osg::Node& node)
    {
        return (visitor.*(&IntersectionAccess::enter))(node);
    }
};

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
    , _asset(other._asset)
    , _gpuAsset(other._gpuAsset)
    , _observer(other._observer)
    , _options(other._options)
    , _pickingOptions(other._pickingOptions)
    , _fileName(other._fileName)
{
    dropPickingSurface(); // a tree of one's own is made when needed, of the same surface
    ensureCullCallback(*this);
    dirtyBound();
    getBoundingBox();
}

TessLODDrawable::~TessLODDrawable() = default;

void TessLODDrawable::setAsset(std::shared_ptr<const LodAsset> asset)
{
    _asset = std::move(asset);
    _gpuAsset = _asset != nullptr ? new GpuAsset(_asset) : nullptr;
    dropPickingSurface();
    _fileName.clear();
    dirtyBound();
    getBoundingBox(); // now: cull traversals, possibly several at once, must find it computed
}

void TessLODDrawable::shareAsset(const TessLODDrawable& other)
{
    _asset = other._asset;
    _gpuAsset = other._gpuAsset;
    _fileName = other._fileName;
    dropPickingSurface();
    dirtyBound();
    getBoundingBox();
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
    PatchRecords records = selector.uniformRecords(0);
    SelectionStatistics statistics = selector.statisticsOf(records);
    const osg::ref_ptr<PatchSelection> coarsest =
        new PatchSelection(_gpuAsset.get(), std::move(records), std::move(statistics), SelectionView(), _options.backend);
    coarsest->drawImplementation(renderInfo);
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
    if (!_pickingSurface) { _pickingSurface = _gpuAsset->proxy(_pickingOptions); }
    return _pickingSurface;
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
