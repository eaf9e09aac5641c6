// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.3, §4.4 and Appendix A.
//
// Rings are found by one shortest path search for each edge of the first layer, as the thesis has it, but not each over the
// whole graph: cheapest rings need not cross one another (where two do, they share an edge and can swap the rest), so the
// ring from the middle edge bounds the search for those to its left and to its right, and so on by halves.
#include <osgTessLOD/bake/StripGraph.h>

#include <algorithm>
#include <cassert>

namespace osgTessLOD::bake {

namespace {

/// The corner before or after a patch corner in its fan; patch kNoPatch where the surface ends.
CornerFan::Corner neighbour(const PatchTopology& topology, CornerFan::Corner at, bool next)
{
    const unsigned side = next ? (at.corner + 2) % 3 : at.corner;
    const PatchTopology::Edge& edge = topology.edges[topology.patchEdges[at.patch][side]];
    const unsigned own = edge.patches[0] == at.patch && edge.sides[0] == side ? 0 : 1;
    const unsigned otherSide = edge.sides[1 - own];
    return {edge.patches[1 - own], next ? otherSide : (otherSide + 1) % 3};
}

/// Number of the edge, counted from the border's ends, that the fractional transition contracts on each half of a border of
/// 2·half segments (Direct3D 11; compare TessellationPattern::tessellatorParent).
unsigned tessellatorSplit(unsigned half)
{
    unsigned highBit = 1;
    while (highBit * 2 <= half - 1) { highBit *= 2; }
    return 2 * ((half - 1) - highBit) + 1;
}

} // namespace

std::vector<CornerFan> cornerFans(const PatchTopology& topology)
{
    std::vector<CornerFan> fans;
    std::vector<char> known(3 * topology.patches.size(), 0);
    for (std::uint32_t number = 0; number < known.size(); ++number) {
        if (known[number] != 0) { continue; }
        const CornerFan::Corner start{number / 3, number % 3};
        const auto isStart = [&](CornerFan::Corner c) { return c.patch == start.patch && c.corner == start.corner; };
        CornerFan::Corner first = start; // the one with nothing before it, if any
        CornerFan fan;
        for (CornerFan::Corner before = neighbour(topology, first, false); !fan.closed && before.patch != kNoPatch;
             before = neighbour(topology, first, false)) {
            fan.closed = isStart(before);
            first = before;
        }
        for (CornerFan::Corner at = first; at.patch != kNoPatch && known[3 * at.patch + at.corner] == 0;
             at = neighbour(topology, at, true)) {
            known[3 * at.patch + at.corner] = 1;
            fan.corners.push_back(at);
        }
        fans.push_back(std::move(fan));
    }
    return fans;
}

StripGraph::StripGraph(const StripMesh& mesh, const CornerFan& fan)
    : _offsets{0}
    , _closed(fan.closed)
{
    for (std::size_t c = 0; c < fan.corners.size(); ++c) {
        const auto& [patch, corner] = fan.corners[c];
        const StripLattice& lattice = mesh.patch(patch).lattice;
        const bool lastRowIsShared = _closed || c + 1 < fan.corners.size();
        _firstLayers.push_back(_layers.size());
        _rows.push_back(lattice.rows(corner));
        for (unsigned row = 0; row + (lastRowIsShared ? 1 : 0) < lattice.rows(corner); ++row) {
            _layers.push_back({patch, corner, row, lattice.width(corner, row), lattice.shift(corner, row)});
            _offsets.push_back(_offsets.back() + _layers.back().width);
        }
    }
}

/// Shortest paths through the layers between a left and a right bound.
class StripGraph::Search {
public:
    Search(const StripGraph& graph, const std::vector<StripCost>& costs)
        : _graph(graph)
        , _costs(costs)
        , _before(graph.edgeCount())
    {
    }

    /// The best ring among those that start at edges first … last and lie between the bounds.
    void rings(unsigned first, unsigned last, const std::vector<unsigned>& left, const std::vector<unsigned>& right)
    {
        const unsigned middle = first + (last - first) / 2;
        const std::vector<unsigned> path = shortest(middle, middle, left, right);
        if (middle > first) { rings(first, middle - 1, left, path.empty() ? right : path); }
        if (middle < last) { rings(middle + 1, last, path.empty() ? left : path, right); }
    }

