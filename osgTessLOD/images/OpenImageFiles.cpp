// SPDX-License-Identifier: MIT
// The module that reads and makes image files: pixels by OpenImageIO, the georeference of GeoTIFF by libgeotiff.
#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/ImageFiles.h>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <geotiff/geotiff.h>
#include <geotiff/geovalues.h>
#include <geotiff/xtiffio.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

namespace {

constexpr std::uint64_t kMostNumbers = std::numeric_limits<std::uint32_t>::max();
/// Bytes of pixels that one byte of a file may claim to hold, so that a small file cannot ask for much memory. Deflate, which
/// most formats use, makes at most 1,032 of one, and PNG up to 8 pixels of each.
constexpr std::uint64_t kMostExpansion = 16384;
constexpr std::uint32_t kTagNoData = 42113; ///< GDAL's, an ASCII number

AssetError fault(const std::string& path, const std::string& what)
{
    return AssetError(path + ": " + what);
}

double largestInteger(const std::string& path, OIIO::TypeDesc::BASETYPE type)
{
    switch (type) {
    case OIIO::TypeDesc::UINT8: return 255.0;
    case OIIO::TypeDesc::INT8: return 127.0;
    case OIIO::TypeDesc::UINT16: return 65535.0;
    case OIIO::TypeDesc::INT16: return 32767.0;
    case OIIO::TypeDesc::HALF:
    case OIIO::TypeDesc::FLOAT:
    case OIIO::TypeDesc::DOUBLE: return 0.0;
    default: throw fault(path, "has neither integers of 8 or 16 bits nor floating-point numbers");
    }
}

std::uint64_t numbersOf(const OIIO::ImageSpec& spec, unsigned channels)
{
    return static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height) * channels;
}

void checkSize(const std::string& path, const OIIO::ImageSpec& spec, unsigned channels)
{
    const std::uint64_t numbers = numbersOf(spec, channels);
    std::error_code error;
    const std::uintmax_t bytes = std::filesystem::file_size(path, error);
    if (error || numbers * spec.format.size() / kMostExpansion > bytes) {
        throw fault(path, "claims to hold more than " + std::to_string(kMostExpansion) + " times its size");
    }
}

/// The reader of what the extension says. ImageInput::open() would try all the others there are on what is something else.
std::unique_ptr<OIIO::ImageInput> readerOf(const std::string& path)
{
    const std::string extension = std::filesystem::path(path).extension().string();
    if (extension.size() < 2) { throw fault(path, "has no extension, which tells the format of an image"); }
    std::unique_ptr<OIIO::ImageInput> reader = OIIO::ImageInput::create(extension.substr(1), false);
    if (!reader) { throw fault(path, OIIO::geterror()); }
    return reader;
}

/// Throws for what is no image of two dimensions with so many channels, or claims to be larger than it can be.
std::unique_ptr<OIIO::ImageInput> openImage(const std::string& path, unsigned channels)
{
    std::unique_ptr<OIIO::ImageInput> input = readerOf(path);
    OIIO::ImageSpec spec;
    if (!input->open(path, spec)) { throw fault(path, input->geterror()); }
    if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1) {
        throw fault(path, "is not an image of two dimensions");
    }
    if (spec.nchannels < static_cast<int>(channels)) {
        throw fault(path, "has " + std::to_string(spec.nchannels) + " channels where " + std::to_string(channels) +
                              " are needed");
    }
    largestInteger(path, static_cast<OIIO::TypeDesc::BASETYPE>(spec.format.basetype));
    checkSize(path, spec, channels);
    return input;
}

