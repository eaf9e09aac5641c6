// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SurfaceDistance.h>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using VectorL = Eigen::Matrix<long double, 3, 1>;

/// Distance from p to the convex hull of the points: the nearest point of all the affine hulls of some of them that is in
/// the hull of those. In extended precision, by least squares.
double distanceToHull(const Vector3d& p, const std::array<Vector3d, 3>& points)
{
    long double nearest = std::numeric_limits<long double>::infinity();
    for (unsigned subset = 1; subset < 8; ++subset) {
        std::vector<VectorL> chosen;
        for (std::size_t k = 0; k < 3; ++k) {
            if ((subset >> k & 1U) != 0) { chosen.push_back((points[k] - p).cast<long double>()); }
        }
        Eigen::Matrix<long double, 3, Eigen::Dynamic> spans(3, static_cast<Eigen::Index>(chosen.size()) - 1);
        for (Eigen::Index i = 0; i < spans.cols(); ++i) {
            spans.col(i) = chosen[static_cast<std::size_t>(i) + 1] - chosen[0];
        }
        VectorL foot = chosen[0];
        if (spans.cols() != 0) {
            const auto solver = spans.colPivHouseholderQr();
            if (solver.rank() < spans.cols()) { continue; }
            const Eigen::Matrix<long double, Eigen::Dynamic, 1> weights = solver.solve(-chosen[0]);
            if (weights.minCoeff() < 0.0L || weights.sum() > 1.0L) { continue; }
            foot += spans * weights;
        }
        nearest = std::min(nearest, foot.norm());
    }
    return static_cast<double>(nearest);
}

double distance(const Vector3d& p, const std::array<Vector3d, 3>& corners)
{
    // The box's centre is the origin, so that positions in single precision are kept as they are.
    const std::vector<Vector3d> positions{corners[0], corners[1], corners[2], Vector3d::Constant(-8.0),
                                          Vector3d::Constant(8.0)};
    return SurfaceDistance(positions, {{0, 1, 2}}).distance(p);
}

TEST(SurfaceDistance, IsExactToSinglePrecisionForSliversToo)
{
    std::mt19937 random(7);
    std::uniform_real_distribution<float> coordinate(-1.0F, 1.0F);
    const auto point = [&] { return Vector3f(coordinate(random), coordinate(random), coordinate(random)); };
    const auto upToOne = [&](float decades) { return std::pow(10.0F, 0.5F * decades * (coordinate(random) - 1.0F)); };
    for (int i = 0; i < 20000; ++i) {
        const float size = upToOne(4.0F);
        const Vector3f a = point();
        const Vector3f b = a + size * point();
        const Vector3f c = a + 0.5F * (1.0F + coordinate(random)) * (b - a) + upToOne(6.0F) * size * point();
        const Vector3f at = 0.5F * (a + b) + upToOne(6.0F) * size * point();
        const std::array<Vector3d, 3> corners{a.cast<double>(), b.cast<double>(), c.cast<double>()};
        const Vector3d p = at.cast<double>();
        const double expected = distanceToHull(p, corners);
        // Rounded to single precision once; the sliver's plane is as good as double precision gives it.
        EXPECT_NEAR(distance(p, corners), expected, 1e-7 * expected + 1e-12 * static_cast<double>(size))
            << "triangle " << i;
    }
}

TEST(SurfaceDistance, OfDegenerateTrianglesIsThatOfTheirSides)
{
    const Vector3d p(0.25, 0.5, 0.0);
    const Vector3d a(0.0, 0.0, 0.0);
    const Vector3d b(1.0, 0.0, 0.0);
    EXPECT_DOUBLE_EQ(0.5, distance(p, {a, b, Vector3d(0.5, 0.0, 0.0)}));
    EXPECT_DOUBLE_EQ(0.5, distance(p, {a, b, b}));
    EXPECT_DOUBLE_EQ(1.0, distance(b, {a, a, a}));
}

TEST(SurfaceDistance, OfAPlaneAndItsBorder)
{
    const std::vector<Vector3d> positions{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}, {0, 2, 3}};
    const SurfaceDistance plane(positions, triangles);
    EXPECT_NEAR(plane.distance({0.3, 0.4, 0.0}), 0.0, 1e-7);
    EXPECT_NEAR(plane.distance({0.3, 0.4, -0.5}), 0.5, 1e-6);
    EXPECT_NEAR(plane.distance({0.5, -3.0, 4.0}), 5.0, 1e-6);
    EXPECT_NEAR(plane.distance({-2.0, -2.0, 1.0}), 3.0, 1e-6);
}

TEST(SurfaceDistance, NearestIsThePointOfTheTriangleThatBruteForceFinds)
{
    std::mt19937 random(11);
    std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
    const auto point = [&] { return Vector3d(coordinate(random), coordinate(random), coordinate(random)); };
    std::vector<Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (std::uint32_t t = 0; t < 60; ++t) {
        const Vector3d a = point();
        for (const Vector3d& p : {a, Vector3d(a + 0.3 * point()), Vector3d(a + 0.3 * point())}) {
            positions.push_back(p.cast<float>().cast<double>());
        }
        triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    }
    const SurfaceDistance surface(positions, triangles);
    const auto distanceToTriangle = [&](const Vector3d& p, std::uint32_t t) {
        return distanceToHull(p, {positions[3 * t], positions[3 * t + 1], positions[3 * t + 2]});
    };
    std::uint32_t triangle = 0; // of the point before
    for (int i = 0; i < 300; ++i) {
        const Vector3d p = 1.5 * point();
        const SurfaceDistance::Nearest nearest = surface.nearest(p);
        EXPECT_EQ(surface.distanceBeyond(p, 0.0, std::numeric_limits<double>::infinity(), triangle), nearest.distance);
        EXPECT_EQ(triangle, nearest.triangle);
        double expected = std::numeric_limits<double>::infinity();
        for (std::uint32_t t = 0; t < triangles.size(); ++t) {
            expected = std::min(expected, distanceToTriangle(p, t));
        }
        constexpr double kSinglePrecision = 1e-6; // of coordinates up to 2, rounded a few times
        EXPECT_NEAR(nearest.distance, expected, kSinglePrecision);
        EXPECT_NEAR((nearest.point - p).norm(), expected, kSinglePrecision);
        EXPECT_LT(distanceToTriangle(nearest.point, nearest.triangle), kSinglePrecision) << "it is on its triangle";
    }
}

TEST(SurfaceDistance, NearestOfNothingIsInfinitelyFar)
{
    EXPECT_TRUE(std::isinf(SurfaceDistance({}, {}).nearest({1.0, 2.0, 3.0}).distance));
}

TEST(SurfaceDistance, HausdorffSeesWhatOnlyOneSurfaceHas)
{
    const std::vector<Vector3d> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const std::vector<Vector3d> half{{0, 0, 0.25}, {1, 0, 0.25}, {1, 1, 0.25}};
    const std::vector<std::array<std::uint32_t, 3>> two{{0, 1, 2}, {0, 2, 3}};
    const std::vector<std::array<std::uint32_t, 3>> one{{0, 1, 2}};
    const HausdorffDistance d = hausdorffDistance({square, two}, {half, one});
    // From the corner (0, 1) to the diagonal, and up.
    EXPECT_NEAR(d.forward, std::sqrt(0.5 + 0.0625), 1e-6);
    EXPECT_NEAR(d.backward, 0.25, 1e-6);
    EXPECT_EQ(d.symmetric(), d.forward);
}

} // namespace
} // namespace osgTessLOD::bake
