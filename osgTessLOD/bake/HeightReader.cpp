// SPDX-License-Identifier: MIT
// Reads height fields: images and GeoTIFF by ImageFiles, raw SRTM tiles by itself.
#include <osgTessLOD/bake/HeightRows.h>

#include <osgTessLOD/asset/AssetError.h>

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

/// A raw SRTM tile: a square of big-endian 16-bit heights in metres over one degree.
class HgtRows : public ImageRows {
public:
    explicit HgtRows(const std::string& path)
        : _path(path)
        , _stream(path, std::ios::binary)
    {
        std::error_code error;
        const std::uintmax_t bytes = std::filesystem::file_size(path, error);
        if (error || !_stream) { throw fault(path, "cannot be opened"); }
        const auto side = static_cast<std::uint32_t>(std::lround(std::sqrt(static_cast<double>(bytes) / 2.0)));
        if (std::uint64_t{side} * side * 2 != bytes) { throw fault(path, "is not a square of 16-bit heights"); }
        width = height = side;
    }

    void read(std::uint32_t first, std::uint32_t count, float* pixels) override
    {
        std::vector<unsigned char> raw(std::size_t{2} * width * count);
        _stream.seekg(static_cast<std::streamoff>(std::size_t{2} * width * first));
        if (!_stream.read(reinterpret_cast<char*>(raw.data()), static_cast<std::streamsize>(raw.size()))) {
            throw fault(_path, "cannot be read");
        }
        for (std::size_t i = 0; i < raw.size(); i += 2) {
            *pixels++ = static_cast<std::int16_t>(raw[i] << 8 | raw[i + 1]);
        }
    }

private:
    std::string _path;
    std::ifstream _stream;
};

/// Of a raw SRTM tile, which is named after its south-western corner.
Georeference hgtPlace(const std::string& path, std::uint32_t side)
{
    Georeference where;
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
    return where;
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

HeightRows::HeightRows(const std::string& path, const HeightOptions& options)
    : _options(options)
{
    if (options.spacing && !((*options.spacing)[0] > 0.0 && (*options.spacing)[1] > 0.0)) {
        throw fault(path, "the spacing of heights must be above 0");
    }
    const std::string extension = extensionOf(path);
    if (extension == ".hgt") {
        _rows = std::make_unique<HgtRows>(path);
    } else {
        _rows = imageFiles().open(path, 1);
    }
    _whole.name = path;
    _whole.columns = _rows->width;
    _whole.rows = _rows->height;
    if (_whole.columns < 2 || _whole.rows < 2) {
        throw fault(path, "a height field has two columns and two rows at least");
    }
    if (extension == ".hgt") { _where = hgtPlace(path, _whole.columns); }
    if (extension == ".tif" || extension == ".tiff") { _where = imageFiles().georeference(path); }
    place();
}

HeightRows::~HeightRows() = default;

void HeightRows::place()
{
    if (_where.inDegrees) { layOutInMetres(_whole, _where); }
    _whole.spacing = _options.spacing.value_or(_where.spacing);
    _whole.corner = _options.spacing ? std::array<double, 2>{0.0, 0.0} : _where.corner;
    checkPlace(_whole);
}

void HeightRows::read(std::uint32_t first, std::uint32_t count, float* heights)
{
    _rows->read(first, count, heights);
    const std::optional<double> voidValue = _options.voidValue ? _options.voidValue : _where.voidValue;
    std::for_each_n(heights, std::size_t{_whole.columns} * count, [&](float& height) {
        if (_rows->largestInteger > 0.0) {
            height = static_cast<float>(std::lround(static_cast<double>(height) * _rows->largestInteger));
        }
        const auto scaled = static_cast<float>(static_cast<double>(height) * _options.scale);
        const bool isVoid = !std::isfinite(scaled) || (voidValue && height == static_cast<float>(*voidValue));
        height = isVoid ? std::numeric_limits<float>::quiet_NaN() : scaled;
    });
}

HeightField readHeightField(const std::string& path, const HeightOptions& options)
{
    HeightRows rows(path, options);
    HeightField field = rows.whole();
    if (std::uint64_t{field.columns} * field.rows > kMostSamples) { throw fault(path, "has more than 2^31 heights"); }
    field.heights.resize(std::size_t{field.columns} * field.rows);
    rows.read(0, field.rows, field.heights.data());
    if (field.voids() == field.heights.size()) { throw fault(path, "has no height at all"); }
    return field;
}

} // namespace osgTessLOD::bake
