// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchCullCallback.h>

#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Camera>
#include <osg/Transform>
#include <osg/Viewport>
#include <osgUtil/CullVisitor>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

/// The camera whose viewpoint this traversal uses, if it is another than the one being traversed; else null.
const osg::Camera* inheritedFrom(osgUtil::CullVisitor& visitor)
{
    const auto inherits = [](const osg::Camera* camera) {
        return camera != nullptr && camera->getReferenceFrame() == osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT;
    };
    if (!inherits(visitor.getCurrentCamera())) { return nullptr; }
    const osg::NodePath& path = visitor.getNodePath();
    for (auto node = path.rbegin(); node != path.rend(); ++node) {
        const osg::Camera* camera = (*node)->asCamera();
        if (camera != nullptr && !inherits(camera)) { return camera; }
    }
    return visitor.getRenderStage()->getCamera(); // the view's own, which is not in the path
}

/// Local space of the visited drawable → eye space of the view that cameras inherit: as if they were not there.
osg::Matrixd inheritedModelView(osgUtil::CullVisitor& visitor)
{
    osg::Matrixd matrix = visitor.getRenderStage()->getCamera()->getViewMatrix();
    for (osg::Node* node : visitor.getNodePath()) {
        const osg::Transform* transform = node->asTransform();
        if (transform != nullptr && transform->getReferenceFrame() != osg::Transform::ABSOLUTE_RF_INHERIT_VIEWPOINT) {
            transform->computeLocalToWorldMatrix(matrix, &visitor);
        }
    }
    return matrix;
}

SelectionView viewOf(osgUtil::CullVisitor& visitor, const SelectionOptions& options)
{
    if (options.frozen) { return options.frozenView; }
    const osg::Camera* other = inheritedFrom(visitor);
    const osg::Viewport* viewport = other != nullptr ? other->getViewport() : visitor.getViewport();
    const osg::Matrixd projection = other != nullptr ? other->getProjectionMatrix() : *visitor.getProjectionMatrix();
    const osg::Matrixd localToEye = other != nullptr ? inheritedModelView(visitor) : *visitor.getModelViewMatrix();
    SelectionView view = makeSelectionView(localToEye, projection, viewport != nullptr ? viewport->width() : 0.0,
                                           viewport != nullptr ? viewport->height() : 0.0);
    const double lodScale = visitor.getLODScale();
    if (lodScale > 0.0) { view.pixelScale /= lodScale; }
    return view;
}

std::vector<osg::Plane> frustumOf(osgUtil::CullVisitor& visitor)
{
    if ((visitor.getCullingMode() & osg::CullSettings::VIEW_FRUSTUM_CULLING) == 0) { return {}; }
    return visitor.getCurrentCullingSet().getFrustum().getPlaneList();
}

/// Extends the visitor's near and far planes by the spheres of the patches that are drawn: nearer to them than the box of all is.
/// False if all are behind the eye.
bool updateNearFarByPatches(osgUtil::CullVisitor& visitor, const LodAsset& asset, const PatchRecords& records)
{
    const osg::Matrixd& matrix = *visitor.getModelViewMatrix();
    const osg::Vec3d toEye(matrix(0, 2), matrix(1, 2), matrix(2, 2)); // grows towards the eye by its length per unit
    double near = std::numeric_limits<double>::max();
    double far = std::numeric_limits<double>::lowest();
    for (const PatchRecord& record : records) {
        const LodPatch& patch = asset.patches[record.patch];
        const osg::Vec3d center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
        const double depth = -(center * toEye + matrix(3, 2));
        const double radius = double{patch.boundRadius} * toEye.length();
        near = std::min(near, depth - radius);
        far = std::max(far, depth + radius);
    }
    if (!(far >= 0.0)) { return false; }
    visitor.setCalculatedNearPlane(std::min<double>(near, visitor.getCalculatedNearPlane()));
    visitor.setCalculatedFarPlane(std::max<double>(far, visitor.getCalculatedFarPlane()));
    return true;
}

/// As CullVisitor::apply(Drawable&) does for the modes of nearest primitives and of bounding volumes. False: behind the eye.
bool updateNearFar(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable, const PatchSelection& leaf)
{
    const osg::BoundingBox& bounds = drawable.getBoundingBox();
    switch (visitor.getComputeNearFarMode()) {
    case osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR: return true;
    case osg::CullSettings::COMPUTE_NEAR_FAR_USING_PRIMITIVES:
    case osg::CullSettings::COMPUTE_NEAR_USING_PRIMITIVES:
        return updateNearFarByPatches(visitor, *drawable.getAsset(), leaf.records());
    default: return !bounds.valid() || visitor.updateCalculatedNearFar(*visitor.getModelViewMatrix(), bounds);
    }
}

/// As CullVisitor::apply(Drawable&) does it, for another drawable than the visited one.
void addLeaf(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable, PatchSelection& leaf,
             const std::vector<const osg::StateSet*>& states)
{
    osg::RefMatrix& matrix = *visitor.getModelViewMatrix();
    const osg::BoundingBox& bounds = drawable.getBoundingBox();
    if (!updateNearFar(visitor, drawable, leaf)) { return; }
    const osg::Vec3d center = osg::Vec3d(bounds.center()) * matrix;
    const auto depth = static_cast<float>(-center.z());
    if (std::isnan(depth)) { return; }
    for (const osg::StateSet* state : states) { visitor.pushStateSet(state); }
    visitor.addDrawableAndDepth(&leaf, &matrix, depth);
    for (std::size_t k = 0; k < states.size(); ++k) { visitor.popStateSet(); }
}

/// The states to push, outermost first.
std::vector<const osg::StateSet*> statesFor(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable,
                                            const osg::BoundingBox& bounds)
{
    std::vector<const osg::StateSet*> states;
    if (drawable.getStateSet() != nullptr) { states.push_back(drawable.getStateSet()); }
    for (const osg::CullingSet::StateFrustumPair& pair : visitor.getCurrentCullingSet().getStateFrustumList()) {
        osg::Polytope frustum = pair.second;
        if (frustum.contains(bounds)) { states.push_back(pair.first.get()); }
    }
    states.push_back(drawable.getGpuAsset()->sortState());
    return states;
}

} // namespace

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
    GpuAsset* asset = lod->getGpuAsset();
    if (asset == nullptr) { return true; }
    const osg::BoundingBox& bounds = lod->getBoundingBox();
    if (lod->isCullingActive() && cull->isCulled(bounds)) { return true; }

    const SelectionView view = viewOf(*cull, lod->getOptions());
    PatchSelector::Result selected = asset->selector().select(view, lod->getOptions(), frustumOf(*cull));
    const osg::ref_ptr<PatchSelection> selection =
        new PatchSelection(asset, std::move(selected.records), std::move(selected.statistics), view,
                           lod->getOptions().backend);
    if (lod->getSelectionObserver() != nullptr) {
        const osg::Matrixd localToWorld = osg::computeLocalToWorld(cull->getNodePath());
        lod->getSelectionObserver()->selected(cull->getCurrentCamera(), localToWorld, *selection);
    }
    if (!selection->records().empty()) { addLeaf(*cull, *lod, *selection, statesFor(*cull, *lod, bounds)); }
    return true;
}

} // namespace osgTessLOD
