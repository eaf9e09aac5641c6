// SPDX-License-Identifier: MIT
// fuzz_seeds FOLDER: writes the seeds that are not text, FOLDER/tlod and FOLDER/image, as they are in fuzz/seeds. Needed again
// where the format of .tlod files changes.
#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TlodFile.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <OpenImageIO/imageio.h>
#include <geotiff/geotiffio.h>
#include <geotiff/xtiffio.h>
#include <zstd.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace osgTessLOD;

/// A file of the same chunks, all as they are: what a change of a byte makes of the content is then seen. Checksums are not
/// those of these bytes any more: the target makes them right.
std::string unpacked(const LodAsset& asset, const std::string& scratch)
{
    writeTlod(scratch, asset);
    const std::string file = readBytes(scratch);
    const std::vector<TlodChunk> chunks = readTlodContents(scratch);
    std::string table = file.substr(0, chunks.front().offset);
    std::string contents;
    for (std::size_t c = 0; c < chunks.size(); ++c) {
        std::string content(chunks[c].contentBytes, '\0');
        const char* stored = file.data() + chunks[c].offset;
        if (chunks[c].storedBytes == chunks[c].contentBytes) {
            content.assign(stored, content.size());
        } else {
            ZSTD_decompress(content.data(), content.size(), stored, chunks[c].storedBytes);
        }
        const std::size_t entry = 32 + 48 * c; // TlodFile.h
        table.replace(entry + 8, 4, 4, '\0');  // codec
        table.replace(entry + 24, 8, table.substr(entry + 32, 8));
        contents += content;
    }
    return table + contents;
}

LodAsset withMaterials(LodAsset asset)
{
    LodMaterial painted;
    painted.name = "painted";
    painted.hasReflectance = true;
    painted.textures = {{LodTexture::Role::Color, "map_Kd", "a.png"}, {LodTexture::Role::Normal, "norm", "n.png"}};
    asset.materials = {painted, {}};
    for (std::size_t p = 0; p < asset.patches.size(); ++p) { asset.patchMaterials.push_back(p % 2); }
    asset.images = {{"a.png", {1, 2, 3}}};
    return asset;
}

void writeTlodSeeds(const std::string& folder)
{
    const TemporaryDirectory scratch;
    const auto write = [&](const char* name, const LodAsset& asset) {
        writeBytes(folder + "/" + name, unpacked(asset, scratch.file("a.tlod")));
    };
    const auto displaced = synthetic::build(synthetic::wavySheet(1), {1, 2}, true, {}, true);
    write("sheet", makeSyntheticSheet(1, 1, false));
    write("attributes", withMaterials(withAttributes(displaced)));
    write("levels", synthetic::build(synthetic::wavySheet(1), {1, 2, 4}, false, {1, 2}));
    writeTlod(folder + "/packed", makeSyntheticSheet(2, 1));
}

/// The content of an image file of `channels` channels, 4 × 3 pixels of rising values.
std::string imageBytes(const std::string& path, OIIO::TypeDesc type, int channels, int tile = 0)
{
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path);
    OIIO::ImageSpec spec(4, 3, channels, type);
    spec.tile_width = spec.tile_height = tile;
    spec.attribute("DateTime", "1970:01:01 00:00:00");
    std::vector<float> pixels;
    for (int k = 0; k < 12 * channels; ++k) {
        pixels.push_back(static_cast<float>(k) / static_cast<float>(12 * channels));
    }
    if (!output || !output->open(path, spec) || !output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) ||
        !output->close()) {
        throw std::runtime_error(path + " cannot be made");
    }
    return readBytes(path);
}

/// 2 × 2 heights of 16 bits in degrees, with a value that means no data.
std::string geoTiffBytes(const std::string& path)
{
    TIFF* tiff = XTIFFOpen(path.c_str(), "w");
    if (tiff == nullptr) { throw std::runtime_error(path + " cannot be made"); }
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 2);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 2);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_INT);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 2);
    const double scale[3] = {0.25, 0.5, 0.0};
    const double tie[6] = {0.0, 0.0, 0.0, 7.0, 45.0, 0.0};
    TIFFSetField(tiff, TIFFTAG_GEOPIXELSCALE, 3, scale);
    TIFFSetField(tiff, TIFFTAG_GEOTIEPOINTS, 6, tie);
    static const TIFFFieldInfo kNoData[] = {
        {42113, -1, -1, TIFF_ASCII, FIELD_CUSTOM, 1, 0, const_cast<char*>("NoData")}};
    TIFFMergeFieldInfo(tiff, kNoData, 1);
    TIFFSetField(tiff, 42113, "-9999");
    GTIF* keys = GTIFNew(tiff);
    GTIFKeySet(keys, GTModelTypeGeoKey, TYPE_SHORT, 1, ModelTypeGeographic);
    GTIFWriteKeys(keys);
    GTIFFree(keys);
    std::int16_t heights[4] = {10, 20, -9999, 40};
    TIFFWriteEncodedStrip(tiff, 0, heights, sizeof heights);
    XTIFFClose(tiff);
    return readBytes(path);
}

void writeImageSeeds(const std::string& folder)
{
    const TemporaryDirectory scratch;
    const auto write = [&](const char* name, const char* kind, const std::string& content) {
        writeBytes(folder + "/" + name, kind + content);
    };
    write("hgt", "0", std::string("\0\1\0\2\0\3\0\4\x80\0\0\6\0\7\0\x8\0\x9", 18));
    const std::string png = scratch.file("a.png");
    write("png8", "1", imageBytes(png, OIIO::TypeDesc::UINT8, 1));
    write("png16_rgb", "5", imageBytes(png, OIIO::TypeDesc::UINT16, 3));
    const std::string tiff = scratch.file("a.tif");
    write("tiff16", "2", imageBytes(tiff, OIIO::TypeDesc::UINT16, 1));
    write("tiff_tiles_rgb", "6", imageBytes(tiff, OIIO::TypeDesc::FLOAT, 3, 16));
    write("geotiff", "2", geoTiffBytes(tiff));
    const std::string exr = scratch.file("a.exr");
    write("exr_half", "3", imageBytes(exr, OIIO::TypeDesc::HALF, 1));
    write("exr_tiles_rgb", "7", imageBytes(exr, OIIO::TypeDesc::FLOAT, 3, 16));
}

} // namespace

int main(int argc, char** argv)
{
    if (argc != 2) {
        std::fprintf(stderr, "fuzz_seeds FOLDER\n");
        return 1;
    }
    try {
        const std::filesystem::path folder = argv[1];
        for (const char* name : {"tlod", "image"}) { std::filesystem::create_directories(folder / name); }
        writeTlodSeeds((folder / "tlod").string());
        writeImageSeeds((folder / "image").string());
        return 0;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "fuzz_seeds: %s\n", error.what());
        return 1;
    }
}
