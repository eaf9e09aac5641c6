// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.6.
#include <osgTessLOD/bake/CollapseCost.h>

#include <osgTessLOD/bake/ChartRelayout.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/Triangulation.h>

#include <algorithm>
#include <cmath>

// One more version of the inner loop for processors that have it; both give the same bits.
#if defined(__GNUC__) && !defined(__clang__) && defined(__x86_64__)
#define OSGTESSLOD_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define OSGTESSLOD_WIDE_VECTORS
#endif

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Point = StripLattice::Point;

constexpr std::size_t kDirections = DirectionalErrors::kDirections;

/// |v × d|² = |v|² − (v·d)² for unit d.
OSGTESSLOD_WIDE_VECTORS
void raise(float* squared, const DirectionalErrors::Directions& d, float x, float y, float z)
{
    const float length = x * x + y * y + z * z;
    for (std::size_t i = 0; i < kDirections; ++i) {
        const float along = x * d.x[i] + y * d.y[i] + z * d.z[i];
        const float value = length - along * along;
        squared[i] = squared[i] < value ? value : squared[i];
    }
}

/// Triangle of a star once its ends have merged, ready to place chart points in it.
struct MergedTriangle {
    Vector2d e1, e2; ///< chart, from the merged vertex
    Vector3d d1, d2; ///< space

    double beyondFirst(const Vector2d& p) const { return e1.x() * p.y() - e1.y() * p.x(); }
    double beforeSecond(const Vector2d& p) const { return p.x() * e2.y() - p.y() * e2.x(); }
    bool contains(const Vector2d& p) const { return beyondFirst(p) >= 0.0 && beforeSecond(p) >= 0.0; }
};

/// The triangles of one part of a star after merging. They cover what those before did.
struct MergedPart {
    MergedPart(const CollapseStar& star, unsigned part, const Vector3d& mergedPosition, ChartPoint parameter)
        : center(parameter.u, parameter.v)
        , position(mergedPosition)
    {
        const auto chart = [&](const CollapseStar::Vertex& v) { return Vector2d(v.parameter.u, v.parameter.v); };
        for (const CollapseStar::Triangle& t : star.triangles) {
            if (t.part != part || !t.survives) { continue; }
            const CollapseStar::Vertex &a = star.vertices[t.vertices[1]], &b = star.vertices[t.vertices[2]];
            triangles.push_back({chart(a) - center, chart(b) - center, a.position - position, b.position - position});
        }
    }

    Vector2d center;
    Vector3d position;
    FixedList<MergedTriangle, CollapseStar::kMostTriangles> triangles;

    /// The surface at a chart point relative to the merged vertex, and the merged vertex' weight there; `guess` is the
    /// triangle that probably has the point.
    Vector3d at(const Vector2d& p, std::size_t guess, double& weight) const
    {
        const bool isGuess = guess < triangles.size() && triangles[guess].contains(p);
        const MergedTriangle& t = triangles[isGuess ? guess : find(p)];
        const double area = t.e1.x() * t.e2.y() - t.e1.y() * t.e2.x();
        const double first = t.beforeSecond(p) / area, second = t.beyondFirst(p) / area;
        weight = 1.0 - first - second;
        return position + first * t.d1 + second * t.d2;
    }

    std::size_t find(const Vector2d& p) const
    {
        for (std::size_t t = 0; t < triangles.size(); ++t) {
            if (triangles[t].contains(p)) { return t; }
        }
        return 0; // a chart point on the star's own outline, whose triangle is not in the star
    }
};

Vector2d exact(ChartPoint p)
{
    return {p.u, p.v};
}

} // namespace

const DirectionalErrors::Directions& DirectionalErrors::directions()
{
    static const Directions all = [] {
        Directions result{};
        const bake::Directions rows = sphericalFibonacci(static_cast<Eigen::Index>(kDirections));
        for (std::size_t i = 0; i < kDirections; ++i) {
            const auto row = static_cast<Eigen::Index>(i);
            result.x[i] = static_cast<float>(rows(row, 0));
            result.y[i] = static_cast<float>(rows(row, 1));
            result.z[i] = static_cast<float>(rows(row, 2));
        }
        return result;
    }();
    return all;
}

