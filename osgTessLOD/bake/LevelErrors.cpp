// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/LevelErrors.h>

#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/MorphedLevels.h>
#include <osgTessLOD/bake/SymmetricHull.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::ArrayXd;
using Eigen::Vector3d;
using Vectors = std::vector<Vector3d>;

/// Continuous levels above k at which a morph from k to k + 1 is measured; both ends are levels.
constexpr std::array<double, 3> kMorphs{0.25, 0.5, 0.75};
constexpr Eigen::Index kDirections = 300;

Triangulation rimOf(unsigned factor)
{
    const Triangulation pattern = Triangulation::ofPattern(factor);
    std::vector<Triangulation::Triangle> triangles;
    for (const auto& t : pattern.triangles()) {
        if (*std::min_element(t.begin(), t.end()) < 3 * factor) { triangles.push_back(t); }
    }
    return Triangulation(pattern.vertexCount(), std::move(triangles));
}

void append(Vectors& to, const Vectors& from)
{
    to.insert(to.end(), from.begin(), from.end());
}

/// How far the parabola through three values, one apart, rises above the largest of them.
double overshoot(double before, double middle, double after)
{
    const double bend = before - 2.0 * middle + after;
    const double slope = 0.5 * (after - before);
    if (bend >= 0.0 || std::fabs(slope) > -bend) { return 0.0; } // highest outside
    return std::max(0.0, middle - 0.5 * slope * slope / bend - std::max({before, middle, after}));
}

/// Of E over the morphs in their order, over all directions.
double largestOvershoot(const std::vector<Vectors>& hulls)
{
    static const Directions directions = sphericalFibonacci(kDirections);
    std::vector<ArrayXd> errors;
    for (const Vectors& hull : hulls) { errors.push_back(squaredErrors(hull, directions).max(0.0).sqrt()); }
    double largest = 0.0;
    for (std::size_t k = 1; k + 1 < errors.size(); ++k) {
        for (Eigen::Index d = 0; d < kDirections; ++d) {
            largest = std::max(largest, overshoot(errors[k - 1][d], errors[k][d], errors[k + 1][d]));
        }
    }
    return largest;
}

/// Of sides 0, 1, 2 while they are at `level`, or at their finest where that is coarser.
std::array<double, 3> bordersAt(double level, const FinestLevels& finest)
{
    std::array<double, 3> levels{};
    for (std::size_t side = 0; side < 3; ++side) {
        levels[side] = std::min(level, static_cast<double>(finest.borders[side]));
    }
    return levels;
}

} // namespace

/// Overlays of morphs of levels without parameters of their own, by what they are of: most patches share them.
struct LevelErrors::Cache {
    using Key = std::pair<const Triangulation*, std::vector<std::array<std::int32_t, 2>>>;

    std::shared_ptr<const DifferenceVectors> find(const Key& key)
    {
        const std::lock_guard<std::mutex> lock(mutex);
        const auto found = tables.find(key);
        return found != tables.end() ? found->second : nullptr;
    }

    void add(Key key, std::shared_ptr<const DifferenceVectors> table)
    {
        const std::lock_guard<std::mutex> lock(mutex);
        tables.emplace(std::move(key), std::move(table));
    }

    std::mutex mutex;
    std::map<Key, std::shared_ptr<const DifferenceVectors>> tables;
};

LevelErrors::LevelErrors(std::vector<std::uint16_t> ladder, unsigned chartFactor)
    : _ladder(std::move(ladder))
    , _chart(Triangulation::ofPattern(chartFactor))
    , _chartPoints(patternPoints(chartFactor))
    , _cache(std::make_unique<Cache>())
{
    for (const std::uint16_t factor : _ladder) {
        _patterns.push_back(Triangulation::ofPattern(factor));
        _rims.push_back(rimOf(factor));
        _places.push_back(patternPoints(factor));
        _atPlaces.push_back(std::make_shared<const DifferenceVectors>(
            PlacedTriangulation{_patterns.back(), _places.back()}, PlacedTriangulation{_chart, _chartPoints}));
    }
}

LevelErrors::~LevelErrors() = default;

Vectors LevelErrors::DrawnMesh::hull(const Vectors& chart) const
{
    Vectors vectors;
    table->evaluate(chart, positions, vectors);
    return symmetricHull(vectors);
}

