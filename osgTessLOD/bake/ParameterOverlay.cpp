// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.1, on integers instead of trees of boxes.
//
// A level's edge p → q is followed from triangle to triangle of the chart. It enters a triangle through an edge, whose
// corners lie left and right of it, and leaves on the side where the third corner is not, or through that corner:
//
//              third                 third
//              /   \                 / | \              The third corner's orientation to p → q says which.
//        ┄p┄┄┄/┄┄┄┄┄\┄┄┄►q          /  ┆  \             At a corner, the triangles around it are searched for the one
//            /       \             /   ┆   \            that lies ahead.
//         left ───── right      left ──p── right
#include <osgTessLOD/bake/ParameterOverlay.h>

#include <cassert>

namespace osgTessLOD::bake {

namespace {

constexpr std::uint32_t kNone = Triangulation::kNone;

std::int64_t dot(ChartPoint from, ChartPoint to, ChartPoint point)
{
    return static_cast<std::int64_t>(to.u - from.u) * (point.u - from.u) +
           static_cast<std::int64_t>(to.v - from.v) * (point.v - from.v);
}

double quotient(std::int64_t part, std::int64_t whole)
{
    return static_cast<double>(part) / static_cast<double>(whole);
}

class Overlay {
public:
    Overlay(const PlacedTriangulation& level, const PlacedTriangulation& chart)
        : _level(level)
        , _chart(chart)
        , _places(level.topology.vertexCount(), kNone)
        , _insideOf(chart.topology.vertexCount(), kNone)
    {
    }

    std::vector<OverlaySample> run()
    {
        for (const Triangulation::Edge& edge : _level.topology.edges()) {
            // Vertices are placed by walking to them; edges come in an order where nearly always one end is known.
            if (_places[edge.vertices[0]] == kNone && _places[edge.vertices[1]] == kNone) { placeFirst(edge.vertices[0]); }
            const bool forward = _places[edge.vertices[0]] != kNone;
            follow(edge, forward);
        }
        return std::move(_samples);
    }

private:
    using Triangle = Triangulation::Triangle;

    const Triangle& chartTriangle(std::uint32_t t) const { return _chart.topology.triangles()[t]; }
    ChartPoint chartPoint(std::uint32_t t, unsigned corner) const { return _chart.points[chartTriangle(t)[corner % 3]]; }
    ChartPoint levelPoint(std::uint32_t vertex) const { return _level.points[vertex]; }

    bool holds(std::uint32_t t, ChartPoint q) const
    {
        return orientation(chartPoint(t, 0), chartPoint(t, 1), q) >= 0 &&
               orientation(chartPoint(t, 1), chartPoint(t, 2), q) >= 0 &&
               orientation(chartPoint(t, 2), chartPoint(t, 0), q) >= 0;
    }

    /// The chart's vertex at a point that chart triangle t holds, or kNone.
    std::uint32_t vertexAt(std::uint32_t t, ChartPoint q) const
    {
        for (const std::uint32_t v : chartTriangle(t)) {
            if (_chart.points[v] == q) { return v; }
        }
        return kNone;
    }

    /// Finds a vertex with no neighbour known: from any chart vertex.
    void placeFirst(std::uint32_t vertex)
    {
        const std::uint32_t start = chartTriangle(0)[0];
        _p = _chart.points[start];
        _q = levelPoint(vertex);
        place(vertex, walk(0, [](std::uint32_t, unsigned) {}, [](std::uint32_t) {}));
    }

    /// Samples a level vertex that chart triangle t holds, and looks for chart vertices about it.
    void place(std::uint32_t vertex, std::uint32_t t)
    {
        _places[vertex] = t;
        const ChartPoint q = levelPoint(vertex);
        OverlaySample sample{};
        sample.levelTriangle = *_level.topology.trianglesAround(vertex).begin();
        sample.levelWeights[cornerOf(sample.levelTriangle, vertex)] = 1.0;
        sample.chartTriangle = t;
        setChartWeights(sample, q);
        _samples.push_back(sample);
        const std::uint32_t chartVertex = vertexAt(t, q);
        for (const std::uint32_t levelTriangle : _level.topology.trianglesAround(vertex)) {
            if (chartVertex != kNone) {
                floodAround(levelTriangle, chartVertex);
            } else {
                for (const std::uint32_t v : chartTriangle(t)) { flood(levelTriangle, v); }
            }
        }
    }

    unsigned cornerOf(std::uint32_t levelTriangle, std::uint32_t vertex) const
    {
        const Triangle& t = _level.topology.triangles()[levelTriangle];
        return t[0] == vertex ? 0 : t[1] == vertex ? 1 : 2;
    }

    void setChartWeights(OverlaySample& sample, ChartPoint q) const
    {
        const ChartPoint a = chartPoint(sample.chartTriangle, 0);
        const ChartPoint b = chartPoint(sample.chartTriangle, 1);
        const ChartPoint c = chartPoint(sample.chartTriangle, 2);
        const std::int64_t area = orientation(a, b, c);
        sample.chartWeights = {quotient(orientation(b, c, q), area), quotient(orientation(c, a, q), area),
                               quotient(orientation(a, b, q), area)};
    }