void DirectionalErrors::include(const Eigen::Vector3f& v)
{
    raise(_squared.data(), directions(), v.x(), v.y(), v.z());
}

float DirectionalErrors::least() const
{
    return *std::min_element(_squared.begin(), _squared.end());
}

double DirectionalErrors::meanExcess(const DirectionalErrors& other) const
{
    double sum = 0.0;
    for (std::size_t i = 0; i < kDirections; ++i) {
        if (other._squared[i] > _squared[i]) {
            sum += static_cast<double>(std::sqrt(other._squared[i]) - std::sqrt(_squared[i]));
        }
    }
    return sum / static_cast<double>(kDirections);
}

/// Difference vectors around a vertex, to be made small by moving it: Σ |v + w·move|² is least for move = −Σ w v / Σ w².
struct CollapseCost::Fit {
    Vector3d moment = Vector3d::Zero();
    double weights = 0.0;

    void add(const Vector3d& v, double weight)
    {
        moment += weight * v;
        weights += weight * weight;
    }
    Vector3d move() const { return weights > 0.0 ? Vector3d(moment / -weights) : Vector3d::Zero(); }
};

struct CollapseCost::PatchState {
    std::vector<std::uint16_t> triangleOf; ///< per chart vertex, lattice triangle index
    std::vector<std::uint16_t> start;      ///< per lattice triangle, into `inTriangle`
    std::vector<std::uint16_t> inTriangle; ///< chart vertices by triangle
    DirectionalErrors errors;
    float leastError = 0.0F; ///< of `errors`, squared
};

CollapseCost::CollapseCost(const StripMesh& mesh, const ChartSet& charts)
    : _mesh(mesh)
    , _charts(charts)
    , _chartPattern(charts.factor)
    , _chartPoints(patternPoints(charts.factor))
    , _patches(mesh.patchCount())
{
    if (mesh.patchCount() == 0) { return; }
    // All patches start with the same layout.
    PatchState& first = _patches[0];
    std::uint32_t triangle = mesh.patch(0).lattice.triangle({1, 1}, 0);
    for (const ChartPoint point : _chartPoints) {
        triangle = locate(0, point, triangle);
        first.triangleOf.push_back(static_cast<std::uint16_t>(triangle));
    }
    for (PatchState& patch : _patches) { patch.triangleOf = first.triangleOf; }
}

CollapseCost::~CollapseCost() = default;

std::uint32_t CollapseCost::locate(std::uint32_t p, ChartPoint point, std::uint32_t start) const
{
    constexpr int kPatience = 256;
    const StripMesh::Patch& patch = _mesh.patch(p);
    const StripLattice& lattice = patch.lattice;
    const auto side = [&](std::uint32_t t, unsigned s) {
        const auto c = lattice.corners(t);
        return orientation(patch.parameters[lattice.index(c[s])], patch.parameters[lattice.index(c[(s + 1) % 3])],
                           point);
    };
    std::uint32_t t = start;
    for (int step = 0; step < kPatience; ++step) {
        unsigned s = 0;
        while (s < 3 && side(t, s) >= 0) { ++s; }
        if (s == 3) { return t; }
        const std::uint32_t next = lattice.across(t, s);
        if (!lattice.hasTriangle(next)) { break; }
        t = next;
    }
    for (t = 0; t < lattice.triangleIndexCount(); ++t) {
        if (lattice.hasTriangle(t) && side(t, 0) >= 0 && side(t, 1) >= 0 && side(t, 2) >= 0) { return t; }
    }
    return start;
}

