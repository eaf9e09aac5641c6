// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/GpuAsset.h>

#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/BackendChoice.h>
#include <osgTessLOD/render/DeformableAsset.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/PatchPrograms.h>
#include <osgTessLOD/render/ShaderSelection.h>

#include <osg/Notify>

#include <algorithm>
#include <string>

namespace osgTessLOD {

GpuAsset::GpuAsset(std::shared_ptr<const StreamedAsset> asset)
    : _source(std::move(asset))
    , _selector(_source->frame())
    , _surface(_source->frame())
    , _programs(PatchPrograms::shared())
    , _sortState(new osg::StateSet)
{
    const LodAsset& a = this->asset();
    _bounds.set(a.boundsMin[0], a.boundsMin[1], a.boundsMin[2], a.boundsMax[0], a.boundsMax[1], a.boundsMax[2]);
    pagesWithin(kPageTexels); // now: most contexts want them, and draw threads should not wait
}

GpuAsset::GpuAsset(std::shared_ptr<const LodAsset> asset)
    : GpuAsset(std::make_shared<const StreamedAsset>(std::move(asset)))
{
}

GpuAsset::~GpuAsset() = default;

const DeformableAsset& GpuAsset::deformable() const
{
    std::call_once(_deformableOnce, [this] { _deformable = std::make_unique<DeformableAsset>(*_source->whole()); });
    return *_deformable;
}

const AssetPages& GpuAsset::pagesWithin(std::int64_t maxTexels) const
{
    const std::lock_guard<std::mutex> lock(_pagesMutex);
    osg::ref_ptr<AssetPages>& pages = _pages[maxTexels];
    if (!pages.valid()) { pages = new AssetPages(*_source, maxTexels); }
    return *pages;
}

void GpuAsset::warnOnce(const std::string& why) const
{
    if (!_warned.exchange(true)) {
        OSG_WARN << "osgTessLOD: cannot draw \"" << asset().source << "\": " << why << std::endl;
    }
}

const AssetPages* GpuAsset::pagesFor(osg::State& state) const
{
    const DrawContext& context = DrawContext::of(state);
    if (!context.supported()) {
        warnOnce("OpenGL 3.3 is needed");
        return nullptr;
    }
    if (asset().levels.size() > AssetPages::kMaxLevels) {
        warnOnce("its ladder has more than " + std::to_string(AssetPages::kMaxLevels) + " levels");
        return nullptr;
    }
    return &pagesWithin(std::min(context.maxTextureBufferTexels(), kPageTexels));
}

const ShaderSelection* GpuAsset::shaderSelectionFor(osg::State& state) const
{
    if (pagesFor(state) == nullptr) { return nullptr; }
    const std::int64_t maxTexels = DrawContext::of(state).maxTextureBufferTexels();
    const PatchBlocks& blocks = _selector.blocks();
    if (ShaderSelection::texelCount(blocks) > maxTexels) { return nullptr; }
    const AssetPages& pages = pagesWithin(std::min(maxTexels, kSelectedPageTexels));
    if (pages.size() != 1) { return nullptr; }
    if (chooseBackend(state, *this, Backend::Tessellation) != Backend::Tessellation) { return nullptr; }
    const std::lock_guard<std::mutex> lock(_pagesMutex);
    if (!_shaderSelection.valid()) { _shaderSelection = new ShaderSelection(blocks, pages); }
    return _shaderSelection.get();
}

osg::ref_ptr<SurfaceProxy> GpuAsset::proxy(const PickingOptions& options) const
{
    const unsigned wanted = SurfaceProxy::levelFor(_selector, _source->levelCount(), options);
    _source->read(wanted + 1, 0);
    const unsigned level = std::min(wanted, _source->levelCount() - 1);
    const std::lock_guard<std::mutex> lock(_proxyMutex);
    osg::ref_ptr<SurfaceProxy> proxy;
    if (!_proxies[level].lock(proxy)) {
        proxy = new SurfaceProxy(asset(), _selector, _surface, level);
        _proxies[level] = proxy;
    }
    return proxy;
}

void GpuAsset::compileGLObjects(osg::State& state, const std::vector<const osg::StateSet*>& more) const
{
    const AssetPages* pages = pagesFor(state);
    if (pages == nullptr || pages->size() == 0) { return; }
    pages->compileGLObjects(state);
    const std::shared_ptr<const AssetPage> first = pages->resident().front();
    state.pushStateSet(first->state.get()); // its defines choose the variants of programs
    for (const osg::StateSet* set : more) {
        set->compileGLObjects(state);
        state.pushStateSet(set);
    }
    _programs->compileGLObjects(state, Backend::Instanced);
    if (DrawContext::of(state).canTessellate(state, asset().ladder)) {
        _programs->compileGLObjects(state, Backend::Tessellation);
    }
    for (std::size_t k = 0; k < more.size(); ++k) { state.popStateSet(); }
    state.popStateSet();
}

void GpuAsset::releaseGLObjects(osg::State* state) const
{
    _programs->releaseGLObjects(state);
    {
        const std::lock_guard<std::mutex> lock(_pagesMutex);
        for (const auto& [limit, pages] : _pages) { pages->releaseGLObjects(state); }
        if (_shaderSelection.valid()) { _shaderSelection->releaseGLObjects(state); }
    }
    if (state != nullptr) { DrawContext::release(*state); }
}

void GpuAsset::resizeGLObjectBuffers(unsigned maxSize)
{
    _programs->resizeGLObjectBuffers(maxSize);
    const std::lock_guard<std::mutex> lock(_pagesMutex);
    for (const auto& [limit, pages] : _pages) { pages->resizeGLObjectBuffers(maxSize); }
    if (_shaderSelection.valid()) { _shaderSelection->resizeGLObjectBuffers(maxSize); }
}

} // namespace osgTessLOD
