// SPDX-License-Identifier: MIT
// Newest-vertex bisection of right triangles, refined across longest sides as in M. Duchaineau et al., "ROAMing terrain:
// real-time optimally adapting meshes", 1997, §4.1:
//
//            a                      a
//           ╱ ╲                    ╱│╲           The longest side b c, opposite of the apex a, is cut in the middle. If the
//          ╱   ╲                  ╱ │ ╲          triangle below has b c as its longest side as well, both are cut at once;
//         b─────c       →        b──m──c         if not, it is bisected first: one of its halves then has.
//          ╲   ╱                  ╲ │ ╱
//           ╲ ╱                    ╲│╱
#include <osgTessLOD/bake/TerrainMap.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/SeamLevels.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint32_t kNone = 0xFFFFFFFFU;
/// Bisections of a root triangle's shorter sides at most: integer coordinates stay exact.
constexpr unsigned kMostHalvings = 18;
constexpr std::int64_t kRootUnits = std::int64_t{1} << kMostHalvings;

/// Vertices of the finest pattern along a sample's side at most. A cliff from one sample to the next would ask for ever smaller
/// patches: its foot and its edge lie between the pattern's vertices.
constexpr double kMostPerSample = 8.0;

/// A vertex of the bisection, in parts of root squares: exact, so that equal vertices are found to be.
using Place = std::array<std::int64_t, 2>;

struct Triangle {
    std::array<Place, 3> corners;        ///< apex, then the ends of the longest side; counter-clockwise seen from above
    std::array<std::uint32_t, 3> beside; ///< across the sides apex → 1, 1 → 2 (the longest), 2 → apex
};

/// Do the heights of a triangle, sampled on a grid, follow the field's?
class HeightError {
public:
    HeightError(const HeightField& field, unsigned factor)
        : _field(field)
        , _factor(factor)
    {
    }

    /// The largest difference in height at the field's samples within the triangle.
    double within(const std::array<Vector2d, 3>& corners) const
    {
        Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
        Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
        const Vector2d along = corners[1] - corners[0];
        const Vector2d across = corners[2] - corners[0];
        const double area = along.x() * across.y() - along.y() * across.x();
        double largest = 0.0;
        for (double row = std::ceil(low.y()); row <= high.y(); row += 1.0) {
            for (double column = std::ceil(low.x()); column <= high.x(); column += 1.0) {
                const Vector2d p = Vector2d(column, row) - corners[0];
                const double s = (p.x() * across.y() - p.y() * across.x()) / area;
                const double t = (along.x() * p.y() - along.y() * p.x()) / area;
                if (s < 0.0 || t < 0.0 || s + t > 1.0) { continue; }
                const double sampled = gridHeight(corners[0], along, across, s, t);
                largest = std::max(largest, std::fabs(sampled - _field.heightAt(column, row)));
            }
        }
        return largest;
    }

private:
    /// Linear between the nearest three points of the regular grid on the triangle.
    double gridHeight(const Vector2d& origin, const Vector2d& along, const Vector2d& across, double s, double t) const
    {
        const double steps = _factor;
        const double i = std::min(std::floor(s * steps), steps - 1.0);
        const double j = std::min(std::floor(t * steps), steps - 1.0 - i);
        const double x = s * steps - i;
        const double y = t * steps - j;
        const auto height = [&](double a, double b) {
            const Vector2d at = origin + along * (a / steps) + across * (b / steps);
            return _field.heightAt(at.x(), at.y());
        };
        const double right = height(i + 1.0, j);
        const double up = height(i, j + 1.0);
        if (x + y <= 1.0) { return (1.0 - x - y) * height(i, j) + x * right + y * up; }
        return (x + y - 1.0) * height(i + 1.0, j + 1.0) + (1.0 - x) * up + (1.0 - y) * right;
    }

    const HeightField& _field;
    double _factor;
};

/// By HeightTile::Side.
using Seams = std::array<std::optional<SeamLevels>, 4>;

class Bisection {
public:
    /// rootSquares(), each two triangles.
    Bisection(const HeightField& field, const Seams& seams)
        : _seams(seams)
    {
        const std::uint32_t across = rootSquares(field.columns);
        const std::uint32_t down = rootSquares(field.rows);
        _last = {across * kRootUnits, down * kRootUnits};
        _scale = Vector2d((field.columns - 1.0) / across, (field.rows - 1.0) / down) / static_cast<double>(kRootUnits);
        std::map<std::pair<Place, Place>, std::uint32_t> sides;
        for (std::uint32_t row = 0; row < down; ++row) {
            for (std::uint32_t column = 0; column < across; ++column) {
                const auto place = [&](std::uint32_t i, std::uint32_t j) {
                    return Place{(column + i) * kRootUnits, (row + j) * kRootUnits};
                };
                // Rows grow to the south: this is counter-clockwise seen from above, x to the east and y to the north.
                addRoot({place(0, 0), place(0, 1), place(1, 0)}, sides);
                addRoot({place(1, 1), place(1, 0), place(0, 1)}, sides);
            }
        }
    }