void CollapseCost::contracted(std::uint32_t p, const StripLattice& before, const std::vector<std::uint32_t>& after)
{
    const StripLattice& lattice = _mesh.patch(p).lattice;
    std::vector<std::uint16_t> moved(before.triangleIndexCount(), 0);
    for (std::uint32_t t = 0; t < moved.size(); ++t) {
        if (!before.hasTriangle(t)) { continue; }
        const auto c = before.corners(t);
        const std::array<Point, 3> now{lattice.point(after[before.index(c[0])]),
                                       lattice.point(after[before.index(c[1])]),
                                       lattice.point(after[before.index(c[2])])};
        if (now[0] != now[1] && now[1] != now[2] && now[2] != now[0]) {
            const Point cell{std::min({now[0].x, now[1].x, now[2].x}), std::min({now[0].y, now[1].y, now[2].y})};
            moved[t] = static_cast<std::uint16_t>(2 * lattice.index(cell) + t % 2);
            continue;
        }
        for (unsigned turn = 0; turn < 6; ++turn) { // vanished: any one nearby
            const Point q = now[0] + StripLattice::kNeighbours[turn],
                        r = now[0] + StripLattice::kNeighbours[(turn + 1) % 6];
            if (lattice.contains(q) && lattice.contains(r)) {
                moved[t] = static_cast<std::uint16_t>(lattice.triangle(now[0], turn));
                break;
            }
        }
    }
    for (std::uint16_t& t : _patches[p].triangleOf) { t = moved[t]; }
}

void CollapseCost::relocate(std::uint32_t p)
{
    PatchState& state = _patches[p];
    for (std::uint32_t v = 0; v < state.triangleOf.size(); ++v) {
        state.triangleOf[v] = static_cast<std::uint16_t>(locate(p, _chartPoints[v], state.triangleOf[v]));
    }
    state.start.assign(_mesh.patch(p).lattice.triangleIndexCount() + 1, 0);
    for (const std::uint16_t t : state.triangleOf) { ++state.start[t + 1U]; }
    for (std::size_t t = 1; t < state.start.size(); ++t) {
        state.start[t] = static_cast<std::uint16_t>(state.start[t] + state.start[t - 1]);
    }
    std::vector<std::uint16_t> next(state.start.begin(), state.start.end() - 1);
    state.inTriangle.resize(state.triangleOf.size());
    for (std::size_t v = 0; v < state.triangleOf.size(); ++v) {
        state.inTriangle[next[state.triangleOf[v]]++] = static_cast<std::uint16_t>(v);
    }
}

Vector3d CollapseCost::difference(std::uint32_t p, std::uint32_t chartVertex) const
{
    const StripMesh::Patch& patch = _mesh.patch(p);
    const auto c = patch.lattice.corners(_patches[p].triangleOf[chartVertex]);
    const std::array<std::uint32_t, 3> at{patch.lattice.index(c[0]), patch.lattice.index(c[1]),
                                          patch.lattice.index(c[2])};
    const ChartPoint point = _chartPoints[chartVertex];
    const auto weight = [&](std::size_t k) {
        return static_cast<double>(
            orientation(patch.parameters[at[(k + 1) % 3]], patch.parameters[at[(k + 2) % 3]], point));
    };
    const double w0 = weight(0), w1 = weight(1), w2 = weight(2);
    return (w0 * patch.positions[at[0]] + w1 * patch.positions[at[1]] + w2 * patch.positions[at[2]]) / (w0 + w1 + w2) -
           _charts.charts[p].positions[chartVertex];
}

void CollapseCost::measure(std::uint32_t p)
{
    PatchState& state = _patches[p];
    state.errors = DirectionalErrors();
    const StripMesh::Patch& patch = _mesh.patch(p);
    for (std::uint32_t v = 0; v < state.triangleOf.size(); ++v) {
        state.errors.include(difference(p, v).cast<float>());
    }
    for (std::uint32_t i = 0; i < patch.lattice.indexCount(); ++i) {
        if (!patch.lattice.contains(patch.lattice.point(i))) { continue; }
        const Vector3d v = patch.positions[i] - chartPosition(_chartPattern, _charts.charts[p], patch.parameters[i]);
        state.errors.include(v.cast<float>());
    }
    state.leastError = state.errors.least();
}

