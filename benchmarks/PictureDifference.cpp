// SPDX-License-Identifier: MIT
#include "PictureDifference.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

constexpr int kWindow = 8;
constexpr int kStride = 4;

const unsigned char* pixelAt(const osg::Image& image, int x, int y)
{
    return image.data(static_cast<unsigned>(x), static_cast<unsigned>(y));
}

bool isDrawn(const osg::Image& image, int x, int y)
{
    return pixelAt(image, x, y)[3] != 0;
}

/// Rec. 601.
double greyAt(const osg::Image& image, int x, int y)
{
    const unsigned char* p = pixelAt(image, x, y);
    return 0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2];
}

/// Drawn on, with a neighbour in the picture that is not.
bool isSilhouette(const osg::Image& image, int x, int y)
{
    if (!isDrawn(image, x, y)) { return false; }
    return (x > 0 && !isDrawn(image, x - 1, y)) || (x + 1 < image.s() && !isDrawn(image, x + 1, y)) ||
           (y > 0 && !isDrawn(image, x, y - 1)) || (y + 1 < image.t() && !isDrawn(image, x, y + 1));
}

double decibelsOf(const osg::Image& first, const osg::Image& second)
{
    double sum = 0.0;
    double count = 0.0;
    for (int y = 0; y < first.t(); ++y) {
        for (int x = 0; x < first.s(); ++x) {
            if (!isDrawn(first, x, y) && !isDrawn(second, x, y)) { continue; }
            for (int k = 0; k < 3; ++k) { sum += std::pow(pixelAt(first, x, y)[k] - pixelAt(second, x, y)[k], 2.0); }
            count += 3.0;
        }
    }
    if (sum == 0.0) { return PictureDifference::kMostDecibels; }
    return std::min(PictureDifference::kMostDecibels, 10.0 * std::log10(255.0 * 255.0 * count / sum));
}

/// Sums over a window of two pictures' grey levels.
struct WindowSums {
    double a = 0.0;
    double b = 0.0;
    double aa = 0.0;
    double bb = 0.0;
    double ab = 0.0;
    bool isDrawn = false;

    double similarity() const
    {
        constexpr double kCount = kWindow * kWindow;
        constexpr double kMeans = 0.01 * 255.0 * 0.01 * 255.0;
        constexpr double kVariances = 0.03 * 255.0 * 0.03 * 255.0;
        const double meanA = a / kCount;
        const double meanB = b / kCount;
        const double varianceA = aa / kCount - meanA * meanA;
        const double varianceB = bb / kCount - meanB * meanB;
        const double covariance = ab / kCount - meanA * meanB;
        return (2.0 * meanA * meanB + kMeans) * (2.0 * covariance + kVariances) /
               ((meanA * meanA + meanB * meanB + kMeans) * (varianceA + varianceB + kVariances));
    }
};

WindowSums sumsAt(const osg::Image& first, const osg::Image& second, int left, int bottom)
{
    WindowSums sums;
    for (int y = bottom; y < bottom + kWindow; ++y) {
        for (int x = left; x < left + kWindow; ++x) {
            const double a = greyAt(first, x, y);
            const double b = greyAt(second, x, y);
            sums.a += a;
            sums.b += b;
            sums.aa += a * a;
            sums.bb += b * b;
            sums.ab += a * b;
            sums.isDrawn = sums.isDrawn || isDrawn(first, x, y) || isDrawn(second, x, y);
        }
    }
    return sums;
}

double meanSimilarity(const osg::Image& first, const osg::Image& second)
{
    double sum = 0.0;
    double count = 0.0;
    for (int y = 0; y + kWindow <= first.t(); y += kStride) {
        for (int x = 0; x + kWindow <= first.s(); x += kStride) {
            const WindowSums window = sumsAt(first, second, x, y);
            if (!window.isDrawn) { continue; }
            sum += window.similarity();
            count += 1.0;
        }
    }
    return count == 0.0 ? 1.0 : sum / count;
}

} // namespace

PictureDifference comparePictures(const osg::Image& first, const osg::Image& second)
{
    if (first.s() != second.s() || first.t() != second.t()) {
        throw std::invalid_argument("pictures of different sizes cannot be compared");
    }
    PictureDifference difference;
    difference.psnr = decibelsOf(first, second);
    difference.ssim = meanSimilarity(first, second);
    for (int y = 0; y < first.t(); ++y) {
        for (int x = 0; x < first.s(); ++x) {
            difference.onlyOne += isDrawn(first, x, y) != isDrawn(second, x, y) ? 1 : 0;
            difference.silhouette += isSilhouette(second, x, y) ? 1 : 0;
        }
    }
    return difference;
}

} // namespace osgTessLOD::benchmarks