    const std::vector<Triangle>& triangles() const { return _triangles; }
    Vector2d sampleAt(const Place& place) const
    {
        return {static_cast<double>(place[0]) * _scale.x(), static_cast<double>(place[1]) * _scale.y()};
    }
    std::array<Vector2d, 3> cornersOf(const Triangle& t) const
    {
        return {sampleAt(t.corners[0]), sampleAt(t.corners[1]), sampleAt(t.corners[2])};
    }
    /// Can it be cut in exact halves, and what has to be cut before it, too, without a seam having less than a segment?
    bool isDivisible(std::uint32_t t) const
    {
        const auto& c = _triangles[t].corners;
        if ((c[1][0] + c[2][0]) % 2 != 0 || (c[1][1] + c[2][1]) % 2 != 0) { return false; }
        for (;;) {
            const Triangle& triangle = _triangles[t];
            const std::uint32_t below = triangle.beside[1];
            if (below == kNone) { return seamSegments(triangle.corners[1], triangle.corners[2]) != 1; }
            if (_triangles[below].beside[1] == t) { return true; }
            t = below;
        }
    }
    /// Has it a side on a seam that goes beyond one of the seam's parts?
    bool crossesSeamParts(std::uint32_t t) const
    {
        const auto& c = _triangles[t].corners;
        for (std::size_t side = 0; side < 3; ++side) {
            const SeamSpan span = seamSpan(c[side], c[(side + 1) % 3]);
            if (span.seam != nullptr && span.seam->isDivided(span.from, span.to)) { return true; }
        }
        return false;
    }
    /// Of a side within one part of a seam; 0: it is on none.
    unsigned seamSegments(const Place& a, const Place& b) const
    {
        const SeamSpan span = seamSpan(a, b);
        return span.seam != nullptr ? span.seam->segments(span.from, span.to) : 0;
    }

    /// Cuts the triangle, and what has to be cut with it. The triangle keeps its number for one half.
    void bisect(std::uint32_t t)
    {
        std::vector<std::uint32_t> waiting{t};
        while (!waiting.empty()) {
            const std::uint32_t next = waiting.back();
            const std::uint32_t below = _triangles[next].beside[1];
            if (below != kNone && _triangles[below].beside[1] != next) {
                waiting.push_back(below); // afterwards the half of it that is then below has this side as its longest
                continue;
            }
            cut(next, below);
            waiting.pop_back();
        }
    }

private:
    struct SeamSpan {
        const SeamLevels* seam = nullptr;
        std::int64_t from = 0;
        std::int64_t to = 0;
    };

    SeamSpan seamSpan(const Place& a, const Place& b) const
    {
        for (std::size_t side = 0; side < _seams.size(); ++side) {
            const std::size_t across = side % 2; // West and East are at a column, North and South at a row
            const std::int64_t line = side < 2 ? 0 : _last[across];
            if (!_seams[side] || a[across] != line || b[across] != line) { continue; }
            const auto [from, to] = std::minmax(a[1 - across], b[1 - across]);
            return {&*_seams[side], from, to};
        }
        return {};
    }

    void addRoot(const std::array<Place, 3>& corners, std::map<std::pair<Place, Place>, std::uint32_t>& sides)
    {
        const auto number = static_cast<std::uint32_t>(_triangles.size());
        _triangles.push_back({corners, {kNone, kNone, kNone}});
        for (std::size_t side = 0; side < 3; ++side) {
            const Place& from = corners[side];
            const Place& to = corners[(side + 1) % 3];
            sides[{from, to}] = number;
            const auto other = sides.find({to, from});
            if (other == sides.end()) { continue; }
            _triangles[number].beside[side] = other->second;
            Triangle& there = _triangles[other->second];
            for (std::size_t k = 0; k < 3; ++k) {
                if (there.corners[k] == to) { there.beside[k] = number; }
            }
        }
    }

    void replaceBeside(std::uint32_t triangle, std::uint32_t before, std::uint32_t after)
    {
        if (triangle == kNone) { return; }
        std::replace(_triangles[triangle].beside.begin(), _triangles[triangle].beside.end(), before, after);
    }

    /// Halves of one triangle: itself with side apex → 1, and a new one with side 2 → apex.
    std::uint32_t halve(std::uint32_t t)
    {
        const Triangle whole = _triangles[t];
        const auto& [a, b, c] = whole.corners;
        const Place middle{(b[0] + c[0]) / 2, (b[1] + c[1]) / 2};
        const auto second = static_cast<std::uint32_t>(_triangles.size());
        _triangles[t] = {{middle, a, b}, {second, whole.beside[0], kNone}};
        _triangles.push_back({{middle, c, a}, {kNone, whole.beside[2], t}});
        replaceBeside(whole.beside[2], t, second);
        return second;
    }