double CollapseCost::evaluate(const CollapseStar& star, const Placement& placement, bool fitted) const
{
    struct Weighted {
        Vector3d v;
        double weight;
    };
    static thread_local std::array<std::vector<Weighted>, 2> vectors;
    Fit fit;
    for (unsigned part = 0; part < 2 && star.patches[part] != kNoPatch; ++part) {
        const std::uint32_t p = star.patches[part];
        const PatchState& state = _patches[p];
        const auto& chart = _charts.charts[p].positions;
        const ChartPoint parameter = part == 0 ? placement.parameter : star.inPart(part, placement.parameter);
        const MergedPart merged(star, part, placement.position, parameter);
        vectors[part].clear();
        const auto add = [&](const Vector3d& v, double weight) {
            vectors[part].push_back({v, weight});
            fit.add(v, weight);
        };
        add(placement.position - chartPosition(_chartPattern, _charts.charts[p], parameter), 1.0);
        std::size_t guess = 0;
        for (const CollapseStar::Triangle& t : star.triangles) {
            if (t.part != part) { continue; }
            for (std::size_t i = state.start[t.index]; i < state.start[t.index + 1U]; ++i) {
                const std::uint32_t v = state.inTriangle[i];
                double weight = 0.0;
                const Vector3d at = merged.at(exact(_chartPoints[v]) - merged.center, guess, weight);
                add(at - chart[v], weight);
            }
            guess += t.survives ? 1U : 0U;
        }
    }
    const bool moves = fitted && star.kind != CollapseStar::Kind::Corner;
    const Vector3d move = moves ? fit.move() : Vector3d::Zero();
    double cost = 0.0;
    for (unsigned part = 0; part < 2 && star.patches[part] != kNoPatch; ++part) {
        const PatchState& state = _patches[star.patches[part]];
        DirectionalErrors raised;
        bool isRaised = false;
        for (const Weighted& w : vectors[part]) {
            const Eigen::Vector3f v = (w.v + w.weight * move).cast<float>();
            if (v.squaredNorm() <= state.leastError) { continue; }
            isRaised = true;
            raised.include(v);
        }
        if (isRaised) { cost += state.errors.meanExcess(raised); }
    }
    return cost;
}

void CollapseCost::fitAround(StripMesh::Site vertex, Fit& fit) const
{
    const StripMesh::Patch& patch = _mesh.patch(vertex.patch);
    const PatchState& state = _patches[vertex.patch];
    const auto& chart = _charts.charts[vertex.patch].positions;
    const Vector3d& position = _mesh.position(vertex);
    const ChartPoint center = _mesh.parameter(vertex);
    fit.add(position - chartPosition(_chartPattern, _charts.charts[vertex.patch], center), 1.0);
    for (unsigned turn = 0; turn < 6; ++turn) {
        const Point p = vertex.point + StripLattice::kNeighbours[turn];
        const Point q = vertex.point + StripLattice::kNeighbours[(turn + 1) % 6];
        if (!patch.lattice.contains(p) || !patch.lattice.contains(q)) { continue; }
        const std::uint32_t a = patch.lattice.index(p), b = patch.lattice.index(q);
        const Vector2d e1 = exact(patch.parameters[a]) - exact(center), e2 = exact(patch.parameters[b]) - exact(center);
        const MergedTriangle t{e1, e2, patch.positions[a] - position, patch.positions[b] - position};
        const double area = e1.x() * e2.y() - e1.y() * e2.x();
        const std::uint32_t triangle = patch.lattice.triangle(vertex.point, turn);
        for (std::size_t i = state.start[triangle]; i < state.start[triangle + 1U]; ++i) {
            const std::uint32_t v = state.inTriangle[i];
            const Vector2d at = exact(_chartPoints[v]) - exact(center);
            const double first = t.beforeSecond(at) / area, second = t.beyondFirst(at) / area;
            fit.add(position + first * t.d1 + second * t.d2 - chart[v], 1.0 - first - second);
        }
    }
}

Vector3d CollapseCost::fittedPosition(StripMesh::Site vertex) const
{
    Fit fit;
    fitAround(vertex, fit);
    unsigned step = 0;
    const unsigned side = _mesh.patch(vertex.patch).lattice.sideOf(vertex.point, step);
    if (side < 3) {
        const StripMesh::Site twin = _mesh.twin(vertex.patch, side, step);
        if (twin.patch != kNoPatch) { fitAround(twin, fit); }
    }
    return _mesh.position(vertex) + fit.move();
}

std::uint32_t CollapseCost::triangleOf(std::uint32_t patch, std::uint32_t chartVertex) const
{
    return _patches[patch].triangleOf[chartVertex];
}

const DirectionalErrors& CollapseCost::errors(std::uint32_t patch) const
{
    return _patches[patch].errors;
}

} // namespace osgTessLOD::bake
