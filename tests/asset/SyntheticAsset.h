// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

// Small valid assets made without a bake, for the tests of every room.

namespace osgTessLOD {
namespace synthetic {

using Point = std::array<double, 3>;
using Corners = std::array<std::uint32_t, 3>;

/// A base mesh, and the surface over it as a function of the point of the flat base mesh.
struct Shape {
    std::vector<Point> base;
    std::vector<Corners> patches;
    std::function<Point(const Point&)> surface;
    double size;        ///< extent of one patch, at most
    double coarseError; ///< claimed error of level 0, object units; level l claims it divided by the factor squared
};

inline Point difference(const Point& a, const Point& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline Point cross(const Point& a, const Point& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline double dot(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline double length(const Point& a)
{
    return std::sqrt(dot(a, a));
}

inline Point normalized(const Point& a)
{
    const double l = length(a);
    return {a[0] / l, a[1] / l, a[2] / l};
}

inline std::uint32_t octahedral(const Point& normal)
{
    const double sum = std::fabs(normal[0]) + std::fabs(normal[1]) + std::fabs(normal[2]);
    double x = normal[0] / sum;
    double y = normal[1] / sum;
    if (normal[2] < 0.0) {
        const double folded = (1.0 - std::fabs(y)) * (x < 0.0 ? -1.0 : 1.0);
        y = (1.0 - std::fabs(x)) * (y < 0.0 ? -1.0 : 1.0);
        x = folded;
    }
    const auto quantized = [](double v) {
        return static_cast<std::uint32_t>(static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(v * 32767.0))));
    };
    return quantized(x) | quantized(y) << 16;
}

/// Builds the asset of a Shape. `displaced`: vertices lie at other places of their patch than the pattern's, but on the
/// first level and, where there are more than two, the last.
class Builder {
public:
    Builder(Shape shape, std::vector<std::uint16_t> ladder, std::vector<std::uint8_t> finestLevels, bool displaced)
        : _shape(std::move(shape))
        , _finest(std::move(finestLevels))
        , _displaced(displaced)
    {
        _asset.technique = "synthetic";
        _asset.source = "a test";
        _asset.sourceTriangles = 1000;
        _asset.ladder = std::move(ladder);
        _asset.lattice.step = static_cast<float>(_shape.size / 100000.0); // of the 131,071 an offset can reach
        _finest.resize(_shape.patches.size(), static_cast<std::uint8_t>(_asset.ladder.size() - 1));
        for (const Point& p : _shape.base) { _asset.baseVertices.push_back(quantized(_shape.surface(p))); }
        makePatches();
        _asset.levels.resize(_asset.ladder.size());
        _asset.boundsMin = {1e30F, 1e30F, 1e30F};
        _asset.boundsMax = {-1e30F, -1e30F, -1e30F};
        for (std::size_t p = 0; p < _asset.patches.size(); ++p) { fillPatch(p); }
    }

    /// Normals of the surface, on a grid of the ladder's last factor rounded down to a power of two.
    void addNormals()
    {
        _asset.normals.resolution = 1;
        while (_asset.normals.resolution * 2 <= _asset.ladder.back()) { _asset.normals.resolution *= 2; }
        for (std::uint32_t r = 1; r <= _asset.normals.resolution; r *= 2) {
            auto& texels = _asset.normals.levels.emplace_back();
            for (std::size_t p = 0; p < _asset.patches.size(); ++p) {
                for (std::uint32_t j = 0; j <= r; ++j) {
                    for (std::uint32_t i = 0; i + j <= r; ++i) {
                        const double n = r;
                        texels.push_back(octahedral(normalAt(p, {(r - i - j) / n, i / n, j / n})));
                    }
                }
            }
        }
    }

    LodAsset take() { return std::move(_asset); }

private:
    std::array<std::int32_t, 3> quantized(const Point& p) const
    {
        std::array<std::int32_t, 3> result{};
        for (std::size_t k = 0; k < 3; ++k) {
            result[k] = static_cast<std::int32_t>(std::lround(p[k] / static_cast<double>(_asset.lattice.step)));
        }
        return result;
    }

    Point flat(std::size_t p, const std::array<double, 3>& weights) const
    {
        const Corners& c = _shape.patches[p];
        Point result{};
        // A border's weight 0 adds nothing, and two products give one sum in either order: neighbours agree bit by bit.
        for (std::size_t k = 0; k < 3; ++k) {
            result[k] = _shape.base[c[0]][k] * weights[0] + _shape.base[c[1]][k] * weights[1] +
                        _shape.base[c[2]][k] * weights[2];
        }
        return result;
    }

    Point normalAt(std::size_t p, const std::array<double, 3>& weights) const
    {
        constexpr double kStep = 1e-4;
        const Point u = difference(flat(p, {weights[0] - kStep, weights[1] + kStep, weights[2]}), flat(p, weights));
        const Point v = difference(flat(p, {weights[0] - kStep, weights[1], weights[2] + kStep}), flat(p, weights));
        const auto along = [&](const Point& step) {
            Point before = flat(p, weights);
            Point after = before;
            for (std::size_t k = 0; k < 3; ++k) {
                before[k] -= step[k];
                after[k] += step[k];
            }
            return difference(_shape.surface(after), _shape.surface(before));
        };
        return normalized(cross(along(u), along(v)));
    }

    void makePatches()
    {
        // An edge is found again by the ends of the patch that runs the other way.
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> open;
        for (std::uint32_t p = 0; p < _shape.patches.size(); ++p) {
            LodPatch patch;
            patch.baseVertices = _shape.patches[p];
            patch.finestLevel = _finest[p];
            for (std::size_t s = 0; s < 3; ++s) {
                const std::uint32_t a = patch.baseVertices[s];
                const std::uint32_t b = patch.baseVertices[(s + 1) % 3];
                const auto opposite = open.find({b, a});
                if (opposite != open.end()) {
                    patch.edges[s] = opposite->second;
                    LodEdge& edge = _asset.edges[opposite->second];
                    edge.patches[1] = p;
                    edge.finestLevel = std::min(edge.finestLevel, patch.finestLevel);
                } else {
                    patch.edges[s] = static_cast<std::uint32_t>(_asset.edges.size());
                    open[{a, b}] = patch.edges[s];
                    _asset.edges.push_back({{a, b}, {p, kNoPatch}, patch.finestLevel});
                }
            }
            _asset.patches.push_back(patch);
        }
    }

    std::uint32_t parent(const LodPatch& patch, std::uint32_t p, std::size_t level, std::uint32_t vertex) const
    {
        if (level == 0) { return 0; }
        const unsigned factor = _asset.ladder[level];
        const unsigned coarse = _asset.ladder[level - 1];
        if (coarse > 1) { return TessellationPattern::tessellatorAncestor(factor, vertex, coarse); }
        // To a single triangle: what lies before the middle of a border to its nearer corner, the middle to the corner that
        // the edge begins with, all inner vertices to corner 0.
        if (vertex >= TessellationPattern::borderVertexCount(factor)) { return 0; }
        const std::uint32_t side = vertex / factor;
        const std::uint32_t step = vertex % factor;
        const bool begins = _asset.edges[patch.edges[side]].patches[0] == p;
        const bool toFirst = 2 * step < factor || (2 * step == factor && begins);
        return toFirst ? side : (side + 1) % 3;
    }

    bool hasParameters(std::size_t level) const
    {
        const std::size_t levels = _asset.ladder.size();
        return _displaced && level > 0 && (level + 1 < levels || levels == 2);
    }

    /// Up to a fifth of a segment from the pattern's place in either direction: inner vertices stay inside.
    ChartPoint displacedPoint(std::uint32_t p, unsigned factor, std::uint32_t vertex) const
    {
        const auto wiggle = [factor](std::uint32_t what, std::uint32_t which) {
            const double most = ChartPoint::kUnits / (5.0 * factor);
            return static_cast<std::int32_t>(std::lround(most * std::sin(12.9898 * what + 78.233 * which + factor)));
        };
        if (vertex >= TessellationPattern::borderVertexCount(factor)) {
            const ChartPoint point = TessellationPattern::chartPoint(factor, vertex);
            return {point.u + wiggle(vertex, 2 * p), point.v + wiggle(vertex, 2 * p + 1)};
        }
        const unsigned side = vertex / factor;
        const unsigned step = vertex % factor;
        if (step == 0) { return borderParameter(side, 0); }
        const std::uint32_t e = _asset.patches[p].edges[side];
        const bool begins = _asset.edges[e].patches[0] == p;
        const std::uint32_t fromBegin = begins ? step : factor - step;
        const auto along = static_cast<std::int32_t>(fromBegin * ChartPoint::kUnits / factor) + wiggle(fromBegin, e);
        return borderParameter(side, begins ? along : ChartPoint::kUnits - along);
    }

    /// Corner weights of a vertex; neighbours' are the same numbers on their border.
    std::array<double, 3> weights(std::size_t p, std::size_t level, std::uint32_t vertex)
    {
        const unsigned factor = _asset.ladder[level];
        if (!hasParameters(level)) {
            const auto b = TessellationPattern::barycentric(factor, vertex);
            const double n = 3.0 * factor;
            return {b[0] / n, b[1] / n, b[2] / n};
        }
        const ChartPoint point = displacedPoint(static_cast<std::uint32_t>(p), factor, vertex);
        _asset.levels[level].parameters.push_back(point.bits());
        const double n = ChartPoint::kUnits;
        return {(ChartPoint::kUnits - point.u - point.v) / n, point.u / n, point.v / n};
    }

    void fillPatch(std::size_t p)
    {
        LodPatch& patch = _asset.patches[p];
        std::vector<std::vector<std::array<std::int32_t, 3>>> points;
        patch.latticeOrigin = _asset.baseVertices[patch.baseVertices[0]];
        for (std::size_t level = 0; level <= patch.finestLevel; ++level) {
            const unsigned factor = _asset.ladder[level];
            auto& ofLevel = points.emplace_back();
            for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
                ofLevel.push_back(quantized(_shape.surface(flat(p, weights(p, level, v)))));
                for (std::size_t k = 0; k < 3; ++k) {
                    patch.latticeOrigin[k] = std::min(patch.latticeOrigin[k], ofLevel.back()[k]);
                }
            }
        }
        for (std::size_t level = 0; level < points.size(); ++level) {
            for (std::uint32_t v = 0; v < points[level].size(); ++v) {
                std::array<std::int32_t, 3> offset = points[level][v];
                for (std::size_t k = 0; k < 3; ++k) {
                    offset[k] -= patch.latticeOrigin[k];
                    if (offset[k] > Lattice::kMaxOffset) { throw std::logic_error("synthetic patch is too large"); }
                }
                _asset.levels[level].vertices.push_back(
                    LodVertex::pack(offset, parent(patch, static_cast<std::uint32_t>(p), level, v)));
            }
            const double factor = _asset.ladder[level];
            const auto error = static_cast<float>(_shape.coarseError / (factor * factor));
            _asset.levels[level].errors.push_back({ViewError::isotropic(error), error, -1.0F});
        }
        bound(patch, points);
    }

    Point place(const std::array<std::int32_t, 3>& lattice) const
    {
        const double step = _asset.lattice.step;
        return {lattice[0] * step, lattice[1] * step, lattice[2] * step};
    }

    /// Sphere, cone and the asset's box around all levels. A morph lies between two levels, so the convex ones hold it.
    void bound(LodPatch& patch, const std::vector<std::vector<std::array<std::int32_t, 3>>>& points)
    {
        Point center{};
        Point axis{};
        for (const auto& lattice : points.back()) {
            for (std::size_t k = 0; k < 3; ++k) { center[k] += place(lattice)[k] / static_cast<double>(points.back().size()); }
        }
        double radius = 0.0;
        std::vector<Point> normals;
        for (std::size_t level = 0; level < points.size(); ++level) {
            for (const auto& lattice : points[level]) {
                const Point at = place(lattice);
                radius = std::max(radius, length(difference(at, center)));
                for (std::size_t k = 0; k < 3; ++k) {
                    _asset.boundsMin[k] = std::min(_asset.boundsMin[k], std::nextafter(static_cast<float>(at[k]), -1e30F));
                    _asset.boundsMax[k] = std::max(_asset.boundsMax[k], std::nextafter(static_cast<float>(at[k]), 1e30F));
                }
            }
            const TessellationPattern pattern(_asset.ladder[level]);
            for (const auto& t : pattern.triangles()) {
                const Point a = place(points[level][t[0]]);
                const Point n = cross(difference(place(points[level][t[1]]), a), difference(place(points[level][t[2]]), a));
                normals.push_back(normalized(n));
                for (std::size_t k = 0; k < 3; ++k) { axis[k] += n[k]; }
            }
        }
        axis = normalized(axis);
        double cosine = 1.0;
        for (const Point& n : normals) { cosine = std::min(cosine, dot(n, axis)); }
        for (std::size_t k = 0; k < 3; ++k) {
            patch.boundCenter[k] = static_cast<float>(center[k]);
            patch.coneAxis[k] = static_cast<float>(axis[k]);
        }
        patch.boundRadius = static_cast<float>(radius * 1.0001);
        for (std::size_t level = 0; level <= patch.finestLevel; ++level) {
            _asset.levels[level].errors.back().coneCosine = static_cast<float>(std::max(-1.0, cosine - 1e-4));
        }
    }

    Shape _shape;
    std::vector<std::uint8_t> _finest;
    bool _displaced;
    LodAsset _asset;
};

/// Ladder 1, 2, 4 … topFactor (a power of two).
inline std::vector<std::uint16_t> powersOfTwo(unsigned topFactor)
{
    std::vector<std::uint16_t> ladder;
    for (unsigned f = 1; f <= topFactor; f *= 2) { ladder.push_back(static_cast<std::uint16_t>(f)); }
    return ladder;
}

inline LodAsset build(const Shape& shape, const std::vector<std::uint16_t>& ladder, bool withNormals,
                      const std::vector<std::uint8_t>& finestLevels = {}, bool displaced = false)
{
    Builder builder(shape, ladder, finestLevels, displaced);
    if (withNormals) { builder.addNormals(); }
    return builder.take();
}

/// An octahedron blown up to a bumpy sphere of radius 0.95 to 1.05 about the origin; outside is counter-clockwise.
inline Shape bumpySphere()
{
    Shape shape;
    shape.base = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (std::uint32_t k = 0; k < 4; ++k) {
        const std::uint32_t next = (k + 1) % 4;
        shape.patches.push_back({k, next, 4});
        shape.patches.push_back({next, k, 5});
    }
    shape.surface = [](const Point& flat) {
        const Point p = normalized(flat);
        const double radius = 1.0 + 0.05 * std::sin(7.0 * p[0] + 0.3) * std::sin(6.0 * p[1] + 0.7) * std::cos(5.0 * p[2]);
        return Point{p[0] * radius, p[1] * radius, p[2] * radius};
    };
    shape.size = 1.1;
    shape.coarseError = 0.5;
    return shape;
}

/// quads × quads unit squares in the plane z = 0 from (0,0), each cut in two, with waves of height 0.1; up is outside.
inline Shape wavySheet(unsigned quads)
{
    Shape shape;
    const std::uint32_t row = quads + 1;
    for (std::uint32_t y = 0; y <= quads; ++y) {
        for (std::uint32_t x = 0; x <= quads; ++x) { shape.base.push_back({double(x), double(y), 0.0}); }
    }
    for (std::uint32_t y = 0; y < quads; ++y) {
        for (std::uint32_t x = 0; x < quads; ++x) {
            const std::uint32_t a = y * row + x;
            shape.patches.push_back({a, a + 1, a + row + 1});
            shape.patches.push_back({a, a + row + 1, a + row});
        }
    }
    shape.surface = [](const Point& p) {
        return Point{p[0], p[1], 0.1 * std::sin(2.5 * p[0] + 0.2) * std::cos(3.0 * p[1])};
    };
    shape.size = 1.05;
    shape.coarseError = 0.2;
    return shape;
}

} // namespace synthetic

/// A closed asset: 8 patches, 6 base vertices, 12 edges; levels 1, 2, 4 … topFactor (a power of two up to 64).
/// Its errors are plausible numbers (isotropic, a quarter from level to level), not measured ones.
inline LodAsset makeSyntheticAsset(unsigned topFactor = 16, bool withNormals = true)
{
    return synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(topFactor), withNormals);
}

