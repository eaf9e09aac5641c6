// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/DisplacementImage.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/ImageFiles.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace osgTessLOD::bake {

namespace {

/// `pixel` of `size` that repeat.
std::size_t wrapped(double pixel, std::uint32_t size)
{
    const double turns = std::floor(pixel / size);
    const auto within = static_cast<std::int64_t>(pixel - turns * size);
    return static_cast<std::size_t>(std::min<std::int64_t>(within, size - 1));
}

void checkFinite(const std::string& path, const ImageData& image)
{
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        if (!std::isfinite(image.pixels[i])) {
            const std::size_t pixel = i / image.channels;
            throw AssetError(path + ": pixel (" + std::to_string(pixel % image.width) + ", " +
                             std::to_string(pixel / image.width) + ") is not a finite number");
        }
    }
}

} // namespace

DisplacementImage::DisplacementImage(std::uint32_t width, std::uint32_t height, unsigned channels,
                                     std::vector<float> pixels)
    : _width(width)
    , _height(height)
    , _channels(channels)
    , _pixels(std::move(pixels))
{
    assert(width > 0 && height > 0 && (channels == 1 || channels == 3));
    assert(_pixels.size() == std::size_t{width} * height * channels);
}

DisplacementImage DisplacementImage::read(const std::string& path, unsigned channels)
{
    ImageData image = imageFiles().read(path, channels);
    checkFinite(path, image);
    return DisplacementImage(image.width, image.height, channels, std::move(image.pixels));
}

DisplacementImage::Footprint DisplacementImage::footprintAt(const Eigen::Vector2d& uv) const
{
    const double x = uv.x() * _width - 0.5;
    const double y = (1.0 - uv.y()) * _height - 0.5;
    const double left = std::floor(x);
    const double top = std::floor(y);
    const double s = x - left;
    const double t = y - top;
    const std::array<std::size_t, 2> columns{wrapped(left, _width), wrapped(left + 1.0, _width)};
    const std::array<std::size_t, 2> rows{wrapped(top, _height), wrapped(top + 1.0, _height)};
    const auto pixel = [&](std::size_t row, std::size_t column) { return rows[row] * _width + columns[column]; };
    return {{pixel(0, 0), pixel(0, 1), pixel(1, 0), pixel(1, 1)},
            {(1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t}};
}

double DisplacementImage::filtered(const Footprint& footprint, unsigned channel) const
{
    double sum = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        sum += footprint.weights[k] * static_cast<double>(_pixels[footprint.pixels[k] * _channels + channel]);
    }
    return sum;
}

double DisplacementImage::scalarAt(const Eigen::Vector2d& uv) const
{
    return filtered(footprintAt(uv), 0);
}

Eigen::Vector3d DisplacementImage::vectorAt(const Eigen::Vector2d& uv) const
{
    const Footprint footprint = footprintAt(uv);
    if (_channels == 1) { return Eigen::Vector3d::Constant(filtered(footprint, 0)); }
    return {filtered(footprint, 0), filtered(footprint, 1), filtered(footprint, 2)};
}

} // namespace osgTessLOD::bake
