// SPDX-License-Identifier: MIT
// C. Bradford Barber, David P. Dobkin, Hannu Huhdanpaa, "The quickhull algorithm for convex hulls", 1996, on ±v.
#include <osgTessLOD/bake/SymmetricHull.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;
using Index = std::uint32_t;

constexpr Index kNone = std::numeric_limits<Index>::max();
/// A set narrower than this, relative to its longest vector, counts as flat.
constexpr double kFlat = 1e-13;
/// Points this little above a facet belong to it; in the hull's own coordinates, where it is about one wide.
constexpr double kOnFacet = 1e-12;

/// Three vectors of the set that span it: the longest, the furthest from its line, the furthest from both's plane. In
/// coordinates of this basis the hull holds the unit octahedron and is at most a few units wide, however flat it was.
struct SpanningBasis {
    unsigned rank = 0;
    std::array<Index, 3> indices{};
    Eigen::Matrix3d frame = Eigen::Matrix3d::Zero();         ///< rows: orthogonal, over the extent of the set along each
    Eigen::Matrix3d triangular = Eigen::Matrix3d::Identity(); ///< the three vectors in that frame
};

template <typename Measure>
Index argMax(std::size_t count, Measure&& measure)
{
    Index best = 0;
    double largest = -1.0;
    for (Index i = 0; i < count; ++i) {
        const double value = measure(i);
        if (value > largest) {
            largest = value;
            best = i;
        }
    }
    return best;
}

SpanningBasis spanningBasis(const std::vector<Vector3d>& v)
{
    SpanningBasis basis;
    const auto use = [&](Index i, const Vector3d& direction) {
        const unsigned k = basis.rank++;
        basis.indices[k] = i;
        basis.frame.row(k) = direction / v[i].dot(direction);
        basis.triangular.col(k).head(k) = basis.frame.topRows(k) * v[i];
    };
    const Index longest = argMax(v.size(), [&](Index i) { return v[i].squaredNorm(); });
    const double length = v[longest].norm();
    const Vector3d axis = v[longest] / length;
    use(longest, axis);

    const auto aside = [&](const Vector3d& p) -> Vector3d { return p - p.dot(axis) * axis; };
    const Index second = argMax(v.size(), [&](Index i) { return aside(v[i]).squaredNorm(); });
    const Vector3d across = aside(v[second]);
    if (!(across.norm() > kFlat * length)) { return basis; }
    const Vector3d acrossAxis = aside(across.normalized()).normalized(); // twice, as the first time much cancels
    use(second, acrossAxis);

    const Vector3d normal = axis.cross(acrossAxis).normalized();
    const Index third = argMax(v.size(), [&](Index i) { return std::fabs(v[i].dot(normal)); });
    if (std::fabs(v[third].dot(normal)) > kFlat * length) { use(third, normal); }
    return basis;
}

/// Convex hull of points and their negatives in the plane of the first two coordinates, by Andrew's monotone chain.
std::vector<Index> planarHull(const std::vector<Vector3d>& points)
{
    struct Signed {
        double x, y;
        Index index;
    };
    std::vector<Signed> sorted;
    for (Index i = 0; i < points.size(); ++i) {
        if (points[i].head<2>().lpNorm<1>() < 1.0 - kOnFacet) { continue; } // inside the rhombus of the basis
        sorted.push_back({points[i].x(), points[i].y(), i});
        sorted.push_back({-points[i].x(), -points[i].y(), i});
    }
    std::sort(sorted.begin(), sorted.end(), [](const Signed& a, const Signed& b) {
        return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.index < b.index;
    });
    // One half of the boundary has one of each pair, and both ends.
    std::vector<Signed> chain;
    for (const Signed& p : sorted) {
        while (chain.size() >= 2) {
            const Signed& a = chain[chain.size() - 2];
            const Signed& b = chain.back();
            if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0.0) { break; }
            chain.pop_back();
        }
        chain.push_back(p);
    }
    chain.pop_back();
    std::vector<Index> hull;
    for (const Signed& p : chain) { hull.push_back(p.index); }
    return hull;
}

