// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/HeightTile.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/HeightRows.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Sides of the squares that bisection starts from, in samples, about.
constexpr double kRootSide = 1024.0;
/// Samples around a tile that are read at most, to fill voids.
constexpr std::uint64_t kMostAround = 1024;
/// Samples in memory while the file is looked through.
constexpr std::uint32_t kBandSamples = 1U << 22;

/// Samples first … last of each axis: columns, rows.
struct Window {
    std::array<std::uint32_t, 2> first;
    std::array<std::uint32_t, 2> last;

    std::uint32_t count(std::size_t axis) const { return last[axis] - first[axis] + 1; }
};

std::array<std::uint32_t, 2> sizeOf(const HeightField& field)
{
    return {field.columns, field.rows};
}

Window tileWindow(const HeightField& whole, const TileChoice& choice)
{
    const std::array<std::uint32_t, 2> at{choice.column, choice.row};
    Window window{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::uint64_t cells = sizeOf(whole)[axis] - 1;
        window.first[axis] = static_cast<std::uint32_t>(cells * at[axis] / choice.count);
        window.last[axis] = static_cast<std::uint32_t>(cells * (at[axis] + std::uint64_t{1}) / choice.count);
    }
    return window;
}

Window widened(const Window& window, std::uint64_t by, const HeightField& whole)
{
    Window wide = window;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        wide.first[axis] -= static_cast<std::uint32_t>(std::min<std::uint64_t>(by, wide.first[axis]));
        const std::uint32_t beyond = sizeOf(whole)[axis] - 1 - wide.last[axis];
        wide.last[axis] += static_cast<std::uint32_t>(std::min<std::uint64_t>(by, beyond));
    }
    return wide;
}

void checkChoice(const HeightField& whole, const TileChoice& choice)
{
    if (choice.count == 0 || choice.column >= choice.count || choice.row >= choice.count) {
        throw AssetError(fmt::format("{}: there is no tile {},{} of {} x {}: they are counted from 0", whole.name,
                                     choice.column, choice.row, choice.count, choice.count));
    }
    if (choice.count > std::min(whole.columns, whole.rows) - 1) {
        throw AssetError(fmt::format("{}: {} x {} heights cannot be cut into {} x {} tiles", whole.name, whole.columns,
                                     whole.rows, choice.count, choice.count));
    }
}

struct Range {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();
};

HeightField emptyField(const HeightField& whole, const Window& window)
{
    HeightField field = whole;
    field.columns = window.count(0);
    field.rows = window.count(1);
    field.first = window.first;
    field.heights.resize(std::size_t{field.columns} * field.rows);
    return field;
}

/// Reads all rows, keeps those samples that the field is for. Returns the range of all.
Range readWindow(HeightRows& rows, HeightField& field)
{
    const HeightField& whole = rows.whole();
    const std::uint32_t bands = std::max(1U, kBandSamples / whole.columns / rows.band());
    const auto count =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(std::uint64_t{bands} * rows.band(), whole.rows));
    std::vector<float> band(std::size_t{whole.columns} * count);
    Range range;
    for (std::uint32_t first = 0; first < whole.rows; first += std::min(count, whole.rows - first)) {
        const std::uint32_t read = std::min(count, whole.rows - first);
        rows.read(first, read, band.data());
        const std::size_t samples = std::size_t{whole.columns} * read;
        for (std::size_t i = 0; i < samples; ++i) {
            if (std::isnan(band[i])) { continue; }
            range.low = std::min(range.low, static_cast<double>(band[i]));
            range.high = std::max(range.high, static_cast<double>(band[i]));
        }
        const std::uint32_t from = std::max(first, field.first[1]);
        const std::uint32_t to = std::min(first + read, field.first[1] + field.rows);
        for (std::uint32_t row = from; row < to; ++row) {
            std::copy_n(
                band.begin() + static_cast<std::ptrdiff_t>(std::size_t{row - first} * whole.columns + field.first[0]),
                field.columns,
                field.heights.begin() + static_cast<std::ptrdiff_t>(std::size_t{row - field.first[1]} * field.columns));
        }
    }
    return range;
}

