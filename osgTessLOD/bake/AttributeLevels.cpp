// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/AttributeLevels.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/Triangulation.h>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <memory>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;
using Eigen::Vector4f;

/// The box around all texture coordinates, cut into 65,534 steps each way.
UvLattice latticeAround(const ChartSet& charts)
{
    Eigen::AlignedBox2f box;
    for (const PatchChart& chart : charts.charts) {
        for (const Vector2f& uv : chart.uvs) {
            if (!uv.hasNaN()) { box.extend(uv); }
        }
    }
    UvLattice lattice;
    if (box.isEmpty()) { return lattice; }
    for (std::size_t k = 0; k < 2; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        lattice.origin[k] = box.min()[axis];
        // Up, so that the last step reaches the other side.
        lattice.step[k] = std::nextafter((box.max()[axis] - box.min()[axis]) / static_cast<float>(UvLattice::kUnits),
                                         std::numeric_limits<float>::max());
    }
    return lattice;
}

std::uint32_t colorBits(const Vector4f& color)
{
    std::uint32_t bits = 0;
    for (Eigen::Index k = 0; k < 4; ++k) {
        const long channel = std::lround(255.0F * std::clamp(color[k], 0.0F, 1.0F));
        bits |= static_cast<std::uint32_t>(channel) << 8 * k;
    }
    return bits;
}

/// Values of a chart's vertices, linear in between.
class ChartSampler {
public:
    ChartSampler(const PatchTopology& topology, unsigned factor)
        : _topology(topology)
        , _pattern(factor)
        , _segment(ChartPoint::kUnits / static_cast<std::int32_t>(factor))
    {
        assert(ChartPoint::kUnits % static_cast<std::int32_t>(factor) == 0);
    }

    /// At `point`, where vertex `vertex` of the pattern of `factor` lies in a patch.
    template <typename Value>
    Value sample(const std::vector<Value>& values, std::uint32_t patch, unsigned factor, std::uint32_t vertex,
                 ChartPoint point) const
    {
        if (vertex < TessellationPattern::borderVertexCount(factor)) {
            return sampleBorder(values, patch, vertex / factor, point);
        }
        constexpr double kUnits = ChartPoint::kUnits;
        const TessellationPattern::Location at =
            _pattern.locate({(ChartPoint::kUnits - point.u - point.v) / kUnits, point.u / kUnits, point.v / kUnits});
        const TessellationPattern::Triangle& t = _pattern.triangles()[at.triangle];
        return static_cast<float>(at.weights[0]) * values[t[0]] + static_cast<float>(at.weights[1]) * values[t[1]] +
               static_cast<float>(at.weights[2]) * values[t[2]];
    }

private:
    /// In the direction of the edge's first patch, so that both patches get the same bits of the same values.
    template <typename Value>
    Value sampleBorder(const std::vector<Value>& values, std::uint32_t patch, unsigned side, ChartPoint point) const
    {
        const PatchTopology::Edge& edge = _topology.edges[_topology.patchEdges[patch][side]];
        const unsigned which = edge.patches[0] == patch && edge.sides[0] == side ? 0 : 1;
        const std::int32_t own = alongBorder(side, point);
        const std::int32_t along = which == 0 ? own : ChartPoint::kUnits - own;
        const auto step = static_cast<unsigned>(along / _segment);
        const Value& from = values[borderVertex(edge, which, _pattern.factor(), step)];
        const std::int32_t within = along % _segment;
        if (within == 0) { return from; }
        const Value& to = values[borderVertex(edge, which, _pattern.factor(), step + 1)];
        return from + static_cast<float>(within) / static_cast<float>(_segment) * (to - from);
    }

    const PatchTopology& _topology;
    TessellationPattern _pattern;
    std::int32_t _segment;
};

