// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/DisplacementFiles.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/bake/ElevationMap.h>
#include <osgTessLOD/bake/ImageFiles.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Pixels around a triangle that go on with its values, for the filters of other programs.
constexpr unsigned kGutter = 2;
constexpr std::uint32_t kLargestSide = 32768;
constexpr double kLargest16 = 65535.0;

/// Where the triangles of patches lie in the image: pairs in squares, row by row.
struct Atlas {
    TriangleLattice lattice;
    std::uint32_t square = 0; ///< pixels along a side
    std::uint32_t width = 0;  ///< both are powers of two: the middles of pixels are exact as texture coordinates
    std::uint32_t height = 0;

    /// Column and row of the lattice's point (i, j), or of one in the gutter.
    std::array<std::uint32_t, 2> pixel(std::size_t patch, int i, int j) const
    {
        const std::size_t perRow = width / square;
        const std::size_t number = patch / 2;
        const bool isSecond = patch % 2 != 0;
        const auto inSquare = [&](int at) {
            const auto offset = static_cast<std::uint32_t>(static_cast<int>(kGutter) + at);
            return isSecond ? square - 1 - offset : offset;
        };
        return {static_cast<std::uint32_t>(number % perRow) * square + inSquare(i),
                static_cast<std::uint32_t>(number / perRow) * square + inSquare(j)};
    }
    Vector2d uv(std::size_t patch, int i, int j) const
    {
        const auto at = pixel(patch, i, j);
        return {(at[0] + 0.5) / width, 1.0 - (at[1] + 0.5) / height};
    }
};

Atlas layOut(const PatchMap& map, unsigned steps)
{
    Atlas atlas{{steps}};
    atlas.square = steps + 2 * kGutter + 4;
    const std::size_t squares = (map.topology().patches.size() + 1) / 2;
    std::uint64_t fewest = std::numeric_limits<std::uint64_t>::max();
    for (std::uint32_t width = 1; width <= kLargestSide; width *= 2) {
        if (width < atlas.square) { continue; }
        const std::uint64_t rows = (squares + width / atlas.square - 1) / (width / atlas.square);
        std::uint32_t height = 1;
        while (height < rows * atlas.square && height <= kLargestSide) { height *= 2; }
        // Of equal sizes the one nearest to a square: width grows, so the first that is no higher than wide.
        if (height > kLargestSide || std::uint64_t{width} * height > fewest ||
            (std::uint64_t{width} * height == fewest && atlas.width >= atlas.height)) {
            continue;
        }
        fewest = std::uint64_t{width} * height;
        atlas.width = width;
        atlas.height = height;
    }
    if (atlas.width == 0) {
        throw AssetError(
            fmt::format("{}: {} patches of {} steps do not fit into an image of {} pixels squared: a smaller "
                        "largest factor, or fewer patches, will",
                        map.name(), map.topology().patches.size(), steps, kLargestSide));
    }
    return atlas;
}

/// The value for a point of the lattice or of the gutter around it.
Vector3d valueAt(const TriangleLattice& lattice, const std::vector<Vector3d>& samples, int i, int j)
{
    const int n = static_cast<int>(lattice.steps);
    const auto at = [&](int x, int y) -> const Vector3d& {
        return samples[lattice.index(static_cast<unsigned>(x), static_cast<unsigned>(y))];
    };
    if (i + j == n + 1 && i >= 1 && j >= 1) { return at(i, j - 1) + at(i - 1, j) - at(i - 1, j - 1); }
    const int beyond = std::max(0, i + j - n);
    const int x = std::clamp(i - beyond / 2, 0, n);
    return at(x, std::clamp(j - (beyond - beyond / 2), 0, n - x));
}

ImageData paint(const Atlas& atlas, const std::vector<std::vector<Vector3d>>& samples, unsigned channels)
{
    ImageData image;
    image.width = atlas.width;
    image.height = atlas.height;
    image.channels = channels;
    image.pixels.assign(std::size_t{atlas.width} * atlas.height * channels, 0.0F);
    const int last = static_cast<int>(atlas.lattice.steps + kGutter);
    const int first = -static_cast<int>(kGutter);
    for (std::size_t p = 0; p < samples.size(); ++p) {
        for (int j = first; j <= last; ++j) {
            for (int i = first; i <= last && i + j <= last; ++i) {
                const Vector3d value = valueAt(atlas.lattice, samples[p], i, j);
                const auto at = atlas.pixel(p, i, j);
                for (unsigned c = 0; c < channels; ++c) {
                    image.pixels[(std::size_t{at[1]} * atlas.width + at[0]) * channels + c] =
                        static_cast<float>(value[c]);
                }
            }
        }
    }
    return image;
}

/// Makes 0 … 1 of the values, and tells how to undo it.
void normalize(ImageData& image, DisplacementOptions& options)
{
    const auto [low, high] = std::minmax_element(image.pixels.begin(), image.pixels.end());
    const auto least = static_cast<double>(*low);
    const double range = static_cast<double>(*high) - least;
    options.scale = range > 0.0 ? range : 1.0;
    options.midlevel = -least / options.scale;
    for (float& pixel : image.pixels) {
        pixel = static_cast<float>((static_cast<double>(pixel) - least) / options.scale);
    }
    image.largestInteger = kLargest16;
}