    void cut(std::uint32_t t, std::uint32_t below)
    {
        const std::uint32_t second = halve(t);
        if (below == kNone) { return; }
        const std::uint32_t belowSecond = halve(below);
        // Seen from below, b and c are the other way round: its first half lies beside this one's second.
        _triangles[t].beside[2] = belowSecond;
        _triangles[belowSecond].beside[0] = t;
        _triangles[second].beside[0] = below;
        _triangles[below].beside[2] = second;
    }

    const Seams& _seams;
    std::vector<Triangle> _triangles;
    Place _last;     ///< the south-eastern corner
    Vector2d _scale; ///< samples per unit
};

std::vector<float> heightsOfSide(const HeightField& field, HeightTile::Side side)
{
    std::vector<float> heights;
    if (side == HeightTile::West || side == HeightTile::East) {
        const std::uint32_t column = side == HeightTile::West ? 0 : field.columns - 1;
        for (std::uint32_t row = 0; row < field.rows; ++row) { heights.push_back(field.at(column, row)); }
    } else {
        const std::uint32_t row = side == HeightTile::North ? 0 : field.rows - 1;
        for (std::uint32_t column = 0; column < field.columns; ++column) { heights.push_back(field.at(column, row)); }
    }
    return heights;
}

/// The even part of a root that a coordinate along a seam is but for rounding; whole samples exactly.
double evenPart(double at, std::size_t samples)
{
    constexpr double kParts = 1 << 28;
    constexpr double kRounding = 1e-7;
    const double unit = static_cast<double>(samples - 1) / rootSquares(static_cast<std::uint32_t>(samples)) / kParts;
    const double part = std::round(at / unit) * unit;
    return std::fabs(part - std::round(part)) < kRounding ? std::round(part) : part;
}

} // namespace

TerrainMap::TerrainMap(HeightField field, unsigned factor, double tolerance, Progress& progress)
    : _field(std::move(field))
{
    fitFrame();
    makePatches(factor, tolerance, 0.0, progress);
}

TerrainMap::TerrainMap(HeightTile tile, unsigned factor, double tolerance, double seamTolerance, Progress& progress)
    : _field(std::move(tile.field))
    , _around(std::move(tile.around))
{
    _frame = tile.frame;
    _lattice = tile.lattice;
    _rootSamples = tile.rootSamples;
    for (const HeightTile::Side side : {HeightTile::West, HeightTile::North, HeightTile::East, HeightTile::South}) {
        if (tile.isSeam[side]) { _seams[side] = heightsOfSide(_field, side); }
    }
    makePatches(factor, tolerance, seamTolerance, progress);
}

void TerrainMap::makePatches(unsigned factor, double tolerance, double seamTolerance, Progress& progress)
{
    _name = _field.name;
    SeamOptions options{factor, tolerance * _frame.scale, seamTolerance * _frame.scale, kRootUnits, kRootUnits};
    while (options.shortestPart > 1 && _rootSamples * static_cast<double>(options.shortestPart) / kRootUnits >
                                           std::max(1.0, factor / 2.0)) {
        options.shortestPart /= 2; // half of the factor then follows all samples
    }
    Seams seams;
    for (std::size_t side = 0; side < seams.size(); ++side) {
        if (_seams[side].empty()) { continue; }
        const std::uint32_t roots = rootSquares(static_cast<std::uint32_t>(_seams[side].size()));
        seams[side].emplace(SeamLine{_seams[side], roots}, options);
    }
    Bisection bisection(_field, seams);
    const HeightError error(_field, factor);
    const auto isCoarse = [&](const std::array<Vector2d, 3>& corners) {
        return (corners[1] - corners[0]).norm() > factor / kMostPerSample;
    };
    progress.begin("bisection", 1, "surface");
    for (std::uint32_t t = 0; t < bisection.triangles().size();) {
        if (bisection.crossesSeamParts(t)) {
            bisection.bisect(t);
        } else {
            ++t;
        }
    }
    for (std::uint32_t t = 0; t < bisection.triangles().size();) {
        const std::array<Vector2d, 3> corners = bisection.cornersOf(bisection.triangles()[t]);
        const bool isRough =
            bisection.isDivisible(t) && isCoarse(corners) && error.within(corners) > tolerance * _frame.scale;
        if (isRough) {
            bisection.bisect(t); // and look at what is left of it
        } else {
            ++t;
        }
        progress.step(0);
    }
    progress.step(1);
    progress.end();

    std::map<Place, std::uint32_t> vertices;
    std::vector<Place> places;
    std::vector<std::array<std::uint32_t, 3>> patches;
    for (const Triangle& triangle : bisection.triangles()) {
        std::array<std::uint32_t, 3> patch{};
        for (std::size_t k = 0; k < 3; ++k) {
            const auto number = static_cast<std::uint32_t>(places.size());
            const auto [at, isNew] = vertices.try_emplace(triangle.corners[k], number);
            if (isNew) { places.push_back(triangle.corners[k]); }
            patch[k] = at->second;
        }
        patches.push_back(patch);
    }
    for (const Place& place : places) { _vertices.push_back(bisection.sampleAt(place)); }
    _topology = PatchTopology::build(static_cast<std::uint32_t>(places.size()), std::move(patches));
    for (PatchTopology::Edge& edge : _topology.edges) {
        if (edge.patches[1] != kNoPatch) { continue; }
        edge.seamFactor =
            static_cast<std::uint16_t>(bisection.seamSegments(places[edge.vertices[0]], places[edge.vertices[1]]));
    }
    sampleSource();
}

