// SPDX-License-Identifier: MIT
#include <benchmarks/ScreenRuler.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

namespace osgTessLOD::benchmarks {
namespace {

using bake::SurfaceDistance;
using Eigen::Vector3d;

/// From z = 10 down at the origin; 90° high, so that a length at depth w is 100 / w pixels.
ScreenCamera camera()
{
    ScreenCamera camera;
    camera.width = 200.0;
    camera.height = 200.0;
    camera.localToEye = osg::Matrixd::lookAt(osg::Vec3d(0.0, 0.0, 10.0), osg::Vec3d(), osg::Vec3d(0.0, 1.0, 0.0));
    camera.projection.makePerspective(90.0, 1.0, 0.1, 100.0);
    return camera;
}

/// Two triangles between these corners of a parallelogram.
SurfaceDistance plane(const Vector3d& corner, const Vector3d& along, const Vector3d& across)
{
    return {{corner, corner + along, corner + along + across, corner + across}, {{0, 1, 2}, {0, 2, 3}}};
}

SurfaceDistance floorAt(double height)
{
    return plane({-20.0, -20.0, height}, {40.0, 0.0, 0.0}, {0.0, 40.0, 0.0});
}

struct Measured {
    double pixels;
    double pixelsInSpace;
};

/// From a point in view, all that there is to compare it with considered.
Measured measured(const Vector3d& point, const SurfaceDistance& surface)
{
    const ScreenRuler ruler(camera());
    const auto first = ruler.measure(point, surface);
    EXPECT_TRUE(first);
    if (!first) { return {}; }
    return {ruler.leastPixels(point, *first, surface, 0.01), first->pixelsInSpace};
}

constexpr double kSinglePrecision = 1e-3; // pixels: of coordinates up to 20

TEST(ScreenRuler, DistancesAlongTheLineOfSightAreNotSeen)
{
    const Measured found = measured({0.0, 0.0, 0.0}, floorAt(-0.5));
    EXPECT_NEAR(found.pixels, 0.0, kSinglePrecision);
    EXPECT_NEAR(found.pixelsInSpace, 5.0, kSinglePrecision) << "0.5 at the depth of 10";
}

TEST(ScreenRuler, PerspectiveShowsThemBesideTheMiddleToo)
{
    // Straight down from (5, 0, 0) is (5, 0, −0.5), which is 500 (1/10 − 1/10.5) = 2.4 pixels away on screen; but the line of sight
    // meets the floor.
    const SurfaceDistance floor = floorAt(-0.5);
    EXPECT_NEAR(ScreenRuler(camera()).measure({5.0, 0.0, 0.0}, floor)->pixels, 50.0 - 500.0 / 10.5, kSinglePrecision);
    EXPECT_LT(measured({5.0, 0.0, 0.0}, floor).pixels, 0.02);
}

TEST(ScreenRuler, DistancesAcrossAreSeenWhole)
{
    // A wall beside the line of sight, which runs along it: the point cannot slide onto it.
    const SurfaceDistance wall = plane({0.3, -20.0, -5.0}, {0.0, 40.0, 0.0}, {0.0, 0.0, 14.0});
    const Measured found = measured({0.0, 0.0, 0.0}, wall);
    // Lower down it is nearer on screen, but only what is near in space is looked for: 0.3 at up to four times that behind the point.
    EXPECT_NEAR(found.pixels, 30.0 / 11.2, kSinglePrecision);
    EXPECT_NEAR(found.pixelsInSpace, 3.0, kSinglePrecision);
}

TEST(ScreenRuler, IsNeverMoreThanTheNearestPointInSpaceShows)
{
    const ScreenRuler ruler(camera());
    const SurfaceDistance slope = plane({-5.0, -5.0, -4.0}, {10.0, 0.0, 6.0}, {0.0, 10.0, 1.0});
    for (double x = -3.0; x <= 3.0; x += 0.5) {
        const Vector3d p(x, 1.0, 0.7 * x);
        const Vector3d q = slope.nearest(p).point;
        const double shown = std::hypot(100.0 * p.x() / (10.0 - p.z()) - 100.0 * q.x() / (10.0 - q.z()),
                                        100.0 * p.y() / (10.0 - p.z()) - 100.0 * q.y() / (10.0 - q.z()));
        EXPECT_NEAR(ruler.measure(p, slope)->pixels, shown, kSinglePrecision);
        EXPECT_LE(measured(p, slope).pixels, shown + kSinglePrecision);
    }
}

TEST(ScreenRuler, MeasuresWhatIsInView)
{
    const ScreenRuler ruler(camera());
    const SurfaceDistance floor = floorAt(0.0);
    EXPECT_TRUE(ruler.isInView({9.9, 0.0, 0.0}));
    EXPECT_FALSE(ruler.measure({10.1, 0.0, 0.0}, floor)) << "beyond the right side";
    EXPECT_FALSE(ruler.measure({0.0, 0.0, 11.0}, floor)) << "behind the eye";
    EXPECT_FALSE(ruler.measure({0.0, 0.0, -95.0}, floor)) << "beyond the far plane";
}

TEST(ScreenRuler, NothingToCompareWithIsAsFarAsTheScreenIsWide)
{
    EXPECT_DOUBLE_EQ(measured({0.0, 0.0, 0.0}, SurfaceDistance({}, {})).pixels, std::hypot(200.0, 200.0));
}

TEST(Deviations, AddUp)
{
    Deviations all;
    all.add({3.0, 0.0, 4.0, 9.0, 1, 0});
    all.add({1.0, 1.0, 6.0, 1.0, 1, 1});
    EXPECT_EQ(all.largest, 3.0);
    EXPECT_EQ(all.largestInSpace, 6.0);
    EXPECT_EQ(all.largestPromised, 1.0);
    EXPECT_DOUBLE_EQ(all.rms(), std::sqrt(5.0));
    EXPECT_EQ(all.promised, 1U);
    EXPECT_EQ(Deviations().rms(), 0.0);
}

} // namespace
} // namespace osgTessLOD::benchmarks
