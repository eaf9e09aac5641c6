// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.1 (Algorithm 3).
#include <osgTessLOD/bake/StripSimplifier.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/ChartRelayout.h>
#include <osgTessLOD/bake/CollapseCost.h>
#include <osgTessLOD/bake/PatternResampling.h>
#include <osgTessLOD/bake/Refit.h>
#include <osgTessLOD/bake/StripGraph.h>
#include <osgTessLOD/bake/WorkTime.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <memory>

namespace osgTessLOD::bake {

namespace {

/// Takes the place of forbidden in a second search, when every strip has forbidden edges: as few of them as can be.
constexpr double kWorst = 1e150;

/// Patches that contracting around a fan may change: its own, and those across the opposite sides, whose border vertices
/// may move.
std::vector<std::uint32_t> reach(const PatchTopology& topology, const CornerFan& fan)
{
    std::vector<std::uint32_t> patches;
    for (const auto& [patch, corner] : fan.corners) {
        patches.push_back(patch);
        for (const std::uint32_t across : topology.edges[topology.patchEdges[patch][(corner + 1) % 3]].patches) {
            if (across != kNoPatch) { patches.push_back(across); }
        }
    }
    std::sort(patches.begin(), patches.end());
    patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
    return patches;
}

/// Fans by batches within which no two reach the same patch.
std::vector<std::vector<std::uint32_t>> independentBatches(const PatchTopology& topology,
                                                           const std::vector<CornerFan>& fans)
{
    std::vector<std::vector<std::uint32_t>> batches;
    std::vector<std::vector<std::uint32_t>> batchesAtPatch(topology.patches.size());
    for (std::uint32_t f = 0; f < fans.size(); ++f) {
        const std::vector<std::uint32_t> patches = reach(topology, fans[f]);
        std::vector<char> taken(batches.size() + 1, 0);
        for (const std::uint32_t p : patches) {
            for (const std::uint32_t batch : batchesAtPatch[p]) { taken[batch] = 1; }
        }
        const auto batch = static_cast<std::uint32_t>(std::find(taken.begin(), taken.end(), 0) - taken.begin());
        if (batch == batches.size()) { batches.emplace_back(); }
        batches[batch].push_back(f);
        for (const std::uint32_t p : patches) { batchesAtPatch[p].push_back(batch); }
    }
    return batches;
}

class Simplifier {
public:
    Simplifier(const PatchTopology& topology, const ChartSet& charts, const std::vector<std::uint16_t>& ladder,
               const StripOptions& options, Progress& progress)
        : _topology(topology)
        , _charts(charts)
        , _options(options)
        , _progress(progress)
        , _chartPattern(charts.factor)
        , _fans(cornerFans(topology))
        , _batches(independentBatches(topology, _fans))
        , _mesh(topology, std::max<unsigned>(2, ladder.back()))
    {
        for (const CornerFan& fan : _fans) { _reach.push_back(reach(topology, fan)); }
        _hierarchy.ladder = ladder;
        _hierarchy.patches.resize(topology.patches.size());
        for (PatchLevels& levels : _hierarchy.patches) {
            levels.positions.resize(ladder.size());
            levels.parents.resize(ladder.size());
            levels.parameters.resize(ladder.size());
        }
    }

    LevelHierarchy run()
    {
        const auto& ladder = _hierarchy.ladder;
        const unsigned finest = _mesh.patch(0).lattice.factor();
        const unsigned coarsest = std::max<unsigned>(2, ladder.front());
        _progress.begin("strips", _fans.size() * (finest - coarsest) / 2, "strips");
        sampleFinest(finest);
        if (usesViewError()) { _cost = std::make_unique<CollapseCost>(_mesh, _charts); }
        std::size_t level = ladder.size();
        for (unsigned factor = finest;; factor -= 2) {
            if (level > 0 && ladder[level - 1] == factor) { store(--level); }
            if (factor == coarsest) { break; }
            measureErrors();
            for (const auto& batch : _batches) { contractBatch(batch); }
        }
        if (ladder.front() == 1) { storeTriangle(); }
        _progress.end();
        return std::move(_hierarchy);
    }