/// Rows of an image without tiles, counted as its file does. OpenImageIO's own conversion takes 16 MB in between, however few there
/// are: here it is what a band of them needs.
bool readScanlines(OIIO::ImageInput& input, int begin, int end, int channels, float* pixels)
{
    const OIIO::ImageSpec& spec = input.spec();
    const OIIO::TypeDesc format = spec.format;
    if (!spec.channelformats.empty() || format == OIIO::TypeDesc::FLOAT) {
        return input.read_scanlines(0, 0, begin, end, spec.z, 0, channels, OIIO::TypeDesc::FLOAT, pixels);
    }
    constexpr std::size_t kBandBytes = std::size_t{1} << 24;
    const std::size_t rowNumbers = static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(channels);
    const auto most = static_cast<int>(std::max<std::size_t>(1, kBandBytes / (rowNumbers * format.size())));
    std::vector<std::uint8_t> band;
    for (int row = begin; row < end; row += most) {
        const int after = std::min(end, row + most);
        const std::size_t numbers = rowNumbers * static_cast<std::size_t>(after - row);
        band.resize(numbers * format.size());
        if (!input.read_scanlines(0, 0, row, after, spec.z, 0, channels, format, band.data())) { return false; }
        if (!OIIO::convert_pixel_values(format, band.data(), OIIO::TypeDesc::FLOAT, pixels, static_cast<int>(numbers))) {
            return false;
        }
        pixels += numbers;
    }
    return true;
}

class OpenImageRows : public ImageRows {
public:
    OpenImageRows(const std::string& path, unsigned channels)
        : _path(path)
        , _channels(static_cast<int>(channels))
        , _input(openImage(path, channels))
    {
        const OIIO::ImageSpec& spec = _input->spec();
        width = static_cast<std::uint32_t>(spec.width);
        height = static_cast<std::uint32_t>(spec.height);
        largestInteger = bake::largestInteger(path, static_cast<OIIO::TypeDesc::BASETYPE>(spec.format.basetype));
        if (spec.tile_height > 0) { band = static_cast<std::uint32_t>(spec.tile_height); }
    }

    void read(std::uint32_t first, std::uint32_t count, float* pixels) override
    {
        const OIIO::ImageSpec& spec = _input->spec();
        const std::uint32_t skipped = spec.tile_width > 0 ? first % band : 0; // tiles are read whole
        if (skipped != 0 || (spec.tile_width > 0 && count % band != 0 && first + count != height)) {
            return readAligned(first, count, pixels);
        }
        const int begin = spec.y + static_cast<int>(first);
        const int end = begin + static_cast<int>(count);
        const bool isRead =
            spec.tile_width > 0
                ? _input->read_tiles(0, 0, spec.x, spec.x + spec.width, begin, end, spec.z, spec.z + 1, 0, _channels,
                                     OIIO::TypeDesc::FLOAT, pixels)
                : readScanlines(*_input, begin, end, _channels, pixels);
        if (!isRead) { throw fault(_path, _input->geterror()); }
    }

private:
    /// Part of the rows of tiles.
    void readAligned(std::uint32_t first, std::uint32_t count, float* pixels)
    {
        const std::size_t row = std::size_t{width} * static_cast<std::size_t>(_channels);
        const std::uint32_t begin = first / band * band;
        const std::uint32_t end = std::min(height, (first + count + band - 1) / band * band);
        std::vector<float> whole(row * (end - begin));
        read(begin, end - begin, whole.data());
        std::copy_n(whole.begin() + static_cast<std::ptrdiff_t>(row * (first - begin)), row * count, pixels);
    }

    std::string _path;
    int _channels;
    std::unique_ptr<OIIO::ImageInput> _input;
};

struct TiffCloser {
    void operator()(TIFF* tiff) const { XTIFFClose(tiff); }
};
struct GeoKeysCloser {
    void operator()(GTIF* keys) const { GTIFFree(keys); }
};

void readPlace(TIFF& tiff, Georeference& where)
{
    std::uint16_t count = 0;
    double* values = nullptr;
    if (TIFFGetField(&tiff, TIFFTAG_GEOPIXELSCALE, &count, &values) == 0 || count < 2 || !(values[0] > 0.0) ||
        !(values[1] > 0.0)) {
        return;
    }
    where.spacing = {values[0], values[1]};
    if (TIFFGetField(&tiff, TIFFTAG_GEOTIEPOINTS, &count, &values) != 0 && count >= 6) {
        where.corner = {values[3] - values[0] * where.spacing[0], values[4] + values[1] * where.spacing[1]};
    }
}

