// SPDX-License-Identifier: MIT
// That views bound what projections do.
#include <osgTessLOD/render/SelectionView.h>

#include <gtest/gtest.h>

#include <osg/Vec2d>
#include <osg/Vec4d>

#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace osgTessLOD {
namespace {

constexpr double kWidth = 900.0;
constexpr double kHeight = 600.0;

struct Named {
    std::string name;
    osg::Matrixd localToEye;
    osg::Matrixd projection;
};

std::vector<Named> cameras()
{
    const osg::Matrixd look =
        osg::Matrixd::lookAt(osg::Vec3d(3.0, -2.0, 1.0), osg::Vec3d(0.2, 0.1, 0.0), osg::Vec3d(0.1, 0.3, 1.0));
    const osg::Matrixd wide = osg::Matrixd::perspective(110.0, 1.5, 0.1, 100.0);
    osg::Matrixd reversed = wide; // depth runs the other way and never ends
    reversed(2, 2) = 0.0;
    reversed(3, 2) = 0.1;
    const osg::Matrixd ortho = osg::Matrixd::ortho(-4.0, 6.0, -3.0, 3.0, 0.1, 100.0);
    const osg::Matrixd turned = osg::Matrixd::rotate(0.5 * osg::PI, 0.0, 0.0, 1.0);
    const osg::Matrixd squeezed = osg::Matrixd::scale(1.0, 3.0, 0.2) * osg::Matrixd::rotate(0.7, 1.0, 1.0, 0.0) * look;
    return {{"narrow", look, osg::Matrixd::perspective(5.0, 1.5, 0.1, 100.0)},
            {"wide", look, wide},
            {"reversed and infinite", look, reversed},
            {"off centre", look, osg::Matrixd::frustum(-0.05, 0.3, 0.02, 0.2, 0.1, 100.0)},
            {"turned", look, wide * turned},
            {"mirrored", osg::Matrixd::scale(-1.0, 1.0, 1.0) * look, wide},
            {"squeezed", squeezed, wide},
            {"tiny", osg::Matrixd::scale(1e-6, 1e-6, 1e-6) * look, wide},
            {"orthographic", look, ortho},
            {"orthographic, squeezed and turned", squeezed, ortho * turned}};
}

osg::Vec4d clipOf(const Named& camera, const osg::Vec3d& p)
{
    return osg::Vec4d(p, 1.0) * (camera.localToEye * camera.projection);
}

osg::Vec2d pixelOf(const osg::Vec4d& clip)
{
    return {0.5 * kWidth * clip.x() / clip.w(), 0.5 * kHeight * clip.y() / clip.w()};
}

TEST(SelectionView, boundsWhatIsSeenOfADisplacementAndNoMoreThanNeeded)
{
    std::mt19937 random(4);
    const auto uniform = [&](double from, double to) {
        return std::uniform_real_distribution<double>(from, to)(random);
    };
    for (const Named& camera : cameras()) {
        const SelectionView view = makeSelectionView(camera.localToEye, camera.projection, kWidth, kHeight);
        ASSERT_GT(view.pixelScale, 0.0) << camera.name;
        const osg::Matrixd clipToLocal = osg::Matrixd::inverse(camera.localToEye * camera.projection);
        double largest = 0.0;
        double leastCosine = 1.0;
        for (int k = 0; k < 20000; ++k) {
            const osg::Vec4d at =
                osg::Vec4d(uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(0.1, 0.9), 1.0) * clipToLocal;
            const osg::Vec3d p = osg::Vec3d(at.x(), at.y(), at.z()) / at.w();
            const double depth = (p - view.eye) * view.axis;
            const osg::Vec3d direction = view.orthographic ? view.axis : (p - view.eye) / (p - view.eye).length();
            const osg::Vec3d v = osg::Vec3d(uniform(-1.0, 1.0), uniform(-1.0, 1.0), uniform(-1.0, 1.0)) *
                                 (0.2 * (view.orthographic ? 1.0 : depth));
            const double pixels = (pixelOf(clipOf(camera, p + v)) - pixelOf(clipOf(camera, p))).length();
            const double cosine = direction * view.axis;
            const double bound = view.pixelScale * (v ^ direction).length() /
                                 (view.orthographic ? 1.0 : cosine * ((p + v - view.eye) * view.axis));
            ASSERT_LE(pixels, bound * (1.0 + 1e-9)) << camera.name;
            largest = std::max(largest, pixels / bound);
            leastCosine = std::min(leastCosine, cosine);
        }
        EXPECT_GT(largest, 0.99) << camera.name;
        EXPECT_GE(leastCosine, view.leastCosine) << camera.name;
        EXPECT_NEAR(std::acos(leastCosine), std::acos(view.leastCosine), 0.05) << camera.name;
    }
}

TEST(SelectionView, knowsWhereTheEyeIsAndWhatItLooksAlong)
{
    for (const Named& camera : cameras()) {
        const SelectionView view = makeSelectionView(camera.localToEye, camera.projection, kWidth, kHeight);
        const osg::Matrixd eyeToLocal = osg::Matrixd::inverse(camera.localToEye);
        EXPECT_EQ(view.orthographic, camera.name.find("orthographic") == 0);
        EXPECT_NEAR(view.axis.length(), 1.0, 1e-12);
        if (view.orthographic) { continue; }
        EXPECT_LE((view.eye - eyeToLocal.getTrans()).length(), 1e-9 * eyeToLocal.getTrans().length()) << camera.name;
        // Depth grows away from the eye.
        EXPECT_GT(clipOf(camera, view.eye + view.axis).w(), 0.0) << camera.name;
        EXPECT_NEAR(clipOf(camera, view.eye).w(), 0.0, 1e-9) << camera.name;
    }
}

TEST(SelectionView, isKnownFromThatOfAnotherSpace)
{
    const osg::Matrixd move = osg::Matrixd::rotate(0.7, 1.0, 2.0, 0.5) * osg::Matrixd::translate(1.0, -2.0, 0.4);
    for (const Named& camera : cameras()) {
        const SelectionView view = makeSelectionView(camera.localToEye, camera.projection, kWidth, kHeight);
        for (const osg::Matrixd& placement : {osg::Matrixd(), move, osg::Matrixd::scale(-0.3, 0.3, 0.3) * move,
                                              osg::Matrixd::scale(0.3, 2.0, 1.1) * move}) {
            const SelectionView exact =
                makeSelectionView(placement * camera.localToEye, camera.projection, kWidth, kHeight);
            const SelectionView placed = placedView(view, placement);
            const bool isAlike = std::fabs(osg::Matrixd::transform3x3(placement, osg::Vec3d(1, 0, 0)).length2() -
                                           osg::Matrixd::transform3x3(placement, osg::Vec3d(0, 1, 0)).length2()) < 1e-9;
            EXPECT_EQ(placed.orthographic, exact.orthographic);
            EXPECT_LE((placed.axis ^ exact.axis).length(), 1e-9) << camera.name;
            EXPECT_GE(placed.pixelScale, exact.pixelScale * (1.0 - 1e-9)) << camera.name;
            EXPECT_LE(placed.pixelScale, exact.pixelScale * (isAlike ? 1.0 + 1e-9 : 20.0)) << camera.name;
            if (placed.orthographic) { continue; }
            EXPECT_GT(placed.axis * exact.axis, 0.0) << camera.name;
            EXPECT_LE((placed.eye - exact.eye).length(), 1e-9 * (1.0 + exact.eye.length())) << camera.name;
            EXPECT_LE(placed.leastCosine, exact.leastCosine + 1e-9) << camera.name;
            if (isAlike) { EXPECT_NEAR(placed.leastCosine, exact.leastCosine, 1e-9) << camera.name; }
        }
        for (const osg::Matrixd& flat : {osg::Matrixd::scale(0.0, 0.0, 0.0), osg::Matrixd::scale(1.0, 0.0, 1.0)}) {
            EXPECT_EQ(placedView(view, flat).pixelScale, 0.0) << camera.name;
        }
    }
}

TEST(SelectionView, whatShowsNothingHasNoPixels)
{
    const Named camera = cameras()[1];
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    for (const double size : {0.0, -5.0, kNan}) {
        EXPECT_EQ(makeSelectionView(camera.localToEye, camera.projection, size, kHeight).pixelScale, 0.0);
        EXPECT_EQ(makeSelectionView(camera.localToEye, camera.projection, kWidth, size).pixelScale, 0.0);
    }
    const osg::Matrixd flat = osg::Matrixd::scale(1.0, 0.0, 1.0);
    const osg::Matrixd nowhere = osg::Matrixd::translate(kNan, 0.0, 0.0);
    for (const osg::Matrixd& strange : {flat, nowhere, osg::Matrixd::scale(0.0, 0.0, 0.0)}) {
        EXPECT_EQ(makeSelectionView(strange, camera.projection, kWidth, kHeight).pixelScale, 0.0);
        EXPECT_EQ(makeSelectionView(camera.localToEye, strange, kWidth, kHeight).pixelScale, 0.0);
    }
}

} // namespace
} // namespace osgTessLOD