    StripReport report() const
    {
        StripReport report = _report;
        report.contractions = _contractions;
        report.relayouts = _relayouts;
        report.placementSeconds = _placementTime.seconds();
        report.fitSeconds = _fitTime.seconds();
        report.costSeconds = _costTime.seconds();
        return report;
    }

private:
    void sampleFinest(unsigned factor)
    {
        const auto samples = PatternResampling::betweenPatterns(_charts.factor, factor);
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(_mesh.patchCount()), [&](std::uint32_t p) {
            const StripLattice& lattice = _mesh.patch(p).lattice;
            for (std::uint32_t v = 0; v < samples.size(); ++v) {
                const StripMesh::Site vertex{p, lattice.patternPoint(v)};
                _mesh.placeAlone(vertex, samples.sample(_charts.charts[p].positions, v), _mesh.parameter(vertex));
            }
        });
    }

    /// The finest level's vertices are where the pattern has them, up to rounding.
    bool isAtPatternPlaces(std::size_t level) const
    {
        return level + 1 == _hierarchy.ladder.size() && ChartPoint::kUnits % (3 * _hierarchy.ladder[level]) == 0;
    }

    /// Moves the vertices to where they fit the charts best; the corners only once, at the finest level.
    void refitLevel(std::size_t level)
    {
        const bool atPatternPlaces = isAtPatternPlaces(level);
        const auto patches = static_cast<std::uint32_t>(_mesh.patchCount());
        std::vector<std::vector<ChartPoint>> parameters(patches);
        std::vector<std::vector<Eigen::Vector3d>> positions(patches);
        for (std::uint32_t p = 0; p < patches; ++p) {
            if (!atPatternPlaces) { parameters[p] = _mesh.patternParameters(p); }
            positions[p] = _mesh.patternPositions(p);
        }
        RefitOptions options;
        options.moveCorners = level + 1 == _hierarchy.ladder.size();
        const RefitResult result =
            refit(_topology, _charts, _mesh.patch(0).lattice.factor(), parameters, options, positions);
        _report.overlaySeconds += result.overlaySeconds;
        _report.refitSeconds += result.seconds - result.overlaySeconds;
        tbb::parallel_for(std::uint32_t{0}, patches, [&](std::uint32_t p) {
            for (std::uint32_t v = 0; v < positions[p].size(); ++v) {
                const StripMesh::Site vertex{p, _mesh.patch(p).lattice.patternPoint(v)};
                _mesh.placeAlone(vertex, positions[p][v], _mesh.parameter(vertex));
            }
        });
    }

    /// Puts the vertices of seams where the charts have them, evenly spaced; what lies beside them is laid out anew if need be.
    void straightenSeams()
    {
        const unsigned factor = _mesh.patch(0).lattice.factor();
        std::vector<std::uint32_t> patches;
        for (const PatchTopology::Edge& edge : _topology.edges) {
            if (edge.seamFactor == 0) { continue; }
            patches.push_back(edge.patches[0]);
            for (unsigned step = 1; step < factor; ++step) {
                const StripMesh::Site vertex{edge.patches[0],
                                             _mesh.patch(edge.patches[0]).lattice.border(edge.sides[0], step)};
                const auto along = static_cast<std::int32_t>(ChartPoint::kUnits / factor * step);
                _mesh.placeAlone(vertex, borderPosition(_charts, edge, factor, step),
                                 borderParameter(edge.sides[0], along));
            }
        }
        std::sort(patches.begin(), patches.end());
        patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
        tbb::parallel_for(std::size_t{0}, patches.size(), [&](std::size_t i) {
            if (isLaidOut(_mesh, patches[i])) { return; }
            relayout(_mesh, patches[i], _chartPattern, _charts.charts[patches[i]]);
            ++_relayouts;
        });
    }

