// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/StarFlattening.h>

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <array>
#include <cmath>
#include <random>
#include <string>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;
using Step = CollapseHistory::Step;

enum class Kind { kInterior, kGapFirst, kGapLast, kCrease };

std::string nameOf(Kind kind)
{
    static constexpr std::array<const char*, 4> kNames{"Interior", "GapFirst", "GapLast", "Crease"};
    return kNames[static_cast<std::size_t>(kind)];
}

/// How the ring's vertices lie around the centre.
enum class Shape { kAnywhere, kNeedles, kFolded, kSlivers, kCoincident, kPoint, kSpike };

Star randomStar(std::mt19937& random, unsigned ringSize, Kind kind, Shape shape)
{
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    std::normal_distribution<double> normal;
    Star star;
    star.ringSize = ringSize;
    star.center = Vector3d(normal(random), normal(random), normal(random));
    if (kind == Kind::kGapFirst) { star.gap = 0; }
    if (kind == Kind::kGapLast) { star.gap = ringSize - 1; }
    if (kind == Kind::kCrease) { star.crease = std::uniform_int_distribution<unsigned>(2, ringSize - 2)(random); }
    const Vector3d axis = Vector3d(normal(random), normal(random), normal(random)).normalized();
    for (unsigned i = 0; i < ringSize; ++i) {
        Vector3d offset = Vector3d(normal(random), normal(random), normal(random));
        const double angle = 2.0 * 3.14159265358979 * i / ringSize;
        switch (shape) {
        case Shape::kAnywhere: break;
        case Shape::kNeedles: offset *= std::pow(10.0, 12.0 * unit(random) - 6.0); break;
        case Shape::kFolded: offset = (i % 2 == 0 ? 1.0 : -1.0) * axis + 1e-9 * offset; break;
        case Shape::kSlivers:
            // All but one sector within a millionth of a right angle.
            offset = Vector3d(std::cos(1e-6 * i), std::sin(1e-6 * i), 0.0) * (1.0 + unit(random));
            break;
        case Shape::kCoincident: offset = unit(random) < 0.5 ? Vector3d::Zero() : offset; break;
        case Shape::kPoint: offset = Vector3d::Zero(); break;
        case Shape::kSpike: offset = Vector3d(1e-3 * std::cos(angle), 1e-3 * std::sin(angle), -1.0); break;
        }
        star.ring[i] = star.center + offset;
    }
    return star;
}

void expectFlat(const Star& star)
{
    Step step;
    flattenStar(star, step);
    EXPECT_EQ(step.ringSize, star.ringSize);
    EXPECT_EQ(step.gap, star.gap);
    EXPECT_GT(step.quality(), 0.0);
    if (star.gap != Step::kNoGap || star.crease != 0) {
        const unsigned other = star.crease != 0 ? star.crease : star.gap == 0 ? 1 : star.ringSize - 1;
        EXPECT_EQ(step.center.y(), 0.0F);
        EXPECT_EQ(step.ring[0].y(), 0.0F);
        EXPECT_EQ(step.ring[other].y(), 0.0F);
        EXPECT_LT((step.ring[0].x() - step.center.x()) * (step.ring[other].x() - step.center.x()), 0.0F)
            << "v lies between the two ends";
    }
    for (unsigned i = 0; i < step.ringSize; ++i) { EXPECT_TRUE(step.ring[i].allFinite()); }
}

class StarFlattening : public testing::TestWithParam<Kind> {};

TEST_P(StarFlattening, IsPositiveForEveryStar)
{
    std::mt19937 random(7);
    const unsigned fewest = GetParam() == Kind::kCrease ? 4 : 3;
    for (const Shape shape : {Shape::kAnywhere, Shape::kNeedles, Shape::kFolded, Shape::kSlivers, Shape::kCoincident,
                              Shape::kPoint, Shape::kSpike}) {
        for (unsigned ringSize = fewest; ringSize < CollapseHistory::kMaxRing; ++ringSize) {
            for (int repeat = 0; repeat < 20; ++repeat) {
                expectFlat(randomStar(random, ringSize, GetParam(), shape));
                ASSERT_FALSE(HasFailure()) << "shape " << static_cast<int>(shape) << ", ring " << ringSize;
            }
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Kinds, StarFlattening,
                         testing::Values(Kind::kInterior, Kind::kGapFirst, Kind::kGapLast, Kind::kCrease),
                         [](const auto& test) { return nameOf(test.param); });

TEST(StarFlattening, KeepsARegularStar)
{
    // A flat regular hexagon is its own image, up to a turn and the scale: nothing forces another shape.
    Star star;
    star.ringSize = 6;
    star.center = Vector3d(1, 2, 3);
    for (unsigned i = 0; i < 6; ++i) {
        const double angle = 0.3 + 3.14159265358979 / 3.0 * i;
        star.ring[i] = star.center + 5.0 * Vector3d(std::cos(angle), std::sin(angle), 0.0);
    }
    Step step;
    flattenStar(star, step);
    for (unsigned i = 0; i < 6; ++i) {
        const double angle = 3.14159265358979 / 3.0 * i;
        EXPECT_NEAR(static_cast<double>(step.ring[i].x()), std::cos(angle), 1e-6);
        EXPECT_NEAR(static_cast<double>(step.ring[i].y()), std::sin(angle), 1e-6);
    }
}

} // namespace
} // namespace osgTessLOD::bake
