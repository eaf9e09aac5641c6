// SPDX-License-Identifier: MIT
// Reads height fields: images by OpenImageIO, the georeference of GeoTIFF by libgeotiff, raw SRTM tiles by itself.
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/HeightField.h>

#include <OpenImageIO/imageio.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>
#include <geotiff/xtiffio.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>

namespace osgTessLOD::bake {

namespace {

constexpr std::uint64_t kMostSamples = std::uint64_t{1} << 31;
constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180.0;
constexpr std::uint32_t kTagNoData = 42113; ///< GDAL's, an ASCII number

/// Where a survey lies, and what it does not know.
struct Georeference {
    std::array<double, 2> spacing{1.0, 1.0};
    std::array<double, 2> corner{0.0, 0.0};
    std::optional<double> voidValue;
};

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
    return field;
}

HeightField readImage(const std::string& path)
{
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path);
    if (!input) { throw fault(path, OIIO::geterror()); }
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1) {
        throw fault(path, "is not an image of two dimensions");
    }
    HeightField field;
    checkSize(path, static_cast<std::uint64_t>(spec.width), static_cast<std::uint64_t>(spec.height));
    field.columns = static_cast<std::uint32_t>(spec.width);
    field.rows = static_cast<std::uint32_t>(spec.height);
    field.heights.resize(std::size_t{field.columns} * field.rows);
    if (!input->read_image(0, 0, 0, 1, OIIO::TypeDesc::FLOAT, field.heights.data())) {
        throw fault(path, input->geterror());
    }
    // Integers come as parts of the largest that their format holds.
    const OIIO::TypeDesc::BASETYPE type = static_cast<OIIO::TypeDesc::BASETYPE>(spec.format.basetype);
    const double unit = type == OIIO::TypeDesc::UINT8    ? 255.0
                        : type == OIIO::TypeDesc::INT8   ? 127.0
                        : type == OIIO::TypeDesc::UINT16 ? 65535.0
                        : type == OIIO::TypeDesc::INT16  ? 32767.0
                                                         : 0.0;
    if (type == OIIO::TypeDesc::UINT32 || type == OIIO::TypeDesc::INT32) {
        throw fault(path, "has 32-bit integers: heights are integers of 8 or 16 bits, or floating-point numbers");
    }
    if (unit > 0.0) {
        for (float& height : field.heights) {
            height = static_cast<float>(std::lround(static_cast<double>(height) * unit));
        }
    }
    return field;
}

struct TiffCloser {
    void operator()(TIFF* tiff) const { XTIFFClose(tiff); }
};
struct GeoKeysCloser {
    void operator()(GTIF* keys) const { GTIFFree(keys); }
};

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

/// Returns true if the coordinates are degrees.
bool readGeoTags(const std::string& path, Georeference& where)
{
    TIFFSetWarningHandler(nullptr); // unknown tags are no news
    const std::unique_ptr<TIFF, TiffCloser> tiff(XTIFFOpen(path.c_str(), "r"));
    if (!tiff) { return false; }
    std::uint16_t count = 0;
    double* values = nullptr;
    if (TIFFGetField(tiff.get(), TIFFTAG_GEOPIXELSCALE, &count, &values) != 0 && count >= 2 && values[0] > 0.0 &&
        values[1] > 0.0) {
        where.spacing = {values[0], values[1]};
        if (TIFFGetField(tiff.get(), TIFFTAG_GEOTIEPOINTS, &count, &values) != 0 && count >= 6) {
            where.corner = {values[3] - values[0] * where.spacing[0], values[4] + values[1] * where.spacing[1]};
        }
    }
    std::uint32_t length = 0; // as of all tags that libtiff does not know
    char* text = nullptr;
    if (TIFFGetField(tiff.get(), kTagNoData, &length, &text) != 0 && text != nullptr) {
        const std::string number(text, length);
        char* end = nullptr;
        const double value = std::strtod(number.c_str(), &end);
        if (end != number.c_str()) { where.voidValue = value; }
    }
    const std::unique_ptr<GTIF, GeoKeysCloser> keys(GTIFNew(tiff.get()));
    unsigned short model = 0;
    return keys && GTIFKeyGetSHORT(keys.get(), GTModelTypeGeoKey, &model, 0, 1) == 1 && model == ModelTypeGeographic;
}

void applyOptions(const HeightOptions& options, const Georeference& where, HeightField& field)
{
    field.spacing = options.spacing.value_or(where.spacing);
    field.corner = options.spacing ? std::array<double, 2>{0.0, 0.0} : where.corner;
    const std::optional<double> voidValue = options.voidValue ? options.voidValue : where.voidValue;
    for (float& height : field.heights) {
        const bool isVoid = !std::isfinite(height) || (voidValue && height == static_cast<float>(*voidValue));
        height = isVoid ? std::numeric_limits<float>::quiet_NaN()
                        : static_cast<float>(static_cast<double>(height) * options.scale);
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
    const bool isTiff = extension == ".tif" || extension == ".tiff";
    if (extension == ".hgt" || (isTiff && readGeoTags(path, where))) { layOutInMetres(field, where); }
    applyOptions(options, where, field);
    if (field.voids() == field.heights.size()) { throw fault(path, "has no height at all"); }
    return field;
}

} // namespace osgTessLOD::bake
