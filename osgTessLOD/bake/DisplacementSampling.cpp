// SPDX-License-Identifier: MIT
// Yotam Livny, Gilad Bauman, Jihad El-Sana, "Displacement patches for view-dependent rendering", The Visual Computer, 2012, §3.7.
#include <osgTessLOD/bake/DisplacementSampling.h>

#include <osgTessLOD/bake/ElevationMap.h>

#include <tbb/parallel_for.h>

#include <array>
#include <cassert>
#include <cmath>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

/// Cells along each side of the lattice's triangles around a point.
constexpr unsigned kCells = 4;

/// A point near another one of the lattice, in steps, and how much it counts.
struct Tap {
    double i;
    double j;
    double weight;
};

/// The middles of the cells of the six triangles around a point.
std::vector<Tap> tapsAround()
{
    constexpr std::array<std::array<int, 2>, 6> kNeighbours{{{1, 0}, {0, 1}, {-1, 1}, {-1, 0}, {0, -1}, {1, -1}}};
    std::vector<Tap> taps;
    const auto add = [&](std::size_t sector, double a, double b) { // shares of the two neighbours
        const auto& first = kNeighbours[sector];
        const auto& second = kNeighbours[(sector + 1) % 6];
        taps.push_back({a * first[0] + b * second[0], a * first[1] + b * second[1], 1.0 - a - b});
    };
    for (std::size_t sector = 0; sector < 6; ++sector) {
        for (unsigned y = 0; y < kCells; ++y) {
            for (unsigned x = 0; x + y < kCells; ++x) {
                add(sector, (x + 1.0 / 3.0) / kCells, (y + 1.0 / 3.0) / kCells);
                if (x + y + 1 < kCells) { add(sector, (x + 2.0 / 3.0) / kCells, (y + 2.0 / 3.0) / kCells); }
            }
        }
    }
    return taps;
}

Vector3d mean(const Displacement& displacement, std::uint32_t patch, const TriangleLattice& lattice,
              const std::vector<Tap>& taps, double i, double j)
{
    Vector3d sum = Vector3d::Zero();
    double total = 0.0;
    for (const Tap& tap : taps) {
        sum += tap.weight * displacement(patch, lattice.weights(i + tap.i, j + tap.j));
        total += tap.weight;
    }
    return sum / total;
}

/// Lattice coordinates of the point `along` steps from corner `side` towards the next one.
std::array<unsigned, 2> onSide(unsigned steps, unsigned side, unsigned along)
{
    switch (side) {
    case 0: return {along, 0};
    case 1: return {steps - along, along};
    default: return {0, steps - along};
    }
}

/// The middles of cells along a side, from its point.
std::vector<Tap> tapsAlong(unsigned side)
{
    const std::array<unsigned, 2> first = onSide(1, side, 0);
    const std::array<unsigned, 2> last = onSide(1, side, 1);
    std::vector<Tap> taps;
    for (unsigned c = 0; c < 2 * kCells; ++c) {
        const double step = (c + 0.5) / kCells - 1.0;
        taps.push_back({step * (static_cast<double>(last[0]) - first[0]),
                        step * (static_cast<double>(last[1]) - first[1]), 1.0 - std::fabs(step)});
    }
    return taps;
}

/// Rounds of c += means − L c, L being the means of the triangles between the values c: its eigenvalues are 1/4 … 1 on triangles, 1/3 … 1
/// along a border, so what is left of the error is (3/4)^24 = 0.001.
constexpr unsigned kFitRounds = 24;

/// Fits the inner points of a border, whose ends are 0, to their means.
void fitBorder(std::vector<Vector3d>& values)
{
    const std::vector<Vector3d> means = values;
    for (unsigned round = 0; round < kFitRounds; ++round) {
        const std::vector<Vector3d> c = values;
        for (std::size_t i = 1; i + 1 < c.size(); ++i) {
            values[i] += means[i] - (2.0 / 3.0 * c[i] + 1.0 / 6.0 * (c[i - 1] + c[i + 1]));
        }
    }
}

