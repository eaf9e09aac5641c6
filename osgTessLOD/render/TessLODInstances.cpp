// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/TessLODInstances.h>

#include <osgTessLOD/render/CullView.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/IntersectionAccess.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/PatchSelector.h>

#include <osgUtil/CullVisitor>

#include <algorithm>
#include <utility>

namespace osgTessLOD {

namespace {

bool everywhere(const osg::BoundingSphere&)
{
    return true;
}

/// The records of many placements as those of one selection: grouped by level.
class GatheredRecords {
public:
    void add(std::uint32_t placement, PatchSelector::Result selected)
    {
        if (selected.records.empty()) { return; }
        _statistics.add(selected.statistics);
        _parts.push_back({placement, std::move(selected)});
    }

    osg::ref_ptr<PatchSelection> selection(const TessLODInstances& drawable, const Placements& placements,
                                           const SelectionView& view)
    {
        const std::vector<std::uint64_t>& byLevel = _statistics.patchesByLevel;
        std::vector<std::size_t> next(byLevel.size(), 0); // per level where its next record goes
        for (std::size_t level = 1; level < byLevel.size(); ++level) {
            next[level] = next[level - 1] + byLevel[level - 1];
        }
        std::vector<PatchRecord> records(_statistics.patches);
        RecordPlacements where{&placements, std::vector<std::uint32_t>(_statistics.patches)};
        for (const Part& part : _parts) {
            const PatchRecord* from = part.selected.records.begin();
            for (std::size_t level = 0; level < byLevel.size(); ++level) {
                const auto count = static_cast<std::ptrdiff_t>(part.selected.statistics.patchesByLevel[level]);
                const auto to = static_cast<std::ptrdiff_t>(next[level]);
                std::copy_n(from, count, records.begin() + to);
                std::fill_n(where.numbers.begin() + to, count, part.placement);
                from += count;
                next[level] += static_cast<std::size_t>(count);
            }
        }
        const std::uint64_t all = drawable.getGpuAsset()->asset().patches.size() * placements.matrices().size();
        _statistics.culledPatches = all - _statistics.patches;
        return new PatchSelection(drawable.getGpuAsset(), std::move(records), std::move(_statistics), view,
                                  drawable.getOptions().backend, std::move(where), drawable.getDeformation());
    }

private:
    struct Part {
        std::uint32_t placement;
        PatchSelector::Result selected;
    };
    std::vector<Part> _parts;
    SelectionStatistics _statistics;
};

/// As CullVisitor tests a drawable's box, in the drawable's space.
bool isOutside(const osg::BoundingBox& box, std::vector<osg::Plane>& frustum)
{
    return std::any_of(frustum.begin(), frustum.end(), [&](osg::Plane& plane) { return plane.intersect(box) < 0; });
}

/// The model matrix of what is met at a placement.
class PlacementMatrix : public osg::RefMatrix {
public:
    PlacementMatrix(const osg::Matrixd& matrix, std::uint32_t number)
        : osg::RefMatrix(matrix)
        , placement(number)
    {
    }
    const std::uint32_t placement;

protected:
    ~PlacementMatrix() override = default;
};

} // namespace

TessLODInstances::TessLODInstances()
    : _placements(new Placements({}, osg::BoundingBox()))
{
}

TessLODInstances::TessLODInstances(std::shared_ptr<const LodAsset> asset)
    : TessLODInstances()
{
    setAsset(std::move(asset));
}

TessLODInstances::TessLODInstances(const TessLODInstances& other, const osg::CopyOp& copyop)
    : TessLODDrawable(other, copyop)
    , _placements(other._placements)
{
    TessLODDrawable::surfaceChanged();
}

TessLODInstances::~TessLODInstances() = default;

void TessLODInstances::setPlacements(std::vector<osg::Matrixd> placements)
{
    const osg::BoundingBox bounds = getGpuAsset() != nullptr ? surfaceBounds() : osg::BoundingBox();
    _placements = new Placements(std::move(placements), bounds);
    TessLODDrawable::surfaceChanged();
}

void TessLODInstances::surfaceChanged()
{
    setPlacements(getPlacements()); // their spheres are around the surface
}

osg::ref_ptr<PatchSelection> TessLODInstances::select(const CullView& view) const
{
    const PatchSelector& selector = this->selector();
    const bool culls = isCullingActive();
    GatheredRecords gathered;
    _placements->forEach(
        [&](const osg::BoundingSphere& sphere) { return !culls || !view.visitor().isCulled(sphere); },
        [&](std::uint32_t number) {
            const osg::Matrixd& placement = getPlacements()[number];
            std::vector<osg::Plane> frustum = view.frustum();
            for (osg::Plane& plane : frustum) { plane.transformProvidingInverse(placement); }
            if (culls && isOutside(surfaceBounds(), frustum)) { return; }
            const SelectionView placed = view.view(placement);
            gathered.add(number, selector.select(placed, getOptions(), frustum, view.culledFaces(placed)));
        });
    return gathered.selection(*this, *_placements, view.view());
}

osg::ref_ptr<PatchSelection> TessLODInstances::selectUniform(unsigned level) const
{
    const GpuAsset& asset = *getGpuAsset();
    PatchSelector::Result uniform{asset.selector().uniformRecords(level), {}};
    uniform.statistics = asset.selector().statisticsOf(uniform.records);
    GatheredRecords gathered;
    _placements->forEach(everywhere, [&](std::uint32_t number) { gathered.add(number, uniform); });
    return gathered.selection(*this, *_placements, SelectionView());
}

osg::BoundingBox TessLODInstances::computeBoundingBox() const
{
    return _placements->bounds();
}

// ------------------------------------------------------------------------------------------------ intersections ---

std::optional<std::uint32_t> TessLODInstances::placementOf(const osg::RefMatrix* hitMatrix)
{
    const auto* matrix = dynamic_cast<const PlacementMatrix*>(hitMatrix);
    return matrix != nullptr ? std::optional<std::uint32_t>(matrix->placement) : std::nullopt;
}

osg::ref_ptr<SurfaceProxy> TessLODInstances::makePickingSurface() const
{
    PickingOptions each = getPickingOptions();
    each.maxTriangles /= std::max<std::size_t>(1, getPlacements().size());
    const osg::ref_ptr<SurfaceProxy> one = makeProxy(each);
    return new SurfaceProxy(*one, *_placements);
}

void TessLODInstances::dropPickingSurface()
{
    TessLODDrawable::dropPickingSurface();
    const std::lock_guard<std::mutex> lock(_pickedMutex);
    _picked = nullptr;
}

osg::ref_ptr<TessLODDrawable> TessLODInstances::pickedDrawable()
{
    const std::lock_guard<std::mutex> lock(_pickedMutex);
    if (!_picked.valid()) {
        _picked = new TessLODDrawable;
        _picked->setName(getName());
        _picked->setPickingOptions(getPickingOptions());
        _picked->shareAsset(*this);
    }
    return _picked;
}

void TessLODInstances::accept(osg::NodeVisitor& visitor)
{
    auto* intersections = dynamic_cast<osgUtil::IntersectionVisitor*>(&visitor);
    if (intersections == nullptr) {
        TessLODDrawable::accept(visitor);
        return;
    }
    if (getGpuAsset() == nullptr || intersections->getDoDummyTraversal() || !visitor.validNodeMask(*this)) { return; }
    visitor.pushOntoNodePath(this);
    intersectPlacements(*intersections);
    visitor.popFromNodePath();
}

/// As IntersectionVisitor::apply(Transform&) does for one.
void TessLODInstances::intersectPlacements(osgUtil::IntersectionVisitor& visitor)
{
    const osg::ref_ptr<TessLODDrawable> picked = pickedDrawable();
    const osg::ref_ptr<osg::Node> volume = new osg::Node; // intersectors are asked by nodes
    const auto enters = [&](const osg::BoundingSphere& sphere) {
        volume->setInitialBound(sphere);
        return IntersectionAccess::enters(visitor, *volume);
    };
    const osg::RefMatrix* outer = visitor.getModelMatrix();
    const osg::Matrixd localToModel = outer != nullptr ? osg::Matrixd(*outer) : osg::Matrixd();
    _placements->forEach(enters, [&](std::uint32_t number) {
        const osg::ref_ptr<osg::RefMatrix> matrix = new PlacementMatrix(getPlacements()[number] * localToModel, number);
        visitor.pushModelMatrix(matrix.get());
        IntersectionAccess::pushClone(visitor);
        picked->accept(visitor);
        IntersectionAccess::popClone(visitor);
        visitor.popModelMatrix();
    });
}

// --------------------------------------------------------------------------------------------------- GL objects ---

std::vector<const osg::StateSet*> TessLODInstances::moreStates(osg::State& state) const
{
    std::vector<const osg::StateSet*> states = TessLODDrawable::moreStates(state);
    states.push_back(_placements->state());
    return states;
}

void TessLODInstances::releaseGLObjects(osg::State* state) const
{
    TessLODDrawable::releaseGLObjects(state);
    _placements->releaseGLObjects(state);
}

void TessLODInstances::resizeGLObjectBuffers(unsigned int maxSize)
{
    TessLODDrawable::resizeGLObjectBuffers(maxSize);
    _placements->resizeGLObjectBuffers(maxSize);
}

} // namespace osgTessLOD
