// SPDX-License-Identifier: MIT
// Let a triangle have corners pⱼ with weights wⱼ in the patch. At λ the GPU draws Σⱼ λⱼ Σᵢ wⱼᵢ (Aᵢ pⱼ + tᵢ); the deformation takes
// the point there to Σᵢ wᵢ (Aᵢ p + tᵢ), w = Σ λⱼ wⱼ, p = Σ λⱼ pⱼ. The difference is Σᵢ Aᵢ Cov(wᵢ, p), where
//
//   Cov(wᵢ, p) = Σ_{j<l} λⱼ λₗ (wⱼᵢ − wₗᵢ) (pⱼ − pₗ)
//
// and, as weights sum to 1, any matrix may be taken from all Aᵢ: it is at most δ Σ_{j<l} λⱼ λₗ |wⱼ − wₗ|₁ |pⱼ − pₗ|, and with
// Σ_{j<l} λⱼ λₗ ≤ 1/3 at most δ/3 times the largest |w − w'|₁ |p − p'| of an edge. Ends of edges are on their way between
// levels: what is largest at the ends of these ways bounds both factors.
#include <osgTessLOD/render/DeformableAsset.h>

#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/LevelNeed.h>

#include <osg/Vec3f>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace osgTessLOD {

namespace {

struct Point {
    osg::Vec3f position;
    osg::Vec3f weights;
};

/// The largest differences between ends of an edge.
struct Spread {
    float weights = 0.0F; ///< Σ |difference|
    float length = 0.0F;

    void add(const Point& a, const Point& b)
    {
        const osg::Vec3f w = a.weights - b.weights;
        weights = std::max(weights, std::fabs(w.x()) + std::fabs(w.y()) + std::fabs(w.z()));
        length = std::max(length, (a.position - b.position).length());
    }
    float product() const { return weights * length; }
};

/// The pattern of a level.
struct LevelPattern {
    unsigned factor;
    std::uint32_t borderCount;
    std::vector<std::array<std::uint32_t, 2>> edges; ///< each once
    std::vector<osg::Vec3f> weights;

    explicit LevelPattern(unsigned f)
        : factor(f)
        , borderCount(TessellationPattern::borderVertexCount(f))
    {
        const TessellationPattern pattern(f);
        for (const TessellationPattern::Triangle& t : pattern.triangles()) {
            for (std::size_t c = 0; c < 3; ++c) {
                const std::uint32_t from = t[c];
                const std::uint32_t to = t[(c + 1) % 3];
                const bool isOnBorder = to == (from + 1) % borderCount && from < borderCount; // has no twin
                if (from < to || isOnBorder) { edges.push_back({from, to}); }
            }
        }
        const float units = 3.0F * static_cast<float>(f);
        for (std::uint32_t v = 0; v < pattern.vertexCount(); ++v) {
            const auto b = TessellationPattern::barycentric(f, v);
            weights.emplace_back(static_cast<float>(b[0]) / units, static_cast<float>(b[1]) / units,
                                 static_cast<float>(b[2]) / units);
        }
    }
};

/// The chord errors of an asset's patches.
class ChordErrors {
public:
    explicit ChordErrors(const LodAsset& asset)
        : _asset(asset)
        , _points(asset.levels.size())
        , _parents(asset.levels.size())
    {
        for (std::size_t level = 0; level < asset.levels.size(); ++level) {
            _patterns.emplace_back(asset.ladder[level]);
            _slots.push_back(asset.levelSlots(level));
        }
    }

    /// Of one patch, a number per level.
    std::vector<float> of(std::uint32_t patch)
    {
        const std::size_t finest = _asset.patches[patch].finestLevel;
        std::vector<float> largest(_asset.levels.size(), 0.0F);
        for (std::size_t side = 0; side < 3; ++side) {
            _sideFinest[side] = _asset.edges[_asset.patches[patch].edges[side]].finestLevel;
        }
        for (std::size_t level = 0; level <= finest; ++level) {
            load(patch, level);
            for (const auto& [a, b] : _patterns[level].edges) { addEdge(level, a, b, largest); }
        }
        constexpr float kRounding = 1e-5F;
        for (float& error : largest) { error *= (1.0F + kRounding) / 3.0F; }
        for (std::size_t level = finest; level-- > 0;) {
            largest[level] = std::max(largest[level],
                                      largest[level + 1] * static_cast<float>(LevelNeed::kErrorRatio * (1.0 + 1e-6)));
        }
        return largest;
    }

private:
    /// Where a vertex may be while no border is below a level that falls.
    struct Places {
        std::array<Point, LodAsset::kMaxLevels + 1> points;
        std::size_t count = 0;
    };