/// makeSyntheticAsset with vertices that lie at other places of their patches than the pattern's (LodLevel::parameters).
inline LodAsset makeSyntheticDisplacedAsset(unsigned topFactor = 16, bool withNormals = true)
{
    return synthetic::build(synthetic::bumpySphere(), synthetic::powersOfTwo(topFactor), withNormals, {}, true);
}

/// An asset with a boundary: quads × quads squares of two patches each.
inline LodAsset makeSyntheticSheet(unsigned topFactor = 8, unsigned quads = 2, bool withNormals = true)
{
    return synthetic::build(synthetic::wavySheet(quads), synthetic::powersOfTwo(topFactor), withNormals);
}

/// The asset with its open borders as seams, at levels 0, 1, 2 … in turn.
inline LodAsset withSeams(LodAsset asset)
{
    unsigned next = 0;
    for (LodEdge& edge : asset.edges) {
        if (edge.patches[1] != kNoPatch) { continue; }
        edge.finestLevel = static_cast<std::uint8_t>(next++ % (edge.finestLevel + 1U));
        edge.coarsestLevel = edge.finestLevel;
    }
    return asset;
}

/// makeSyntheticAsset with every patch at another finest level than its neighbours: 0, 1, 2 … in turn.
inline LodAsset makeSyntheticMixedAsset(unsigned topFactor = 16, bool withNormals = false)
{
    const auto ladder = synthetic::powersOfTwo(topFactor);
    std::vector<std::uint8_t> finest;
    for (std::size_t p = 0; p < 8; ++p) { finest.push_back(static_cast<std::uint8_t>((3 * p + 1) % ladder.size())); }
    finest[3] = static_cast<std::uint8_t>(ladder.size() - 1);
    return synthetic::build(synthetic::bumpySphere(), ladder, withNormals, finest);
}