void TerrainMap::fitFrame()
{
    const auto [low, high] = std::minmax_element(_field.heights.begin(), _field.heights.end());
    const Vector3d first(_field.corner[0], _field.corner[1], static_cast<double>(*low));
    const Vector3d last(_field.corner[0] + _field.spacing[0] * (_field.columns - 1),
                        _field.corner[1] - _field.spacing[1] * (_field.rows - 1), static_cast<double>(*high));
    _frame.center = 0.5 * (first + last);
    _frame.scale = (last - first).norm();
}

std::array<Vector2d, 3> TerrainMap::cornersOf(std::uint32_t patch) const
{
    const auto& corners = _topology.patches[patch];
    return {_vertices[corners[0]], _vertices[corners[1]], _vertices[corners[2]]};
}

/// Takes what rounding did to points on seams back, so that the tiles on both sides have the same bits.
double TerrainMap::heightAt(Vector2d& at) const
{
    constexpr double kOnSeam = 1e-6; // samples; other points of patterns are farther away
    for (std::size_t side = 0; side < _seams.size(); ++side) {
        const Eigen::Index across = side % 2;
        const double line = side < 2 ? 0.0 : (across == 0 ? _field.columns : _field.rows) - 1.0;
        if (_seams[side].empty() || std::fabs(at[across] - line) > kOnSeam) { continue; }
        at[across] = line;
        at[1 - across] = evenPart(at[1 - across], _seams[side].size());
        return heightOnSeam(_seams[side], at[1 - across]);
    }
    return _field.heightAt(at.x(), at.y());
}

SurfacePoint TerrainMap::evaluate(std::uint32_t patch, const Vector3d& barycentric) const
{
    const auto corners = cornersOf(patch);
    Vector2d at = barycentric[0] * corners[0] + barycentric[1] * corners[1] + barycentric[2] * corners[2];
    const double height = heightAt(at);
    const Vector2d place = _field.placeAt(at.x(), at.y());
    const Vector3d position(place.x(), place.y(), height);
    const Vector2d slope = _around.heights.empty() ? _field.slopeAt(at.x(), at.y())
                                                   : _around.slopeAt(at.x() + (_field.first[0] - _around.first[0]),
                                                                     at.y() + (_field.first[1] - _around.first[1]));
    SurfacePoint point;
    point.position = (position - _frame.center) / _frame.scale;
    point.normal = Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
    return point;
}

void TerrainMap::sampleSource()
{
    _source = triangulate(_field);
    for (Vector3d& position : _source.positions) { position = (position - _frame.center) / _frame.scale; }
    _source.frame = _frame;
    for (std::uint32_t patch = 0; patch < _topology.patches.size(); ++patch) {
        const auto corners = cornersOf(patch);
        const Vector2d low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
        const Vector2d high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
        const auto isLeft = [](const Vector2d& a, const Vector2d& b, const Vector2d& p) {
            // Rows grow to the south, so counter-clockwise is clockwise in columns and rows.
            return (b.x() - a.x()) * (p.y() - a.y()) - (b.y() - a.y()) * (p.x() - a.x()) <= 0.0;
        };
        for (double row = std::ceil(low.y()); row <= high.y(); row += 1.0) {
            for (double column = std::ceil(low.x()); column <= high.x(); column += 1.0) {
                const Vector2d p(column, row);
                if (!isLeft(corners[0], corners[1], p) || !isLeft(corners[1], corners[2], p) ||
                    !isLeft(corners[2], corners[0], p)) {
                    continue;
                }
                const Vector3d position =
                    _field.position(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row));
                _samples.positions.push_back((position - _frame.center) / _frame.scale);
                _samples.patches.push_back(patch);
            }
        }
    }
}

} // namespace osgTessLOD::bake
