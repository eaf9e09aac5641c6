// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.4.
#include <osgTessLOD/render/PatchSelector.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/ViewError.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/DeformedPatch.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>

namespace osgTessLOD {

namespace {

/// The needs of fewer patches than this are not bounded together: to bound them takes about as long as to compute them.
constexpr std::uint32_t kFewPatches = 64;

std::vector<BoundSphere> boundSpheres(const LodAsset& asset)
{
    std::vector<BoundSphere> spheres;
    for (const LodPatch& patch : asset.patches) {
        spheres.push_back({{patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]}, patch.boundRadius});
    }
    return spheres;
}

/// Of patches by their numbers.
std::vector<BoundSphere> deformedSpheres(const ControlMeshDeformation& deformation)
{
    std::vector<BoundSphere> spheres = boundSpheres(deformation.asset().asset());
    for (std::size_t p = 0; p < spheres.size(); ++p) {
        spheres[p] = DeformedPatch::sphere(deformation.asset().asset().patches[p], deformation.maps(), spheres[p]);
    }
    return spheres;
}

std::uint64_t triangleCount(const std::vector<std::uint64_t>& patchesByLevel, const std::vector<std::uint16_t>& ladder)
{
    std::uint64_t triangles = 0;
    for (std::size_t level = 0; level < ladder.size(); ++level) {
        triangles += patchesByLevel[level] * TessellationPattern::triangleCount(ladder[level]);
    }
    return triangles;
}

} // namespace

/// What one selection works in.
struct PatchSelector::Workspace {
    struct VisibleBlock {
        std::uint32_t block;
        unsigned lanes;
    };
    std::vector<VisibleBlock> visible;
    std::vector<kernel::Lanes> needs; ///< of sides, as far as they differ, of blocks that are known
    std::vector<std::uint8_t> known;  ///< of blocks: are their needs?
    std::vector<PatchRecord> records; ///< in the order of the visible blocks
    std::vector<std::uint8_t> drawn;  ///< and the levels they are drawn with
};

/// Workspaces of selections that ended, for the next ones: as many as there are selections at once.
class PatchSelector::Workspaces {
public:
    std::unique_ptr<Workspace> acquire()
    {
        const std::lock_guard<std::mutex> lock(_mutex);
        if (_free.empty()) { return std::make_unique<Workspace>(); }
        std::unique_ptr<Workspace> workspace = std::move(_free.back());
        _free.pop_back();
        return workspace;
    }
    void release(std::unique_ptr<Workspace> workspace)
    {
        const std::lock_guard<std::mutex> lock(_mutex);
        _free.push_back(std::move(workspace));
    }

private:
    std::mutex _mutex;
    std::vector<std::unique_ptr<Workspace>> _free;
};

/// uniformRecords() that were asked for.
struct PatchSelector::UniformRecords {
    std::array<std::once_flag, LodAsset::kMaxLevels> once;
    std::array<PatchRecords, LodAsset::kMaxLevels> records;
};

PatchSelector::PatchSelector(const LodAsset& asset)
    : _ladder(asset.ladder)
    , _tree(boundSpheres(asset))
    , _blocks(asset, _tree.order())
    , _uniform(std::make_shared<UniformRecords>())
    , _workspaces(std::make_shared<Workspaces>())
{
    scaleNodes();
    boundNodes();
}

PatchSelector::PatchSelector(const PatchSelector& undeformed, const ControlMeshDeformation& deformation)
    : _ladder(undeformed._ladder)
    , _deformedSpheres(deformedSpheres(deformation))
    , _tree(undeformed._tree, _deformedSpheres)
    , _blocks(undeformed._blocks, deformation, _deformedSpheres)
    , _uniform(undeformed._uniform)
    , _workspaces(undeformed._workspaces)
    , _recordPool(undeformed._recordPool)
{
    scaleNodes();
    boundDeformedNodes();
}

PatchSelector::~PatchSelector() = default;

void PatchSelector::scaleNodes()
{
    const auto units = static_cast<float>(_blocks.unitsPerLength());
    _nodeSpheres.reserve(_tree.nodes().size());
    for (const PatchTree::Node& node : _tree.nodes()) {
        _nodeSpheres.push_back({node.sphere.center * units, node.sphere.radius * units});
    }
}

