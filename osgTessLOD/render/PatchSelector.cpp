// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.4.
#include <osgTessLOD/render/PatchSelector.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

constexpr float kErrorRatio = 1.1F; // least ratio of successive levels' errors, see the class comment

/// The side of the patch that the edge is.
std::uint32_t sideOf(const LodPatch& patch, std::uint32_t edge)
{
    return patch.edges[0] == edge ? 0 : patch.edges[1] == edge ? 1 : 2;
}

/// Isotropic error of the patch at each level that it reaches.
std::vector<float> patchErrors(const LodAsset& asset)
{
    const std::size_t levelCount = asset.ladder.size();
    std::vector<float> errors(asset.patches.size() * levelCount, 0.0F);
    for (std::size_t level = 0; level < levelCount; ++level) {
        const std::vector<std::uint32_t> slots = asset.levelSlots(level);
        for (std::size_t p = 0; p < slots.size(); ++p) {
            if (slots[p] != kNoPatch) {
                errors[p * levelCount + level] = asset.levels[level].errors[slots[p]].isotropic;
            }
        }
    }
    return errors;
}

/// The finest level that the patch is drawn at: the largest that any of its borders has.
std::uint8_t reachOf(const LodAsset& asset, const LodPatch& patch)
{
    std::uint8_t reach = 0;
    for (const std::uint32_t edge : patch.edges) { reach = std::max(reach, asset.edges[edge].finestLevel); }
    return reach;
}

/// Makes errors[0 … finest] fall strictly, raising only.
void makeFalling(float* errors, unsigned finest)
{
    for (unsigned level = finest; level > 0; --level) {
        const float finer = errors[level];
        if (finer <= 0.0F) { continue; }
        const float least = std::max(kErrorRatio * finer, std::nextafter(finer, std::numeric_limits<float>::max()));
        errors[level - 1] = std::min(std::max(errors[level - 1], least), std::numeric_limits<float>::max());
    }
}

/// The middle of the displaced border: what the error is seen from. Both sides agree, as the first one decides.
std::array<float, 3> edgeCenter(const LodAsset& asset, const MorphedSurface& surface, std::uint32_t edge)
{
    const LodEdge& e = asset.edges[edge];
    const std::uint32_t patch = e.patches[0] != kNoPatch ? e.patches[0] : e.patches[1];
    const std::uint32_t factor = asset.ladder[e.finestLevel];
    const std::uint32_t first = sideOf(asset.patches[patch], edge) * factor;
    const auto level = static_cast<float>(e.finestLevel);
    const auto point = [&](std::uint32_t index) {
        return surface.tessLodSurfacePoint(patch, {level, level, level}, index % (3 * factor)).position;
    };
    if (factor > 1) { return point(first + factor / 2); }
    const std::array<float, 3> a = point(first);
    const std::array<float, 3> b = point(first + 1);
    return {0.5F * (a[0] + b[0]), 0.5F * (a[1] + b[1]), 0.5F * (a[2] + b[2])};
}

double largest(const std::array<float, 3>& levels)
{
    return std::max(levels[0], std::max(levels[1], levels[2]));
}

} // namespace

PatchSelector::PatchSelector(const LodAsset& asset)
    : _ladder(asset.ladder)
    , _edgeErrors(asset.edges.size() * asset.ladder.size(), 0.0F)
{
    const MorphedSurface surface(asset);
    const std::vector<float> errors = patchErrors(asset);
    for (std::uint32_t edge = 0; edge < asset.edges.size(); ++edge) {
        addEdge(asset, edge, errors);
        _edgeCenters.push_back(edgeCenter(asset, surface, edge));
    }
    for (const LodPatch& patch : asset.patches) {
        addRelays(patch);
        _patchEdges.push_back(patch.edges);
        _patchSpheres.push_back({patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2], patch.boundRadius});
    }
}

void PatchSelector::addEdge(const LodAsset& asset, std::uint32_t edge, const std::vector<float>& patchErrors)
{
    const std::size_t levelCount = _ladder.size();
    const LodEdge& e = asset.edges[edge];
    float* edgeErrors = &_edgeErrors[edge * levelCount];
    std::uint8_t farthest = 0;
    float endError = 0.0F;
    for (const std::uint32_t patch : e.patches) {
        if (patch == kNoPatch) { continue; }
        const float* errors = &patchErrors[patch * levelCount];
        const std::uint8_t reach = reachOf(asset, asset.patches[patch]);
        for (std::size_t k = 0; k <= reach; ++k) { edgeErrors[k] = std::max(edgeErrors[k], errors[k]); }
        if (reach == e.finestLevel) { endError = std::max(endError, errors[reach]); }
        farthest = std::max(farthest, reach);
    }
    makeFalling(edgeErrors, farthest);
    _edgeFinest.push_back(e.finestLevel);
    _edgeReach.push_back(farthest);
    _edgeEndErrors.push_back(endError);
}

void PatchSelector::addRelays(const LodPatch& patch)
{
    const auto isCoarser = [&](std::uint32_t a, std::uint32_t b) { return _edgeFinest[a] < _edgeFinest[b]; };
    const std::uint32_t carrier = *std::max_element(patch.edges.begin(), patch.edges.end(), isCoarser);
    for (const std::uint32_t edge : patch.edges) {
        if (isCoarser(edge, carrier)) { _relays.push_back({edge, carrier}); }
    }
}

unsigned PatchSelector::capOf(const SelectionOptions& options) const
{
    const unsigned allowed = std::min(options.maxFactor, kMaxDrawnFactor);
    unsigned cap = 0;
    while (cap + 1 < _ladder.size() && _ladder[cap + 1] <= allowed) { ++cap; }
    return cap;
}

