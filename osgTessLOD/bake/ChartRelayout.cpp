// SPDX-License-Identifier: MIT
// William Tutte, "How to Draw a Graph", 1963: with the border convex and every inner vertex a positively weighted mean of
// its neighbours, no triangle is turned over. Michael Floater, "Mean value coordinates", CAGD 2003: weights that give a
// layout back. The pattern has no edge between two border vertices but the border's own, so that border vertices may lie on
// straight lines.
#include <osgTessLOD/bake/ChartRelayout.h>

#include <Eigen/SparseLU>

#include <cmath>
#include <stdexcept>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Point = StripLattice::Point;

Vector2d exact(ChartPoint p)
{
    return {p.u, p.v};
}

bool isInterior(const StripLattice& lattice, Point p)
{
    unsigned step = 0;
    return lattice.contains(p) && !lattice.isCorner(p) && lattice.sideOf(p, step) == 3;
}

bool isPositive(const StripLattice& lattice, const std::vector<ChartPoint>& parameters)
{
    for (std::uint32_t t = 0; t < lattice.triangleIndexCount(); ++t) {
        if (!lattice.hasTriangle(t)) { continue; }
        const auto c = lattice.corners(t);
        if (orientation(parameters[lattice.index(c[0])], parameters[lattice.index(c[1])],
                        parameters[lattice.index(c[2])]) <= 0) {
            return false;
        }
    }
    return true;
}

/// Mean value weights of an interior vertex' six neighbours; all 1 where its triangles are not all positive.
std::array<double, 6> weightsAround(const StripMesh::Patch& patch, Point center)
{
    std::array<double, 6> weights{};
    weights.fill(1.0);
    const ChartPoint middle = patch.parameters[patch.lattice.index(center)];
    std::array<Vector2d, 6> arms;
    for (unsigned i = 0; i < 6; ++i) {
        const ChartPoint a = patch.parameters[patch.lattice.index(center + StripLattice::kNeighbours[i])];
        const ChartPoint b = patch.parameters[patch.lattice.index(center + StripLattice::kNeighbours[(i + 1) % 6])];
        if (orientation(middle, a, b) <= 0) { return weights; }
        arms[i] = exact(a) - exact(middle);
    }
    std::array<double, 6> halfTangents{};
    for (unsigned i = 0; i < 6; ++i) {
        const Vector2d& a = arms[i];
        const Vector2d& b = arms[(i + 1) % 6];
        halfTangents[i] = std::tan(0.5 * std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)));
    }
    for (unsigned i = 0; i < 6; ++i) { weights[i] = (halfTangents[i] + halfTangents[(i + 5) % 6]) / arms[i].norm(); }
    return weights;
}

/// Every interior vertex as the weighted mean of its neighbours; `evenly`: with equal weights.
std::vector<ChartPoint> laidOut(const StripMesh::Patch& patch, bool evenly)
{
    const StripLattice& lattice = patch.lattice;
    std::vector<int> unknown(lattice.indexCount(), -1);
    int count = 0;
    for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
        if (isInterior(lattice, lattice.point(i))) { unknown[i] = count++; }
    }
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::Matrix<double, Eigen::Dynamic, 2> right = Eigen::Matrix<double, Eigen::Dynamic, 2>::Zero(count, 2);
    for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
        if (unknown[i] < 0) { continue; }
        std::array<double, 6> weights{1.0, 1.0, 1.0, 1.0, 1.0, 1.0};
        if (!evenly) { weights = weightsAround(patch, lattice.point(i)); }
        double sum = 0.0;
        for (const double w : weights) { sum += w; }
        entries.emplace_back(unknown[i], unknown[i], 1.0);
        for (unsigned n = 0; n < 6; ++n) {
            const std::uint32_t j = lattice.index(lattice.point(i) + StripLattice::kNeighbours[n]);
            if (unknown[j] >= 0) {
                entries.emplace_back(unknown[i], unknown[j], -weights[n] / sum);
            } else {
                right.row(unknown[i]) += weights[n] / sum * exact(patch.parameters[j]).transpose();
            }
        }
    }
    Eigen::SparseMatrix<double> system(count, count);
    system.setFromTriplets(entries.begin(), entries.end());
    Eigen::SparseLU<Eigen::SparseMatrix<double>> solver(system);
    if (solver.info() != Eigen::Success) { throw std::runtime_error("a patch cannot be laid out in its chart"); }
    const Eigen::Matrix<double, Eigen::Dynamic, 2> solution = solver.solve(right);
    std::vector<ChartPoint> result = patch.parameters;
    for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
        if (unknown[i] < 0) { continue; }
        result[i] = {static_cast<std::int32_t>(std::lround(solution(unknown[i], 0))),
                     static_cast<std::int32_t>(std::lround(solution(unknown[i], 1)))};
    }
    return result;
}

} // namespace

Eigen::Vector3d chartPosition(const TessellationPattern& pattern, const PatchChart& chart, ChartPoint parameter)
{
    constexpr double kUnit = 1.0 / ChartPoint::kUnits;
    const double u = parameter.u * kUnit, v = parameter.v * kUnit;
    const TessellationPattern::Location at = pattern.locate({1.0 - u - v, u, v});
    const auto& t = pattern.triangles()[at.triangle];
    return at.weights[0] * chart.positions[t[0]] + at.weights[1] * chart.positions[t[1]] +
           at.weights[2] * chart.positions[t[2]];
}

bool isLaidOut(const StripMesh& mesh, std::uint32_t p)
{
    return isPositive(mesh.patch(p).lattice, mesh.patch(p).parameters);
}

void relayout(StripMesh& mesh, std::uint32_t p, const TessellationPattern& chartPattern, const PatchChart& chart)
{
    const StripLattice lattice = mesh.patch(p).lattice;
    std::vector<ChartPoint> layout = laidOut(mesh.patch(p), false);
    if (!isPositive(lattice, layout)) { layout = laidOut(mesh.patch(p), true); }
    if (!isPositive(lattice, layout)) {
        throw std::runtime_error("a patch's layout is too fine for its chart's lattice");
    }
    for (std::uint32_t i = 0; i < lattice.indexCount(); ++i) {
        const StripMesh::Site vertex{p, lattice.point(i)};
        if (!lattice.contains(vertex.point) || layout[i] == mesh.parameter(vertex)) { continue; }
        const Eigen::Vector3d moved =
            chartPosition(chartPattern, chart, layout[i]) - chartPosition(chartPattern, chart, mesh.parameter(vertex));
        mesh.placeAlone(vertex, mesh.position(vertex) + moved, layout[i]);
    }
}

} // namespace osgTessLOD::bake