/// Quickhull of ±points, begun with the unit octahedron, whose corners are points.
/// A signed point is 2·index, plus 1 for the negative.
class Quickhull {
public:
    Quickhull(const std::vector<Vector3d>& points, const std::array<Index, 3>& corners)
        : _points(points)
    {
        // Facet f of the octahedron has its bits 0, 1, 2 set where x, y, z are negative.
        for (Index f = 0; f < 8; ++f) {
            const bool mirrored = ((f ^ (f >> 1) ^ (f >> 2)) & 1U) != 0;
            std::array<Index, 3> axes{0, mirrored ? 2U : 1U, mirrored ? 1U : 2U};
            Facet facet;
            for (std::size_t k = 0; k < 3; ++k) {
                facet.vertices[k] = 2 * corners[axes[k]] + ((f >> axes[k]) & 1U);
                facet.neighbours[k] = f ^ (1U << axes[(k + 2) % 3]); // the edge from axis k to k + 1 leaves the third out
            }
            _facets.push_back(facet);
            setPlane(_facets.back());
        }
        for (Index i = 0; i < points.size(); ++i) {
            if (points[i].lpNorm<1>() <= 1.0 + kOnFacet) { continue; }
            const Vector3d& p = points[i];
            const Index octant = (p.x() < 0.0 ? 1U : 0U) | (p.y() < 0.0 ? 2U : 0U) | (p.z() < 0.0 ? 4U : 0U);
            _facets[octant].outside.push_back(2 * i);
            _facets[octant ^ 7U].outside.push_back(2 * i + 1);
        }
    }

    /// Indices of points, each once: the hull's vertices, and what was not proven inside when rounding ended the search.
    std::vector<Index> run()
    {
        for (Index f = 0; f < _facets.size(); ++f) {
            if (!_facets[f].dead && !_facets[f].outside.empty() && !extend(f)) { break; }
        }
        std::vector<Index> kept;
        for (const Facet& facet : _facets) {
            if (facet.dead) { continue; }
            for (const Index vertex : facet.vertices) { kept.push_back(vertex / 2); }
            for (const Index point : facet.outside) { kept.push_back(point / 2); }
        }
        return kept;
    }

private:
    struct Facet {
        std::array<Index, 3> vertices{};
        std::array<Index, 3> neighbours{}; ///< across the edge from vertex k to k + 1
        Vector3d normal = Vector3d::Zero();
        double offset = 0.0;
        std::vector<Index> outside;        ///< signed points above this facet
        bool dead = false;
        bool visible = false;
    };
    struct HorizonEdge {
        Index from, to, beyond; ///< beyond: the facet on the far side
    };

    Vector3d at(Index signedPoint) const
    {
        return (signedPoint & 1U) != 0 ? Vector3d(-_points[signedPoint / 2]) : _points[signedPoint / 2];
    }
    double above(const Facet& facet, const Vector3d& p) const { return facet.normal.dot(p) - facet.offset; }

    bool setPlane(Facet& facet) const
    {
        const Vector3d a = at(facet.vertices[0]);
        const Vector3d cross = (at(facet.vertices[1]) - a).cross(at(facet.vertices[2]) - a);
        const double norm = cross.norm();
        facet.normal = cross / norm;
        facet.offset = facet.normal.dot(a);
        // The octahedron is inside, so every facet lies off the origin.
        return norm > kOnFacet * kOnFacet && facet.offset > 0.1;
    }

    /// Replaces what the furthest point above facet f sees by a cone from it. False, with the hull as it was, if rounding
    /// spoils the horizon.
    bool extend(Index f)
    {
        const std::vector<Index>& candidates = _facets[f].outside;
        const Index apex =
            candidates[argMax(candidates.size(), [&](Index i) { return above(_facets[f], at(candidates[i])); })];
        std::vector<Index> visible;
        std::vector<HorizonEdge> horizon;
        findHorizon(f, at(apex), visible, horizon);
        std::vector<Facet> cone;
        const bool sound = orderHorizon(horizon) && makeCone(apex, horizon, cone);
        for (const Index old : visible) { _facets[old].visible = false; }
        if (!sound) { return false; }

        const auto first = static_cast<Index>(_facets.size());
        const auto count = static_cast<Index>(cone.size());
        for (Index k = 0; k < count; ++k) {
            cone[k].neighbours = {horizon[k].beyond, first + (k + 1) % count, first + (k + count - 1) % count};
            auto& back = _facets[horizon[k].beyond];
            for (std::size_t e = 0; e < 3; ++e) {
                if (back.vertices[e] == horizon[k].to) { back.neighbours[e] = first + k; }
            }
        }
        for (const Index old : visible) {
            _facets[old].dead = true;
            for (const Index point : _facets[old].outside) { assign(point, apex, cone); }
            std::vector<Index>().swap(_facets[old].outside);
        }
        _facets.insert(_facets.end(), std::make_move_iterator(cone.begin()), std::make_move_iterator(cone.end()));
        return true;
    }