/// The same for all patches of one level.
class LevelAttributes {
public:
    LevelAttributes(const PatchTopology& topology, const ChartSet& charts, const LevelHierarchy& hierarchy,
                    std::size_t level, LodAsset& asset)
        : _charts(charts)
        , _hierarchy(hierarchy)
        , _index(level)
        , _factor(hierarchy.ladder[level])
        , _lattice(asset.uvLattice)
        , _level(asset.levels[level])
        , _sampler(topology, charts.factor)
        , _chart(Triangulation::ofPattern(charts.factor))
        , _chartPoints(patternPoints(charts.factor))
        , _pattern(Triangulation::ofPattern(_factor))
        , _places(patternPoints(_factor))
    {
        const PatchChart& any = charts.charts.front();
        if (!any.uvs.empty()) {
            _level.uvs.resize(_level.vertices.size());
            _level.uvErrors.resize(_level.errors.size());
            _atPlaces = std::make_unique<DifferenceVectors>(PlacedTriangulation{_pattern, _places},
                                                            PlacedTriangulation{_chart, _chartPoints});
        }
        if (!any.colors.empty()) { _level.colors.resize(_level.vertices.size()); }
    }

    void fill(std::uint32_t patch, std::uint32_t slot) const
    {
        const PatchLevels& levels = _hierarchy.patches[patch];
        const std::vector<ChartPoint>& points = levels.hasParameters(_index) ? levels.parameters[_index] : _places;
        const PatchChart& chart = _charts.charts[patch];
        const std::size_t first = std::size_t{slot} * points.size();
        for (std::uint32_t v = 0; v < points.size(); ++v) {
            if (!chart.uvs.empty()) {
                const Vector2f uv = _sampler.sample(chart.uvs, patch, _factor, v, points[v]);
                _level.uvs[first + v] = _lattice.encode(uv.x(), uv.y());
            }
            if (!chart.colors.empty()) {
                _level.colors[first + v] = colorBits(_sampler.sample(chart.colors, patch, _factor, v, points[v]));
            }
        }
        if (!chart.uvs.empty()) { _level.uvErrors[slot] = uvError(chart, levels, first); }
    }

private:
    /// Up, so that it is not below what was measured.
    float uvError(const PatchChart& chart, const PatchLevels& levels, std::size_t first) const
    {
        std::vector<Vector3d> reference;
        for (const Vector2f& uv : chart.uvs) { reference.emplace_back(uv.x(), uv.y(), 0.0); }
        std::vector<Vector3d> stored;
        for (std::uint32_t v = 0; v < _pattern.vertexCount(); ++v) {
            const auto uv = _lattice.decode(_level.uvs[first + v]);
            stored.emplace_back(uv[0], uv[1], 0.0);
        }
        const double largest = levels.hasParameters(_index)
                                   ? DifferenceVectors({_pattern, levels.parameters[_index]}, {_chart, _chartPoints})
                                         .largest(reference, stored)
                                   : _atPlaces->largest(reference, stored);
        // Where there are no texture coordinates, the chart's are no numbers and count for nothing.
        return largest > 0.0 ? std::nextafter(static_cast<float>(largest), std::numeric_limits<float>::max()) : 0.0F;
    }

    const ChartSet& _charts;
    const LevelHierarchy& _hierarchy;
    std::size_t _index;
    unsigned _factor;
    const UvLattice& _lattice;
    LodLevel& _level;
    ChartSampler _sampler;
    Triangulation _chart;
    std::vector<ChartPoint> _chartPoints;
    Triangulation _pattern;
    std::vector<ChartPoint> _places; ///< of the pattern's vertices
    std::unique_ptr<DifferenceVectors> _atPlaces;
};

} // namespace

void addAttributes(const PatchTopology& topology, const ChartSet& charts, const LevelHierarchy& hierarchy,
                   LodAsset& asset, Progress& progress)
{
    const PatchChart& any = charts.charts.front();
    if (any.uvs.empty() && any.colors.empty()) { return; }
    asset.uvLattice = latticeAround(charts);
    progress.begin("attributes", asset.levels.size() * asset.patches.size(), "patch levels");
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        const LevelAttributes attributes(topology, charts, hierarchy, level, asset);
        const std::vector<std::uint32_t> slots = asset.levelSlots(level);
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(slots.size()), [&](std::uint32_t p) {
            if (slots[p] != kNoPatch) { attributes.fill(p, slots[p]); }
            progress.step(1);
        });
    }
    progress.end();
}

} // namespace osgTessLOD::bake