void PatchSelector::boundNodes()
{
    const std::size_t levelCount = _ladder.size();
    const std::size_t nodeSize = LevelNeed::kBoundRows * levelCount;
    _nodeBounds.resize(_tree.nodes().size() * nodeSize);
    for (std::size_t n = 0; n < _tree.nodes().size(); ++n) {
        const PatchTree::Node& node = _tree.nodes()[n];
        if (node.count < kFewPatches && n > 0) { continue; }
        for (std::size_t level = 0; level < levelCount; ++level) {
            float leastSeen = std::numeric_limits<float>::max();
            float leastIsotropic = leastSeen;
            float largestIsotropic = 0.0F;
            for (std::uint32_t position = node.first; position < node.first + node.count; ++position) {
                const kernel::Errors& errors = _blocks.errors(position / PatchBlocks::kLanes)[level];
                const std::size_t lane = position % PatchBlocks::kLanes;
                ViewError error;
                for (std::size_t k = 0; k < error.q.size(); ++k) { error.q[k] = errors.q[k][lane]; }
                const float isotropic = errors.isotropic[lane];
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

/// The largest errors, from the leaves up. The least are taken to be none: to find them would take longer than they save.
void PatchSelector::boundDeformedNodes()
{
    const std::size_t levelCount = _ladder.size();
    const std::size_t nodeSize = LevelNeed::kBoundRows * levelCount;
    const std::vector<PatchTree::Node>& nodes = _tree.nodes();
    _nodeBounds.assign(nodes.size() * nodeSize, 0.0F);
    const auto largest = [&](std::size_t n) {
        return &_nodeBounds[n * nodeSize + LevelNeed::kLargestIsotropic * levelCount];
    };
    for (std::size_t n = nodes.size(); n-- > 0;) {
        for (std::size_t level = 0; level < levelCount; ++level) {
            if (nodes[n].right != 0) {
                largest(n)[level] = std::max(largest(n + 1)[level], largest(nodes[n].right)[level]);
            } else {
                const float* errors = _blocks.errors(nodes[n].first / PatchBlocks::kLanes)[level].isotropic;
                largest(n)[level] = *std::max_element(errors, errors + PatchBlocks::kLanes);
            }
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

/// One selection under way.
class PatchSelector::Visit {
public:
    Visit(const PatchSelector& selector, const SelectionView& view, const SelectionOptions& options)
        : _selector(selector)
        , _blocks(selector._blocks)
        , _kernel(kernel::best())
        , _cap(selector.capOf(options))
        , _need(view, options, selector._ladder.size(), _cap, _blocks.unitsPerLength())
        , _stride(_need.isPerPatch() ? 0 : _blocks.positionCount())
        , _workspace(selector._workspaces->acquire())
        , _visible(_workspace->visible)
        , _known(_workspace->known)
    {
        _visible.clear();
    }
    ~Visit() { _selector._workspaces->release(std::move(_workspace)); }
    Visit(const Visit&) = delete;
    Visit& operator=(const Visit&) = delete;

    Result run(const std::vector<osg::Plane>& frustum, CulledFaces faces)
    {
        setFrustum(frustum);
        _faces = _selector._deformedSpheres.empty() ? faces : CulledFaces::None;
        if (_blocks.patchCount() == 0) { return {PatchRecords(), _selector.statisticsOf({})}; }
        if (std::optional<Result> all = ifAllNeedTheSame()) { return *std::move(all); }
        makeRoomForNeeds();
        visit(0, (1U << _planes.size()) - 1);
        findNeeds();
        return result();
    }

    EdgeLevel edgeLevel(std::uint32_t edge)
    {
        makeRoomForNeeds();
        std::fill_n(_needs, _blocks.positionCount() * (_need.isPerPatch() ? 1 : 3), 0.0F);
        const std::uint32_t side = _blocks.sideOfEdge(edge);
        const std::uint32_t block = side / 3 / PatchBlocks::kLanes;
        const std::uint32_t lane = side / 3 % PatchBlocks::kLanes;
        const kernel::Borders& borders = _blocks.borders(block);
        const std::uint32_t twinBlock = borders.twins[side % 3][lane] / PatchBlocks::kLanes;
        const std::uint32_t twinLane = borders.twins[side % 3][lane] % PatchBlocks::kLanes;
        findNeedsOf(block);
        for (const std::uint32_t* n = _blocks.neighboursBegin(block); n != _blocks.neighboursEnd(block); ++n) {
            findNeedsOf(*n);
        }
        kernel::Levels levels;
        const unsigned saturated = levelsOf(block, levels);
        kernel::Levels ofTwin; // not right: what the twin's other neighbours need is not known
        const unsigned twinSaturated = levelsOf(twinBlock, ofTwin);
        return {levels.edges[side % 3][lane], (saturated >> lane & 1U) != 0 || (twinSaturated >> twinLane & 1U) != 0};
    }

private:
    using VisibleBlock = Workspace::VisibleBlock;

    void setFrustum(const std::vector<osg::Plane>& frustum)
    {
        constexpr std::size_t kMostPlanes = 31; // bits of an unsigned, but one
        for (const osg::Plane& plane : frustum) {
            if (_planes.size() == kMostPlanes) { break; }
            _planes.push_back(_blocks.planeInUnits(plane));
            std::array<float, 4>& rounded = _roundedPlanes.emplace_back();
            for (int k = 0; k < 4; ++k) {
                rounded[static_cast<std::size_t>(k)] = static_cast<float>(_planes.back()[k]);
            }
        }
    }

    /// Signed distance of a node's centre from a plane.
    double distanceTo(std::size_t plane, const BoundSphere& sphere) const
    {
        const osg::Vec4d& p = _planes[plane];
        return p.x() * double{sphere.center.x()} + p.y() * double{sphere.center.y()} +
               p.z() * double{sphere.center.z()} + p.w();
    }

    /// Those of `planes` (bits) that part of the node may lie behind; nothing if all of it lies behind one.
    std::optional<unsigned> planesThrough(const BoundSphere& sphere, unsigned planes) const
    {
        for (std::size_t k = 0; planes >> k != 0; ++k) {
            if ((planes >> k & 1U) == 0) { continue; }
            const double distance = distanceTo(k, sphere);
            if (distance < -double{sphere.radius}) { return std::nullopt; }
            if (distance > double{sphere.radius}) { planes &= ~(1U << k); }
        }
        return planes;
    }

    LevelNeed::Range rangeOf(std::size_t node) const
    {
        return _need.ofPatches(_selector._nodeSpheres[node],
                               &_selector._nodeBounds[node * LevelNeed::kBoundRows * _selector._ladder.size()]);
    }

    /// All patches in view, and at one level: their records are there already.
    std::optional<Result> ifAllNeedTheSame() const
    {
        const std::optional<unsigned> planes = planesThrough(_selector._nodeSpheres[0], (1U << _planes.size()) - 1);
        if (!planes || *planes != 0) { return std::nullopt; }
        const LevelNeed::Range range = rangeOf(0);
        const float level = std::min(range.least, static_cast<float>(_cap));
        if (_blocks.hasSeams()) { return std::nullopt; }
        if (range.least != range.largest || level != std::floor(level)) { return std::nullopt; }
        if (_faces != CulledFaces::None && level > 0.0F) { return std::nullopt; }
        Result result;
        result.records = _selector.uniformRecords(static_cast<unsigned>(level));
        result.statistics = _selector.uniformStatistics(static_cast<unsigned>(level));
        for (std::size_t reach = 0; reach < _blocks.patchesByReach().size(); ++reach) {
            if (isSaturated(range.least, static_cast<unsigned>(reach))) {
                result.statistics.saturatedPatches += _blocks.patchesByReach()[reach];
            }
        }
        return result;
    }

    /// Is what a patch with a border up to level `reach` has, not good enough where this is needed?
    bool isSaturated(float need, unsigned reach) const
    {
        const auto finest = static_cast<float>(std::min(reach, _cap));
        return _need.isPerPatch() ? need >= finest + 1.0F : need > finest;
    }

    /// `planes`: those that part of the node may lie behind.
    void visit(std::uint32_t number, unsigned planes)
    {
        const PatchTree::Node& node = _selector._tree.nodes()[number];
        const std::optional<unsigned> through = planesThrough(_selector._nodeSpheres[number], planes);
        if (!through) { return; }
        const bool beginsUniform = !_inUniformNode && node.count >= kFewPatches && setNeedsIfUniform(number);
        _inUniformNode = _inUniformNode || beginsUniform;
        const bool isWhole = *through == 0 && (_inUniformNode || node.count < kFewPatches);
        if (isWhole || node.right == 0) {
            addBlocks(node, *through);
        } else {
            visit(number + 1, *through);
            visit(node.right, *through);
        }
        if (beginsUniform) { _inUniformNode = false; }
    }

    bool setNeedsIfUniform(std::uint32_t number)
    {
        const LevelNeed::Range range = rangeOf(number);
        if (range.least != range.largest) { return false; }
        setNeeds(_selector._tree.nodes()[number], range.least);
        return true;
    }

    void addBlocks(const PatchTree::Node& node, unsigned planes)
    {
        const std::uint32_t end = (node.first + node.count + PatchBlocks::kLanes - 1) / PatchBlocks::kLanes;
        for (std::uint32_t block = node.first / PatchBlocks::kLanes; block < end; ++block) {
            unsigned lanes = _blocks.lanesOf(block);
            for (std::size_t k = 0; planes >> k != 0; ++k) {
                if ((planes >> k & 1U) != 0) {
                    lanes &= ~_kernel.behind(_roundedPlanes[k].data(), _blocks.spheres(block));
                }
            }
            if (lanes != 0) { _visible.push_back({block, lanes}); }
        }
    }

    void makeRoomForNeeds()
    {
        const std::size_t rows = std::size_t{_blocks.blockCount()} * (_need.isPerPatch() ? 1 : 3);
        if (_workspace->needs.size() < rows) { _workspace->needs.resize(rows); }
        _needs = _workspace->needs.front().at;
        _known.assign(_blocks.blockCount(), 0);
    }

    /// Also of patches that are not visible: their neighbours ask for it.
    void setNeeds(const PatchTree::Node& node, float need)
    {
        const std::uint32_t first = node.first / PatchBlocks::kLanes;
        const std::uint32_t end = (node.first + node.count + PatchBlocks::kLanes - 1) / PatchBlocks::kLanes;
        std::fill(_known.begin() + first, _known.begin() + end, std::uint8_t{1});
        for (std::uint32_t side = 0; side < (_need.isPerPatch() ? 1U : 3U); ++side) {
            float* needs = &_needs[side * _stride];
            std::fill(needs + first * PatchBlocks::kLanes, needs + end * PatchBlocks::kLanes, need);
        }
    }

    void findNeeds()
    {
        for (const VisibleBlock& visible : _visible) { findNeedsOf(visible.block); }
        if (_visible.size() == _blocks.blockCount()) { return; }
        for (const VisibleBlock& visible : _visible) {
            const std::uint32_t* end = _blocks.neighboursEnd(visible.block);
            for (const std::uint32_t* block = _blocks.neighboursBegin(visible.block); block != end; ++block) {
                findNeedsOf(*block);
            }
        }
    }

    void findNeedsOf(std::uint32_t block)
    {
        if (_known[block] != 0) { return; }
        _known[block] = 1;
        float* needs = &_needs[block * PatchBlocks::kLanes];
        const kernel::Errors* errors = _blocks.errors(block);
        if (_need.isPerPatch()) {
            _kernel.needs(_need.kernelView(), _blocks.spheres(block), errors, _hint, needs);
            return;
        }
        for (std::size_t side = 0; side < 3; ++side) {
            _kernel.needs(_need.kernelView(), _blocks.middles(block)[side], errors, _hint, needs + side * _stride);
        }
        if (_blocks.hasShortBorders(block)) { carryNeeds(_blocks.borders(block), needs); }
    }

    /// Of each patch to the first of its borders that goes on farthest, from those that end before.
    void carryNeeds(const kernel::Borders& borders, float* needs) const
    {
        for (std::size_t lane = 0; lane < PatchBlocks::kLanes; ++lane) {
            std::size_t carrier = 0;
            while (borders.finest[carrier][lane] < borders.reach[lane]) { ++carrier; }
            float& carried = needs[carrier * _stride + lane];
            for (std::size_t side = 0; side < 3; ++side) {
                if (borders.finest[side][lane] < borders.reach[lane]) {
                    carried = std::max(carried, needs[side * _stride + lane]);
                }
            }
        }
    }

    /// Bits of patches that are saturated.
    unsigned levelsOf(std::uint32_t block, kernel::Levels& levels) const
    {
        return _kernel.levels(_need.kernelView(), _blocks.borders(block), _needs, _stride, block * PatchBlocks::kLanes,
                              static_cast<float>(_cap), levels);
    }

    /// Bits of patches of which all triangles show the culled face.
    unsigned hiddenAt(std::uint32_t block, const kernel::Levels& levels) const
    {
        const kernel::Errors* errors = _blocks.errors(block);
        kernel::Lanes cosines;
        for (std::size_t lane = 0; lane < PatchBlocks::kLanes; ++lane) {
            cosines.at[lane] = errors[levels.drawn[lane]].coneCosine[lane];
        }
        return _kernel.hidden(_need.kernelView(), _blocks.spheres(block), _blocks.coneAxes(block), cosines,
                              _faces == CulledFaces::Back ? 1.0F : -1.0F);
    }

    Result result()
    {
        const std::size_t mostRecords = _visible.size() * PatchBlocks::kLanes;
        if (_workspace->records.size() < mostRecords) {
            _workspace->records.resize(mostRecords);
            _workspace->drawn.resize(mostRecords);
        }
        PatchRecord* const records = _workspace->records.data();
        std::uint8_t* const drawn = _workspace->drawn.data();
        std::array<std::uint64_t, LodAsset::kMaxLevels> counts{};
        std::size_t count = 0;
        std::uint64_t saturated = 0;
        for (const VisibleBlock& visible : _visible) {
            kernel::Levels levels;
            const unsigned saturatedLanes = levelsOf(visible.block, levels);
            unsigned shown = visible.lanes;
            if (_faces != CulledFaces::None) { shown &= ~hiddenAt(visible.block, levels); }
            for (unsigned lanes = saturatedLanes & shown; lanes != 0; lanes &= lanes - 1) { ++saturated; }
            const kernel::Borders& borders = _blocks.borders(visible.block);
            for (unsigned lanes = shown; lanes != 0; lanes &= lanes - 1) {
                const auto lane = static_cast<unsigned>(__builtin_ctz(lanes));
                records[count] = {borders.numbers[lane],
                                  {levels.edges[0][lane], levels.edges[1][lane], levels.edges[2][lane]}};
                drawn[count] = static_cast<std::uint8_t>(levels.drawn[lane]);
                ++counts[static_cast<std::size_t>(levels.drawn[lane])];
                ++count;
            }
        }
        Result result;
        result.records = groupedByLevel(count, counts);
        SelectionStatistics& statistics = result.statistics;
        statistics.patches = count;
        statistics.culledPatches = _blocks.patchCount() - count;
        statistics.saturatedPatches = saturated;
        statistics.patchesByLevel.assign(counts.begin(),
                                         counts.begin() + static_cast<std::ptrdiff_t>(_selector._ladder.size()));
        statistics.triangles = triangleCount(statistics.patchesByLevel, _selector._ladder);
        return result;
    }

    /// In the order of the levels they are drawn with, otherwise in the order they have.
    PatchRecords groupedByLevel(std::size_t count, const std::array<std::uint64_t, LodAsset::kMaxLevels>& counts) const
    {
        const PatchRecord* const records = _workspace->records.data();
        const std::uint8_t* const drawn = _workspace->drawn.data();
        std::array<std::uint64_t, LodAsset::kMaxLevels> next{};
        for (std::size_t level = 1; level < next.size(); ++level) { next[level] = next[level - 1] + counts[level - 1]; }
        const std::shared_ptr<PatchRecord[]> grouped = _selector._recordPool.acquire(count);
        for (std::size_t k = 0; k < count; ++k) { grouped[next[drawn[k]]++] = records[k]; }
        return {grouped, count};
    }

    const PatchSelector& _selector;
    const PatchBlocks& _blocks;
    const kernel::Kernel& _kernel;
    unsigned _cap;
    LevelNeed _need;
    std::uint32_t _stride; ///< of needs, from side to side
    std::vector<osg::Vec4d> _planes;
    std::vector<std::array<float, 4>> _roundedPlanes;
    CulledFaces _faces = CulledFaces::None;
    bool _inUniformNode = false;
    std::unique_ptr<Workspace> _workspace;
    std::vector<VisibleBlock>& _visible;
    std::vector<std::uint8_t>& _known;
    float* _needs = nullptr; ///< at [side · stride + position]
    int _hint = 0;
};

PatchSelector::Result PatchSelector::select(const SelectionView& view, const SelectionOptions& options,
                                            const std::vector<osg::Plane>& frustum, CulledFaces faces) const
{
    return options.cullPatches ? Visit(*this, view, options).run(frustum, faces)
                               : Visit(*this, view, options).run({}, CulledFaces::None);
}

PatchSelector::EdgeLevel PatchSelector::edgeLevel(std::uint32_t edge, const SelectionView& view,
                                                  const SelectionOptions& options) const
{
    return Visit(*this, view, options).edgeLevel(edge);
}

SelectionStatistics PatchSelector::statisticsOf(const PatchRecords& records) const
{
    SelectionStatistics statistics;
    statistics.patches = records.size();
    statistics.patchesByLevel.assign(_ladder.size(), 0);
    for (const PatchRecord& record : records) {
        ++statistics.patchesByLevel[MorphedSurface::drawnLevel(record.edgeLevels)];
    }
    statistics.triangles = triangleCount(statistics.patchesByLevel, _ladder);
    return statistics;
}

kernel::View PatchSelector::kernelView(const SelectionView& view, const SelectionOptions& options) const
{
    return LevelNeed(view, options, _ladder.size(), capOf(options), _blocks.unitsPerLength()).kernelView();
}

SelectionStatistics PatchSelector::uniformStatistics(unsigned level) const
{
    if (_blocks.hasSeams()) { return statisticsOf(uniformRecords(level)); }
    SelectionStatistics statistics;
    statistics.patches = _blocks.patchCount();
    statistics.patchesByLevel.assign(_ladder.size(), 0);
    for (std::size_t reach = 0; reach < _blocks.patchesByReach().size(); ++reach) {
        statistics.patchesByLevel[std::min<std::size_t>(level, reach)] += _blocks.patchesByReach()[reach];
    }
    statistics.triangles = triangleCount(statistics.patchesByLevel, _ladder);
    return statistics;
}

PatchRecords PatchSelector::uniformRecords(unsigned level) const
{
    level = std::min<unsigned>(level, static_cast<unsigned>(_ladder.size()) - 1);
    std::call_once(_uniform->once[level], [&] {
        std::vector<std::vector<PatchRecord>> byLevel(_ladder.size());
        for (std::uint32_t position = 0; position < _blocks.patchCount(); ++position) {
            const kernel::Borders& borders = _blocks.borders(position / PatchBlocks::kLanes);
            const std::uint32_t lane = position % PatchBlocks::kLanes;
            PatchRecord record{borders.numbers[lane], {}};
            for (std::size_t side = 0; side < 3; ++side) {
                record.edgeLevels[side] = std::max(std::min(borders.finest[side][lane], static_cast<float>(level)),
                                                   borders.coarsest[side][lane]);
            }
            byLevel[MorphedSurface::drawnLevel(record.edgeLevels)].push_back(record);
        }
        std::vector<PatchRecord> records; // grouped, coarse first
        records.reserve(_blocks.patchCount());
        for (const auto& drawn : byLevel) { records.insert(records.end(), drawn.begin(), drawn.end()); }
        _uniform->records[level] = PatchRecords(std::move(records));
    });
    return _uniform->records[level];
}

} // namespace osgTessLOD
