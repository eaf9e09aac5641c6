// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/CullView.h>

#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelection.h>
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

/// Extends the visitor's near and far planes by the spheres of the patches that are drawn: nearer to them than the box of all is.
/// False if all are behind the eye.
bool updateNearFarByPatches(osgUtil::CullVisitor& visitor, const LodAsset& asset,
                            const std::vector<PatchRecord>& records)
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

/// The states to push, outermost first.
std::vector<const osg::StateSet*> statesFor(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable)
{
    std::vector<const osg::StateSet*> states;
    if (drawable.getStateSet() != nullptr) { states.push_back(drawable.getStateSet()); }
    for (const osg::CullingSet::StateFrustumPair& pair : visitor.getCurrentCullingSet().getStateFrustumList()) {
        osg::Polytope frustum = pair.second;
        if (frustum.contains(drawable.getBoundingBox())) { states.push_back(pair.first.get()); }
    }
    states.push_back(drawable.getGpuAsset()->sortState());
    return states;
}

} // namespace

CullView::CullView(osgUtil::CullVisitor& visitor, const SelectionOptions& options)
    : _visitor(visitor)
    , _options(options)
{
    const osg::Camera* other = inheritedFrom(visitor);
    const osg::Viewport* viewport = other != nullptr ? other->getViewport() : visitor.getViewport();
    _projection = other != nullptr ? other->getProjectionMatrix() : *visitor.getProjectionMatrix();
    _localToEye = other != nullptr ? inheritedModelView(visitor) : *visitor.getModelViewMatrix();
    if (viewport == nullptr) { return; }
    _width = viewport->width();
    _height = viewport->height();
}

SelectionView CullView::view() const
{
    if (_options.frozen) { return _options.frozenView; }
    SelectionView view = makeSelectionView(_localToEye, _projection, _width, _height);
    const double lodScale = _visitor.getLODScale();
    if (lodScale > 0.0) { view.pixelScale /= lodScale; }
    return view;
}

std::vector<osg::Plane> CullView::frustum() const
{
    if ((_visitor.getCullingMode() & osg::CullSettings::VIEW_FRUSTUM_CULLING) == 0) { return {}; }
    return _visitor.getCurrentCullingSet().getFrustum().getPlaneList();
}

void addLeaf(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable, PatchSelection& leaf)
{
    osg::RefMatrix& matrix = *visitor.getModelViewMatrix();
    if (!updateNearFar(visitor, drawable, leaf)) { return; }
    const osg::Vec3d center = osg::Vec3d(drawable.getBoundingBox().center()) * matrix;
    const auto depth = static_cast<float>(-center.z());
    if (std::isnan(depth)) { return; }
    const std::vector<const osg::StateSet*> states = statesFor(visitor, drawable);
    for (const osg::StateSet* state : states) { visitor.pushStateSet(state); }
    visitor.addDrawableAndDepth(&leaf, &matrix, depth);
    for (std::size_t k = 0; k < states.size(); ++k) { visitor.popStateSet(); }
}

} // namespace osgTessLOD
