// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchCullCallback.h>

#include <osgTessLOD/render/CullView.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Transform>
#include <osgUtil/CullVisitor>

namespace osgTessLOD {

PatchCullCallback::PatchCullCallback(const PatchCullCallback& other, const osg::CopyOp& copyop)
    : osg::Object(other, copyop)
    , osg::Callback(other, copyop)
    , osg::DrawableCullCallback(other, copyop)
{
}

bool PatchCullCallback::cull(osg::NodeVisitor* visitor, osg::Drawable* drawable, osg::RenderInfo* renderInfo) const
{
    auto* cull = visitor != nullptr ? visitor->asCullVisitor() : nullptr;
    const auto* lod = dynamic_cast<const TessLODDrawable*>(drawable);
    if (cull == nullptr || lod == nullptr) { return false; }
    // CullVisitor calls the outermost callback only: the ones that were added later are up to it.
    const auto* nested = dynamic_cast<const osg::DrawableCullCallback*>(getNestedCallback());
    if (nested != nullptr && nested->cull(visitor, drawable, renderInfo)) { return true; }
    if (lod->getGpuAsset() == nullptr) { return true; }
    // By the box, and by the sphere where features of a few pixels are culled.
    if (lod->isCullingActive() && (cull->isCulled(lod->getBoundingBox()) || cull->isCulled(lod->getBound()))) {
        return true;
    }
    const osg::ref_ptr<PatchSelection> selection = lod->select(CullView(*cull, *lod));
    if (lod->getSelectionObserver() != nullptr) {
        const osg::Matrixd localToWorld = osg::computeLocalToWorld(cull->getNodePath());
        lod->getSelectionObserver()->selected(cull->getCurrentCamera(), localToWorld, *selection);
    }
    const std::vector<osg::ref_ptr<PatchSelection>> parts = selection->byMaterial();
    for (std::size_t m = 0; m < parts.size(); ++m) {
        if (parts[m].valid() && !parts[m]->records().empty()) { addLeaf(*cull, *lod, *parts[m], lod->getMaterialState(m)); }
    }
    return true;
}

} // namespace osgTessLOD
