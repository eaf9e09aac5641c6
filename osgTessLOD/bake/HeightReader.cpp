// SPDX-License-Identifier: MIT
// Reads height fields: images and GeoTIFF by ImageFiles, raw SRTM tiles by itself.
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/ImageFiles.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <utility>

namespace osgTessLOD::bake {

namespace {

constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 31;
constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180.0;

std::string extensionOf(const std::string& path)
{
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension;
}

AssetError fault(const std::string& path, const std::string& what)
{
    return AssetError(path + ": " + what);
}

void checkSize(const std::string& path, std::uint64_t columns, std::uint64_t rows)
{
    if (columns < 2 || rows < 2) { throw fault(path, "a height field has two columns and two rows at least"); }
    if (columns * rows > kMostSamples) { throw fault(path, "has more than 2^31 heights"); }
}

/// A raw SRTM tile: a square of big-endian 16-bit heights in metres over one degree, named after its south-western corner.
HeightField readHgt(const std::string& path, Georeference& where)
{
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    std::ifstream stream(path, std::ios::binary);
    if (error || !stream) { throw fault(path, "cannot be opened"); }
    const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(bytes) / 2.0)));
    if (std::uint64_t{side} * side * 2 != bytes) { throw fault(path, "is not a square of 16-bit heights"); }
    checkSize(path, side, side);
    std::vector<unsigned char> raw(static_cast<std::size_t>(bytes));
    if (!stream.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(bytes))) {
        throw fault(path, "cannot be read");
    }
    HeightField field;
    field.columns = field.rows = side;
    for (std::size_t i = 0; i < raw.size(); i += 2) {
        field.heights.push_back(static_cast<std::int16_t>(raw[i] << 8 | raw[i + 1]));
    }
    where.voidValue = std::numeric_limits<std::int16_t>::min();
    char hemisphere = 0;
    char meridian = 0;
    int latitude = 0;
    int longitude = 0;
    const std::string name = std::filesystem::path(path).stem().string();
    if (std::sscanf(name.c_str(), "%c%2d%c%3d", &hemisphere, &latitude, &meridian, &longitude) == 4) {
        const double south = std::toupper(hemisphere) == 'S' ? -latitude : latitude;
        const double west = std::toupper(meridian) == 'W' ? -longitude : longitude;
        where.corner = {west, south + 1.0};
    }
    where.spacing = {1.0 / (side - 1), 1.0 / (side - 1)};
    where.inDegrees = true;
    return field;
}

HeightField readImage(const std::string& path)
{
    ImageData image = imageFiles().read(path, 1);
    checkSize(path, image.width, image.height);
    HeightField field;
    field.columns = image.width;
    field.rows = image.height;
    field.heights = std::move(image.pixels);
    if (image.largestInteger > 0.0) {
        for (float& height : field.heights) {
            height = static_cast<float>(std::lround(static_cast<double>(height) * image.largestInteger));
        }
    }
    return field;
}

/// Degrees of longitude and latitude to metres at the middle latitude (WGS 84's mean radii, spherical).
void layOutInMetres(const HeightField& field, Georeference& where)
{
    constexpr double kMetresPerDegree = 6371008.8 * kRadiansPerDegree;
    const double middle = where.corner[1] - 0.5 * where.spacing[1] * (field.rows - 1);
    const std::array<double, 2> scale{kMetresPerDegree * std::cos(middle * kRadiansPerDegree), kMetresPerDegree};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        where.spacing[axis] *= scale[axis];
        where.corner[axis] *= scale[axis];
    }
}

void applyOptions(const HeightOptions& options, const Georeference& where, HeightField& field)
{
    field.spacing = options.spacing.value_or(where.spacing);
    field.corner = options.spacing ? std::array<double, 2>{0.0, 0.0} : where.corner;
    const std::optional<double> voidValue = options.voidValue ? options.voidValue : where.voidValue;
    for (float& height : field.heights) {
        const auto scaled = static_cast<float>(static_cast<double>(height) * options.scale);
        const bool isVoid = !std::isfinite(scaled) || (voidValue && height == static_cast<float>(*voidValue));
        height = isVoid ? std::numeric_limits<float>::quiet_NaN() : scaled;
    }
}

/// A file may say of its place what no place is, such as a latitude beyond the poles.
void checkPlace(const HeightField& field)
{
    constexpr double kMost = 1e150; // its square is finite, as that of its reciprocal
    const std::array<std::uint32_t, 2> samples{field.columns, field.rows};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const double spacing = field.spacing[axis];
        if (!(spacing >= 1.0 / kMost && std::fabs(field.corner[axis]) + spacing * samples[axis] <= kMost)) {
            throw fault(field.name, "its heights have no place: the spacing is not above 0, or a coordinate beyond 1e150");
        }
    }
}

} // namespace

bool isHeightFile(const std::string& path)
{
    static const std::array<const char*, 5> known{".png", ".tif", ".tiff", ".exr", ".hgt"};
    return std::find(known.begin(), known.end(), extensionOf(path)) != known.end();
}

HeightField readHeightField(const std::string& path, const HeightOptions& options)
{
    if (options.spacing && !((*options.spacing)[0] > 0.0 && (*options.spacing)[1] > 0.0)) {
        throw fault(path, "the spacing of heights must be above 0");
    }
    Georeference where;
    const std::string extension = extensionOf(path);
    HeightField field = extension == ".hgt" ? readHgt(path, where) : readImage(path);
    field.name = path;
    if (extension == ".tif" || extension == ".tiff") { where = imageFiles().georeference(path); }
    if (where.inDegrees) { layOutInMetres(field, where); }
    applyOptions(options, where, field);
    checkPlace(field);
    if (field.voids() == field.heights.size()) { throw fault(path, "has no height at all"); }
    return field;
}

} // namespace osgTessLOD::bake
