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
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

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

/// From where to where along the view what is drawn reaches.
class DepthRange {
public:
    /// Of what `toEye` takes to eye space.
    void add(const osg::Matrixd& toEye, const osg::Vec3d& center, double radius)
    {
        const osg::Vec3d axis = depthAxis(toEye);
        add(-(center * axis + toEye(3, 2)), radius * axis.length());
    }
    void add(const osg::Matrixd& toEye, const osg::BoundingBox& box)
    {
        const osg::Vec3d axis = depthAxis(toEye);
        const osg::Vec3d half = osg::Vec3d(box._max - box._min) * 0.5;
        const double reach =
            std::fabs(axis.x()) * half.x() + std::fabs(axis.y()) * half.y() + std::fabs(axis.z()) * half.z();
        add(-(osg::Vec3d(box.center()) * axis + toEye(3, 2)), reach);
    }
    /// Extends the visitor's near and far planes. False if all is behind the eye.
    bool apply(osgUtil::CullVisitor& visitor) const
    {
        if (!(_far >= 0.0)) { return false; }
        visitor.setCalculatedNearPlane(std::min<double>(_near, visitor.getCalculatedNearPlane()));
        visitor.setCalculatedFarPlane(std::max<double>(_far, visitor.getCalculatedFarPlane()));
        return true;
    }

private:
    /// Grows towards the eye by its length per unit.
    static osg::Vec3d depthAxis(const osg::Matrixd& toEye) { return {toEye(0, 2), toEye(1, 2), toEye(2, 2)}; }
    void add(double depth, double reach)
    {
        _near = std::min(_near, depth - reach);
        _far = std::max(_far, depth + reach);
    }

    double _near = std::numeric_limits<double>::max();
    double _far = std::numeric_limits<double>::lowest();
};

/// Calls visit(first record, end, matrix to eye space) for records that follow each other in one place.
template <class Visit>
void forEachPlace(const PatchSelection& selection, const osg::Matrixd& localToEye, const Visit& visit)
{
    const RecordPlacements& placements = selection.placements();
    if (!placements.set.valid()) {
        visit(std::size_t{0}, selection.records().size(), localToEye);
        return;
    }
    const std::vector<std::uint32_t>& numbers = placements.numbers;
    for (std::size_t first = 0; first < numbers.size();) {
        std::size_t end = first + 1;
        while (end < numbers.size() && numbers[end] == numbers[first]) { ++end; }
        visit(first, end, placements.set->matrices()[numbers[first]] * localToEye);
        first = end;
    }
}

BoundSphere sphereOf(const PatchSelection& selection, const LodAsset& asset, std::uint32_t number)
{
    if (selection.deformation() != nullptr) { return selection.deformation()->selector().deformedSphere(number); }
    const LodPatch& patch = asset.patches[number];
    return {{patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]}, patch.boundRadius};
}

/// By the spheres of the patches that are drawn: nearer to them than the box of all is.
DepthRange depthsOfPatches(const PatchSelection& selection, const LodAsset& asset, const osg::Matrixd& localToEye)
{
    DepthRange range;
    forEachPlace(selection, localToEye, [&](std::size_t first, std::size_t end, const osg::Matrixd& toEye) {
        for (std::size_t k = first; k < end; ++k) {
            const BoundSphere sphere = sphereOf(selection, asset, selection.records()[k].patch);
            range.add(toEye, sphere.center, sphere.radius);
        }
    });
    return range;
}

/// By the boxes of the placements that are drawn.
DepthRange depthsOfPlacements(const PatchSelection& selection, const osg::BoundingBox& bounds,
                              const osg::Matrixd& localToEye)
{
    DepthRange range;
    forEachPlace(selection, localToEye,
                 [&](std::size_t, std::size_t, const osg::Matrixd& toEye) { range.add(toEye, bounds); });
    return range;
}

