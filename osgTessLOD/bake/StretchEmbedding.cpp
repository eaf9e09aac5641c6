// SPDX-License-Identifier: MIT
// William Tutte, "How to Draw a Graph", 1963. Michael Floater, "Mean value coordinates", CAGD 2003.
// Shin Yoshizawa, Alexander Belyaev, Hans-Peter Seidel, "A fast and simple stretch-minimizing mesh parameterization", SMI 2004.
#include <osgTessLOD/bake/StretchEmbedding.h>

#include <osgTessLOD/bake/PlaneTriangle.h>

#include <Eigen/Geometry>
#include <Eigen/SparseLU>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Plane = std::vector<Vector2d>;

constexpr int kMostRounds = 24;
/// Energies less than this much lower are not worth a further round.
constexpr double kWorthwhile = 0.99;
/// Rounds in a row that may fail to lower the energy.
constexpr int kPatience = 3;
/// Half angles are cut off here: their tangents, the weights, stay below 15.
constexpr double kLargestHalfAngle = 1.5;
/// Limits of how densely a part of a patch is sampled compared with the rest.
constexpr double kLeastDensity = 0.7;
constexpr double kMostDensity = 4.0;
/// A vertex' stretch changes its neighbours' weights by no more than this factor in one round.
constexpr double kLargestChange = 8.0;

bool isPositive(const DiscMesh& mesh, const Plane& plane)
{
    return std::all_of(mesh.triangles.begin(), mesh.triangles.end(),
                       [&](const auto& t) { return twiceArea(plane[t[0]], plane[t[1]], plane[t[2]]) > 0.0; });
}

/// A directed edge's share of a mean value weight: vertex → neighbour, as seen from one triangle.
struct WeightedEdge {
    std::uint32_t vertex;
    std::uint32_t neighbour;
    double weight;
};

std::vector<WeightedEdge> meanValueWeights(const DiscMesh& mesh)
{
    double longest = 0.0;
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            longest = std::max(longest, (mesh.positions[t[k]] - mesh.positions[t[(k + 1) % 3]]).norm());
        }
    }
    const double shortest = std::max(1e-6 * longest, std::numeric_limits<double>::min());
    std::vector<WeightedEdge> weights;
    weights.reserve(6 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t i = t[k];
            if (mesh.isFixed[i] != 0) { continue; }
            const Vector3d a = mesh.positions[t[(k + 1) % 3]] - mesh.positions[i];
            const Vector3d b = mesh.positions[t[(k + 2) % 3]] - mesh.positions[i];
            const double half = std::clamp(0.5 * std::atan2(a.cross(b).norm(), a.dot(b)), 1e-3, kLargestHalfAngle);
            const double tangent = std::tan(half);
            weights.push_back({i, t[(k + 1) % 3], tangent / std::max(a.norm(), shortest)});
            weights.push_back({i, t[(k + 2) % 3], tangent / std::max(b.norm(), shortest)});
        }
    }
    return weights;
}

/// The free vertices as weighted means of their neighbours.
class MeanSolver {
public:
    explicit MeanSolver(const DiscMesh& mesh)
        : _mesh(mesh)
        , _unknown(mesh.positions.size(), -1)
    {
        for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
            if (mesh.isFixed[v] == 0) { _unknown[v] = _count++; }
        }
    }

    bool solve(const std::vector<WeightedEdge>& weights, Plane& plane)
    {
        std::vector<Eigen::Triplet<double>> entries;
        entries.reserve(2 * weights.size());
        Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(_count, 2);
        std::vector<double> sum(_mesh.positions.size(), 0.0);
        for (const WeightedEdge& e : weights) { sum[e.vertex] += e.weight; }
        for (const WeightedEdge& e : weights) {
            const int row = _unknown[e.vertex];
            const double weight = e.weight / sum[e.vertex];
            entries.emplace_back(row, row, weight);
            if (_unknown[e.neighbour] >= 0) {
                entries.emplace_back(row, _unknown[e.neighbour], -weight);
            } else {
                right.row(row) += weight * plane[e.neighbour].transpose();
            }
        }
        Eigen::SparseMatrix<double> matrix(_count, _count);
        matrix.setFromTriplets(entries.begin(), entries.end());
        if (!_analyzed) {
            _factors.analyzePattern(matrix);
            _analyzed = true;
        }
        _factors.factorize(matrix);
        if (_factors.info() != Eigen::Success) { return false; }
        const Eigen::MatrixX2d solution = _factors.solve(right);
        for (std::size_t v = 0; v < plane.size(); ++v) {
            if (_unknown[v] >= 0) { plane[v] = solution.row(_unknown[v]).transpose(); }
        }
        return solution.allFinite();
    }

private:
    const DiscMesh& _mesh;
    std::vector<int> _unknown;
    int _count = 0;
    Eigen::SparseLU<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> _factors;
    bool _analyzed = false;
};

