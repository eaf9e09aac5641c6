// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/ViewError.h>

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace osgTessLOD {
namespace {

std::array<double, 3> randomDirection(std::mt19937& random)
{
    std::normal_distribution<double> normal;
    std::array<double, 3> d{normal(random), normal(random), normal(random)};
    const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (double& x : d) { x /= length; }
    return d;
}

TEST(ViewError, isotropicIsTheSameInAllDirections)
{
    std::mt19937 random(2);
    const ViewError error = ViewError::isotropic(0.25F);
    // 0.25 and its square are exact; what is left is the direction's length, rounded in double.
    for (int k = 0; k < 1000; ++k) { EXPECT_NEAR(error.evaluate(randomDirection(random)), 0.25, 1e-15); }
    EXPECT_EQ(ViewError::isotropic(0.0F).evaluate({1.0, 0.0, 0.0}), 0.0);
}

TEST(ViewError, evaluatesTheQuadraticFormOfItsMatrix)
{
    std::mt19937 random(3);
    std::uniform_real_distribution<float> uniform(-0.2F, 0.2F);
    for (int k = 0; k < 1000; ++k) {
        // Diagonally dominant, hence positive: 1 > 2 · 0.2 + 0.2.
        ViewError error{{1.0F + uniform(random), 1.0F + uniform(random), 1.0F + uniform(random), uniform(random),
                         uniform(random), uniform(random)}};
        const auto& q = error.q;
        const double matrix[3][3] = {{q[0], q[3], q[4]}, {q[3], q[1], q[5]}, {q[4], q[5], q[2]}};
        const auto d = randomDirection(random);
        double squared = 0.0;
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < 3; ++j) { squared += d[i] * matrix[i][j] * d[j]; }
        }
        EXPECT_NEAR(error.evaluate(d), std::sqrt(squared), 1e-14);
    }
}

TEST(ViewError, ofOneVectorIsItsLengthAsSeen)
{
    // The difference vector v = (0, 0, 2): E(d) = |v × d|, Q = |v|² I − v vᵀ.
    const ViewError error{{4.0F, 4.0F, 0.0F, 0.0F, 0.0F, 0.0F}};
    EXPECT_EQ(error.evaluate({0.0, 0.0, 1.0}), 0.0);
    EXPECT_EQ(error.evaluate({1.0, 0.0, 0.0}), 2.0);
    EXPECT_NEAR(error.evaluate({0.6, 0.0, 0.8}), 1.2, 1e-15);
}

TEST(ViewError, negativeByRoundingIsZero)
{
    EXPECT_EQ((ViewError{{-1e-20F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F}}.evaluate({1.0, 0.0, 0.0})), 0.0);
}

} // namespace
} // namespace osgTessLOD