    void findHorizon(Index f, const Vector3d& apex, std::vector<Index>& visible, std::vector<HorizonEdge>& horizon)
    {
        visible.push_back(f);
        _facets[f].visible = true;
        for (std::size_t next = 0; next < visible.size(); ++next) {
            for (std::size_t k = 0; k < 3; ++k) {
                const Facet& facet = _facets[visible[next]];
                const Index neighbour = facet.neighbours[k];
                if (_facets[neighbour].visible) { continue; }
                if (above(_facets[neighbour], apex) > kOnFacet) {
                    _facets[neighbour].visible = true;
                    visible.push_back(neighbour);
                }
            }
        }
        for (const Index v : visible) {
            const Facet& facet = _facets[v];
            for (std::size_t k = 0; k < 3; ++k) {
                if (_facets[facet.neighbours[k]].visible) { continue; }
                horizon.push_back({facet.vertices[k], facet.vertices[(k + 1) % 3], facet.neighbours[k]});
            }
        }
    }

    /// Puts the edges one after the other; false if they are not one closed line.
    static bool orderHorizon(std::vector<HorizonEdge>& horizon)
    {
        for (std::size_t k = 0; k + 1 < horizon.size(); ++k) {
            const auto next = std::find_if(horizon.begin() + static_cast<std::ptrdiff_t>(k) + 1, horizon.end(),
                                           [&](const HorizonEdge& e) { return e.from == horizon[k].to; });
            if (next == horizon.end()) { return false; }
            std::swap(horizon[k + 1], *next);
        }
        return horizon.size() >= 3 && horizon.back().to == horizon.front().from;
    }

    bool makeCone(Index apex, const std::vector<HorizonEdge>& horizon, std::vector<Facet>& cone) const
    {
        for (const HorizonEdge& edge : horizon) {
            Facet facet;
            facet.vertices = {edge.from, edge.to, apex};
            if (!setPlane(facet)) { return false; }
            cone.push_back(std::move(facet));
        }
        return true;
    }

    void assign(Index point, Index apex, std::vector<Facet>& cone) const
    {
        if (point == apex) { return; }
        const Vector3d p = at(point);
        for (Facet& facet : cone) {
            if (above(facet, p) > kOnFacet) {
                facet.outside.push_back(point);
                return;
            }
        }
    }

    const std::vector<Vector3d>& _points;
    std::vector<Facet> _facets;
};

} // namespace

std::vector<Vector3d> symmetricHull(const std::vector<Vector3d>& vectors)
{
    double largest = 0.0;
    for (const Vector3d& v : vectors) { largest = std::max(largest, v.cwiseAbs().maxCoeff()); }
    if (!(largest > 0.0)) { return {}; }

    std::vector<Vector3d> points(vectors.size());
    for (std::size_t i = 0; i < points.size(); ++i) { points[i] = vectors[i] / largest; }
    const SpanningBasis basis = spanningBasis(points);
    if (basis.rank == 1) { return {vectors[basis.indices[0]]}; }

    const auto toVectors = basis.triangular.triangularView<Eigen::UnitUpper>();
    for (Vector3d& p : points) { p = toVectors.solve(basis.frame * p); }
    std::vector<Index> kept;
    if (basis.rank == 2) {
        kept = planarHull(points);
    } else {
        // Exactly the octahedron's corners: rounding must not tilt its facets.
        for (unsigned k = 0; k < 3; ++k) { points[basis.indices[k]] = Vector3d::Unit(k); }
        kept = Quickhull(points, basis.indices).run();
    }
    std::sort(kept.begin(), kept.end());
    kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    std::vector<Vector3d> hull;
    for (const Index i : kept) { hull.push_back(vectors[i]); }
    return hull;
}

} // namespace osgTessLOD::bake