/// Fits a patch's inner points to their means; its borders stay.
void fitInside(const TriangleLattice& lattice, std::vector<Vector3d>& values)
{
    const std::vector<Vector3d> means = values;
    for (unsigned round = 0; round < kFitRounds; ++round) {
        const std::vector<Vector3d> c = values;
        for (unsigned j = 1; j < lattice.steps; ++j) {
            for (unsigned i = 1; i + j < lattice.steps; ++i) {
                const Vector3d around = c[lattice.index(i + 1, j)] + c[lattice.index(i, j + 1)] +
                                        c[lattice.index(i - 1, j + 1)] + c[lattice.index(i - 1, j)] +
                                        c[lattice.index(i, j - 1)] + c[lattice.index(i + 1, j - 1)];
                const std::size_t at = lattice.index(i, j);
                values[at] += means[at] - (0.5 * c[at] + around / 12.0);
            }
        }
    }
}

} // namespace

Displacement displacementOf(const PatchMap& map, bool scalar)
{
    const double scale = map.frame().scale;
    if (scalar) {
        const auto* elevations = dynamic_cast<const ElevationMap*>(&map);
        assert(elevations != nullptr);
        return [elevations, scale](std::uint32_t patch, const Vector3d& b) {
            const RayPrism& prism = elevations->prism(patch);
            const Vector3d offset = elevations->evaluate(patch, b).position - prism.pointAt(b);
            const double length = prism.rayAt(b).norm();
            return Vector3d(length > 0.0 ? scale * prism.rayAt(b).dot(offset) / length : 0.0, 0.0, 0.0);
        };
    }
    std::vector<Vector3d> corners(map.topology().vertexCount);
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (unsigned k = 0; k < 3; ++k) {
            corners[map.topology().patches[p][k]] = map.evaluate(p, Vector3d::Unit(k)).position;
        }
    }
    return [&map, scale, corners](std::uint32_t patch, const Vector3d& b) {
        Vector3d flat = Vector3d::Zero();
        for (unsigned k = 0; k < 3; ++k) { flat += b[k] * corners[map.topology().patches[patch][k]]; }
        return Vector3d(scale * (map.evaluate(patch, b).position - flat));
    };
}

std::vector<std::vector<Vector3d>> sampleDisplacement(const PatchTopology& topology, const Displacement& displacement,
                                                      const TriangleLattice& lattice, DisplacementSampling sampling,
                                                      Progress& progress)
{
    const unsigned n = lattice.steps;
    const std::vector<Tap> one{{0.0, 0.0, 1.0}};
    const bool isMean = sampling != DisplacementSampling::Intersection;
    const bool isFit = sampling == DisplacementSampling::Fit;
    const std::vector<Tap> around = isMean ? tapsAround() : one;
    std::vector<std::vector<Vector3d>> samples(topology.patches.size(),
                                               std::vector<Vector3d>(lattice.size(), Vector3d::Zero()));
    progress.begin("displacement", samples.size(), "patches");
    tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t p) {
        for (unsigned j = 1; j < n; ++j) {
            for (unsigned i = 1; i + j < n; ++i) {
                samples[p][lattice.index(i, j)] =
                    mean(displacement, static_cast<std::uint32_t>(p), lattice, around, i, j);
            }
        }
        progress.step(1);
    });
    tbb::parallel_for(std::size_t{0}, topology.edges.size(), [&](std::size_t e) {
        const PatchTopology::Edge& edge = topology.edges[e];
        const std::vector<Tap> along = isMean ? tapsAlong(edge.sides[0]) : one;
        std::vector<Vector3d> border(n + 1, Vector3d::Zero());
        for (unsigned step = 1; step < n; ++step) {
            const auto own = onSide(n, edge.sides[0], step);
            border[step] = mean(displacement, edge.patches[0], lattice, along, own[0], own[1]);
        }
        if (isFit) { fitBorder(border); }
        for (unsigned step = 1; step < n; ++step) {
            const auto own = onSide(n, edge.sides[0], step);
            samples[edge.patches[0]][lattice.index(own[0], own[1])] = border[step];
            if (edge.patches[1] == kNoPatch) { continue; }
            const auto other = onSide(n, edge.sides[1], n - step);
            samples[edge.patches[1]][lattice.index(other[0], other[1])] = border[step];
        }
    });
    if (isFit) {
        tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t p) { fitInside(lattice, samples[p]); });
    }
    progress.end();
    return samples;
}

} // namespace osgTessLOD::bake