    /// The best path from one of the edges first … last: back to the same edge in a closed graph (then first = last).
    std::vector<unsigned> shortest(unsigned first, unsigned last, const std::vector<unsigned>& left,
                                   const std::vector<unsigned>& right)
    {
        assert(!_graph._closed || first == last);
        const auto& layers = _graph._layers;
        std::vector<StripCost> reached, next;
        reached.assign(layers[0].width, StripCost::forbidden());
        for (unsigned i = first; i <= last; ++i) { reached[i] = _costs[i]; }
        for (std::size_t layer = 1; layer < layers.size(); ++layer) {
            next.assign(layers[layer].width, StripCost::forbidden());
            advance(layer, left[layer], right[layer], reached, next);
            reached.swap(next);
        }
        unsigned end = 0;
        if (_graph._closed) {
            next.assign(layers[0].width, StripCost::forbidden());
            const unsigned from = bestBefore(layers.size(), first, reached);
            if (from >= layers.back().width) { return {}; }
            end = from;
        } else {
            end = static_cast<unsigned>(std::min_element(reached.begin(), reached.end()) - reached.begin());
        }
        if (reached[end].isForbidden()) { return {}; }
        std::vector<unsigned> path = trace(end);
        if (!hasBest || reached[end] < bestCost) {
            hasBest = true;
            bestCost = reached[end];
            best = path;
        }
        return path;
    }

    std::vector<unsigned> best;
    StripCost bestCost;
    bool hasBest = false;

private:
    /// Of the two edges on the layer before that lead to edge i of `layer`, the one reached cheaper; beyond them if neither.
    unsigned bestBefore(std::size_t layer, unsigned i, const std::vector<StripCost>& reached) const
    {
        const Layer& before = _graph._layers[layer - 1];
        const int second = static_cast<int>(i) - before.shift, first = second - 1;
        const auto cost = [&](int j) {
            return j >= 0 && j < static_cast<int>(before.width) ? reached[static_cast<unsigned>(j)]
                                                                : StripCost::forbidden();
        };
        const StripCost a = cost(first), b = cost(second);
        if (a.isForbidden() && b.isForbidden()) { return before.width; }
        return static_cast<unsigned>(b < a ? second : first);
    }

    void advance(std::size_t layer, unsigned left, unsigned right, const std::vector<StripCost>& reached,
                 std::vector<StripCost>& next)
    {
        for (unsigned i = left; i <= right; ++i) {
            const std::size_t edge = _graph.edge(layer, i);
            const unsigned from = bestBefore(layer, i, reached);
            _before[edge] = from;
            if (from < reached.size() && !_costs[edge].isForbidden()) { next[i] = reached[from] + _costs[edge]; }
        }
    }

    std::vector<unsigned> trace(unsigned end) const
    {
        std::vector<unsigned> path(_graph._layers.size());
        for (std::size_t layer = path.size(); layer-- > 0;) {
            path[layer] = end;
            if (layer > 0) { end = _before[_graph.edge(layer, end)]; }
        }
        return path;
    }

    const StripGraph& _graph;
    const std::vector<StripCost>& _costs;
    std::vector<unsigned> _before;
};

std::vector<unsigned> StripGraph::optimal(const std::vector<StripCost>& costs) const
{
    assert(costs.size() == edgeCount());
    const std::vector<unsigned> left(_layers.size(), 0);
    std::vector<unsigned> right(_layers.size());
    for (std::size_t layer = 0; layer < right.size(); ++layer) { right[layer] = _layers[layer].width - 1; }
    Search search(*this, costs);
    if (_closed) {
        search.rings(0, _layers[0].width - 1, left, right);
    } else {
        search.shortest(0, _layers[0].width - 1, left, right);
    }
    return search.best;
}

std::vector<unsigned> StripGraph::straight() const
{
    // At a constant distance from the side opposite to the fan's base vertex.
    std::vector<unsigned> strip;
    const unsigned split = tessellatorSplit(_layers[0].width);
    for (const Layer& layer : _layers) { strip.push_back(layer.width - split - 1); }
    return strip;
}

StripCost StripGraph::total(const std::vector<unsigned>& strip, const std::vector<StripCost>& costs) const
{
    StripCost sum;
    for (std::size_t layer = 0; layer < strip.size(); ++layer) { sum = sum + costs[edge(layer, strip[layer])]; }
    return sum;
}

bool StripGraph::isStrip(const std::vector<unsigned>& strip) const
{
    if (strip.size() != _layers.size()) { return false; }
    for (std::size_t layer = 0; layer < strip.size(); ++layer) {
        if (strip[layer] >= _layers[layer].width) { return false; }
        if (layer + 1 == strip.size() && !_closed) { break; }
        const unsigned next = strip[(layer + 1) % strip.size()];
        const int step = static_cast<int>(next) - static_cast<int>(strip[layer]) - _layers[layer].shift;
        if (step != 0 && step != 1) { return false; }
    }
    return true;
}

std::vector<unsigned> StripGraph::within(std::size_t which, const std::vector<unsigned>& strip) const
{
    std::vector<unsigned> result(_rows[which]);
    for (unsigned row = 0; row < result.size(); ++row) {
        result[row] = strip[(_firstLayers[which] + row) % strip.size()];
    }
    return result;
}

} // namespace osgTessLOD::bake
