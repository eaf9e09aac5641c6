// SPDX-License-Identifier: MIT
// Michael Garland, Paul Heckbert, "Surface simplification using quadric error metrics", 1997.
// Peter Lindstrom, Greg Turk, "Fast and memory efficient polygonal simplification", 1998, §4.2 and §4.4.
// Donald Shepard, "A two-dimensional interpolation function for irregularly-spaced data", 1968.
#include <osgTessLOD/bake/ClassicPlacement.h>

#include <osgTessLOD/bake/PlacementRange.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Weight of the pull towards the edge's middle, relative to the objective's own.
constexpr double kRegularization = 1e-3;

Vector2d exact(ChartPoint p)
{
    return {p.u, p.v};
}

/// Normal with the length of twice the area.
Vector3d normal(const CollapseStar& star, const CollapseStar::Triangle& t)
{
    const Vector3d& a = star.vertices[t.vertices[0]].position;
    return (star.vertices[t.vertices[1]].position - a).cross(star.vertices[t.vertices[2]].position - a);
}

/// Moves on to the nearest valid parameter; false if there is none.
bool settle(const CollapseStar& star, const Vector2d& wanted, Placement& placement)
{
    placement.isValid = star.onBorder() ? nearestOnBorder(star, wanted.x(), placement.parameter)
                                        : nearestInStar(star, wanted, placement.parameter);
    return placement.isValid;
}

/// Chart coordinates as PlacementRange has them.
Vector2d coordinates(const CollapseStar& star, ChartPoint parameter)
{
    return star.onBorder() ? Vector2d(alongBorder(star.sides[0], parameter), 0.0) : exact(parameter);
}

/// How far from the first end to the second a parameter lies, from 0 to 1.
double partOfEdge(const CollapseStar& star, ChartPoint parameter)
{
    if (star.kind == CollapseStar::Kind::BorderEnd) { return 0.0; }
    const Vector2d along = exact(star.ends[1].parameter) - exact(star.ends[0].parameter);
    return std::clamp((exact(parameter) - exact(star.ends[0].parameter)).dot(along) / along.squaredNorm(), 0.0, 1.0);
}

Vector3d onEdge(const CollapseStar& star, double part)
{
    return (1.0 - part) * star.ends[0].position + part * star.ends[1].position;
}

/// Where on the edge the quadric is least.
double bestPart(const CollapseStar& star)
{
    if (star.kind == CollapseStar::Kind::BorderEnd) { return 0.0; }
    double mixed = 0.0, squared = 0.0;
    for (const CollapseStar::Triangle& t : star.triangles) {
        const Vector3d n = normal(star, t);
        const double length = n.norm();
        if (!(length > 0.0)) { continue; }
        const double at = n.dot(star.ends[0].position - star.vertices[t.vertices[0]].position) / length;
        const double slope = n.dot(star.ends[1].position - star.ends[0].position) / length;
        mixed += length * at * slope;
        squared += length * slope * slope;
    }
    return squared > 0.0 ? std::clamp(-mixed / squared, 0.0, 1.0) : 0.5;
}

/// The position whose tetrahedra with the star's triangles have the least squared volumes and a sum of zero.
Vector3d leastVolumes(const CollapseStar& star)
{
    const Vector3d middle = onEdge(star, 0.5);
    Matrix3d squares = Matrix3d::Zero();
    Vector3d right = Vector3d::Zero(), sum = Vector3d::Zero();
    double volume = 0.0;
    for (const CollapseStar::Triangle& t : star.triangles) {
        const Vector3d n = normal(star, t);
        const double distance = n.dot(star.vertices[t.vertices[0]].position - middle);
        squares += n * n.transpose();
        right += distance * n;
        sum += n;
        volume += distance;
    }
    const double trace = squares.trace();
    if (!(trace > std::numeric_limits<double>::min())) { return middle; }
    squares.diagonal().array() += kRegularization * trace;
    const Matrix3d inverse = squares.inverse();
    const Vector3d best = inverse * right, away = inverse * sum;
    const double steepness = sum.dot(away);
    if (!(steepness > 1e-3)) { return middle + best; } // the normals cancel: any place keeps the volume
    return middle + best + (volume - sum.dot(best)) / steepness * away;
}

/// Means of the neighbours' parameters, weighted by inverse squared distance; on a border of those on it.
Vector2d shepard(const CollapseStar& star, const Vector3d& position)
{
    const double closest =
        1e-6 * (star.ends[0].position - star.ends[1].position).squaredNorm() + std::numeric_limits<double>::min();
    double weights = 0.0;
    Vector2d sum = Vector2d::Zero();
    std::array<bool, CollapseStar::kMostVertices> known{};
    for (const CollapseStar::Triangle& t : star.triangles) {
        for (const std::uint8_t v : t.vertices) {
            const CollapseStar::Vertex& vertex = star.vertices[v];
            if (t.part != 0 || known[v]) { continue; }
            known[v] = true;
            const bool isEnd = vertex.parameter == star.ends[0].parameter || vertex.parameter == star.ends[1].parameter;
            if (star.onBorder()) {
                const std::int32_t along = alongBorder(star.sides[0], vertex.parameter);
                if (borderParameter(star.sides[0], along) != vertex.parameter) { continue; }
            } else if (isEnd) {
                continue;
            }
            const double weight = 1.0 / std::max(closest, (vertex.position - position).squaredNorm());
            weights += weight;
            sum += weight * coordinates(star, vertex.parameter);
        }
    }
    return sum / weights;
}

} // namespace

double quadricObjective(const CollapseStar& star, const Vector3d& position)
{
    double sum = 0.0;
    for (const CollapseStar::Triangle& t : star.triangles) {
        const Vector3d n = normal(star, t);
        const double length = n.norm();
        if (!(length > 0.0)) { continue; }
        const double distance = n.dot(position - star.vertices[t.vertices[0]].position);
        sum += distance * distance / length;
    }
    return sum;
}

Placement placeByQuadric(const CollapseStar& star)
{
    Placement placement;
    const double part = bestPart(star);
    const Vector2d a = coordinates(star, star.ends[0].parameter);
    Vector2d wanted = a;
    if (part > 0.0) { wanted += part * (coordinates(star, star.ends[1].parameter) - a); }
    if (!settle(star, wanted, placement)) { return placement; }
    placement.position = onEdge(star, partOfEdge(star, placement.parameter));
    placement.residual = quadricObjective(star, placement.position);
    return placement;
}

double volumeObjective(const CollapseStar& star, const Vector3d& position)
{
    double sum = 0.0;
    for (const CollapseStar::Triangle& t : star.triangles) {
        const double volume = normal(star, t).dot(position - star.vertices[t.vertices[0]].position);
        sum += volume * volume;
    }
    return sum;
}

Placement placeByVolume(const CollapseStar& star)
{
    if (star.isOpen) {
        Placement placement = placeByQuadric(star);
        placement.residual = placement.isValid ? volumeObjective(star, placement.position) : 0.0;
        return placement;
    }
    Placement placement;
    placement.position = leastVolumes(star);
    if (!settle(star, shepard(star, placement.position), placement)) { return placement; }
    placement.residual = volumeObjective(star, placement.position);
    return placement;
}

} // namespace osgTessLOD::bake