    void store(std::size_t level)
    {
        straightenSeams();
        if (_options.refit) { refitLevel(level); }
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(_mesh.patchCount()), [&](std::uint32_t p) {
            PatchLevels& levels = _hierarchy.patches[p];
            levels.positions[level] = _mesh.patternPositions(p);
            if (!isAtPatternPlaces(level)) { levels.parameters[level] = _mesh.patternParameters(p); }
            if (level + 1 < levels.positions.size()) { levels.parents[level + 1] = _mesh.patternImages(p); }
            _mesh.mark(p);
        });
    }

    bool usesViewError() const
    {
        return _options.cost == StripOptions::Cost::ViewError && _options.strips == StripOptions::Strips::Optimal;
    }

    void measureErrors()
    {
        if (!_cost) { return; }
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(_mesh.patchCount()), [&](std::uint32_t p) {
            _fitTime.measure([&] {
                _cost->relocate(p);
                _cost->measure(p);
            });
        });
    }

    void contractBatch(const std::vector<std::uint32_t>& batch)
    {
        tbb::parallel_for(std::size_t{0}, batch.size(), [&](std::size_t i) {
            contractFan(batch[i]);
            _progress.step(1);
        });
    }

    void contractFan(std::uint32_t f)
    {
        const CornerFan& fan = _fans[f];
        const StripGraph graph(_mesh, fan);
        const std::vector<unsigned> strip =
            _options.strips == StripOptions::Strips::Straight ? graph.straight() : cheapest(graph);
        const std::vector<std::uint32_t> broken = mergeEnds(graph, strip);
        for (std::size_t c = 0; c < fan.corners.size(); ++c) {
            const auto& [patch, corner] = fan.corners[c];
            const StripLattice before = _mesh.patch(patch).lattice;
            const std::vector<std::uint32_t> after = _mesh.contract(patch, corner, graph.within(c, strip));
            if (_cost) { _cost->contracted(patch, before, after); }
        }
        for (const std::uint32_t p : broken) { relayout(_mesh, p, _chartPattern, _charts.charts[p]); }
        if (_cost) { relocate(_reach[f]); }
        if (_cost && _options.refit) { fitMerged(graph, strip); }
        _contractions += strip.size();
        _relayouts += broken.size();
    }

    void relocate(const std::vector<std::uint32_t>& patches)
    {
        tbb::parallel_for(std::size_t{0}, patches.size(), [&](std::size_t i) { _cost->relocate(patches[i]); });
    }

    /// Moves the merged vertices of a contracted strip, one after the other, to where they fit the charts best: as C_edge
    /// took them to be.
    void fitMerged(const StripGraph& graph, const std::vector<unsigned>& strip)
    {
        for (std::size_t layer = 0; layer < strip.size(); ++layer) {
            const StripMesh::Site vertex = edgeStart(graph.layers()[layer], strip[layer]);
            if (_mesh.patch(vertex.patch).lattice.isCorner(vertex.point)) { continue; }
            _mesh.place(vertex, _cost->fittedPosition(vertex), _mesh.parameter(vertex));
        }
    }

    /// Where an edge starts: also, once the strip is contracted, where the merged vertex is.
    StripMesh::Site edgeStart(const StripGraph::Layer& layer, unsigned index) const
    {
        return {layer.patch, _mesh.patch(layer.patch).lattice.point(layer.corner, {layer.row, index})};
    }

    std::vector<unsigned> cheapest(const StripGraph& graph) const
    {
        std::vector<StripCost> costs(graph.edgeCount());
        tbb::parallel_for(std::size_t{0}, graph.layers().size(), [&](std::size_t layer) {
            for (unsigned i = 0; i < graph.layers()[layer].width; ++i) {
                costs[graph.edge(layer, i)] = edgeCost(graph.layers()[layer], i);
            }
        });
        std::vector<unsigned> strip = graph.optimal(costs);
        if (!strip.empty()) { return strip; }
        for (StripCost& cost : costs) {
            if (cost.isForbidden()) { cost.error = kWorst; }
        }
        return graph.optimal(costs);
    }

    Placement place(const CollapseStar& star) const
    {
        return _placementTime.measure([&] { return placeVertex(star, _options.placement); });
    }

    StripCost edgeCost(const StripGraph::Layer& layer, unsigned index) const
    {
        const CollapseStar star = collapseStar(_mesh, edgeStart(layer, index), layer.corner);
        const Placement placement = place(star);
        if (!placement.isValid) { return StripCost::forbidden(); }
        if (!_cost) { return {0.0, placement.residual}; }
        const double error = _costTime.measure([&] { return _cost->evaluate(star, placement, _options.refit); });
        return {error, placement.residual};
    }

    /// Gives both ends of every edge of a strip their common place, one edge after the other. Returns the patches in which
    /// triangles are turned over because there was none.
    std::vector<std::uint32_t> mergeEnds(const StripGraph& graph, const std::vector<unsigned>& strip)
    {
        std::vector<std::uint32_t> broken;
        for (std::size_t layer = 0; layer < strip.size(); ++layer) {
            const StripGraph::Layer& line = graph.layers()[layer];
            const StripMesh::Site a = edgeStart(line, strip[layer]);
            const StripMesh::Site b{a.patch, a.point + StripLattice::direction(line.corner)};
            const CollapseStar star = collapseStar(_mesh, a, line.corner);
            Placement placement = place(star);
            if (!placement.isValid) {
                placement.position = star.ends[0].position;
                placement.parameter = star.ends[0].parameter;
                for (const std::uint32_t p : star.patches) {
                    if (p != kNoPatch) { broken.push_back(p); }
                }
            }
            _mesh.place(a, placement.position, placement.parameter);
            _mesh.place(b, placement.position, placement.parameter);
        }
        std::sort(broken.begin(), broken.end());
        broken.erase(std::unique(broken.begin(), broken.end()), broken.end());
        return broken;
    }

    /// Factor 1: the corners of factor 2.
    void storeTriangle()
    {
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(_mesh.patchCount()), [&](std::uint32_t p) {
            PatchLevels& levels = _hierarchy.patches[p];
            const std::vector<Eigen::Vector3d> two = _mesh.patternPositions(p);
            levels.positions[0] = {two[0], two[2], two[4]};
            if (levels.parents.size() == 1) { return; }
            const std::vector<std::uint32_t> corners = parentsInTriangle(_topology, p, two);
            levels.parents[1].clear();
            for (const std::uint32_t image : _mesh.patternImages(p)) { levels.parents[1].push_back(corners[image]); }
        });
    }

    const PatchTopology& _topology;
    const ChartSet& _charts;
    const StripOptions& _options;
    Progress& _progress;
    TessellationPattern _chartPattern;
    std::vector<CornerFan> _fans;
    std::vector<std::vector<std::uint32_t>> _batches;
    std::vector<std::vector<std::uint32_t>> _reach; ///< per fan
    StripMesh _mesh;
    std::unique_ptr<CollapseCost> _cost; ///< if C_edge is asked for
    LevelHierarchy _hierarchy;
    std::atomic<std::uint64_t> _contractions{0};
    std::atomic<std::uint64_t> _relayouts{0};
    mutable WorkTime _placementTime;
    mutable WorkTime _costTime;
    WorkTime _fitTime;
    StripReport _report; ///< of refits; the rest is in the counters above
};

} // namespace

LevelHierarchy makeStripLevels(const PatchTopology& topology, const ChartSet& charts,
                               const std::vector<std::uint16_t>& ladder, const StripOptions& options,
                               Progress& progress, StripReport* report)
{
    Simplifier simplifier(topology, charts, ladder, options, progress);
    LevelHierarchy hierarchy = simplifier.run();
    if (report != nullptr) { *report = simplifier.report(); }
    return hierarchy;
}

} // namespace osgTessLOD::bake
