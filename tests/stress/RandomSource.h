// SPDX-License-Identifier: MIT
// Small source meshes by seed: of every kind that breaks geometry code, at any scale, anywhere, turned in any way.
#pragma once

#include <bake/ProceduralMeshes.h>
#include <stress/Random.h>

#include <Eigen/Geometry>

#include <cmath>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace osgTessLOD::stress {

using bake::SourceMesh;
using Eigen::Vector3d;

/// Random input of bakes.
class SourceRandom : public Random {
public:
    using Random::Random;
    Vector3d direction()
    {
        std::normal_distribution<double> normal;
        const double x = normal(generator());
        const double y = normal(generator());
        const double z = normal(generator());
        return Vector3d(x, y, z).normalized();
    }
    Eigen::Matrix3d rotation()
    {
        const Vector3d axis = direction();
        return Eigen::AngleAxisd(between(0.0, 2.0 * bake::kPi), axis).toRotationMatrix();
    }
};

enum class Kind { Ball, Sheet, SliverFan, CoplanarSoup, CocircularDisc, EqualHeights, Wall, kCount };

inline const char* nameOf(Kind kind)
{
    constexpr const char* kNames[] = {"ball",          "sheet", "fan of slivers", "coplanar soup", "cocircular disc",
                                      "equal heights", "wall"};
    return kNames[static_cast<std::size_t>(kind)];
}

/// A sphere whose vertices were moved in and out: closed, folded here and there.
inline SourceMesh ball(SourceRandom& random)
{
    SourceMesh mesh = bake::sphere(2 + random.below(2));
    const double roughness = random.magnitude(1e-9, 0.3);
    for (Vector3d& p : mesh.positions) { p *= 1.0 + random.between(-roughness, roughness); }
    return mesh;
}

/// An open grid of uneven cells, some of no more than 10⁻¹² of its side wide.
inline SourceMesh sheet(SourceRandom& random)
{
    const std::uint32_t n = 6 + random.below(8);
    const double roughness = random.magnitude(1e-9, 0.1);
    std::vector<double> columns{0.0};
    for (std::uint32_t k = 0; k < n; ++k) {
        columns.push_back(columns.back() + (random.chance(0.2) ? random.magnitude(1e-12, 1.0) : 1.0));
    }
    return bake::gridMesh(n + 1, n + 1, false, false, [&](std::uint32_t i, std::uint32_t j) {
        return Vector3d(columns[i], j, n * random.between(-roughness, roughness));
    });
}

/// Triangles about one point, of any angles down to 10⁻¹² radians.
inline SourceMesh sliverFan(SourceRandom& random)
{
    const std::uint32_t count = 20 + random.below(60);
    SourceMesh mesh;
    mesh.positions.emplace_back(0.0, 0.0, random.between(0.0, 1.0));
    double angle = 0.0;
    for (std::uint32_t k = 0; k < count && angle < 6.0; ++k) {
        mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 0.1 * std::sin(5.0 * angle));
        angle += random.chance(0.5) ? random.magnitude(1e-12, 0.1) : 6.0 / count;
        if (k > 0) { mesh.triangles.push_back({0, k, k + 1}); }
    }
    return mesh;
}

/// Triangles between few points of a plane's lattice, over one another, of no area, twice the same.
inline SourceMesh coplanarSoup(SourceRandom& random)
{
    SourceMesh mesh;
    for (std::uint32_t i = 0; i < 6; ++i) {
        for (std::uint32_t j = 0; j < 6; ++j) { mesh.positions.emplace_back(i, j, 0.0); }
    }
    for (unsigned k = 0; k < 60; ++k) {
        mesh.triangles.push_back({random.below(36), random.below(36), random.below(36)});
    }
    return mesh;
}

/// Rings of points on circles about one centre, all in a plane or all on a sphere.
inline SourceMesh cocircularDisc(SourceRandom& random)
{
    const std::uint32_t around = 8 + random.below(12);
    const bool isFlat = random.chance(0.5);
    return bake::gridMesh(around, 5 + random.below(4), true, false, [&](std::uint32_t i, std::uint32_t j) {
        const double u = 2.0 * bake::kPi * i / around;
        const double v = 0.15 * (j + 1);
        return isFlat ? Vector3d(v * std::cos(u), v * std::sin(u), 0.0)
                      : Vector3d(std::sin(v) * std::cos(u), std::sin(v) * std::sin(u), std::cos(v));
    });
}

/// A height field all of whose heights are one, but for the last digits of some.
inline SourceMesh equalHeights(SourceRandom& random)
{
    const std::uint32_t n = 6 + random.below(8);
    const double height = random.between(-100.0, 100.0);
    const double noise = random.chance(0.5) ? 1e-15 : 0.0;
    return bake::gridMesh(n + 1, n + 1, false, false, [&](std::uint32_t i, std::uint32_t j) {
        return Vector3d(i, j, height * (1.0 + random.between(-noise, noise)));
    });
}

/// A strip 10⁻¹² to 1 of its length wide.
inline SourceMesh wall(SourceRandom& random)
{
    const double height = random.magnitude(1e-12, 1.0);
    return bake::gridMesh(24, 3, false, false,
                          [&](std::uint32_t i, std::uint32_t j) { return Vector3d(i, std::sin(0.5 * i), height * j); });
}

inline SourceMesh randomSource(Kind kind, SourceRandom& random)
{
    using Maker = SourceMesh (*)(SourceRandom&);
    constexpr Maker kMakers[] = {ball, sheet, sliverFan, coplanarSoup, cocircularDisc, equalHeights, wall};
    SourceMesh mesh = kMakers[static_cast<std::size_t>(kind)](random);
    mesh.frame = {};
    mesh.name = nameOf(kind);
    return mesh;
}

/// x ↦ scale (turn x + offset).
struct Similarity {
    Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
    double scale = 1.0;
    Vector3d offset = Vector3d::Zero();

    SourceMesh operator()(SourceMesh mesh) const
    {
        for (Vector3d& p : mesh.positions) { p = scale * (turn * p + offset); }
        return mesh;
    }
};

} // namespace osgTessLOD::stress