/// The asset with texture coordinates, which differ at every border as if it were a seam and are missing at some vertices, with
/// made-up errors of them, and with colours, which are a function of the place.
inline LodAsset withAttributes(LodAsset asset)
{
    const auto mixed = [](std::uint32_t h) {
        h = (h ^ h >> 16) * 0x7FEB352DU;
        h = (h ^ h >> 15) * 0x846CA68BU;
        return h ^ h >> 16;
    };
    asset.uvLattice = {{-0.25F, 0.5F}, {1.5F / UvLattice::kUnits, 0.75F / UvLattice::kUnits}};
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        LodLevel& level = asset.levels[l];
        const std::uint32_t count = TessellationPattern::vertexCount(asset.ladder[l]);
        const std::vector<std::uint32_t> slots = asset.levelSlots(l);
        level.uvErrors.assign(level.errors.size(), 0.5F / static_cast<float>(l + 1));
        for (std::uint32_t p = 0; p < slots.size(); ++p) {
            if (slots[p] == kNoPatch) { continue; }
            for (std::uint32_t v = 0; v < count; ++v) {
                const std::uint32_t h = mixed(p * 4001 + v * 17 + static_cast<std::uint32_t>(l));
                level.uvs.push_back(h % 7 == 0 ? UvLattice::kNone : (h & 0xFFFFU) % 65535 | (h >> 16) % 65535 << 16);
                const auto offset = level.vertices[slots[p] * std::size_t{count} + v].offset();
                std::uint32_t place = 0;
                for (std::size_t k = 0; k < 3; ++k) {
                    place = mixed(place ^ static_cast<std::uint32_t>(asset.patches[p].latticeOrigin[k] + offset[k]));
                }
                level.colors.push_back(place);
            }
        }
    }
    return asset;
}

/// 200 MB in memory, of normals that are all the same, and less than one in a file.
inline LodAsset makeSyntheticHeavyAsset()
{
    LodAsset asset = makeSyntheticSheet(1, 6, false);
    asset.normals.resolution = NormalTexture::kMaxResolution;
    for (std::uint32_t r = 1; r <= asset.normals.resolution; r *= 2) {
        asset.normals.levels.emplace_back(asset.patches.size() * NormalTexture::texelCount(r));
    }
    return asset;
}

} // namespace osgTessLOD
