// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.4.
#include <osgTessLOD/render/PatchSelector.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace osgTessLOD {

namespace {

/// The middle of the displaced border: what FirstOrder sees the error from. Both sides have the same bits.
osg::Vec3f borderMiddle(const LodAsset& asset, const MorphedSurface& surface, std::uint32_t patch, std::uint32_t side)
{
    const unsigned finest = asset.edges[asset.patches[patch].edges[side]].finestLevel;
    const std::uint32_t factor = asset.ladder[finest];
    const auto level = static_cast<float>(finest);
    const auto point = [&](std::uint32_t index) {
        const auto p = surface.tessLodSurfacePoint(patch, {level, level, level}, index % (3 * factor)).position;
        return osg::Vec3f(p[0], p[1], p[2]);
    };
    const std::uint32_t first = side * factor;
    return factor > 1 ? point(first + factor / 2) : (point(first) + point(first + 1)) * 0.5F;
}

std::vector<BoundSphere> boundSpheres(const LodAsset& asset)
{
    std::vector<BoundSphere> spheres;
    for (const LodPatch& patch : asset.patches) {
        spheres.push_back({{patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]}, patch.boundRadius});
    }
    return spheres;
}

/// The records in the order of the levels they are drawn with, `counts` of each, otherwise in the order they have.
std::vector<PatchRecord> groupedByLevel(const std::vector<PatchRecord>& records,
                                        const std::vector<std::uint64_t>& counts)
{
    std::vector<std::uint64_t> next(counts.size(), 0);
    std::partial_sum(counts.begin(), counts.end() - 1, next.begin() + 1);
    std::vector<PatchRecord> grouped(records.size());
    for (const PatchRecord& record : records) {
        grouped[next[MorphedSurface::drawnLevel(record.edgeLevels)]++] = record;
    }
    return grouped;
}

/// Signed distance of the sphere's centre from a plane of unit length.
double distanceTo(const osg::Plane& plane, const BoundSphere& sphere)
{
    return plane.distance(osg::Vec3d(sphere.center));
}

} // namespace

PatchSelector::PatchSelector(const LodAsset& asset)
    : _ladder(asset.ladder)
    , _tree(boundSpheres(asset))
    , _edgeSides(asset.edges.size(), kNoPatch)
{
    addPatches(asset);
    linkSides(asset);
    boundNodes();
}

void PatchSelector::addPatches(const LodAsset& asset)
{
    const MorphedSurface surface(asset);
    const std::vector<BoundSphere> spheres = boundSpheres(asset);
    for (const std::uint32_t number : _tree.order()) {
        Patch patch{number, {}, {}, {}, spheres[number]};
        for (std::uint32_t side = 0; side < 3; ++side) {
            patch.borderMiddles[side] = borderMiddle(asset, surface, number, side);
            patch.borderFinest[side] = asset.edges[asset.patches[number].edges[side]].finestLevel;
        }
        _patches.push_back(patch);
    }

    const std::size_t levelCount = _ladder.size();
    _errors.assign(_patches.size() * LevelNeed::kErrorRows * levelCount, 0.0F);
    for (std::size_t level = 0; level < levelCount; ++level) {
        const std::vector<std::uint32_t> slots = asset.levelSlots(level);
        for (std::size_t position = 0; position < _patches.size(); ++position) {
            const std::uint32_t slot = slots[_patches[position].number];
            if (slot == kNoPatch) { continue; }
            const LevelError& error = asset.levels[level].errors[slot];
            float* at = &_errors[position * LevelNeed::kErrorRows * levelCount + level];
            for (std::size_t k = 0; k < error.quadratic.q.size(); ++k) { at[k * levelCount] = error.quadratic.q[k]; }
            at[error.quadratic.q.size() * levelCount] = error.isotropic;
        }
    }
}

void PatchSelector::linkSides(const LodAsset& asset)
{
    for (std::uint32_t position = 0; position < _patches.size(); ++position) {
        for (std::uint32_t side = 0; side < 3; ++side) {
            const std::uint32_t own = 3 * position + side;
            std::uint32_t& first = _edgeSides[asset.patches[_patches[position].number].edges[side]];
            if (first == kNoPatch) { first = own; }
            _patches[position].twins[side] = first;
            _patches[first / 3].twins[first % 3] = own;
        }
    }
}