/// How densely each vertex' surroundings are to be sampled, compared with the rest: the error of linear pieces of size h
/// where the curvature is κ goes with κ·h², so h should go with 1/√κ. Averaged over neighbours, within limits.
std::vector<double> wantedDensity(const DiscMesh& mesh)
{
    const std::size_t count = mesh.positions.size();
    std::vector<Vector3d> normals(count, Vector3d::Zero());
    std::vector<Vector3d> faceNormals;
    for (const auto& t : mesh.triangles) {
        const Vector3d& a = mesh.positions[t[0]];
        faceNormals.push_back((mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a));
        for (const std::uint32_t v : t) { normals[v] += faceNormals.back(); }
    }
    const auto averaged = [&](const auto& valueAtCorner) {
        std::vector<double> sum(count, 0.0);
        std::vector<double> area(count, 0.0);
        for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
            const double own = faceNormals[f].norm();
            for (const std::uint32_t v : mesh.triangles[f]) {
                sum[v] += own * valueAtCorner(f, v);
                area[v] += own;
            }
        }
        for (std::size_t v = 0; v < count; ++v) { sum[v] = area[v] > 0.0 ? sum[v] / area[v] : 0.0; }
        return sum;
    };
    const std::vector<double> curvature = averaged([&](std::size_t f, std::uint32_t v) {
        const double size = std::sqrt(faceNormals[f].norm());
        const double angle = std::atan2(faceNormals[f].cross(normals[v]).norm(), faceNormals[f].dot(normals[v]));
        return size > 0.0 ? angle / size : 0.0;
    });
    std::vector<double> density(curvature);
    const auto middle = density.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(density.begin(), middle, density.end());
    const double typical = *middle;
    for (std::size_t v = 0; v < count; ++v) {
        density[v] = typical > 0.0 ? std::clamp(std::sqrt(curvature[v] / typical), kLeastDensity, kMostDensity) : 1.0;
    }
    for (int pass = 0; pass < 2; ++pass) {
        density = averaged([&](std::size_t f, std::uint32_t /*v*/) {
            const auto& t = mesh.triangles[f];
            return (density[t[0]] + density[t[1]] + density[t[2]]) / 3.0;
        });
    }
    return density;
}

/// Stretch of the map from plane to surface (Sander et al. 2001): per vertex, root mean square over its triangles.
struct Stretch {
    double energy = 0.0;
    std::vector<double> atVertex;
};

Stretch measureStretch(const DiscMesh& mesh, const std::vector<double>& density, const Plane& plane)
{
    Stretch stretch;
    stretch.atVertex.assign(mesh.positions.size(), 0.0);
    std::vector<double> area(mesh.positions.size(), 0.0);
    for (const auto& t : mesh.triangles) {
        const Vector3d a = mesh.positions[t[1]] - mesh.positions[t[0]];
        const Vector3d b = mesh.positions[t[2]] - mesh.positions[t[0]];
        const Vector2d u = plane[t[1]] - plane[t[0]];
        const Vector2d v = plane[t[2]] - plane[t[0]];
        const double determinant = std::max(u.x() * v.y() - u.y() * v.x(), 1e-300);
        const Vector3d ds = (a * v.y() - b * u.y()) / determinant;
        const Vector3d dt = (b * u.x() - a * v.x()) / determinant;
        const double dense = (density[t[0]] + density[t[1]] + density[t[2]]) / 3.0;
        const double squared = 0.5 * dense * dense * (ds.squaredNorm() + dt.squaredNorm());
        const double surfaceArea = a.cross(b).norm();
        stretch.energy += surfaceArea * squared;
        for (const std::uint32_t corner : t) {
            stretch.atVertex[corner] += surfaceArea * squared;
            area[corner] += surfaceArea;
        }
    }
    double mean = 0.0;
    double total = 0.0;
    for (std::size_t v = 0; v < area.size(); ++v) {
        stretch.atVertex[v] = area[v] > 0.0 ? std::sqrt(stretch.atVertex[v] / area[v]) : 0.0;
        mean += stretch.atVertex[v] * area[v];
        total += area[v];
    }
    mean = total > 0.0 ? mean / total : 1.0;
    for (double& s : stretch.atVertex) { s = std::clamp(s / mean, 1.0 / kLargestChange, kLargestChange); }
    return stretch;
}

} // namespace

bool embedEvenly(const DiscMesh& mesh, Plane& plane)
{
    if (std::all_of(mesh.isFixed.begin(), mesh.isFixed.end(), [](char fixed) { return fixed != 0; })) {
        return isPositive(mesh, plane);
    }
    MeanSolver solver(mesh);
    std::vector<WeightedEdge> weights = meanValueWeights(mesh);
    const std::vector<double> density = wantedDensity(mesh);
    double best = std::numeric_limits<double>::infinity();
    int failures = 0;
    for (int round = 0; round < kMostRounds && failures < kPatience; ++round) {
        Plane candidate = plane;
        if (!solver.solve(weights, candidate)) { break; }
        const Stretch stretch = measureStretch(mesh, density, candidate);
        if (!isPositive(mesh, candidate)) {
            // The first rounds may squeeze parts until rounding turns triangles over; their stretch gives them room.
        } else if (stretch.energy < kWorthwhile * best) {
            best = stretch.energy;
            plane = std::move(candidate);
            failures = 0;
        } else {
            ++failures;
        }
        for (WeightedEdge& e : weights) { e.weight /= stretch.atVertex[e.neighbour]; }
    }
    return best < std::numeric_limits<double>::infinity();
}

} // namespace osgTessLOD::bake
