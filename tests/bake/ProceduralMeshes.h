// SPDX-License-Identifier: MIT
// Source meshes with known shape and topology, in the working frame.
#pragma once

#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

constexpr double kPi = 3.14159265358979323846;

inline SourceMesh finished(SourceMesh mesh, const std::string& name)
{
    mesh.name = name;
    normalizeFrame(mesh);
    return mesh;
}

/// Octahedron whose faces were split into four `splits` times, on the unit sphere: 8 · 4^splits triangles.
inline SourceMesh sphere(unsigned splits)
{
    SourceMesh mesh;
    mesh.positions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (unsigned s = 0; s < splits; ++s) {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const auto [at, isNew] =
                middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.positions.size()));
            if (isNew) { mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]).normalized()); }
            return at->second;
        };
        const auto coarse = std::exchange(mesh.triangles, {});
        for (const auto& [a, b, c] : coarse) {
            const std::uint32_t ab = middle(a, b);
            const std::uint32_t bc = middle(b, c);
            const std::uint32_t ca = middle(c, a);
            mesh.triangles.insert(mesh.triangles.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
    }
    return finished(std::move(mesh), "sphere");
}

/// Quads (i, j) … (i + 1, j + 1) of a grid of points, each cut along a diagonal; a wrapped direction has as many cells as points.
template <typename Point>
SourceMesh gridMesh(std::uint32_t columns, std::uint32_t rows, bool wrapColumns, bool wrapRows, Point point)
{
    SourceMesh mesh;
    for (std::uint32_t j = 0; j < rows; ++j) {
        for (std::uint32_t i = 0; i < columns; ++i) { mesh.positions.push_back(point(i, j)); }
    }
    const auto index = [&](std::uint32_t i, std::uint32_t j) { return j % rows * columns + i % columns; };
    for (std::uint32_t j = 0; j + (wrapRows ? 0 : 1) < rows; ++j) {
        for (std::uint32_t i = 0; i + (wrapColumns ? 0 : 1) < columns; ++i) {
            const std::uint32_t a = index(i, j);
            const std::uint32_t b = index(i + 1, j);
            const std::uint32_t c = index(i + 1, j + 1);
            const std::uint32_t d = index(i, j + 1);
            mesh.triangles.push_back({a, b, c});
            mesh.triangles.push_back({a, c, d});
        }
    }
    return mesh;
}

/// Large radius 1, small radius 0.4: 2 · around · tube triangles.
inline SourceMesh torus(std::uint32_t around, std::uint32_t tube)
{
    return finished(gridMesh(around, tube, true, true,
                             [&](std::uint32_t i, std::uint32_t j) {
                                 const double u = 2.0 * kPi * i / around;
                                 const double v = 2.0 * kPi * j / tube;
                                 const double r = 1.0 + 0.4 * std::cos(v);
                                 return Eigen::Vector3d(r * std::cos(u), r * std::sin(u), 0.4 * std::sin(v));
                             }),
                    "torus");
}

/// A wavy square of n × n quads.
inline SourceMesh openGrid(std::uint32_t n)
{
    return finished(gridMesh(n + 1, n + 1, false, false,
                             [&](std::uint32_t i, std::uint32_t j) {
                                 const double x = static_cast<double>(i) / n;
                                 const double y = static_cast<double>(j) / n;
                                 return Eigen::Vector3d(x, y, 0.05 * std::sin(9.0 * x) * std::cos(7.0 * y));
                             }),
                    "open grid");
}

/// A plain square of n × n quads in the plane z = 0.
inline SourceMesh flatGrid(std::uint32_t n)
{
    return finished(gridMesh(n + 1, n + 1, false, false,
                             [&](std::uint32_t i, std::uint32_t j) {
                                 return Eigen::Vector3d(static_cast<double>(i) / n, static_cast<double>(j) / n, 0.0);
                             }),
                    "flat grid");
}

