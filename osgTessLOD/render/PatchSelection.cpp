// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchSelection.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/BackendChoice.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/FixedFunction.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchDraw.h>
#include <osgTessLOD/render/PatchPrograms.h>
#include <osgTessLOD/render/ShaderSelection.h>
#include <osgTessLOD/render/TransformFeedback.h>

#include <osg/Notify>
#include <osg/Program>
#include <osg/State>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

namespace osgTessLOD {

namespace {

/// Is the program that OSG applied last this one, linked? Otherwise drawing patches would be a GL error.
bool isApplied(const osg::State& state, const osg::StateSet& wanted)
{
    const osg::Program::PerContextProgram* applied = state.getLastAppliedProgramObject();
    return applied != nullptr && applied->isLinked() &&
           applied->getProgram() == wanted.getAttribute(osg::StateAttribute::PROGRAM);
}

} // namespace

void SelectionStatistics::add(const SelectionStatistics& other)
{
    patches += other.patches;
    culledPatches += other.culledPatches;
    saturatedPatches += other.saturatedPatches;
    isUpperBound = isUpperBound || other.isUpperBound;
    triangles += other.triangles;
    patchesByLevel.resize(std::max(patchesByLevel.size(), other.patchesByLevel.size()), 0);
    for (std::size_t k = 0; k < other.patchesByLevel.size(); ++k) { patchesByLevel[k] += other.patchesByLevel[k]; }
}

PatchSelection::PatchSelection()
{
    setUseDisplayList(false);
    setDataVariance(osg::Object::STATIC); // DYNAMIC would make the next frame wait for this one's draw
    setCullingActive(false);              // it exists because it was found visible
}

PatchSelection::PatchSelection(const GpuAsset* asset, PatchRecords records, SelectionStatistics statistics,
                               const SelectionView& view, Backend backend, RecordPlacements placements,
                               osg::ref_ptr<const ControlMeshDeformation> deformation)
    : PatchSelection()
{
    _asset = asset;
    _records = std::move(records);
    _placements = std::move(placements);
    _deformation = std::move(deformation);
    _statistics = std::move(statistics);
    _view = view;
    _backend = backend;
}

PatchSelection::PatchSelection(const GpuAsset* asset, SelectionRequest request)
    : PatchSelection()
{
    const PatchSelector& selector = asset->selector();
    // Seams may be finer than what is asked for, and then only records of all levels are in the order of ShaderSelection::patches().
    const auto finest = selector.blocks().hasSeams()
                            ? static_cast<unsigned>(asset->asset().ladder.size() - 1)
                            : static_cast<unsigned>(selector.kernelView(request.view, request.options).top);
    _asset = asset;
    _records = selector.uniformRecords(finest);
    _statistics = selector.uniformStatistics(finest);
    _statistics.isUpperBound = true;
    _view = request.view;
    _backend = request.options.backend;
    _viewState = ShaderSelection::viewState(selector, request);
    _request = std::make_shared<const SelectionRequest>(std::move(request));
}

PatchSelection::PatchSelection(const PatchSelection& other, const osg::CopyOp& copyop)
    : osg::Drawable(other, copyop)
    , _asset(other._asset)
    , _records(other._records)
    , _placements(other._placements)
    , _deformation(other._deformation)
    , _statistics(other._statistics)
    , _view(other._view)
    , _backend(other._backend)
    , _request(other._request)
    , _viewState(other._viewState)
{
}

PatchSelection::~PatchSelection() = default;

std::vector<osg::ref_ptr<PatchSelection>> PatchSelection::byMaterial()
{
    const LodAsset& asset = _asset->asset();
    if (asset.patchMaterials.empty()) { return {this}; }
    std::vector<std::vector<PatchRecord>> records(asset.materials.size());
    std::vector<RecordPlacements> placements(asset.materials.size(), {_placements.set, {}});
    for (std::size_t k = 0; k < _records.size(); ++k) {
        const std::uint16_t material = asset.patchMaterials[_records[k].patch];
        records[material].push_back(_records[k]);
        if (_placements.set.valid()) { placements[material].numbers.push_back(_placements.numbers[k]); }
    }
    std::vector<osg::ref_ptr<PatchSelection>> parts(records.size());
    for (std::size_t m = 0; m < parts.size(); ++m) {
        if (records[m].empty()) { continue; }
        PatchRecords own = std::move(records[m]);
        SelectionStatistics statistics = _asset->selector().statisticsOf(own);
        parts[m] = new PatchSelection(_asset.get(), std::move(own), std::move(statistics), _view, _backend,
                                      std::move(placements[m]), _deformation);
    }
    return parts;
}

osg::BoundingBox PatchSelection::computeBoundingBox() const
{
    if (!_asset.valid()) { return {}; }
    if (_placements.set.valid()) { return _placements.set->bounds(); }
    return _deformation.valid() ? _deformation->bounds() : _asset->bounds();
}

const ShaderSelection* PatchSelection::shaderSelectionFor(osg::State& state) const
{
    if (_request == nullptr || _backend == Backend::Instanced) { return nullptr; }
    return _asset->shaderSelectionFor(state);
}

/// Itself, or what PatchSelector selects in its place where the control shader cannot select.
osg::ref_ptr<const PatchSelection> PatchSelection::asDrawnIn(osg::State& state) const
{
    if (_request == nullptr || shaderSelectionFor(state) != nullptr) { return this; }
    PatchSelector::Result selected =
        _asset->selector().select(_request->view, _request->options, _request->frustum, _request->faces);
    return new PatchSelection(_asset.get(), std::move(selected.records), std::move(selected.statistics), _view,
                              _backend);
}

/// What to draw with beside the program and a page's state.
std::vector<const osg::StateSet*> PatchSelection::moreStates(osg::State& state) const
{
    std::vector<const osg::StateSet*> states;
    if (_placements.set.valid()) { states.push_back(_placements.set->state()); }
    if (_deformation.valid()) { states.push_back(_deformation->state()); }
    if (!states.empty()) { return states; }
    if (const ShaderSelection* selection = shaderSelectionFor(state)) { return {selection->state(), _viewState.get()}; }
    return {};
}

/// How much of each page the records need.
std::vector<PageDetail> PatchSelection::neededDetail(const AssetPages& pages) const
{
    std::vector<PageDetail> needed(pages.size());
    std::size_t page = 0;
    for (const PatchRecord& record : _records) {
        if (pages.size() > 1) { page = pages.pageOf(record.patch); }
        needed[page].levels = std::max(needed[page].levels, MorphedSurface::drawnLevel(record.edgeLevels) + 1U);
    }
    for (page = 0; page < needed.size(); ++page) {
        if (needed[page].levels > 0) { needed[page].normals = neededNormals(pages, page); }
    }
    return needed;
}

/// Resolutions of normals that a page's patches may be looked up in, all where it is not known how large they are on screen.
unsigned PatchSelection::neededNormals(const AssetPages& pages, std::size_t page) const
{
    const unsigned all = pages.whole().normals;
    if (_placements.set.valid() || _deformation.valid() || !(_view.pixelScale > 0.0)) { return all; }
    constexpr double kStretch = 4.0; // how much denser than on average its points may be somewhere on a patch
    const AssetPages::Extent& extent = pages.extent(page);
    double pixels = _view.pixelScale * 2.0 * extent.patchRadius * kStretch;
    if (!_view.orthographic) {
        const double distance = (_view.eye - osg::Vec3d(extent.sphere.center())).length() - extent.sphere.radius();
        pixels /= _view.leastCosine * _view.leastCosine * distance;
        if (!(distance > 0.0)) { return all; }
    }
    unsigned resolutions = std::min(1U, all);
    while (resolutions < all && std::exp2(resolutions - 1) < pixels) { ++resolutions; }
    return resolutions;
}

/// With levels as far as the pages have them: those of a border as far as both its patches' have.
osg::ref_ptr<const PatchSelection> PatchSelection::within(const AssetPages& pages,
                                                          const AssetPages::Resident& resident) const
{
    const LodAsset& asset = _asset->asset();
    std::vector<PatchRecord> records = _records.vector();
    std::vector<std::vector<std::size_t>> byLevel(asset.levels.size());
    for (std::size_t k = 0; k < records.size(); ++k) {
        PatchRecord& record = records[k];
        for (std::size_t side = 0; side < 3; ++side) {
            float& level = record.edgeLevels[side];
            for (const std::uint32_t patch : asset.edges[asset.patches[record.patch].edges[side]].patches) {
                if (patch == kNoPatch) { continue; }
                level = std::min(level, static_cast<float>(resident[pages.pageOf(patch)]->detail.levels - 1));
            }
        }
        byLevel[MorphedSurface::drawnLevel(record.edgeLevels)].push_back(k);
    }
    std::vector<PatchRecord> grouped;
    RecordPlacements placements{_placements.set, {}};
    for (const std::vector<std::size_t>& level : byLevel) {
        for (const std::size_t k : level) {
            grouped.push_back(records[k]);
            if (_placements.set.valid()) { placements.numbers.push_back(_placements.numbers[k]); }
        }
    }
    return new PatchSelection(_asset.get(), PatchRecords(std::move(grouped)), _statistics, _view, _backend,
                              std::move(placements), _deformation);
}

/// Calls draw(records) for the records of each page, with the page's state and the program's applied; records of coarser levels
/// where the pages do not have those of the selection.
template <typename Draw>
void PatchSelection::forEachPage(osg::State& state, osg::StateSet& program, const Draw& draw) const
{
    if (const ShaderSelection* selection = shaderSelectionFor(state)) {
        forEachPage(state, program, selection->pages(), {selection->page()}, draw);
        return;
    }
    const AssetPages& pages = *_asset->pagesFor(state);
    const std::vector<PageDetail> needed = neededDetail(pages);
    const AssetPages::Resident resident = pages.acquire(state, needed);
    bool isEnough = true;
    for (std::size_t page = 0; page < needed.size(); ++page) {
        isEnough = isEnough && resident[page]->detail.levels >= needed[page].levels;
    }
    const osg::ref_ptr<const PatchSelection> drawn = isEnough ? osg::ref_ptr<const PatchSelection>(this) : within(pages, resident);
    drawn->forEachPage(state, program, pages, resident, draw);
}

template <typename Draw>
void PatchSelection::forEachPage(osg::State& state, osg::StateSet& program, const AssetPages& pages,
                                 const AssetPages::Resident& resident, const Draw& draw) const
{
    struct Page {
        std::vector<PatchRecord> records;
        std::vector<std::uint32_t> placements;
    };
    std::vector<Page> byPage;
    if (pages.size() > 1) {
        byPage.resize(pages.size());
        for (std::size_t k = 0; k < _records.size(); ++k) {
            Page& page = byPage[pages.pageOf(_records[k].patch)];
            page.records.push_back(_records[k]);
            if (_placements.set.valid()) { page.placements.push_back(_placements.numbers[k]); }
        }
    }
    const std::vector<const osg::StateSet*> more = moreStates(state);
    state.pushStateSet(&program);
    for (const osg::StateSet* set : more) { state.pushStateSet(set); }
    for (std::size_t page = 0; page < pages.size(); ++page) {
        const DrawnRecords records = byPage.empty()
                                         ? DrawnRecords{_records, _placements.numbers}
                                         : DrawnRecords{std::move(byPage[page].records), byPage[page].placements};
        if (records.records.empty()) { continue; }
        state.pushStateSet(resident[page]->state.get());
        if (_deformation.valid()) { state.pushStateSet(pages.deformedPages()[page].state.get()); }
        state.apply();
        if (isApplied(state, program)) {
            state.applyModelViewAndProjectionUniformsIfRequired();
            applyFixedFunctionUniforms(state);
            draw(records);
        }
        if (_deformation.valid()) { state.popStateSet(); }
        state.popStateSet();
    }
    for (std::size_t k = 0; k < more.size(); ++k) { state.popStateSet(); }
    state.popStateSet();
    state.apply();
}

/// Calls draw(first record, count, factor) for pieces of one level and of at most `verticesPerDraw` tessellated vertices.
template <typename Draw>
void PatchSelection::forEachDraw(const PatchRecords& records, std::uint64_t verticesPerDraw, const Draw& draw) const
{
    const auto levelOf = [&](std::size_t k) { return MorphedSurface::drawnLevel(records[k].edgeLevels); };
    for (std::size_t first = 0; first < records.size();) {
        const unsigned level = levelOf(first);
        const unsigned factor = _asset->asset().ladder[level];
        const std::size_t most = std::max<std::uint64_t>(1, verticesPerDraw / TessellationPattern::vertexCount(factor));
        std::size_t end = first + 1;
        while (end < records.size() && end - first < most && levelOf(end) == level) { ++end; }
        draw(first, end - first, factor);
        first = end;
    }
}

std::unique_ptr<PatchDraw> PatchSelection::makeDraw(Backend backend, osg::State& state,
                                                    const DrawnRecords& records) const
{
    const ShaderSelection* selection = shaderSelectionFor(state);
    return selection != nullptr ? PatchDraw::make(state, *selection) : PatchDraw::make(backend, state, records);
}

std::optional<Backend> PatchSelection::backend(osg::RenderInfo& renderInfo) const
{
    osg::State& state = *renderInfo.getState();
    if (!_asset.valid() || _asset->pagesFor(state) == nullptr) { return std::nullopt; }
    if (_placements.set.valid() && !_placements.set->fits(state)) { return std::nullopt; }
    if (_deformation.valid() && !_deformation->fits(state)) { return std::nullopt; }
    if (shaderSelectionFor(state) != nullptr) { return Backend::Tessellation; }
    return chooseBackend(state, *_asset, _backend);
}

void PatchSelection::drawImplementation(osg::RenderInfo& renderInfo) const
{
    if (_records.empty()) { return; }
    const std::optional<Backend> backend = this->backend(renderInfo);
    if (!backend) { return; }
    osg::State& state = *renderInfo.getState();
    const osg::ref_ptr<const PatchSelection> drawn = asDrawnIn(state);
    if (drawn != this) {
        drawn->drawImplementation(renderInfo);
        return;
    }
    forEachPage(state, *_asset->programs().draw(*backend, state), [&](const DrawnRecords& records) {
        const std::unique_ptr<PatchDraw> patches = makeDraw(*backend, state, records);
        forEachDraw(
            records.records, DrawContext::of(state).verticesPerDraw(*backend),
            [&](std::size_t first, std::size_t count, unsigned factor) { patches->draw(first, count, factor); });
    });
}

std::vector<osg::Vec3f> PatchSelection::capture(osg::RenderInfo& renderInfo, const std::string& varying) const
{
    using Triangle = std::array<osg::Vec3f, 3>;
    std::vector<osg::Vec3f> corners;
    if (_records.empty()) { return corners; }
    const std::optional<Backend> backend = this->backend(renderInfo);
    if (!backend) { return corners; }
    osg::State& state = *renderInfo.getState();
    const osg::ref_ptr<const PatchSelection> drawn = asDrawnIn(state);
    if (drawn != this) { return drawn->capture(renderInfo, varying); }
    const osg::ref_ptr<osg::StateSet> program = _asset->programs().capture(*backend, varying);
    forEachPage(state, *program, [&](const DrawnRecords& records) {
        const std::unique_ptr<PatchDraw> patches = makeDraw(*backend, state, records);
        TransformFeedback feedback(state);
        const auto captureDraw = [&](std::size_t first, std::size_t count, unsigned factor) {
            std::vector<Triangle> triangles(count * TessellationPattern::triangleCount(factor));
            const std::size_t captured =
                feedback.capture(triangles.data(), triangles.size(), [&] { patches->draw(first, count, factor); });
            if (captured != triangles.size() && !isSelectedWhenDrawn()) {
                OSG_WARN << "PatchSelection::capture: " << triangles.size() << " triangles expected, " << captured
                         << " captured" << std::endl;
            }
            for (std::size_t k = 0; k < captured; ++k) {
                corners.insert(corners.end(), triangles[k].begin(), triangles[k].end());
            }
        };
        forEachDraw(records.records, DrawContext::kSoftwareVerticesPerDraw, captureDraw);
    });
    return corners;
}

void PatchSelection::accept(osg::PrimitiveFunctor& functor) const
{
    constexpr std::uint64_t kMost = std::numeric_limits<GLsizei>::max() / 3;
    functor.setVertexArray(0, static_cast<const osg::Vec3*>(nullptr));
    functor.drawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(3 * std::min(_statistics.triangles, kMost)));
}

} // namespace osgTessLOD
