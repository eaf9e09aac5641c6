// SPDX-License-Identifier: MIT
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/bake/StretchEmbedding.h>

#include <gtest/gtest.h>

#include <cmath>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Disc {
    DiscMesh mesh;
    std::vector<Vector2d> plane;
};

/// The parameter triangle as n rows of triangles, lifted by `height`; its border is fixed.
template <typename Height>
Disc triangleDisc(unsigned n, Height height)
{
    Disc disc;
    const auto index = [n](unsigned i, unsigned j) { return j * (2 * n + 3 - j) / 2 + i; };
    for (unsigned j = 0; j <= n; ++j) {
        for (unsigned i = 0; i + j <= n; ++i) {
            const Vector2d p(static_cast<double>(i) / n, static_cast<double>(j) / n);
            disc.plane.push_back(p);
            disc.mesh.positions.emplace_back(p.x(), p.y(), height(p));
            disc.mesh.isFixed.push_back(i == 0 || j == 0 || i + j == n ? 1 : 0);
            if (i + j < n) { disc.mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i, j + 1)}); }
            if (i + j + 1 < n) { disc.mesh.triangles.push_back({index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)}); }
        }
    }
    return disc;
}

double flat(const Vector2d&) { return 0.0; }
/// Twelve times as high as it is wide.
double protrusion(const Vector2d& p) { return 1.2 * std::exp(-200.0 * (p - Vector2d(0.3, 0.35)).squaredNorm()); }

double twiceArea(const std::vector<Vector2d>& plane, const std::array<std::uint32_t, 3>& t)
{
    const Vector2d a = plane[t[1]] - plane[t[0]];
    const Vector2d b = plane[t[2]] - plane[t[0]];
    return a.x() * b.y() - a.y() * b.x();
}

void expectPositive(const Disc& disc)
{
    double sum = 0.0;
    for (const auto& t : disc.mesh.triangles) {
        EXPECT_GT(twiceArea(disc.plane, t), 0.0);
        sum += twiceArea(disc.plane, t);
    }
    EXPECT_NEAR(sum, 1.0, 1e-12) << "together the parameter triangle";
}

/// Integral over the surface of the squared L² stretch (Sander et al. 2001), per area.
double stretchEnergy(const Disc& disc)
{
    double energy = 0.0;
    double total = 0.0;
    for (const auto& t : disc.mesh.triangles) {
        Eigen::Matrix<double, 3, 2> edges;
        edges << disc.mesh.positions[t[1]] - disc.mesh.positions[t[0]], disc.mesh.positions[t[2]] - disc.mesh.positions[t[0]];
        Eigen::Matrix2d parameters;
        parameters << disc.plane[t[1]] - disc.plane[t[0]], disc.plane[t[2]] - disc.plane[t[0]];
        const Eigen::Matrix<double, 3, 2> jacobian = edges * parameters.inverse();
        const double area = 0.5 * Vector3d(edges.col(0)).cross(Vector3d(edges.col(1))).norm();
        energy += 0.5 * jacobian.squaredNorm() * area;
        total += area;
    }
    return energy / total;
}

TEST(StretchEmbedding, SpreadsAProtrusion)
{
    Disc disc = triangleDisc(32, protrusion);
    const auto start = disc.plane;
    const double before = stretchEnergy(disc);
    ASSERT_TRUE(embedEvenly(disc.mesh, disc.plane));
    expectPositive(disc);
    EXPECT_LT(stretchEnergy(disc), 0.7 * before);
    for (std::size_t v = 0; v < start.size(); ++v) {
        if (disc.mesh.isFixed[v] != 0) { EXPECT_EQ(disc.plane[v], start[v]); }
    }
}

TEST(StretchEmbedding, GivesTheProtrusionRoom)
{
    // The share of the plane that the vertices above z = 0.2 take up.
    const auto share = [](const Disc& disc) {
        double sum = 0.0;
        for (const auto& t : disc.mesh.triangles) {
            if (disc.mesh.positions[t[0]].z() > 0.2) { sum += twiceArea(disc.plane, t); }
        }
        return sum;
    };
    Disc disc = triangleDisc(32, protrusion);
    const double before = share(disc);
    ASSERT_TRUE(embedEvenly(disc.mesh, disc.plane));
    EXPECT_GT(share(disc), 2.0 * before);
}

TEST(StretchEmbedding, AFlatDiscIsHardlyStretched)
{
    Disc disc = triangleDisc(16, flat);
    // From anywhere: the free vertices' old places do not matter.
    for (std::size_t v = 0; v < disc.plane.size(); ++v) {
        if (disc.mesh.isFixed[v] == 0) { disc.plane[v] = Vector2d(0.5, 0.1); }
    }
    ASSERT_TRUE(embedEvenly(disc.mesh, disc.plane));
    expectPositive(disc);
    EXPECT_LT(stretchEnergy(disc), 1.01) << "1 is the least there is";
}

TEST(StretchEmbedding, NeedlesAndCoincidentVerticesStayPositive)
{
    std::mt19937 random(5);
    std::uniform_real_distribution<double> exponent(-9.0, 0.0);
    Disc disc = triangleDisc(20, flat);
    for (auto& p : disc.mesh.positions) { p.z() = std::pow(10.0, exponent(random)); }
    for (std::size_t v = 30; v < 60; ++v) { disc.mesh.positions[v] = disc.mesh.positions[29]; }
    const auto start = disc.plane;
    if (embedEvenly(disc.mesh, disc.plane)) {
        expectPositive(disc);
    } else {
        EXPECT_EQ(disc.plane, start);
    }
}

TEST(StretchEmbedding, WithNothingToMoveItTellsWhetherThePlaneIsSound)
{
    Disc disc = triangleDisc(1, flat);
    ASSERT_EQ(disc.mesh.triangles.size(), 1U);
    const auto start = disc.plane;
    EXPECT_TRUE(embedEvenly(disc.mesh, disc.plane));
    EXPECT_EQ(disc.plane, start);
    std::swap(disc.plane[0], disc.plane[1]);
    const auto turned = disc.plane;
    EXPECT_FALSE(embedEvenly(disc.mesh, disc.plane));
    EXPECT_EQ(disc.plane, turned);
}

} // namespace
} // namespace osgTessLOD::bake