LevelErrors::DrawnMesh LevelErrors::morph(const PatchLevels& levels, const Triangulation& triangles, double patchLevel,
                                          const std::array<double, 3>& borderLevels) const
{
    MorphedPatch patch = morphPatch(levels, _ladder, _places, patchLevel, borderLevels);
    const auto makeTable = [&] {
        return std::make_shared<const DifferenceVectors>(PlacedTriangulation{triangles, patch.points},
                                                         PlacedTriangulation{_chart, _chartPoints});
    };
    const bool atPlaces = std::all_of(levels.parameters.begin(), levels.parameters.end(),
                                      [](const std::vector<ChartPoint>& points) { return points.empty(); });
    const bool alike = borderLevels[0] == borderLevels[1] && borderLevels[1] == borderLevels[2];
    // What starts from level 0 differs from patch to patch: its parents do. So, mostly, do borders that end at different
    // levels.
    if (!atPlaces || !alike || borderLevels[0] < 1.0) { return {makeTable(), std::move(patch.positions)}; }
    Cache::Key key{&triangles, {}};
    for (const ChartPoint p : patch.points) { key.second.push_back({p.u, p.v}); }
    std::shared_ptr<const DifferenceVectors> table = _cache->find(key);
    if (table == nullptr) {
        table = makeTable();
        _cache->add(std::move(key), table);
    }
    return {std::move(table), std::move(patch.positions)};
}

LevelErrors::DrawnMesh LevelErrors::whole(const PatchLevels& levels, std::size_t level,
                                          const FinestLevels& finest) const
{
    if (*std::min_element(finest.borders.begin(), finest.borders.end()) < level) {
        const auto patchLevel = static_cast<double>(level);
        return morph(levels, _patterns[level], patchLevel, bordersAt(patchLevel, finest));
    }
    if (!levels.hasParameters(level)) { return {_atPlaces[level], levels.positions[level]}; }
    return {std::make_shared<const DifferenceVectors>(PlacedTriangulation{_patterns[level], levels.parameters[level]},
                                                      PlacedTriangulation{_chart, _chartPoints}),
            levels.positions[level]};
}

double LevelErrors::atFinest(const PatchLevels& levels, const Vectors& chart, const FinestLevels& finest) const
{
    const DrawnMesh mesh = whole(levels, finest.patch, finest);
    return mesh.table->largest(chart, mesh.positions);
}

std::vector<LevelVectors> LevelErrors::measure(const PatchLevels& levels, const Vectors& chart) const
{
    return measure(levels, chart, FinestLevels::all(_ladder.size() - 1));
}

std::vector<LevelVectors> LevelErrors::measure(const PatchLevels& levels, const Vectors& chart,
                                               const FinestLevels& finest) const
{
    const auto hullOf = [&](const Triangulation& triangles, double patchLevel, double borderLevel) {
        return morph(levels, triangles, patchLevel, bordersAt(borderLevel, finest)).hull(chart);
    };
    const std::size_t count = finest.patch + std::size_t{1};
    std::vector<LevelVectors> result(count);
    for (std::size_t level = count; level-- > 0;) {
        LevelVectors& at = result[level];
        at.bare = whole(levels, level, finest).hull(chart);
        Vectors drawn = at.bare;
        if (level + 1 < count) {
            append(drawn, result[level + 1].drawn);
            std::vector<Vectors> morphs{at.bare};
            for (const double progress : kMorphs) {
                const double continuous = static_cast<double>(level) + progress;
                morphs.push_back(hullOf(_patterns[level + 1], continuous, continuous));
                append(drawn, morphs.back());
            }
            morphs.push_back(result[level + 1].bare);
            at.betweenSamples = std::max(largestOvershoot(morphs), result[level + 1].betweenSamples);
            // Borders that lag: at the level while the inside is finer, and half way to the next one.
            for (std::size_t inside = level + 1; inside < count; ++inside) {
                append(drawn, hullOf(_rims[inside], static_cast<double>(inside), static_cast<double>(level)));
            }
            append(drawn, hullOf(_rims[level + 1], static_cast<double>(level + 1), static_cast<double>(level) + 0.5));
        }
        at.drawn = symmetricHull(drawn);
    }
    return result;
}

} // namespace osgTessLOD::bake
