// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.7. The normal equations join vertices that share
// an edge and are as well conditioned as a mass matrix: conjugate gradients with the diagonal as preconditioner.
#include <osgTessLOD/bake/Refit.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/SymmetricHull.h>
#include <osgTessLOD/bake/WorkTime.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;
using Positions = std::vector<Vector3d>;

constexpr Eigen::Index kDirections = 200;
constexpr unsigned kMostIterations = 500;
/// So many passes may be no better than the best before the refit ends: the first of a new exponent often is worse.
constexpr unsigned kPatience = 3;
/// Rows of overlays that are kept from pass to pass, 0.8 GB of them; those of further patches are made anew every time.
constexpr std::size_t kMostKeptRows = 10'000'000;

/// Numbers the vertices of all patches, what they share once: base vertices first, then borders, then insides.
class SharedVertices {
public:
    SharedVertices(const PatchTopology& topology, unsigned factor)
        : _baseVertices(topology.vertexCount)
        , _ofPatch(topology.patches.size(), std::vector<std::uint32_t>(TessellationPattern::vertexCount(factor)))
    {
        for (std::size_t p = 0; p < _ofPatch.size(); ++p) {
            for (unsigned k = 0; k < 3; ++k) { _ofPatch[p][k * factor] = topology.patches[p][k]; }
        }
        _count = _baseVertices;
        _isOnSeam.assign(_baseVertices + topology.edges.size() * (factor - 1), 0);
        for (const PatchTopology::Edge& edge : topology.edges) {
            if (edge.seamFactor != 0) {
                for (const std::uint32_t end : edge.vertices) { _isOnSeam[end] = 1; }
                std::fill_n(_isOnSeam.begin() + _count, factor - 1, 1);
            }
            for (unsigned step = 1; step < factor; ++step, ++_count) {
                for (unsigned which = 0; which < 2; ++which) {
                    if (edge.patches[which] == kNoPatch) { continue; }
                    _ofPatch[edge.patches[which]][borderVertex(edge, which, factor, step)] = _count;
                }
            }
        }
        for (auto& vertices : _ofPatch) {
            for (std::size_t v = TessellationPattern::borderVertexCount(factor); v < vertices.size(); ++v) {
                vertices[v] = _count++;
            }
        }
    }

    std::uint32_t count() const { return _count; }
    std::uint32_t baseVertexCount() const { return _baseVertices; }
    bool isOnSeam(std::size_t vertex) const { return vertex < _isOnSeam.size() && _isOnSeam[vertex] != 0; }
    const std::vector<std::uint32_t>& ofPatch(std::size_t p) const { return _ofPatch[p]; }

    Positions gather(const std::vector<Positions>& positions) const
    {
        Positions shared(_count, Vector3d::Zero());
        for (std::size_t p = 0; p < _ofPatch.size(); ++p) {
            for (std::size_t v = 0; v < _ofPatch[p].size(); ++v) { shared[_ofPatch[p][v]] = positions[p][v]; }
        }
        return shared;
    }

    Positions scatter(std::size_t p, const Positions& shared) const
    {
        Positions positions;
        positions.reserve(_ofPatch[p].size());
        for (const std::uint32_t v : _ofPatch[p]) { positions.push_back(shared[v]); }
        return positions;
    }

private:
    std::uint32_t _baseVertices;
    std::uint32_t _count = 0;
    std::vector<char> _isOnSeam; ///< of base vertices and those of borders
    std::vector<std::vector<std::uint32_t>> _ofPatch;
};

/// One patch's part of CᵀWC and CᵀWP: a diagonal, a number per edge of the pattern, a right side.
struct NormalEquations {
    std::vector<double> diagonal;
    std::vector<double> edges;
    Positions right;
    double meanError = 0.0; ///< E over all directions, of the positions they were made from
};

class Refitting {
public:
    Refitting(const PatchTopology& topology, const ChartSet& charts, unsigned factor,
              const std::vector<std::vector<ChartPoint>>& parameters, const RefitOptions& options)
        : _charts(charts)
        , _parameters(parameters)
        , _options(options)
        , _vertices(topology, factor)
        , _pattern(Triangulation::ofPattern(factor))
        , _chart(Triangulation::ofPattern(charts.factor))
        , _chartPoints(patternPoints(charts.factor))
        , _equations(topology.patches.size())
        , _kept(topology.patches.size())
    {
        const std::vector<ChartPoint> places = patternPoints(factor);
        _atPlaces.emplace(PlacedTriangulation{_pattern, places}, PlacedTriangulation{_chart, _chartPoints});
        _edgeOf.resize(_pattern.triangles().size());
        for (std::uint32_t e = 0; e < _pattern.edges().size(); ++e) {
            for (const std::uint32_t t : _pattern.edges()[e].triangles) {
                if (t == Triangulation::kNone) { continue; }
                // Edge k of a triangle lies across from corner k + 2.
                for (unsigned k = 0; k < 3; ++k) {
                    const auto& corners = _pattern.triangles()[t];
                    const auto [a, b] = std::minmax(corners[k], corners[(k + 1) % 3]);
                    const auto [c, d] = std::minmax(_pattern.edges()[e].vertices[0], _pattern.edges()[e].vertices[1]);
                    if (a == c && b == d) { _edgeOf[t][k] = e; }
                }
            }
        }
    }

