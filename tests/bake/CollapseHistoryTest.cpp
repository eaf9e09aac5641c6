// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/CollapseHistory.h>

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Step = CollapseHistory::Step;

/// A step whose sector i replaces source face i, v being corner i mod 3 of it.
Step stepOf(const std::vector<Eigen::Vector2f>& ring, unsigned gap = Step::kNoGap)
{
    Step step;
    step.ringSize = static_cast<unsigned>(ring.size());
    step.gap = gap;
    step.center = {0.0F, 0.0F};
    for (unsigned i = 0; i < step.ringSize; ++i) {
        step.ring[i] = ring[i];
        step.oldFace[i] = i;
        step.corner[i] = static_cast<std::uint8_t>(i % 3);
    }
    return step;
}

// Coordinates and areas are powers of two, so that nothing is rounded and results are exact.
//
//        r2 ─── r1
//       /         \        twice the area is 4 for every old face and for the new ones (0, 1, 2) and (0, 4, 5),
//     r3     v     r0      8 for (0, 2, 3) and (0, 3, 4)
//       \         /
//        r4 ─── r5
const std::vector<Eigen::Vector2f> kHexagon{{2, 0}, {1, 2}, {-1, 2}, {-2, 0}, {-1, -2}, {1, -2}};
const std::vector<Eigen::Vector2f> kUpperHalf{{2, 0}, {1, 2}, {-1, 2}, {-2, 0}};   // gap 3
const std::vector<Eigen::Vector2f> kLowerHalf{{2, 0}, {-2, 0}, {-1, -2}, {1, -2}}; // gap 0

/// A source point in sector `sector` of `step`, with these weights of v, ring[sector], ring[sector + 1].
FacePoint inSector(const Step& step, unsigned sector, const Vector3d& weights)
{
    FacePoint point{step.oldFace[sector], Vector3d::Zero()};
    for (Eigen::Index k = 0; k < 3; ++k) { point.barycentric[(step.corner[sector] + k) % 3] = weights[k]; }
    return point;
}

Vector2d planePosition(const Step& step, unsigned sector, const Vector3d& w)
{
    return w[0] * step.center.cast<double>() + w[1] * step.ring[sector].cast<double>() +
           w[2] * step.ring[(sector + 1) % step.ringSize].cast<double>();
}

Vector2d planePosition(const Step& step, std::uint32_t firstNew, const FacePoint& p)
{
    const std::uint32_t j = p.face - firstNew;
    return p.barycentric[0] * step.ring[0].cast<double>() + p.barycentric[1] * step.ring[j + 1].cast<double>() +
           p.barycentric[2] * step.ring[j + 2].cast<double>();
}

/// Calls visit(weights) for all points of the triangle with eighths for weights.
template <typename Visit>
void forEachEighth(Visit visit)
{
    for (int i = 0; i <= 8; ++i) {
        for (int j = 0; i + j <= 8; ++j) { visit(Vector3d(Vector3d(i, j, 8 - i - j) / 8.0)); }
    }
}

void expectExactRoundTrip(const Step& step)
{
    ASSERT_GT(step.quality(), 0.0);
    CollapseHistory history(step.ringSize);
    const std::uint32_t firstNew = history.add(step);
    EXPECT_EQ(firstNew, step.ringSize);
    history.validate();
    for (unsigned sector = 0; sector < step.ringSize; ++sector) {
        if (sector == step.gap) { continue; }
        forEachEighth([&](const Vector3d& weights) {
            const FacePoint source = inSector(step, sector, weights);
            const FacePoint coarse = history.toCoarse(source);
            ASSERT_GE(coarse.face, firstNew);
            ASSERT_LT(coarse.face, firstNew + step.ringSize - 2);
            EXPECT_GE(coarse.barycentric.minCoeff(), 0.0);
            EXPECT_EQ(coarse.barycentric.sum(), 1.0);
            EXPECT_EQ(planePosition(step, firstNew, coarse), planePosition(step, sector, weights));
            const FacePoint carried = step.carry(sector, weights);
            EXPECT_EQ(carried.face + firstNew, coarse.face);
            EXPECT_EQ(carried.barycentric, coarse.barycentric);
            const FacePoint back = history.toSource(coarse);
            // On an edge between two sectors either face will do; the place is the same.
            const unsigned backSector = back.face;
            const Vector3d backWeights(back.barycentric[step.corner[backSector]],
                                       back.barycentric[(step.corner[backSector] + 1) % 3],
                                       back.barycentric[(step.corner[backSector] + 2) % 3]);
            EXPECT_EQ(planePosition(step, backSector, backWeights), planePosition(step, sector, weights));
            if (weights.minCoeff() > 0.0) {
                EXPECT_EQ(back.face, source.face);
                EXPECT_EQ(back.barycentric, source.barycentric);
            }
        });
    }
    for (std::uint32_t face = firstNew; face < firstNew + step.ringSize - 2; ++face) {
        forEachEighth([&](const Vector3d& weights) {
            const FacePoint back = history.toCoarse(history.toSource({face, weights}));
            EXPECT_EQ(planePosition(step, firstNew, back), planePosition(step, firstNew, FacePoint{face, weights}));
            if (weights.minCoeff() > 0.0) { EXPECT_EQ(back.face, face); }
        });
    }
}