    void follow(const Triangulation::Edge& edge, bool forward)
    {
        const std::uint32_t from = edge.vertices[forward ? 0 : 1];
        const std::uint32_t to = edge.vertices[forward ? 1 : 0];
        _p = levelPoint(from);
        _q = levelPoint(to);
        const unsigned fromCorner = (edge.corner + (forward ? 0 : 1)) % 3;
        const unsigned toCorner = (edge.corner + (forward ? 1 : 0)) % 3;
        OverlaySample sample{};
        sample.levelTriangle = edge.triangles[0];
        const auto setLevelWeights = [&](double weightOfTo) {
            sample.levelWeights[fromCorner] = 1.0 - weightOfTo;
            sample.levelWeights[toCorner] = weightOfTo;
        };
        const auto crossing = [&](std::uint32_t t, unsigned k) {
            const ChartPoint a = chartPoint(t, k);
            const ChartPoint b = chartPoint(t, k + 1);
            const std::int64_t atA = orientation(_p, _q, a);
            const std::int64_t atB = orientation(_p, _q, b);
            const std::int64_t atP = orientation(a, b, _p);
            const std::int64_t atQ = orientation(a, b, _q);
            sample.chartTriangle = t;
            sample.chartWeights = {};
            sample.chartWeights[(k + 1) % 3] = quotient(atA, atA - atB);
            sample.chartWeights[k] = 1.0 - sample.chartWeights[(k + 1) % 3];
            setLevelWeights(quotient(atP, atP - atQ));
            _samples.push_back(sample);
            for (const std::uint32_t levelTriangle : edge.triangles) {
                flood(levelTriangle, chartTriangle(t)[k]);
                flood(levelTriangle, chartTriangle(t)[(k + 1) % 3]);
            }
        };
        const auto passing = [&](std::uint32_t vertex) {
            sample.chartTriangle = *_chart.topology.trianglesAround(vertex).begin();
            sample.chartWeights = {};
            for (unsigned k = 0; k < 3; ++k) {
                if (chartTriangle(sample.chartTriangle)[k] == vertex) { sample.chartWeights[k] = 1.0; }
            }
            setLevelWeights(quotient(dot(_p, _q, _chart.points[vertex]), dot(_p, _q, _q)));
            _samples.push_back(sample);
            for (const std::uint32_t levelTriangle : edge.triangles) { floodAround(levelTriangle, vertex); }
        };
        const std::uint32_t end = walk(_places[from], crossing, passing);
        if (_places[to] == kNone) { place(to, end); }
    }

    /// From _p, which triangle t holds, to _q: tells of each chart edge crossed (triangle, corner before the edge) and each
    /// chart vertex passed, both strictly between the ends. Returns a triangle that holds _q.
    template <typename Crossing, typename Passing>
    std::uint32_t walk(std::uint32_t t, Crossing&& crossing, Passing&& passing) const
    {
        if (_p == _q) { return t; }
        std::uint32_t vertex = vertexAt(t, _p);
        unsigned entry = 3; // the edge that t was entered through
        while (true) {
            if (vertex != kNone) {
                const Ahead ahead = aheadOf(vertex);
                t = ahead.triangle;
                if (holds(t, _q)) { return t; }
                vertex = ahead.vertex;
                if (vertex != kNone) {
                    passing(vertex);
                    continue;
                }
                crossing(t, ahead.exit);
                enter(t, entry, ahead.exit);
                continue;
            }
            if (holds(t, _q)) { return t; }
            const unsigned exit = entry == 3 ? firstExit(t, vertex) : exitOf(t, entry, vertex);
            if (vertex != kNone) {
                passing(vertex);
                continue;
            }
            // An edge that _p lies on is left, not crossed.
            if (orientation(chartPoint(t, exit), chartPoint(t, exit + 1), _p) != 0) { crossing(t, exit); }
            enter(t, entry, exit);
        }
    }

    /// To the triangle across edge `exit` of t.
    void enter(std::uint32_t& t, unsigned& entry, unsigned exit) const
    {
        const std::uint32_t from = chartTriangle(t)[exit];
        t = _chart.topology.neighbour(t, exit);
        assert(t != kNone); // _q lies in the parameter triangle
        const Triangle& next = chartTriangle(t);
        entry = next[0] == from ? 2 : next[1] == from ? 0 : 1; // the edge that ends there
    }

    struct Ahead {
        std::uint32_t triangle;
        std::uint32_t vertex; ///< the next one, if an edge leads straight on
        unsigned exit;        ///< the edge to be crossed otherwise
    };
    Ahead aheadOf(std::uint32_t vertex) const
    {
        for (const std::uint32_t t : _chart.topology.trianglesAround(vertex)) {
            const Triangle& corners = chartTriangle(t);
            const unsigned k = corners[0] == vertex ? 0 : corners[1] == vertex ? 1 : 2;
            const std::int64_t right = orientation(_p, _q, chartPoint(t, k + 1));
            const std::int64_t left = orientation(_p, _q, chartPoint(t, k + 2));
            if (right < 0 && left > 0) { return {t, kNone, (k + 1) % 3}; }
            for (unsigned j = 1; j <= 2; ++j) {
                const std::uint32_t other = corners[(k + j) % 3];
                if ((j == 1 ? right : left) == 0 && isAhead(vertex, other)) { return {t, other, 0}; }
            }
        }
        assert(false); // the chart is a triangulation of the whole parameter triangle
        return {kNone, kNone, 0};
    }