    RefitResult run(std::vector<Positions>& positions)
    {
        Positions current = _vertices.gather(positions);
        Positions best;
        RefitResult result;
        double exponent = 0.0;
        result.errorBefore = result.errorAfter = assemble(current, exponent);
        for (unsigned pass = 1; pass <= std::min(_options.mostPasses, result.passes + kPatience); ++pass) {
            approach(_time.measure([&] { return solve(current); }), exponent, current);
            exponent = std::clamp(2.0 * exponent, 1.0, _options.largestExponent);
            const double error = assemble(current, exponent);
            if (error < result.errorAfter) {
                best = current;
                result.errorAfter = error;
                result.passes = pass;
            }
        }
        if (result.passes > 0) {
            for (std::size_t p = 0; p < positions.size(); ++p) { positions[p] = _vertices.scatter(p, best); }
        }
        result.seconds = _time.seconds();
        result.overlaySeconds = _overlayTime.seconds();
        return result;
    }

private:
    /// Moves `positions` towards the solution of a pass with weights of this exponent: the part of the way that Newton's
    /// method would go for the p-norm, p = exponent + 2, twice that while p is small.
    static void approach(const Positions& solution, double exponent, Positions& positions)
    {
        const double part = std::min(1.0, 2.0 / (exponent + 1.0));
        for (std::size_t v = 0; v < positions.size(); ++v) { positions[v] += part * (solution[v] - positions[v]); }
    }

    /// Makes all patches' equations, with weights by the vectors at these positions: eq. 4.8 with the ratio to this power, or
    /// all one if it is 0. Returns the mean error at these positions.
    double assemble(const Positions& shared, double exponent)
    {
        tbb::parallel_for(std::size_t{0}, _equations.size(), [&](std::size_t p) {
            _time.measure([&] { assemblePatch(p, _vertices.scatter(p, shared), exponent); });
        });
        double sum = 0.0;
        for (const NormalEquations& equations : _equations) { sum += equations.meanError; }
        return sum / static_cast<double>(std::max<std::size_t>(_equations.size(), 1));
    }

    void assemblePatch(std::size_t p, const Positions& positions, double exponent)
    {
        if (_parameters[p].empty()) { return assemblePatch(*_atPlaces, p, positions, exponent); }
        if (_kept[p]) { return assemblePatch(*_kept[p], p, positions, exponent); }
        auto differences = _overlayTime.measure([&] {
            return std::make_unique<DifferenceVectors>(PlacedTriangulation{_pattern, _parameters[p]},
                                                       PlacedTriangulation{_chart, _chartPoints});
        });
        assemblePatch(*differences, p, positions, exponent);
        if ((_keptRows += differences->rows().size()) <= kMostKeptRows) { _kept[p] = std::move(differences); }
    }

    void assemblePatch(const DifferenceVectors& differences, std::size_t p, const Positions& positions, double exponent)
    {
        static const Directions directions = sphericalFibonacci(kDirections);
        const Positions& chart = _charts.charts[p].positions;
        Positions vectors;
        differences.evaluate(chart, positions, vectors);
        const Positions hull = symmetricHull(vectors);
        double longest = 0.0;
        for (const Vector3d& v : hull) { longest = std::max(longest, v.norm()); }

        NormalEquations& equations = _equations[p];
        equations.meanError = squaredErrors(hull, directions).max(0.0).sqrt().mean();
        equations.diagonal.assign(_pattern.vertexCount(), 0.0);
        equations.edges.assign(_pattern.edges().size(), 0.0);
        equations.right.assign(_pattern.vertexCount(), Vector3d::Zero());
        const auto& rows = differences.rows();
        for (std::size_t i = 0; i < rows.size(); ++i) {
            const DifferenceVectors::Row& row = rows[i];
            const double weight = exponent == 0.0 || !(longest > 0.0)
                                      ? 1.0
                                      : _options.leastWeight + std::pow(vectors[i].norm() / longest, exponent);
            const Vector3d target = row.chartWeights[0] * chart[row.chartVertices[0]] +
                                    row.chartWeights[1] * chart[row.chartVertices[1]] +
                                    row.chartWeights[2] * chart[row.chartVertices[2]];
            for (unsigned k = 0; k < 3; ++k) {
                const double own = weight * row.levelWeights[k];
                if (own == 0.0) { continue; }
                equations.diagonal[row.levelVertices[k]] += own * row.levelWeights[k];
                equations.right[row.levelVertices[k]] += own * target;
                equations.edges[_edgeOf[row.levelTriangle][k]] += own * row.levelWeights[(k + 1) % 3];
            }
        }
    }

