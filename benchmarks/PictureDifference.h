// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Image>

#include <cstdint>

namespace osgTessLOD::benchmarks {

/// How two pictures of the same size differ. They are GL_RGBA, GL_UNSIGNED_BYTE; alpha 0 is where nothing was drawn.
struct PictureDifference {
    /// Peak signal-to-noise ratio, dB, of red, green and blue of all pixels that either draws on; kMostDecibels where these are equal,
    /// or there are none.
    double psnr = 0.0;
    /// Mean structural similarity of grey levels (Wang et al., "Image quality assessment: from error visibility to structural
    /// similarity", IEEE TIP 13 (4), 2004, eq. 13) in 8 × 8 windows, a window every 4 pixels, that either draws in; 1 without any.
    double ssim = 1.0;
    std::uint64_t onlyOne = 0; ///< pixels that one of them draws on and the other does not
    std::uint64_t silhouette =
        0; ///< pixels that the second draws on and that have a neighbour which it does not draw on

    static constexpr double kMostDecibels = 100.0;
    /// By how many pixels silhouettes are apart on average; 0 where the second has none.
    double silhouettePixels() const
    {
        return silhouette == 0 ? 0.0 : static_cast<double>(onlyOne) / static_cast<double>(silhouette);
    }
};

/// Throws std::invalid_argument for pictures of different sizes.
PictureDifference comparePictures(const osg::Image& first, const osg::Image& second);

} // namespace osgTessLOD::benchmarks