    void load(std::uint32_t patch, std::size_t level)
    {
        const LodLevel& stored = _asset.levels[level];
        const std::size_t count = _patterns[level].weights.size();
        const std::size_t first = _slots[level][patch] * count;
        _points[level].resize(count);
        _parents[level].resize(count);
        for (std::size_t v = 0; v < count; ++v) {
            const auto at = _asset.position(_asset.patches[patch], stored.vertices[first + v]);
            Point& point = _points[level][v];
            point.position.set(at[0], at[1], at[2]);
            point.weights = _patterns[level].weights[v];
            _parents[level][v] = stored.vertices[first + v].parent();
            if (stored.parameters.empty()) { continue; }
            const ChartPoint chart = ChartPoint::fromBits(stored.parameters[first + v]);
            point.weights = osg::Vec3f(static_cast<float>(ChartPoint::kUnits - chart.u - chart.v),
                                       static_cast<float>(chart.u), static_cast<float>(chart.v)) /
                            static_cast<float>(ChartPoint::kUnits);
        }
    }

    /// What `level`'s pattern has of the edge, for all levels that no border is below.
    void addEdge(std::size_t level, std::uint32_t a, std::uint32_t b, std::vector<float>& largest) const
    {
        Spread spread;
        if (movesByItself(level, a) && movesByItself(level, b)) { // both the same part of their ways
            spread.add(_points[level][a], _points[level][b]);
            largest[level] = std::max(largest[level], spread.product());
            if (level == 0) { return; }
            spread.add(_points[level - 1][_parents[level][a]], _points[level - 1][_parents[level][b]]);
            largest[level - 1] = std::max(largest[level - 1], spread.product());
            return;
        }
        const LevelPattern& pattern = _patterns[level];
        const bool onOneSide =
            std::max(a, b) < pattern.borderCount && a / pattern.factor == b / pattern.factor; // go together, too
        Places placesOfA;
        Places placesOfB;
        for (std::size_t floor = level + 1; floor-- > 0;) {
            const std::size_t knownA = placesOfA.count;
            const std::size_t knownB = placesOfB.count;
            addPlaces(level, a, floor, placesOfA);
            addPlaces(level, b, floor, placesOfB);
            for (std::size_t k = 0; k < placesOfA.count; ++k) {
                for (std::size_t l = k < knownA ? knownB : 0; l < placesOfB.count; ++l) {
                    if (!onOneSide || k == l) { spread.add(placesOfA.points[k], placesOfB.points[l]); }
                }
            }
            largest[floor] = std::max(largest[floor], spread.product());
        }
    }

    /// Inside the patch, and on its way from inside?
    bool movesByItself(std::size_t level, std::uint32_t vertex) const
    {
        if (vertex < _patterns[level].borderCount) { return false; }
        return level == 0 || _parents[level][vertex] >= _patterns[level - 1].borderCount;
    }

    /// Those that come with `floor`, the last ones having been those of the level above it.
    void addPlaces(std::size_t level, std::uint32_t vertex, std::size_t floor, Places& places) const
    {
        std::size_t at = level;
        if (vertex >= _patterns[level].borderCount) {
            if (floor == level) {
                places.points[places.count++] = _points[level][vertex];
                return;
            }
            vertex = _parents[level][vertex];
            at = level - 1;
            if (vertex >= _patterns[at].borderCount) {
                if (floor == at) { places.points[places.count++] = _points[at][vertex]; }
                return;
            }
        }
        const std::size_t sideFinest = _sideFinest[vertex / _patterns[at].factor];
        const std::size_t reached = std::min(floor, sideFinest);
        if (floor != at && reached == std::min(floor + 1, sideFinest)) { return; }
        for (; at > reached; --at) { vertex = _parents[at][vertex]; }
        places.points[places.count++] = _points[at][vertex];
    }

    const LodAsset& _asset;
    std::vector<LevelPattern> _patterns;
    std::vector<std::vector<std::uint32_t>> _slots;
    std::vector<std::vector<Point>> _points;          ///< of the patch, per level
    std::vector<std::vector<std::uint32_t>> _parents; ///< likewise
    std::array<std::size_t, 3> _sideFinest{};
};

} // namespace

DeformableAsset::DeformableAsset(const LodAsset& asset)
    : _levelCount(asset.levels.size())
    , _boxes(asset.baseVertices.size())
{
    const osg::BoundingBox all(asset.boundsMin[0], asset.boundsMin[1], asset.boundsMin[2], asset.boundsMax[0],
                               asset.boundsMax[1], asset.boundsMax[2]);
    ChordErrors errors(asset);
    for (std::uint32_t p = 0; p < asset.patches.size(); ++p) {
        const LodPatch& patch = asset.patches[p];
        const osg::Vec3f center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
        const osg::Vec3f half(patch.boundRadius, patch.boundRadius, patch.boundRadius);
        const osg::BoundingBox box = osg::BoundingBox(center - half, center + half).intersect(all);
        for (const std::uint32_t vertex : patch.baseVertices) { _boxes[vertex].expandBy(box); }
        const std::vector<float> ofPatch = errors.of(p);
        _chordErrors.insert(_chordErrors.end(), ofPatch.begin(), ofPatch.end());
    }
}

} // namespace osgTessLOD