    /// Sums up over the patches, in their order: the same on any number of threads.
    template <typename Value, typename PerPatch>
    std::vector<Value> sum(const Value& zero, PerPatch&& perPatch) const
    {
        std::vector<std::vector<Value>> parts(_equations.size());
        tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t p) { parts[p] = perPatch(p); });
        std::vector<Value> total(_vertices.count(), zero);
        for (std::size_t p = 0; p < parts.size(); ++p) {
            const auto& vertices = _vertices.ofPatch(p);
            for (std::size_t v = 0; v < vertices.size(); ++v) { total[vertices[v]] += parts[p][v]; }
        }
        return total;
    }

    Positions multiply(const Positions& shared) const
    {
        return sum<Vector3d>(Vector3d::Zero(), [&](std::size_t p) {
            const NormalEquations& equations = _equations[p];
            const auto& vertices = _vertices.ofPatch(p);
            Positions product(vertices.size());
            for (std::size_t v = 0; v < product.size(); ++v) { product[v] = equations.diagonal[v] * shared[vertices[v]]; }
            for (std::size_t e = 0; e < equations.edges.size(); ++e) {
                const auto [a, b] = _pattern.edges()[e].vertices;
                product[a] += equations.edges[e] * shared[vertices[b]];
                product[b] += equations.edges[e] * shared[vertices[a]];
            }
            return product;
        });
    }

    bool isFixed(std::size_t vertex) const
    {
        return _vertices.isOnSeam(vertex) || (!_options.moveCorners && vertex < _vertices.baseVertexCount());
    }

    /// Solves the equations by conjugate gradients from `start`, whose fixed vertices stay.
    Positions solve(const Positions& start) const
    {
        const auto diagonal = sum<double>(0.0, [&](std::size_t p) { return _equations[p].diagonal; });
        Positions residual = sum<Vector3d>(Vector3d::Zero(), [&](std::size_t p) { return _equations[p].right; });
        const Vector3d scale = dot(residual, residual, diagonal);
        const Positions product = multiply(start);
        for (std::size_t v = 0; v < residual.size(); ++v) {
            residual[v] = isFixed(v) || !(diagonal[v] > 0.0) ? Vector3d::Zero() : Vector3d(residual[v] - product[v]);
        }
        Positions x = start;
        Positions direction(x.size());
        for (std::size_t v = 0; v < x.size(); ++v) { direction[v] = divided(residual[v], diagonal[v]); }
        Vector3d energy = dot(residual, residual, diagonal);
        for (unsigned iteration = 0; iteration < kMostIterations; ++iteration) {
            if ((energy.array() <= _options.tolerance * _options.tolerance * scale.maxCoeff()).all()) { break; }
            Positions image = multiply(direction);
            Vector3d curvature = Vector3d::Zero();
            for (std::size_t v = 0; v < x.size(); ++v) {
                if (isFixed(v)) { image[v].setZero(); }
                curvature += direction[v].cwiseProduct(image[v]);
            }
            // The three coordinates are three systems with one matrix.
            const Vector3d length = quotient(energy, curvature);
            for (std::size_t v = 0; v < x.size(); ++v) {
                x[v] += length.cwiseProduct(direction[v]);
                residual[v] -= length.cwiseProduct(image[v]);
            }
            const Vector3d next = dot(residual, residual, diagonal);
            const Vector3d ratio = quotient(next, energy);
            for (std::size_t v = 0; v < x.size(); ++v) {
                direction[v] = divided(residual[v], diagonal[v]) + ratio.cwiseProduct(direction[v]);
            }
            energy = next;
        }
        return x;
    }

    static Vector3d divided(const Vector3d& value, double by) { return by > 0.0 ? Vector3d(value / by) : Vector3d::Zero(); }

    static Vector3d quotient(const Vector3d& a, const Vector3d& b)
    {
        return (b.array() > 0.0).select(a.array() / b.array(), 0.0);
    }

    /// a · b over the diagonal, per coordinate.
    static Vector3d dot(const Positions& a, const Positions& b, const std::vector<double>& diagonal)
    {
        Vector3d total = Vector3d::Zero();
        for (std::size_t v = 0; v < a.size(); ++v) { total += divided(a[v].cwiseProduct(b[v]), diagonal[v]); }
        return total;
    }

    const ChartSet& _charts;
    const std::vector<std::vector<ChartPoint>>& _parameters;
    const RefitOptions& _options;
    SharedVertices _vertices;
    Triangulation _pattern;
    Triangulation _chart;
    std::vector<ChartPoint> _chartPoints;
    std::optional<DifferenceVectors> _atPlaces;
    std::vector<std::array<std::uint32_t, 3>> _edgeOf; ///< per triangle: the edge from corner k to corner k + 1
    std::vector<NormalEquations> _equations;
    std::vector<std::unique_ptr<DifferenceVectors>> _kept; ///< per patch, as far as there is room
    std::atomic<std::size_t> _keptRows{0};
    WorkTime _time;
    WorkTime _overlayTime;
};

} // namespace

RefitResult refit(const PatchTopology& topology, const ChartSet& charts, unsigned factor,
                  const std::vector<std::vector<ChartPoint>>& parameters, const RefitOptions& options,
                  std::vector<Positions>& positions)
{
    return Refitting(topology, charts, factor, parameters, options).run(positions);
}

} // namespace osgTessLOD::bake