/// A flat ring between radius 1 and 2: two boundary loops.
inline SourceMesh annulus(std::uint32_t around, std::uint32_t rings)
{
    return finished(gridMesh(around, rings + 1, true, false,
                             [&](std::uint32_t i, std::uint32_t j) {
                                 const double u = 2.0 * kPi * i / around;
                                 const double r = 2.0 - static_cast<double>(j) / rings;
                                 return Eigen::Vector3d(r * std::cos(u), r * std::sin(u), 0.0);
                             }),
                    "annulus");
}

/// The surface of the unit voxels (x, y, z) with isSolid; two triangles a face. Voxels may not touch in an edge or corner only.
template <typename IsSolid>
SourceMesh voxelSurface(const std::array<int, 3>& size, IsSolid isSolid)
{
    SourceMesh mesh;
    std::map<std::array<int, 3>, std::uint32_t> numbers;
    const auto vertex = [&](const std::array<int, 3>& p) {
        const auto [at, isNew] = numbers.try_emplace(p, static_cast<std::uint32_t>(mesh.positions.size()));
        if (isNew) { mesh.positions.emplace_back(p[0], p[1], p[2]); }
        return at->second;
    };
    const auto solid = [&](const std::array<int, 3>& v) {
        for (std::size_t k = 0; k < 3; ++k) {
            if (v[k] < 0 || v[k] >= size[k]) { return false; }
        }
        return isSolid(v[0], v[1], v[2]);
    };
    std::array<int, 3> v{};
    for (v[2] = 0; v[2] < size[2]; ++v[2]) {
        for (v[1] = 0; v[1] < size[1]; ++v[1]) {
            for (v[0] = 0; v[0] < size[0]; ++v[0]) {
                if (!solid(v)) { continue; }
                for (std::size_t axis = 0; axis < 3; ++axis) {
                    for (const int direction : {-1, 1}) {
                        std::array<int, 3> outside = v;
                        outside[axis] += direction;
                        if (solid(outside)) { continue; }
                        // Counter-clockwise seen from outside: along the next axis, then the one after it; else reversed.
                        std::array<std::array<int, 3>, 4> p{v, v, v, v};
                        for (auto& corner : p) { corner[axis] += direction > 0 ? 1 : 0; }
                        for (const std::size_t i : {1U, 2U}) { ++p[i][(axis + 1) % 3]; }
                        for (const std::size_t i : {2U, 3U}) { ++p[i][(axis + 2) % 3]; }
                        if (direction < 0) { std::swap(p[1], p[3]); }
                        const std::uint32_t a = vertex(p[0]);
                        const std::uint32_t b = vertex(p[1]);
                        const std::uint32_t c = vertex(p[2]);
                        const std::uint32_t d = vertex(p[3]);
                        mesh.triangles.push_back({a, b, c});
                        mesh.triangles.push_back({a, c, d});
                    }
                }
            }
        }
    }
    return mesh;
}

/// A cube whose sides are n × n grids: twelve creases of 90°.
inline SourceMesh cube(int n)
{
    return finished(voxelSurface({n, n, n}, [](int, int, int) { return true; }), "cube");
}

/// A block of 5 × 3 × 1 cells of n³ voxels with two of the cells missing: genus 2.
inline SourceMesh blockWithTwoHoles(int n)
{
    return finished(voxelSurface({5 * n, 3 * n, n},
                                 [n](int x, int y, int) { return y / n != 1 || (x / n != 1 && x / n != 3); }),
                    "block with two holes");
}

/// Both side by side, as one mesh of more components.
inline SourceMesh besideEachOther(const SourceMesh& first, const SourceMesh& second)
{
    SourceMesh mesh = first;
    const auto offset = static_cast<std::uint32_t>(first.positions.size());
    for (const auto& p : second.positions) { mesh.positions.emplace_back(p + Eigen::Vector3d(3, 0, 0)); }
    for (const auto& [a, b, c] : second.triangles) { mesh.triangles.push_back({a + offset, b + offset, c + offset}); }
    mesh.frame = {};
    return finished(std::move(mesh), first.name + " and " + second.name);
}