void PatchSelector::boundNodes()
{
    const std::size_t levelCount = _ladder.size();
    const std::size_t nodeSize = LevelNeed::kBoundRows * levelCount;
    _nodeBounds.resize(_tree.nodes().size() * nodeSize);
    for (std::size_t n = 0; n < _tree.nodes().size(); ++n) {
        const PatchTree::Node& node = _tree.nodes()[n];
        for (std::size_t level = 0; level < levelCount; ++level) {
            float leastSeen = std::numeric_limits<float>::max();
            float leastIsotropic = leastSeen;
            float largestIsotropic = 0.0F;
            for (std::size_t position = node.first; position < node.first + node.count; ++position) {
                const float* at = &_errors[position * LevelNeed::kErrorRows * levelCount + level];
                ViewError error;
                for (std::size_t k = 0; k < error.q.size(); ++k) { error.q[k] = at[k * levelCount]; }
                const float isotropic = at[error.q.size() * levelCount];
                const auto seen = static_cast<float>(error.smallest());
                leastSeen = std::min({leastSeen, std::nextafter(seen, 0.0F), isotropic});
                leastIsotropic = std::min(leastIsotropic, isotropic);
                largestIsotropic = std::max(largestIsotropic, isotropic);
            }
            float* bounds = &_nodeBounds[n * nodeSize + level];
            bounds[LevelNeed::kLeastSeen * levelCount] = leastSeen;
            bounds[LevelNeed::kLeastIsotropic * levelCount] = leastIsotropic;
            bounds[LevelNeed::kLargestIsotropic * levelCount] = largestIsotropic;
        }
    }
}

unsigned PatchSelector::capOf(const SelectionOptions& options) const
{
    const unsigned allowed = std::min(options.maxFactor, kMaxDrawnFactor);
    unsigned cap = 0;
    while (cap + 1 < _ladder.size() && _ladder[cap + 1] <= allowed) { ++cap; }
    return cap;
}

/// What the patch needs at each of its sides.
std::array<float, 3> PatchSelector::needsOf(std::uint32_t position, const LevelNeed& need) const
{
    const Patch& patch = _patches[position];
    const float* errors = &_errors[position * LevelNeed::kErrorRows * _ladder.size()];
    if (need.isPerPatch()) {
        const float all = need.ofPatch(patch.sphere, errors);
        return {all, all, all};
    }
    std::array<float, 3> needs{};
    for (std::size_t side = 0; side < 3; ++side) { needs[side] = need.atBorder(patch.borderMiddles[side], errors); }
    float& carried = needs[patch.carrier()];
    for (std::size_t side = 0; side < 3; ++side) {
        if (patch.borderFinest[side] < patch.reach()) { carried = std::max(carried, needs[side]); }
    }
    return needs;
}

PatchSelector::EdgeLevel PatchSelector::edgeLevel(std::uint32_t edge, const SelectionView& view,
                                                  const SelectionOptions& options) const
{
    const unsigned cap = capOf(options);
    const LevelNeed need(view, options, _ladder.size(), cap);
    const std::uint32_t side = _edgeSides[edge];
    const std::uint32_t twin = _patches[side / 3].twins[side % 3];
    const float most = std::max(needsOf(side / 3, need)[side % 3], needsOf(twin / 3, need)[twin % 3]);
    const unsigned finest = std::min<unsigned>(_patches[side / 3].borderFinest[side % 3], cap);
    return {std::min(most, static_cast<float>(finest)),
            isSaturated(side / 3, need, cap) || isSaturated(twin / 3, need, cap)};
}

bool PatchSelector::isSaturated(std::uint32_t position, const LevelNeed& need, unsigned cap) const
{
    const std::array<float, 3> needs = needsOf(position, need);
    return need.isSaturated(*std::max_element(needs.begin(), needs.end()), std::min(_patches[position].reach(), cap));
}

/// One selection under way.
class PatchSelector::Visit {
public:
    Visit(const PatchSelector& selector, const SelectionView& view, const SelectionOptions& options,
          const std::vector<osg::Plane>& frustum)
        : _selector(selector)
        , _cap(selector.capOf(options))
        , _need(view, options, selector._ladder.size(), _cap)
    {
        if (options.cullPatches) { _planes = frustum; }
        for (osg::Plane& plane : _planes) { plane.makeUnitLength(); }
    }

    Result run()
    {
        if (!_selector._patches.empty()) { visit(0, _planes); }
        return result();
    }

private:
    static constexpr float kUnknown = -1.0F;

    /// `planes`: those that the node may be outside of.
    void visit(std::uint32_t number, std::vector<osg::Plane> planes)
    {
        const PatchTree::Node& node = _selector._tree.nodes()[number];
        for (std::size_t k = planes.size(); k-- > 0;) {
            const double distance = distanceTo(planes[k], node.sphere);
            if (distance < -static_cast<double>(node.sphere.radius)) { return; }
            if (distance > static_cast<double>(node.sphere.radius)) {
                planes.erase(planes.begin() + static_cast<std::ptrdiff_t>(k));
            }
        }
        const LevelNeed::Range range = _need.ofPatches(
            node.sphere, &_selector._nodeBounds[number * LevelNeed::kBoundRows * _selector._ladder.size()]);
        const bool uniform = range.least == range.largest;
        if (node.right != 0 && !(uniform && planes.empty())) {
            visit(number + 1, planes);
            visit(node.right, std::move(planes));
            return;
        }
        for (std::uint32_t position = node.first; position < node.first + node.count; ++position) {
            if (!isOutside(_selector._patches[position].sphere, planes)) { _visible.push_back(position); }
        }
        if (uniform && node.count == _selector._patches.size()) {
            _everywhere = range.least;
        } else if (uniform) {
            setNeeds(node, range.least);
        }
    }

