// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/LevelNeedKernel.h>
#include <support/RandomDirection.h>

#include <osg/Vec3d>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <vector>

namespace osgTessLOD::kernel {
namespace {

constexpr int kLevels = 7;

class Random {
public:
    explicit Random(unsigned seed)
        : _generator(seed)
    {
    }
    double between(double from, double to) { return std::uniform_real_distribution<double>(from, to)(_generator); }
    float single(double from, double to) { return static_cast<float>(between(from, to)); }
    osg::Vec3d direction() { return randomDirection(_generator); }

private:
    std::mt19937 _generator;
};

/// Eight patches with the errors of a few vectors each, which fall from level to level as PatchBlocks has them.
struct Block {
    Spheres spheres{};
    std::vector<Errors> errors;
};

Block randomBlock(Random& random)
{
    Block block;
    block.errors.resize(kLevels);
    for (unsigned lane = 0; lane < kLanes; ++lane) {
        block.spheres.x[lane] = random.single(-1.0, 1.0);
        block.spheres.y[lane] = random.single(-1.0, 1.0);
        block.spheres.z[lane] = random.single(-1.0, 1.0);
        block.spheres.radius[lane] = random.single(0.01, 0.3);
        double size = random.between(1e-7, 1e-6);
        const osg::Vec3d v = random.direction();
        const int finest = static_cast<int>(random.between(2.0, kLevels));
        for (int level = finest; level-- > 0;) {
            Errors& at = block.errors[static_cast<std::size_t>(level)];
            const double square = size * size * 1.01;
            const std::array<double, 6> q{square - size * size * v.x() * v.x(), square - size * size * v.y() * v.y(),
                                          square - size * size * v.z() * v.z(), -size * size * v.x() * v.y(),
                                          -size * size * v.x() * v.z(),         -size * size * v.y() * v.z()};
            for (std::size_t k = 0; k < 6; ++k) { at.q[k][lane] = static_cast<float>(q[k]); }
            at.isotropic[lane] = static_cast<float>(std::sqrt(square));
            size *= random.between(LevelNeed::kErrorRatio * 1.001, 6.0);
        }
    }
    return block;
}

struct SeenBlock {
    SelectionView view;
    SelectionOptions options;
};

SeenBlock randomView(Random& random)
{
    SeenBlock seen;
    const osg::Vec3d target(random.between(-1.0, 1.0), random.between(-1.0, 1.0), random.between(-1.0, 1.0));
    seen.view.eye = target + random.direction() * std::pow(10.0, random.between(-1.0, 3.0));
    seen.view.axis = target - seen.view.eye;
    seen.view.axis.normalize();
    seen.view.axis += random.direction() * 0.2;
    seen.view.axis.normalize();
    seen.view.leastCosine = random.between(0.3, 0.99);
    seen.view.pixelScale = std::pow(10.0, random.between(1.0, 5.0));
    seen.view.orthographic = random.between(0.0, 1.0) < 0.2;
    seen.options.errorPixels = std::pow(10.0, random.between(-3.0, 1.0));
    seen.options.bound =
        random.between(0.0, 1.0) < 0.5 ? SelectionOptions::Bound::Conservative : SelectionOptions::Bound::FirstOrder;
    seen.options.metric =
        random.between(0.0, 1.0) < 0.7 ? SelectionOptions::Metric::View : SelectionOptions::Metric::Isotropic;
    return seen;
}

Lanes needsOf(const Kernel& kernel, const Block& block, const View& view, int hint)
{
    Lanes needs;
    kernel.needs(view, block.spheres, block.errors.data(), hint, needs.at);
    return needs;
}

bool haveSameBits(const Lanes& a, const Lanes& b)
{
    return std::memcmp(&a, &b, sizeof(Lanes)) == 0;
}

/// LevelNeed.cpp's formulas in double precision.
double needInDoublePrecision(const Block& block, unsigned lane, const SeenBlock& seen)
{
    const SelectionView& view = seen.view;
    const bool conservative = seen.options.bound == SelectionOptions::Bound::Conservative;
    const double slope = seen.options.errorPixels / view.pixelScale;
    const osg::Vec3d center(block.spheres.x[lane], block.spheres.y[lane], block.spheres.z[lane]);
    const double radius = conservative ? block.spheres.radius[lane] : 0.0;
    const double distance = (center - view.eye).length();
    osg::Vec3d direction = (center - view.eye) / distance;
    double sine = std::min(radius / distance, 1.0);
    double tolerance = slope * distance;
    double loss = 0.0;
    if (view.orthographic) {
        direction = view.axis;
        sine = 0.0;
        tolerance = slope;
    }
    const double cosine = std::sqrt(1.0 - sine * sine);
    if (conservative && !view.orthographic) {
        const double axial = direction * view.axis;
        const double leastCosine = std::max(axial * cosine - std::sqrt(1.0 - axial * axial) * sine, view.leastCosine);
        loss = slope * leastCosine;
        tolerance = distance > radius
                        ? loss * std::max({distance * axial - radius, (distance - radius) * leastCosine, 0.0})
                        : 0.0;
    }
    const auto errorAt = [&](int level) {
        if (level == kLevels) { return 0.0; }
        const Errors& at = block.errors[static_cast<std::size_t>(level)];
        const double most = at.isotropic[lane];
        if (seen.options.metric == SelectionOptions::Metric::Isotropic) { return most * (1.0 + loss); }
        const auto q = [&](std::size_t k) { return double{at.q[k][lane]}; };
        const double x = direction.x();
        const double y = direction.y();
        const double z = direction.z();
        const double form =
            q(0) * x * x + q(1) * y * y + q(2) * z * z + 2.0 * (q(3) * x * y + q(4) * x * z + q(5) * y * z);
        const double squared = std::min(std::max(form, 0.0), most * most * cosine * cosine);
        return std::sqrt(squared) * cosine + std::sqrt(most * most - squared) * sine + most * loss;
    };
    for (int level = kLevels; level-- > 0;) {
        const double error = errorAt(level);
        const double enough = conservative ? LevelNeed::kErrorRatio * error : error;
        const double tooMuch = conservative ? error : errorAt(level + 1);
        if (enough > tolerance) { return level + std::min(1.0, (enough - tolerance) / (enough - tooMuch)); }
    }
    return 0.0;
}

TEST(LevelNeedKernel, sayWhatDoublePrecisionSaysAndNeverLessWhereItIsABound)
{
    Random random(1);
    std::size_t between = 0;
    for (int k = 0; k < 20000; ++k) {
        Block block = randomBlock(random);
        const SeenBlock seen = randomView(random);
        const LevelNeed need(seen.view, seen.options, kLevels, kLevels - 1, 1.0);
        const bool conservative = seen.options.bound == SelectionOptions::Bound::Conservative;
        if (!conservative) { std::fill_n(block.spheres.radius, kLanes, 0.0F); }
        const Lanes needs = needsOf(best(), block, need.kernelView(), 0);
        for (unsigned lane = 0; lane < kLanes; ++lane) {
            const double exact = needInDoublePrecision(block, lane, seen);
            const auto found = double{needs.at[lane]};
            if (conservative) { ASSERT_GE(found, exact - 1e-6) << k; } // a level's own rounding to single precision
            // Allowances add up to a thousandth of the error, the level's slope in it is 11: a hundredth of a level. The depth
            // may be a small difference of large numbers.
            EXPECT_NEAR(found, exact, 0.05) << k << " " << lane;
            between += found != std::floor(found) ? 1 : 0;
        }
    }
    EXPECT_GT(between, 10000U);
}

TEST(LevelNeedKernel, doesNotDependOnTheHint)
{
    Random random(2);
    for (int k = 0; k < 5000; ++k) {
        const Block block = randomBlock(random);
        const SeenBlock seen = randomView(random);
        const LevelNeed need(seen.view, seen.options, kLevels, static_cast<unsigned>(random.between(0.0, kLevels)),
                             1.0);
        const Lanes expected = needsOf(best(), block, need.kernelView(), 0);
        for (int hint = 1; hint < kLevels + 2; ++hint) {
            ASSERT_TRUE(haveSameBits(needsOf(best(), block, need.kernelView(), hint), expected)) << k << " " << hint;
        }
    }
}

/// Those of all builds on anything, numbers or not.
TEST(LevelNeedKernel, givesTheSameBitsWhateverTheProcessor)
{
    if (avx2() == nullptr) { GTEST_SKIP() << "this processor has no AVX2"; }
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    Random random(3);
    for (int k = 0; k < 20000; ++k) {
        const Block block = randomBlock(random);
        const SeenBlock seen = randomView(random);
        View view = LevelNeed(seen.view, seen.options, kLevels, kLevels - 1, 1.0).kernelView();
        if (k % 10 == 0) {
            const std::array<float, 5> strange{kNan, kInfinity, -kInfinity, 0.0F, 1e30F};
            const float value = strange[static_cast<std::size_t>(k / 10) % strange.size()];
            float* const places[] = {&view.eyeHigh[1], &view.eyeLow[0], &view.axis[2], &view.slope, &view.leastCosine};
            *places[static_cast<std::size_t>(k / 50) % 5] = value;
        }
        const Lanes needs = needsOf(*avx2(), block, view, 3);
        ASSERT_TRUE(haveSameBits(needs, needsOf(baseline(), block, view, 3))) << k;
        for (const float need : needs.at) { ASSERT_TRUE(need >= 0.0F && need <= kLevels) << k << ": " << need; }

        ConeAxes axes{};
        Lanes cosines{};
        Borders borders{};
        std::array<Lanes, 3> all{};
        for (unsigned lane = 0; lane < kLanes; ++lane) {
            const osg::Vec3d axis = random.direction();
            axes.x[lane] = static_cast<float>(axis.x());
            axes.y[lane] = static_cast<float>(axis.y());
            axes.z[lane] = static_cast<float>(axis.z());
            cosines.at[lane] = random.single(-1.0, 1.0);
            borders.reach[lane] = 6.0F;
            for (std::size_t side = 0; side < 3; ++side) {
                borders.twins[side][lane] = static_cast<std::uint32_t>(random.between(0.0, 8.0));
                borders.twinSides[side][lane] = static_cast<std::uint32_t>(random.between(0.0, 3.0));
                borders.finest[side][lane] = std::floor(random.single(0.0, 7.0));
                all[side].at[lane] = random.single(0.0, 7.0);
            }
        }
        const float plane[] = {0.6F, 0.0F, 0.8F, random.single(-1.0, 1.0)};
        ASSERT_EQ(avx2()->behind(plane, block.spheres), baseline().behind(plane, block.spheres));
        for (const float sign : {1.0F, -1.0F}) {
            ASSERT_EQ(avx2()->hidden(view, block.spheres, axes, cosines, sign),
                      baseline().hidden(view, block.spheres, axes, cosines, sign));
        }
        for (const std::uint32_t stride : {0U, kLanes}) {
            Levels fast{};
            Levels plain{};
            ASSERT_EQ(avx2()->levels(view, borders, all[0].at, stride, 0, 5.0F, fast),
                      baseline().levels(view, borders, all[0].at, stride, 0, 5.0F, plain));
            ASSERT_EQ(std::memcmp(&fast, &plain, sizeof(Levels)), 0);
            for (unsigned lane = 0; lane < kLanes; ++lane) {
                const float most = std::max({plain.edges[0][lane], plain.edges[1][lane], plain.edges[2][lane]});
                ASSERT_EQ(static_cast<float>(plain.drawn[lane]), std::ceil(most));
            }
        }
    }
}

TEST(LevelNeedKernel, hiddenIsWhatShowsItsBackFromAnywhere)
{
    Random random(4);
    std::size_t hidden = 0;
    for (int k = 0; k < 4000; ++k) {
        const Block block = randomBlock(random);
        const SeenBlock seen = randomView(random);
        const View view = LevelNeed(seen.view, seen.options, kLevels, kLevels - 1, 1.0).kernelView();
        ConeAxes rounded{};
        Lanes cosines{};
        std::array<osg::Vec3d, kLanes> axes;
        for (unsigned lane = 0; lane < kLanes; ++lane) {
            axes[lane] = random.direction();
            const double angle = random.between(0.0, 1.2);
            rounded.x[lane] = static_cast<float>(axes[lane].x());
            rounded.y[lane] = static_cast<float>(axes[lane].y());
            rounded.z[lane] = static_cast<float>(axes[lane].z());
            cosines.at[lane] = static_cast<float>(std::cos(angle));
        }
        for (const double sign : {1.0, -1.0}) {
            const unsigned lanes = best().hidden(view, block.spheres, rounded, cosines, static_cast<float>(sign));
            for (unsigned lane = 0; lane < kLanes; ++lane) {
                if ((lanes >> lane & 1U) == 0) { continue; }
                ++hidden;
                const osg::Vec3d center(block.spheres.x[lane], block.spheres.y[lane], block.spheres.z[lane]);
                for (int sample = 0; sample < 50; ++sample) {
                    const osg::Vec3d point = center + random.direction() * double{block.spheres.radius[lane]};
                    // On the cone's rim.
                    osg::Vec3d across = random.direction() ^ axes[lane];
                    across.normalize();
                    const double cosine = cosines.at[lane];
                    const osg::Vec3d normal = axes[lane] * cosine + across * std::sqrt(1.0 - cosine * cosine);
                    const osg::Vec3d sight = seen.view.orthographic ? seen.view.axis : point - seen.view.eye;
                    ASSERT_GT(sign * (normal * sight), 0.0) << k;
                }
            }
        }
    }
    EXPECT_GT(hidden, 3000U);
}

} // namespace
} // namespace osgTessLOD::kernel
