// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// The first channels of an image file.
struct ImageData {
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    unsigned channels = 0;
    std::vector<float> pixels; ///< `channels` numbers each, rows from the top; integers as parts of the largest one
    double largestInteger =
        0.0; ///< that the file's format holds, such as 65,535; 0: floating-point numbers, as they are
};

/// The first channels of an image file that is read a few rows at a time: of images that are larger than memory.
class ImageRows {
public:
    virtual ~ImageRows() = default;

    std::uint32_t width = 0;
    std::uint32_t height = 0;
    double largestInteger = 0.0; ///< as in ImageData
    std::uint32_t band = 1;      ///< rows that the file has together: reads best begin at multiples of it

    /// Rows `first` … `first` + `count` − 1 from the top, width · channels numbers each, as ImageData has them. Quick where rows are
    /// read in their order. Throws AssetError naming the file and the fault.
    virtual void read(std::uint32_t first, std::uint32_t count, float* pixels) = 0;
};

/// Where a survey lies, and what it does not know.
struct Georeference {
    std::array<double, 2> spacing{1.0, 1.0}; ///< between columns and rows
    std::array<double, 2> corner{0.0, 0.0};  ///< of column 0 of row 0, to the east and to the north
    std::optional<double> voidValue;         ///< the height that means no data
    bool inDegrees = false;                  ///< longitude and latitude
};

/// What reads and makes image files: a module of its own, loaded when the first one is to be read. It brings the libraries of all
/// image formats along, which bakes of meshes do without.
class ImageFiles {
public:
    virtual ~ImageFiles() = default;

    /// Of the format that the path's extension tells. Throws AssetError naming the file and the fault: unreadable, not of two dimensions, fewer channels than asked for, more
    /// than 2^32 numbers or 16,384 times the size of the file.
    virtual ImageData read(const std::string& path, unsigned channels) const = 0;
    /// The same, to be read by rows, however many there are.
    virtual std::unique_ptr<ImageRows> open(const std::string& path, unsigned channels) const = 0;
    /// The bytes of a file of this image, of the format that the path's extension tells; nothing is written there. Floating-point numbers
    /// of 32 bits if image.largestInteger is 0, else 16 bits for 0 … 1. Throws AssetError naming the path and the fault.
    virtual std::string encode(const std::string& path, const ImageData& image) const = 0;
    /// Of a TIFF file; the default where it has none.
    virtual Georeference georeference(const std::string& path) const = 0;
};

/// Throws AssetError where the module cannot be loaded. Any thread.
const ImageFiles& imageFiles();

/// The module's only function: its ImageFiles, which lives as long as the program.
constexpr const char* kImageFilesFunction = "osgTessLODImageFiles";
using ImageFilesFunction = const ImageFiles*();

} // namespace osgTessLOD::bake