HeightField cut(const HeightField& from, const Window& window)
{
    HeightField field = emptyField(from, window);
    for (std::uint32_t row = 0; row < field.rows; ++row) {
        const std::size_t start =
            std::size_t{row + window.first[1] - from.first[1]} * from.columns + window.first[0] - from.first[0];
        std::copy_n(from.heights.begin() + static_cast<std::ptrdiff_t>(start), field.columns,
                    field.heights.begin() + static_cast<std::ptrdiff_t>(std::size_t{row} * field.columns));
    }
    return field;
}

/// Samples across the largest square that a tile's bisection may start from, times the scale of each axis.
double largestRoot(const HeightField& whole, std::uint32_t count, const std::array<double, 2>& scale)
{
    double largest = 0.0;
    for (std::size_t axis = 0; axis < 2; ++axis) {
        const std::uint32_t fewest = (sizeOf(whole)[axis] - 1) / count;
        for (const std::uint32_t cells : {fewest, fewest + 1}) { // tiles of both sizes may be there
            largest = std::max(largest, scale[axis] * cells / rootSquares(cells + 1));
        }
    }
    return largest;
}

/// Functions of the whole alone.
void placeTiles(const HeightField& whole, const Range& range, std::uint32_t count, HeightTile& tile)
{
    const Vector2d corner = whole.placeAt(0.0, 0.0);
    const Vector2d opposite = whole.placeAt(whole.columns - 1.0, whole.rows - 1.0);
    const Vector3d size(opposite.x() - corner.x(), corner.y() - opposite.y(), range.high - range.low);
    tile.frame.center << 0.5 * (corner + opposite), 0.5 * (range.low + range.high);
    tile.frame.scale = Vector3d(size.x() / count, size.y() / count, size.z()).norm();

    tile.rootSamples = largestRoot(whole, count, {1.0, 1.0});
    constexpr double kFarAway = 2.0; // times the size, as for any asset
    const bool isFar = tile.frame.center.norm() > kFarAway * size.norm();
    if (isFar) { tile.lattice.origin = {tile.frame.center.x(), tile.frame.center.y(), tile.frame.center.z()}; }
    const double farthest = 0.5 * size.maxCoeff() + (isFar ? 0.0 : tile.frame.center.cwiseAbs().maxCoeff());
    constexpr double kRoom = 1.125; // refitted vertices may lie outside of the samples' range
    constexpr double kMostSteps = 1 << 30;
    const double patch = std::max(largestRoot(whole, count, whole.spacing), size.z());
    tile.lattice.step = static_cast<float>(kRoom * std::max(patch / Lattice::kMaxOffset, farthest / kMostSteps));
}

} // namespace

std::uint32_t rootSquares(std::uint32_t samples)
{
    return static_cast<std::uint32_t>(std::max(1.0, std::round((samples - 1) / kRootSide)));
}

HeightTile readHeightTile(const std::string& path, const HeightOptions& options, const TileChoice& choice)
{
    HeightRows rows(path, options);
    const HeightField& whole = rows.whole();
    checkChoice(whole, choice);
    const Window window = tileWindow(whole, choice);
    // A void that may be filled and touches the tile ends within so many samples of it.
    const std::uint64_t margin = std::clamp<std::uint64_t>(options.largestFilledVoid, 1, kMostAround - 1) + 1;

    HeightTile tile;
    tile.around = emptyField(whole, widened(window, margin, whole));
    const Range range = readWindow(rows, tile.around);
    if (!(range.low <= range.high)) { throw AssetError(path + ": has no height at all"); }
    const std::uint64_t voids = cut(tile.around, window).voids();
    fillVoids(tile.around, options.largestFilledVoid);
    tile.field = cut(tile.around, window);
    tile.filledVoids = voids - tile.field.voids();
    tile.isSeam = {choice.column > 0, choice.row > 0, choice.column + 1 < choice.count, choice.row + 1 < choice.count};
    placeTiles(whole, range, choice.count, tile);
    return tile;
}

} // namespace osgTessLOD::bake