/// The base mesh's vertices, source units: of each the first patch's that has it.
std::vector<Vector3d> baseVertices(const PatchMap& map)
{
    std::vector<Vector3d> vertices(map.topology().vertexCount);
    std::vector<char> isKnown(vertices.size(), 0);
    for (std::uint32_t p = 0; p < map.topology().patches.size(); ++p) {
        for (unsigned k = 0; k < 3; ++k) {
            const std::uint32_t v = map.topology().patches[p][k];
            if (isKnown[v] != 0) { continue; }
            isKnown[v] = 1;
            vertices[v] = map.frame().center + map.frame().scale * map.evaluate(p, Vector3d::Unit(k)).position;
        }
    }
    return vertices;
}

/// Throws where what is read from the file would not be the same triangles.
void checkBase(const PatchMap& map, const std::vector<Vector3d>& vertices)
{
    SourceMesh mesh;
    mesh.name = map.name();
    mesh.positions = vertices;
    mesh.triangles = map.topology().patches;
    const CleaningReport report = cleanMesh(mesh);
    if (report.degenerateFaces + report.duplicateFaces > 0) {
        throw AssetError(
            fmt::format("{}: {} patches have no area and {} the corners of another, which no base mesh can have: more "
                        "patches (--patches) may help",
                        map.name(), report.degenerateFaces, report.duplicateFaces));
    }
}

std::string meshText(const PatchMap& map, const Atlas& atlas, const std::vector<Vector3d>& vertices,
                     const DisplacementFiles& files)
{
    std::string text = fmt::format("# {}\n", files.command());
    auto out = std::back_inserter(text);
    for (const Vector3d& v : vertices) { fmt::format_to(out, "v {:.17g} {:.17g} {:.17g}\n", v.x(), v.y(), v.z()); }
    const int n = static_cast<int>(atlas.lattice.steps);
    for (std::size_t p = 0; p < map.topology().patches.size(); ++p) {
        for (const Vector2d& uv : {atlas.uv(p, 0, 0), atlas.uv(p, n, 0), atlas.uv(p, 0, n)}) {
            fmt::format_to(out, "vt {:.17g} {:.17g}\n", uv.x(), uv.y());
        }
    }
    for (std::size_t p = 0; p < map.topology().patches.size(); ++p) {
        const auto& corners = map.topology().patches[p];
        fmt::format_to(out, "f {}/{} {}/{} {}/{}\n", corners[0] + 1, 3 * p + 1, corners[1] + 1, 3 * p + 2,
                       corners[2] + 1, 3 * p + 3);
    }
    return text;
}

std::string meshPathOf(const std::string& imagePath)
{
    return std::filesystem::path(imagePath).replace_extension(".obj").string();
}

bool isFloat(const std::string& imagePath)
{
    return std::filesystem::path(imagePath).extension() == ".exr";
}

} // namespace

void checkDisplacementPath(const std::string& imagePath, const std::string& source)
{
    const std::string extension = std::filesystem::path(imagePath).extension().string();
    if (extension != ".exr" && extension != ".png" && extension != ".tif" && extension != ".tiff") {
        throw AssetError(imagePath + ": a displacement map is written as .exr, .png or .tif");
    }
    std::error_code ignored; // of files that are not there
    if (std::filesystem::equivalent(meshPathOf(imagePath), source, ignored)) {
        throw AssetError(imagePath + ": its base mesh would replace the source " + source);
    }
}

DisplacementFiles makeDisplacementFiles(const PatchMap& map, const std::string& imagePath, unsigned steps,
                                        DisplacementSampling sampling, Progress& progress)
{
    const bool isScalar = dynamic_cast<const ElevationMap*>(&map) != nullptr;
    const Atlas atlas = layOut(map, steps);
    const std::vector<Vector3d> vertices = baseVertices(map);
    checkBase(map, vertices);
    const auto samples =
        sampleDisplacement(map.topology(), displacementOf(map, isScalar), atlas.lattice, sampling, progress);
    ImageData image = paint(atlas, samples, isScalar ? 1 : 3);
    DisplacementFiles files;
    files.imagePath = imagePath;
    files.meshPath = meshPathOf(imagePath);
    files.width = atlas.width;
    files.height = atlas.height;
    files.options.kind = isScalar ? DisplacementOptions::Kind::Scalar : DisplacementOptions::Kind::ObjectVector;
    if (!isFloat(imagePath)) { normalize(image, files.options); }
    files.imageBytes = imageFiles().encode(imagePath, image);
    files.meshText = meshText(map, atlas, vertices, files);
    return files;
}

std::string DisplacementFiles::command() const
{
    return fmt::format("osgtesslodbake {} --displacement {} --scale {:.17g} --midlevel {:.17g}{}",
                       std::filesystem::path(meshPath).filename().string(),
                       std::filesystem::path(imagePath).filename().string(), options.scale, options.midlevel,
                       options.kind == DisplacementOptions::Kind::ObjectVector ? " --vector object" : "");
}

void DisplacementFiles::write() const
{
    AtomicFile image(imagePath);
    AtomicFile mesh(meshPath);
    image.stream() << imageBytes << std::flush;
    mesh.stream() << meshText << std::flush;
    if (!mesh.stream()) { mesh.commit(); } // which says why not
    image.commit();
    mesh.commit();
}

} // namespace osgTessLOD::bake