PatchSelector::EdgeLevel PatchSelector::edgeLevel(std::uint32_t edge, const SelectionView& view,
                                                  const SelectionOptions& options) const
{
    return edgeLevels(view, options)[edge];
}

std::vector<PatchSelector::EdgeLevel> PatchSelector::edgeLevels(const SelectionView& view,
                                                                const SelectionOptions& options) const
{
    const unsigned cap = capOf(options);
    std::vector<EdgeLevel> needed;
    needed.reserve(_edgeCenters.size());
    for (std::uint32_t edge = 0; edge < _edgeCenters.size(); ++edge) {
        needed.push_back(neededLevel(edge, view, options.errorPixels, cap));
    }
    std::vector<EdgeLevel> levels = needed;
    for (const Relay& relay : _relays) {
        levels[relay.carrier].level = std::max(levels[relay.carrier].level, needed[relay.ended].level);
    }
    for (std::size_t edge = 0; edge < levels.size(); ++edge) {
        levels[edge].level = std::min(levels[edge].level, static_cast<float>(_edgeFinest[edge]));
    }
    return levels;
}

/// What either patch needs for its error as seen at the edge, if it had all levels that the patch reaches.
PatchSelector::EdgeLevel PatchSelector::neededLevel(std::uint32_t edge, const SelectionView& view, double errorPixels,
                                                    unsigned cap) const
{
    const std::array<float, 3>& center = _edgeCenters[edge];
    const osg::Vec3d toEye = view.eye - osg::Vec3d(center[0], center[1], center[2]);
    const double distance = view.orthographic ? 1.0 : toEye.length();
    // The error, in object units, that is errorPixels on screen. Comparisons with NaN are false: level 0.
    const double bound = std::max(errorPixels, 0.0) * distance / view.pixelScale;
    const float* errors = &_edgeErrors[edge * _ladder.size()];
    const unsigned finest = std::min<unsigned>(_edgeReach[edge], cap);
    if (!(errors[0] > bound)) { return {0.0F, false}; }
    for (unsigned k = 1; k <= finest; ++k) {
        if (errors[k] > bound) { continue; }
        const double coarser = errors[k - 1];
        const double alpha = (coarser - bound) / (coarser - static_cast<double>(errors[k])); // eq. 2.11
        return {static_cast<float>(k - 1 + alpha), _edgeEndErrors[edge] > bound};
    }
    return {static_cast<float>(finest), true};
}

void PatchSelector::cullPatches(const std::vector<osg::Plane>& frustum, std::vector<std::uint8_t>& visible) const
{
    for (osg::Plane plane : frustum) {
        plane.makeUnitLength();
        for (std::size_t p = 0; p < _patchSpheres.size(); ++p) {
            const std::array<float, 4>& s = _patchSpheres[p];
            const double d = plane[0] * s[0] + plane[1] * s[1] + plane[2] * s[2] + plane[3];
            if (d < -static_cast<double>(s[3])) { visible[p] = 0; }
        }
    }
}

PatchSelector::Result PatchSelector::select(const SelectionView& view, const SelectionOptions& options,
                                            const std::vector<osg::Plane>& frustum) const
{
    const std::size_t patchCount = _patchEdges.size();
    const std::vector<EdgeLevel> levels = edgeLevels(view, options);
    std::vector<std::uint8_t> visible(patchCount, 1);
    if (options.cullPatches) { cullPatches(frustum, visible); }

    Result result;
    std::vector<std::vector<PatchRecord>> byLevel(_ladder.size());
    for (std::uint32_t p = 0; p < patchCount; ++p) {
        if (visible[p] == 0) { continue; }
        PatchRecord record{p, {}};
        bool saturated = false;
        for (std::size_t side = 0; side < 3; ++side) {
            const EdgeLevel& edge = levels[_patchEdges[p][side]];
            record.edgeLevels[side] = edge.level;
            saturated = saturated || edge.saturated;
        }
        byLevel[MorphedSurface::drawnLevel(record.edgeLevels)].push_back(record);
        result.statistics.saturatedPatches += saturated ? 1 : 0;
    }
    for (const std::vector<PatchRecord>& group : byLevel) {
        result.records.insert(result.records.end(), group.begin(), group.end());
    }
    const std::uint64_t saturated = result.statistics.saturatedPatches;
    result.statistics = statisticsOf(result.records);
    result.statistics.saturatedPatches = saturated;
    result.statistics.culledPatches = patchCount - result.records.size();
    return result;
}

SelectionStatistics PatchSelector::statisticsOf(const std::vector<PatchRecord>& records) const
{
    SelectionStatistics statistics;
    statistics.patches = records.size();
    statistics.patchesByLevel.assign(_ladder.size(), 0);
    for (const PatchRecord& record : records) {
        const unsigned level = MorphedSurface::drawnLevel(record.edgeLevels);
        ++statistics.patchesByLevel[level];
        statistics.triangles += TessellationPattern::triangleCount(_ladder[level]);
    }
    return statistics;
}

std::vector<PatchRecord> PatchSelector::uniformRecords(unsigned level) const
{
    std::vector<PatchRecord> records;
    for (std::uint32_t p = 0; p < _patchEdges.size(); ++p) {
        PatchRecord record{p, {}};
        for (std::size_t side = 0; side < 3; ++side) {
            record.edgeLevels[side] = static_cast<float>(std::min<unsigned>(level, _edgeFinest[_patchEdges[p][side]]));
        }
        records.push_back(record);
    }
    std::stable_sort(records.begin(), records.end(), [](const PatchRecord& a, const PatchRecord& b) {
        return largest(a.edgeLevels) < largest(b.edgeLevels);
    });
    return records;
}

} // namespace osgTessLOD
