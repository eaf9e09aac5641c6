// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// Heights on a regular grid, as surveys have them: row 0 is the northernmost, column 0 the westernmost. x points east, y
/// north, z up. Between samples the surface is two triangles per cell, cut along the diagonal whose ends are nearer in height.
struct OSGTESSLOD_EXPORT HeightField {
    std::string name; ///< for messages: the file's path
    std::uint32_t columns = 0;
    std::uint32_t rows = 0;
    std::vector<float> heights;              ///< object units, row by row; NaN: a void
    std::array<double, 2> spacing{1.0, 1.0}; ///< object units from column to column and from row to row, above 0
    std::array<double, 2> corner{0.0, 0.0};  ///< x and y of the sample in column 0 of row 0 of the whole
    /// Of the whole that is column 0, row 0 here: above 0 in a part of it.
    std::array<std::uint32_t, 2> first{};

    float at(std::uint32_t column, std::uint32_t row) const { return heights[std::size_t{row} * columns + column]; }
    bool isVoid(std::uint32_t column, std::uint32_t row) const { return std::isnan(at(column, row)); }
    std::uint64_t voids() const;

    /// x and y at fractional columns and rows.
    Eigen::Vector2d placeAt(double column, double row) const
    {
        return {corner[0] + spacing[0] * (first[0] + column), corner[1] - spacing[1] * (first[1] + row)};
    }
    Eigen::Vector3d position(std::uint32_t column, std::uint32_t row) const;
    /// Is the cell whose north-western sample this is cut from there to the south-east, or else the other way?
    bool isCutSouthEast(std::uint32_t column, std::uint32_t row) const;
    /// Height at fractional columns and rows within the grid.
    double heightAt(double column, double row) const;
    /// Change of height per object unit to the east and to the north: central differences at samples, bilinear in between.
    Eigen::Vector2d slopeAt(double column, double row) const;
};

/// What a height image does not say by itself.
struct HeightOptions {
    std::optional<std::array<double, 2>> spacing; ///< object units between columns and rows; without: the file's, or 1
    double scale = 1.0;                           ///< object units per unit of height
    std::optional<double> voidValue;              ///< the height that means no data; without: the file's, if it has one
    /// Voids of up to so many samples are filled with the smoothest surface between their borders; larger ones stay open.
    std::uint64_t largestFilledVoid = 256;
};

/// Is it an image or survey that readHeightField() knows, by its extension?
OSGTESSLOD_EXPORT bool isHeightFile(const std::string& path);

/// Reads the first channel of PNG, TIFF or OpenEXR images, in the image's own units (an 8- or 16-bit one: 0 … 65,535), and raw
/// SRTM tiles (.hgt, big-endian, −32,768 is no data). Of GeoTIFF, the georeference and the value that means no data are
/// taken; geographic ones (degrees) are laid out in metres, by the length of a degree at their middle latitude. Heights that
/// are not finite are voids. Throws AssetError naming the file and the fault.
OSGTESSLOD_EXPORT HeightField readHeightField(const std::string& path, const HeightOptions& options);

/// Fills voids of up to `largest` samples that do not touch the edge of the grid: their heights become harmonic. Returns how
/// many samples were filled.
OSGTESSLOD_EXPORT std::uint64_t fillVoids(HeightField& field, std::uint64_t largest);

/// The triangles whose three samples are there. Vertices are the samples that are, row by row.
OSGTESSLOD_EXPORT SourceMesh triangulate(const HeightField& field);

} // namespace osgTessLOD::bake