/// Every coordinate moved by up to `amplitude` (of the size).
inline SourceMesh noisy(SourceMesh mesh, double amplitude, unsigned seed)
{
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> noise(-amplitude, amplitude);
    for (auto& p : mesh.positions) {
        for (Eigen::Index k = 0; k < 3; ++k) { p[k] += noise(random); }
    }
    mesh.frame = {};
    return finished(std::move(mesh), "noisy " + mesh.name);
}

/// A sphere with long thin spikes, which collapses squeeze into little of a patch.
inline SourceMesh spikySphere(unsigned splits)
{
    SourceMesh mesh = sphere(splits);
    const std::array<Eigen::Vector3d, 3> tips{
        {Eigen::Vector3d(1, 2, 3).normalized(), Eigen::Vector3d(-3, 1, -1).normalized(), Eigen::Vector3d(0, -1, 0)}};
    for (auto& p : mesh.positions) {
        const Eigen::Vector3d direction = p.normalized();
        double height = 1.0;
        for (const auto& tip : tips) { height += 2.0 * std::exp(-60.0 * (direction - tip).squaredNorm()); }
        p *= height;
    }
    mesh.frame = {};
    return finished(std::move(mesh), "spiky sphere");
}

/// Vertices, edges, faces and boundary loops of each connected component, sorted.
struct ComponentTopology {
    long eulerCharacteristic = 0;
    long boundaryLoops = 0;
    bool operator<(const ComponentTopology& o) const
    {
        return std::tie(eulerCharacteristic, boundaryLoops) < std::tie(o.eulerCharacteristic, o.boundaryLoops);
    }
    bool operator==(const ComponentTopology& o) const { return !(*this < o) && !(o < *this); }
    /// Of the closed surface that filling the loops would give.
    long genus() const { return (2 - eulerCharacteristic - boundaryLoops) / 2; }
};

inline std::vector<ComponentTopology> topologyOf(std::size_t vertexCount,
                                                 const std::vector<std::array<std::uint32_t, 3>>& triangles)
{
    std::vector<std::uint32_t> parent(vertexCount);
    for (std::uint32_t v = 0; v < vertexCount; ++v) { parent[v] = v; }
    const auto root = [&](std::uint32_t v) {
        while (parent[v] != v) { v = parent[v] = parent[parent[v]]; }
        return v;
    };
    std::map<std::pair<std::uint32_t, std::uint32_t>, bool> directed;
    for (const auto& t : triangles) {
        for (std::size_t k = 0; k < 3; ++k) {
            directed[{t[k], t[(k + 1) % 3]}] = true;
            parent[root(t[k])] = root(t[(k + 1) % 3]);
        }
    }
    std::map<std::uint32_t, ComponentTopology> components;
    std::map<std::uint32_t, std::uint32_t> nextOnBoundary;
    for (std::uint32_t v = 0; v < vertexCount; ++v) { ++components[root(v)].eulerCharacteristic; }
    for (const auto& t : triangles) { ++components[root(t[0])].eulerCharacteristic; }
    for (const auto& [edge, ignored] : directed) {
        const bool isOpen = directed.count({edge.second, edge.first}) == 0;
        if (isOpen) { nextOnBoundary[edge.first] = edge.second; }
        if (isOpen || edge.first < edge.second) { --components[root(edge.first)].eulerCharacteristic; }
    }
    while (!nextOnBoundary.empty()) {
        ++components[root(nextOnBoundary.begin()->first)].boundaryLoops;
        for (auto at = nextOnBoundary.begin(); at != nextOnBoundary.end();) {
            const std::uint32_t next = at->second;
            nextOnBoundary.erase(at);
            at = nextOnBoundary.find(next);
        }
    }
    std::vector<ComponentTopology> result;
    for (const auto& [ignored, component] : components) { result.push_back(component); }
    std::sort(result.begin(), result.end());
    return result;
}

/// Weights of a random point of a triangle, evenly distributed.
template <typename Random>
Eigen::Vector3d randomWeights(Random& random)
{
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    double a = unit(random);
    double b = unit(random);
    if (a + b > 1.0) {
        a = 1.0 - a;
        b = 1.0 - b;
    }
    return {1.0 - a - b, a, b};
}

} // namespace osgTessLOD::bake
