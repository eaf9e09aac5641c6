// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// A displacement map: an image of one or three channels, as numbers, over texture coordinates. Integer formats are read
/// as 0 … 1, floating-point ones as they are. (0, 0) is the lower left corner of the image, (1, 1) the upper right one,
/// samples are at the middles of pixels, linear in between, and the image repeats beyond [0, 1].
class OSGTESSLOD_EXPORT DisplacementImage {
public:
    /// `pixels`: `channels` (1 or 3) numbers each, rows from the top, all finite.
    DisplacementImage(std::uint32_t width, std::uint32_t height, unsigned channels, std::vector<float> pixels);

    /// Reads what OpenImageIO reads: PNG, TIFF, OpenEXR and more, of 8 to 32 bits, by the file's extension. Of images with more channels than are
    /// asked for the first ones count. Throws AssetError naming the file and the fault: unreadable, fewer channels than
    /// asked for, numbers that are not finite (which pixel).
    static DisplacementImage read(const std::string& path, unsigned channels);

    std::uint32_t width() const { return _width; }
    std::uint32_t height() const { return _height; }
    unsigned channels() const { return _channels; }

    /// Channel 0.
    double scalarAt(const Eigen::Vector2d& uv) const;
    /// All three channels; of an image with one, that one thrice.
    Eigen::Vector3d vectorAt(const Eigen::Vector2d& uv) const;

private:
    /// The four pixels around a point and their weights.
    struct Footprint {
        std::array<std::size_t, 4> pixels;
        std::array<double, 4> weights;
    };
    Footprint footprintAt(const Eigen::Vector2d& uv) const;
    double filtered(const Footprint& footprint, unsigned channel) const;

    std::uint32_t _width;
    std::uint32_t _height;
    unsigned _channels;
    std::vector<float> _pixels;
};

} // namespace osgTessLOD::bake