/// As CullVisitor::apply(Drawable&) does for the modes of nearest primitives and of bounding volumes. False: behind the eye.
bool updateNearFar(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable, const PatchSelection& leaf)
{
    const osg::BoundingBox& bounds = drawable.getBoundingBox();
    const osg::RefMatrix& matrix = *visitor.getModelViewMatrix();
    const auto byBounds = [&] { return !bounds.valid() || visitor.updateCalculatedNearFar(matrix, bounds); };
    switch (visitor.getComputeNearFarMode()) {
    case osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR: return true;
    case osg::CullSettings::COMPUTE_NEAR_FAR_USING_PRIMITIVES:
    case osg::CullSettings::COMPUTE_NEAR_USING_PRIMITIVES:
        if (leaf.isSelectedWhenDrawn()) { return byBounds(); }
        return depthsOfPatches(leaf, drawable.getGpuAsset()->asset(), matrix).apply(visitor);
    default:
        if (leaf.placements().set.valid()) {
            return depthsOfPlacements(leaf, drawable.surfaceBounds(), matrix).apply(visitor);
        }
        return byBounds();
    }
}

/// The states to push, outermost first.
std::vector<const osg::StateSet*> statesFor(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable,
                                            const osg::StateSet* material)
{
    std::vector<const osg::StateSet*> states;
    if (drawable.getStateSet() != nullptr) { states.push_back(drawable.getStateSet()); }
    if (material != nullptr) { states.push_back(material); }
    for (const osg::CullingSet::StateFrustumPair& pair : visitor.getCurrentCullingSet().getStateFrustumList()) {
        osg::Polytope frustum = pair.second;
        if (frustum.contains(drawable.getBoundingBox())) { states.push_back(pair.first.get()); }
    }
    states.push_back(drawable.getGpuAsset()->sortState());
    return states;
}

} // namespace

CullView::CullView(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable)
    : _visitor(visitor)
    , _options(drawable.getOptions())
    , _culledFace(culledFaceOf(visitor, drawable.getStateSet()))
{
    const osg::Camera* other = inheritedFrom(visitor);
    // Which side of a triangle shows is up to the camera that draws.
    if (other != nullptr || _options.frozen) { _culledFace = CulledFace::None; }
    const osg::Viewport* viewport = other != nullptr ? other->getViewport() : visitor.getViewport();
    _projection = other != nullptr ? other->getProjectionMatrix() : *visitor.getProjectionMatrix();
    _localToEye = other != nullptr ? inheritedModelView(visitor) : *visitor.getModelViewMatrix();
    if (viewport == nullptr) { return; }
    _width = viewport->width();
    _height = viewport->height();
}

SelectionView CullView::view() const
{
    return _options.frozen ? _options.frozenView : viewThrough(_localToEye);
}

SelectionView CullView::view(const osg::Matrixd& placement) const
{
    return _options.frozen ? placedView(_options.frozenView, placement) : viewThrough(placement * _localToEye);
}

SelectionView CullView::viewThrough(const osg::Matrixd& localToEye) const
{
    SelectionView view = makeSelectionView(localToEye, _projection, _width, _height);
    const double lodScale = _visitor.getLODScale();
    if (lodScale > 0.0) { view.pixelScale /= lodScale; }
    return view;
}

PatchSelector::CulledFaces CullView::culledFaces(const SelectionView& view) const
{
    using Faces = PatchSelector::CulledFaces;
    if (_culledFace == CulledFace::None) { return Faces::None; }
    return (_culledFace == CulledFace::Clockwise) != view.mirrored ? Faces::Back : Faces::Front;
}

std::vector<osg::Plane> CullView::frustum() const
{
    if ((_visitor.getCullingMode() & osg::CullSettings::VIEW_FRUSTUM_CULLING) == 0) { return {}; }
    return _visitor.getCurrentCullingSet().getFrustum().getPlaneList();
}

void addLeaf(osgUtil::CullVisitor& visitor, const TessLODDrawable& drawable, PatchSelection& leaf,
             const osg::StateSet* material)
{
    osg::RefMatrix& matrix = *visitor.getModelViewMatrix();
    if (!updateNearFar(visitor, drawable, leaf)) { return; }
    const osg::Vec3d center = osg::Vec3d(drawable.getBoundingBox().center()) * matrix;
    const auto depth = static_cast<float>(-center.z());
    if (std::isnan(depth)) { return; }
    const std::vector<const osg::StateSet*> states = statesFor(visitor, drawable, material);
    for (const osg::StateSet* state : states) { visitor.pushStateSet(state); }
    visitor.addDrawableAndDepth(&leaf, &matrix, depth);
    for (std::size_t k = 0; k < states.size(); ++k) { visitor.popStateSet(); }
}

} // namespace osgTessLOD