    static bool isOutside(const BoundSphere& sphere, const std::vector<osg::Plane>& planes)
    {
        return std::any_of(planes.begin(), planes.end(), [&](const osg::Plane& plane) {
            return distanceTo(plane, sphere) < -static_cast<double>(sphere.radius);
        });
    }

    void setNeeds(const PatchTree::Node& node, float need)
    {
        makeRoomForNeeds();
        const auto first = _needs.begin() + std::ptrdiff_t{3} * node.first;
        std::fill(first, first + std::ptrdiff_t{3} * node.count, need);
    }

    void makeRoomForNeeds()
    {
        if (_needs.empty()) { _needs.assign(3 * _selector._patches.size(), kUnknown); }
    }

    /// Also of patches that are not visible: their neighbours ask for it.
    float needAt(std::uint32_t side)
    {
        if (_everywhere != kUnknown) { return _everywhere; }
        float* needs = &_needs[side - side % 3];
        if (needs[0] == kUnknown) {
            const std::array<float, 3> found = _selector.needsOf(side / 3, _need);
            std::copy(found.begin(), found.end(), needs);
        }
        return needs[side % 3];
    }

    Result result()
    {
        if (_everywhere == kUnknown) { makeRoomForNeeds(); }
        std::vector<PatchRecord> records;
        records.reserve(_visible.size());
        std::uint64_t saturated = 0;
        for (const std::uint32_t position : _visible) { records.push_back(recordOf(position, saturated)); }
        Result result;
        result.statistics = _selector.statisticsOf(records);
        result.statistics.saturatedPatches = saturated;
        result.statistics.culledPatches = _selector._patches.size() - records.size();
        result.records = groupedByLevel(records, result.statistics.patchesByLevel);
        return result;
    }

    PatchRecord recordOf(std::uint32_t position, std::uint64_t& saturatedPatches)
    {
        const Patch& patch = _selector._patches[position];
        PatchRecord record{patch.number, {}};
        float most = 0.0F;
        for (std::uint32_t side = 0; side < 3; ++side) {
            const float own = needAt(3 * position + side);
            const unsigned finest = std::min<unsigned>(patch.borderFinest[side], _cap);
            record.edgeLevels[side] = std::min(std::max(own, needAt(patch.twins[side])), static_cast<float>(finest));
            most = std::max(most, own);
        }
        saturatedPatches += _need.isSaturated(most, std::min(patch.reach(), _cap)) ? 1 : 0;
        return record;
    }

    const PatchSelector& _selector;
    unsigned _cap;
    LevelNeed _need;
    std::vector<osg::Plane> _planes;
    std::vector<std::uint32_t> _visible; ///< positions
    float _everywhere = kUnknown;        ///< what all patches need, if that is the same
    std::vector<float> _needs;           ///< per side, as far as known
};

PatchSelector::Result PatchSelector::select(const SelectionView& view, const SelectionOptions& options,
                                            const std::vector<osg::Plane>& frustum) const
{
    return Visit(*this, view, options, frustum).run();
}

SelectionStatistics PatchSelector::statisticsOf(const std::vector<PatchRecord>& records) const
{
    SelectionStatistics statistics;
    statistics.patches = records.size();
    statistics.patchesByLevel.assign(_ladder.size(), 0);
    for (const PatchRecord& record : records) {
        ++statistics.patchesByLevel[MorphedSurface::drawnLevel(record.edgeLevels)];
    }
    for (std::size_t level = 0; level < _ladder.size(); ++level) {
        statistics.triangles += statistics.patchesByLevel[level] * TessellationPattern::triangleCount(_ladder[level]);
    }
    return statistics;
}

std::vector<PatchRecord> PatchSelector::uniformRecords(unsigned level) const
{
    std::vector<PatchRecord> records;
    for (const Patch& patch : _patches) {
        PatchRecord record{patch.number, {}};
        for (std::size_t side = 0; side < 3; ++side) {
            record.edgeLevels[side] = static_cast<float>(std::min<unsigned>(level, patch.borderFinest[side]));
        }
        records.push_back(record);
    }
    return groupedByLevel(records, statisticsOf(records).patchesByLevel);
}

} // namespace osgTessLOD