    bool isAhead(std::uint32_t vertex, std::uint32_t other) const
    {
        return dot(_p, _q, _chart.points[other]) > dot(_p, _q, _chart.points[vertex]);
    }

    /// The edge that leads out of t, which holds _p but not at a corner; or the corner, as `vertex`.
    unsigned firstExit(std::uint32_t t, std::uint32_t& vertex) const
    {
        for (unsigned k = 0; k < 3; ++k) {
            const ChartPoint a = chartPoint(t, k);
            const ChartPoint b = chartPoint(t, k + 1);
            if (orientation(a, b, _q) >= 0) { continue; } // not on the far side of this edge
            const std::int64_t right = orientation(_p, _q, a);
            const std::int64_t left = orientation(_p, _q, b);
            if (right == 0 || left == 0) {
                // Straight along an edge, or out through a corner.
                const std::uint32_t corner = chartTriangle(t)[right == 0 ? k : (k + 1) % 3];
                if (dot(_p, _q, _chart.points[corner]) > 0) {
                    vertex = corner;
                    return k;
                }
            }
            if (right < 0 && left > 0) { return k; }
        }
        assert(false);
        return 0;
    }

    /// The same for a triangle that was entered through edge `entry`.
    unsigned exitOf(std::uint32_t t, unsigned entry, std::uint32_t& vertex) const
    {
        const unsigned third = (entry + 2) % 3;
        const std::int64_t side = orientation(_p, _q, chartPoint(t, third));
        if (side == 0) { vertex = chartTriangle(t)[third]; }
        return side > 0 ? (entry + 1) % 3 : third;
    }

    void floodAround(std::uint32_t levelTriangle, std::uint32_t chartVertex)
    {
        for (const std::uint32_t v : _chart.topology.verticesAround(chartVertex)) { flood(levelTriangle, v); }
    }

    /// Samples the chart vertices strictly inside a level triangle that are connected with `start` in there. As the
    /// chart is connected, each is with one on the far side of the border or next to a vertex on it.
    void flood(std::uint32_t levelTriangle, std::uint32_t start)
    {
        if (levelTriangle == kNone || _insideOf[start] == levelTriangle) { return; }
        const Triangle& corners = _level.topology.triangles()[levelTriangle];
        const ChartPoint a = levelPoint(corners[0]);
        const ChartPoint b = levelPoint(corners[1]);
        const ChartPoint c = levelPoint(corners[2]);
        const std::int64_t area = orientation(a, b, c);
        if (area == 0) { return; }
        const std::int64_t sign = area > 0 ? 1 : -1; // a triangle turned over has an inside, too
        _stack.push_back(start);
        while (!_stack.empty()) {
            const std::uint32_t v = _stack.back();
            _stack.pop_back();
            if (_insideOf[v] == levelTriangle) { continue; }
            const ChartPoint q = _chart.points[v];
            const std::int64_t atA = sign * orientation(b, c, q);
            const std::int64_t atB = sign * orientation(c, a, q);
            const std::int64_t atC = sign * orientation(a, b, q);
            if (atA <= 0 || atB <= 0 || atC <= 0) { continue; }
            _insideOf[v] = levelTriangle;
            OverlaySample sample{};
            sample.levelTriangle = levelTriangle;
            sample.levelWeights = {quotient(atA, sign * area), quotient(atB, sign * area), quotient(atC, sign * area)};
            sample.chartTriangle = *_chart.topology.trianglesAround(v).begin();
            for (unsigned k = 0; k < 3; ++k) {
                if (chartTriangle(sample.chartTriangle)[k] == v) { sample.chartWeights[k] = 1.0; }
            }
            _samples.push_back(sample);
            for (const std::uint32_t next : _chart.topology.verticesAround(v)) {
                if (_insideOf[next] != levelTriangle) { _stack.push_back(next); }
            }
        }
    }

    const PlacedTriangulation& _level;
    const PlacedTriangulation& _chart;
    ChartPoint _p; ///< the line being walked
    ChartPoint _q;
    std::vector<std::uint32_t> _places;   ///< per level vertex: a chart triangle that holds it
    std::vector<std::uint32_t> _insideOf; ///< per chart vertex: a level triangle that it is strictly inside of
    std::vector<std::uint32_t> _stack;
    std::vector<OverlaySample> _samples;
};

} // namespace

std::vector<OverlaySample> overlay(const PlacedTriangulation& level, const PlacedTriangulation& chart)
{
    return Overlay(level, chart).run();
}

} // namespace osgTessLOD::bake