std::optional<double> readNoData(TIFF& tiff)
{
    std::uint32_t length = 0; // as of all tags that libtiff does not know
    char* text = nullptr;
    if (TIFFGetField(&tiff, kTagNoData, &length, &text) == 0 || text == nullptr) { return std::nullopt; }
    const std::string number(text, length);
    char* end = nullptr;
    const double value = std::strtod(number.c_str(), &end);
    return end != number.c_str() ? std::optional<double>(value) : std::nullopt;
}

class OpenImageFiles : public ImageFiles {
public:
    ImageData read(const std::string& path, unsigned channels) const override
    {
        const std::unique_ptr<OIIO::ImageInput> input = openImage(path, channels);
        const OIIO::ImageSpec& spec = input->spec();
        if (numbersOf(spec, channels) > kMostNumbers) { throw fault(path, "is too large an image"); }
        ImageData image;
        image.width = static_cast<std::uint32_t>(spec.width);
        image.height = static_cast<std::uint32_t>(spec.height);
        image.channels = channels;
        image.largestInteger = largestInteger(path, static_cast<OIIO::TypeDesc::BASETYPE>(spec.format.basetype));
        image.pixels.resize(std::size_t{image.width} * image.height * channels);
        const bool isRead =
            spec.tile_width > 0
                ? input->read_image(0, 0, 0, static_cast<int>(channels), OIIO::TypeDesc::FLOAT, image.pixels.data())
                : readScanlines(*input, spec.y, spec.y + spec.height, static_cast<int>(channels), image.pixels.data());
        if (!isRead) { throw fault(path, input->geterror()); }
        return image;
    }

    std::unique_ptr<ImageRows> open(const std::string& path, unsigned channels) const override
    {
        return std::make_unique<OpenImageRows>(path, channels);
    }

    std::string encode(const std::string& path, const ImageData& image) const override
    {
        const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path);
        if (!output) { throw fault(path, OIIO::geterror()); }
        if (output->supports("ioproxy") == 0) { throw fault(path, "is no format that can be made in memory"); }
        OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height),
                             static_cast<int>(image.channels),
                             image.largestInteger == 0.0 ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT16);
        spec.attribute("compression", "zip");
        if (output->format_name() != std::string("png")) {
            spec.attribute("DateTime", "1970:01:01 00:00:00"); // else it is now, and bytes differ
        }
        OIIO::Filesystem::IOVecOutput memory;
        if (!output->set_ioproxy(&memory) || !output->open(path, spec) ||
            !output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) || !output->close()) {
            throw fault(path, output->geterror());
        }
        return {memory.buffer().begin(), memory.buffer().end()};
    }

    Georeference georeference(const std::string& path) const override
    {
        Georeference where;
        TIFFSetWarningHandler(nullptr); // unknown tags are no news
        const std::unique_ptr<TIFF, TiffCloser> tiff(XTIFFOpen(path.c_str(), "r"));
        if (!tiff) { return where; }
        readPlace(*tiff, where);
        where.voidValue = readNoData(*tiff);
        const std::unique_ptr<GTIF, GeoKeysCloser> keys(GTIFNew(tiff.get()));
        unsigned short model = 0;
        where.inDegrees =
            keys && GTIFKeyGetSHORT(keys.get(), GTModelTypeGeoKey, &model, 0, 1) == 1 && model == ModelTypeGeographic;
        return where;
    }
};

} // namespace

} // namespace osgTessLOD::bake

extern "C" OSGTESSLOD_EXPORT const osgTessLOD::bake::ImageFiles* osgTessLODImageFiles()
{
    static const osgTessLOD::bake::OpenImageFiles files;
    return &files;
}
