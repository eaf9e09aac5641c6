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

TEST(ViewError, isNowhereBelowItsSmallest)
{
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    for (int k = 0; k < 200; ++k) {
        // BᵀB plus, at times, next to nothing: flat forms, equal eigenvalues and small ones.
        float b[3][3];
        for (auto& row : b) {
            for (float& x : row) { x = normal(random) * (k % 4 == 0 ? 1e-3F : 1.0F); }
        }
        if (k % 3 == 0) { b[2][0] = b[2][1] = b[2][2] = 0.0F; }
        const auto product = [&](int i, int j) { return b[0][i] * b[0][j] + b[1][i] * b[1][j] + b[2][i] * b[2][j]; };
        const float more = k % 5 == 0 ? 1.0F : 0.0F;
        const ViewError error{{product(0, 0) + more, product(1, 1) + more, product(2, 2) + more, product(0, 1),
                               product(0, 2), product(1, 2)}};
        const double smallest = error.smallest();
        double least = 1e9;
        for (int n = 0; n < 20000; ++n) { least = std::min(least, error.evaluate(randomDirection(random))); }
        EXPECT_LE(smallest, least);
        const double size = std::sqrt(double{error.q[0]} + error.q[1] + error.q[2]);
        EXPECT_NEAR(smallest, least, 0.03 * size) << "as near as so many directions come";
    }
    EXPECT_NEAR(ViewError::isotropic(0.25F).smallest(), 0.25, 1e-7);
    EXPECT_EQ(ViewError().smallest(), 0.0);
    EXPECT_EQ((ViewError{{4.0F, 4.0F, 0.0F, 0.0F, 0.0F, 0.0F}}.smallest()), 0.0);
    EXPECT_EQ((ViewError{{-1e-20F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F}}.smallest()), 0.0);
}

TEST(ViewError, negativeByRoundingIsZero)
{
    EXPECT_EQ((ViewError{{-1e-20F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F}}.evaluate({1.0, 0.0, 0.0})), 0.0);
}

} // namespace
} // namespace osgTessLOD
