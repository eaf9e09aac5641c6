// SPDX-License-Identifier: MIT
#include <benchmarks/PictureDifference.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace osgTessLOD::benchmarks {
namespace {

using Pixel = std::array<unsigned char, 4>;

constexpr int kSize = 32;
constexpr Pixel kNothing{0, 0, 0, 0};
constexpr Pixel kGrey{100, 100, 100, 255};

/// A picture of `colorAt(x, y)`.
template <typename ColorAt> osg::ref_ptr<osg::Image> picture(const ColorAt& colorAt, int size = kSize)
{
    osg::ref_ptr<osg::Image> image = new osg::Image;
    image->allocateImage(size, size, 1, GL_RGBA, GL_UNSIGNED_BYTE);
    for (int y = 0; y < size; ++y) {
        for (int x = 0; x < size; ++x) {
            const Pixel pixel = colorAt(x, y);
            std::copy(pixel.begin(), pixel.end(), image->data(static_cast<unsigned>(x), static_cast<unsigned>(y)));
        }
    }
    return image;
}

/// A grey square from `first` to `last` in both directions.
osg::ref_ptr<osg::Image> square(int first, int last, Pixel color = kGrey)
{
    return picture([=](int x, int y) {
        const bool isInside = std::min(x, y) >= first && std::max(x, y) <= last;
        return isInside ? color : kNothing;
    });
}

TEST(PictureDifference, EqualPicturesDoNotDiffer)
{
    const PictureDifference difference = comparePictures(*square(4, 19), *square(4, 19));
    EXPECT_EQ(difference.psnr, PictureDifference::kMostDecibels);
    EXPECT_NEAR(difference.ssim, 1.0, 1e-12) << "rounding of sums";
    EXPECT_EQ(difference.onlyOne, 0U);
    EXPECT_EQ(difference.silhouette, 4U * 15U) << "the square's rim";
    EXPECT_EQ(difference.silhouettePixels(), 0.0);
}

TEST(PictureDifference, BackgroundDoesNotCount)
{
    // Of 256 drawn pixels all differ by 10 steps: 20 log10(255 / 10).
    const PictureDifference difference = comparePictures(*square(4, 19), *square(4, 19, {110, 110, 110, 255}));
    EXPECT_NEAR(difference.psnr, 20.0 * std::log10(25.5), 1e-9);
    const osg::ref_ptr<osg::Image> empty = square(1, 0);
    const PictureDifference none = comparePictures(*empty, *empty);
    EXPECT_EQ(none.psnr, PictureDifference::kMostDecibels);
    EXPECT_EQ(none.ssim, 1.0);
    EXPECT_EQ(none.silhouettePixels(), 0.0);
}

TEST(PictureDifference, SilhouettesOneStepApart)
{
    // 18² − 16² pixels around a rim of 60.
    const PictureDifference difference = comparePictures(*square(3, 20), *square(4, 19));
    EXPECT_EQ(difference.onlyOne, 68U);
    EXPECT_DOUBLE_EQ(difference.silhouettePixels(), 68.0 / 60.0);
}

TEST(PictureDifference, SimilarityIsOfStructure)
{
    // In one window, all of the picture: variances are 400, means 120, and the covariance is −400.
    const auto stripes = [](int parity) {
        return picture(
            [=](int x, int) {
                const auto grey = static_cast<unsigned char>((x + parity) % 2 == 0 ? 100 : 140);
                return Pixel{grey, grey, grey, 255};
            },
            8);
    };
    const double c2 = std::pow(0.03 * 255.0, 2.0);
    const double expected = (-2.0 * 400.0 + c2) / (400.0 + 400.0 + c2);
    EXPECT_NEAR(comparePictures(*stripes(0), *stripes(1)).ssim, expected, 1e-9);
}

TEST(PictureDifference, RefusesOtherSizes)
{
    const auto grey = [](int, int) { return kGrey; };
    EXPECT_THROW(comparePictures(*picture(grey, 8), *picture(grey, 16)), std::invalid_argument);
}

} // namespace
} // namespace osgTessLOD::benchmarks