TEST(CollapseHistory, InteriorCollapseIsExactBothWays) { expectExactRoundTrip(stepOf(kHexagon)); }
TEST(CollapseHistory, BoundaryCollapseWithTheGapLastIsExactBothWays) { expectExactRoundTrip(stepOf(kUpperHalf, 3)); }
TEST(CollapseHistory, BoundaryCollapseWithTheGapFirstIsExactBothWays) { expectExactRoundTrip(stepOf(kLowerHalf, 0)); }

TEST(CollapseHistory, TheCollapsedVertexLiesOnTheNewEdgeOfItsCrease)
{
    // The crease r3 ─ v ─ r0 is straight, and halves at v.
    const Step step = stepOf(kHexagon);
    CollapseHistory history(6);
    const std::uint32_t firstNew = history.add(step);
    for (unsigned sector = 0; sector < 6; ++sector) {
        const FacePoint p = history.toCoarse(inSector(step, sector, Vector3d::UnitX()));
        const bool above = p.face == firstNew + 1; // (w, r2, r3); else (w, r3, r4)
        ASSERT_TRUE(above || p.face == firstNew + 2);
        EXPECT_EQ(p.barycentric, above ? Vector3d(0.5, 0.0, 0.5) : Vector3d(0.5, 0.5, 0.0));
    }
}

TEST(CollapseHistory, PointsOfTheRingStayOnTheRing)
{
    const Step step = stepOf(kHexagon);
    CollapseHistory history(6);
    const std::uint32_t firstNew = history.add(step);
    for (int eighth = 1; eighth < 8; ++eighth) {
        const Vector3d weights(0.0, 1.0 - eighth / 8.0, eighth / 8.0);
        for (unsigned i = 0; i < 6; ++i) {
            const FacePoint p = history.toCoarse(inSector(step, i, weights));
            // Edge i of the ring is opposite w, except beside w.
            EXPECT_EQ(p.face, firstNew + (i == 0 ? 0 : i == 5 ? 3 : i - 1));
            EXPECT_EQ(p.barycentric[i == 0 ? 2 : i == 5 ? 1 : 0], 0.0) << i;
        }
    }
}

TEST(CollapseHistory, PointsOfTheBoundaryStayOnTheBoundary)
{
    for (const unsigned gap : {0U, 3U}) {
        const Step step = stepOf(gap == 0 ? kLowerHalf : kUpperHalf, gap);
        CollapseHistory history(4);
        const std::uint32_t firstNew = history.add(step);
        for (int eighth = 0; eighth < 8; ++eighth) { // w itself is in both new faces
            const double t = eighth / 8.0;
            // From v along the boundary, to the first ring vertex after the gap and to the last before it.
            const unsigned first = gap == 0 ? 1 : 0;
            const unsigned last = gap == 0 ? 3 : 2;
            const FacePoint a = history.toCoarse(inSector(step, first, {1.0 - t, t, 0.0}));
            const FacePoint b = history.toCoarse(inSector(step, last, {1.0 - t, 0.0, t}));
            for (const FacePoint& p : {a, b}) {
                EXPECT_EQ(p.face, firstNew + (gap == 0 ? 0 : 1));
                EXPECT_EQ(p.barycentric[gap == 0 ? 2 : 1], 0.0) << "off the edge from w to the other end";
            }
        }
    }
}

TEST(CollapseHistory, TwoCollapsesCompose)
{
    // After the hexagon's collapse r2 goes to r1 along the polygon's border: faces 6 = (r0, r1, r2) and 7 = (r0, r2, r3)
    // become 10 = (r1, r3, r0).
    const Step first = stepOf(kHexagon);
    Step second = stepOf({{2, 0}, {-2, 0}, {0, -2}}, 0);
    second.oldFace[1] = 7;
    second.corner[1] = 1;
    second.oldFace[2] = 6;
    second.corner[2] = 2;
    CollapseHistory history(6);
    EXPECT_EQ(history.add(first), 6U);
    EXPECT_EQ(history.add(second), 10U);
    EXPECT_EQ(history.stepCount(), 2U);
    EXPECT_EQ(history.sourceFaces(), 6U);
    history.validate();
    std::vector<int> hits(11, 0);
    for (unsigned sector = 0; sector < 6; ++sector) {
        forEachEighth([&](const Vector3d& weights) {
            if (weights.minCoeff() == 0.0) { return; }
            const FacePoint source = inSector(first, sector, weights);
            const FacePoint coarse = history.toCoarse(source);
            ++hits.at(coarse.face);
            const FacePoint back = history.toSource(coarse);
            EXPECT_EQ(back.face, source.face);
            EXPECT_EQ(back.barycentric, source.barycentric);
        });
    }
    EXPECT_EQ(hits[6] + hits[7], 0) << "replaced";
    EXPECT_GT(hits[8], 0);
    EXPECT_GT(hits[9], 0);
    EXPECT_GT(hits[10], 0);
    // r2 itself: the middle of r1 ─ r3.
    EXPECT_EQ(history.toCoarse(inSector(first, 1, Vector3d::UnitZ())).barycentric, Vector3d(0.5, 0.5, 0.0));
}

TEST(CollapseHistory, FacesThatNoStepReplacedMapToThemselves)
{
    CollapseHistory history(8); // 6 and 7 are elsewhere
    history.add(stepOf(kHexagon));
    const FacePoint p{7, Vector3d(0.25, 0.25, 0.5)};
    EXPECT_EQ(history.toCoarse(p).face, 7U);
    EXPECT_EQ(history.toCoarse(p).barycentric, p.barycentric);
    EXPECT_EQ(history.toSource(p).face, 7U);
    EXPECT_EQ(history.toSource(p).barycentric, p.barycentric);
}

TEST(CollapseHistory, QualityIsTheSmallestAreaOverTheMean)
{
    // Six of 4, then 4, 8, 8, 4: 48 in ten triangles.
    EXPECT_DOUBLE_EQ(stepOf(kHexagon).quality(), 4.0 / 4.8);
    // Three of 4, then 8 and 4: 24 in five.
    EXPECT_DOUBLE_EQ(stepOf(kLowerHalf, 0).quality(), 4.0 / 4.8);
    EXPECT_DOUBLE_EQ(stepOf(kUpperHalf, 3).quality(), 4.0 / 4.8);
}

/// Not positively oriented, each in its own way.
std::vector<Step> turnedSteps()
{
    Step outside = stepOf(kHexagon);
    outside.center = {0.0F, 3.0F}; // the sector at (1, 2), (−1, 2) is turned, the fan from w is not
    Step onTheRing = stepOf(kHexagon);
    onTheRing.center = {0.0F, 2.0F};
    Step hidden = stepOf(kHexagon);
    hidden.ring[1] = {0.25F, 0.25F}; // star-shaped around v, but not seen from w: (w, r1, r2)
    Step clockwise = stepOf({{2, 0}, {1, -2}, {-1, -2}, {-2, 0}, {-1, 2}, {1, 2}});
    return {outside, onTheRing, hidden, clockwise};
}

TEST(CollapseHistory, QualityIsNotPositiveWhereATriangleIsTurnedOver)
{
    for (const Step& step : turnedSteps()) { EXPECT_LE(step.quality(), 0.0); }
}

TEST(CollapseHistory, ValidateFindsTurnedTriangles)
{
    for (const Step& step : turnedSteps()) {
        CollapseHistory history(6);
        history.add(step);
        EXPECT_THROW(history.validate(), std::logic_error);
    }
}

} // namespace
} // namespace osgTessLOD::bake
