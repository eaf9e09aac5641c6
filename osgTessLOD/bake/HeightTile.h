// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/PatchMap.h>

#include <array>
#include <cstdint>
#include <string>

namespace osgTessLOD::bake {

/// One of count × count tiles that a terrain is cut into: column 0 is the westernmost, row 0 the northernmost.
struct TileChoice {
    std::uint32_t column = 0;
    std::uint32_t row = 0;
    std::uint32_t count = 1;
};

/// A tile of a height field that may be larger than memory, and what all of its tiles have in common. Neighbours share the samples on
/// their border.
struct HeightTile {
    enum Side : std::uint8_t { West, North, East, South };

    HeightField field;             ///< the tile's samples, small voids filled; others are NaN
    HeightField around;            ///< the same and more on each side where there are any: slopes on seams need them
    std::array<bool, 4> isSeam{};  ///< per Side: is there a tile beyond it?
    WorkingFrame frame;            ///< of all tiles: about the middle of the whole, scaled to the size of a tile
    double rootSamples = 0.0; ///< across the largest square that patches of any tile are bisected from
    Lattice lattice;               ///< of all tiles' assets, so that what they share decodes to the same bits
    std::uint64_t filledVoids = 0; ///< of the tile's samples
};

/// Reads one tile of what readHeightField() reads. All rows are looked at, for the lowest and the highest sample, but only a few at
/// a time; memory is for the tile. Voids are filled as in the whole (HeightOptions::largestFilledVoid) if they end no farther
/// than 1,024 samples from the tile. Throws AssetError naming the file and the fault, such as a tile that there is not.
OSGTESSLOD_EXPORT HeightTile readHeightTile(const std::string& path, const HeightOptions& options,
                                            const TileChoice& choice);

/// Squares side by side that patches across so many samples are bisected from.
OSGTESSLOD_EXPORT std::uint32_t rootSquares(std::uint32_t samples);

} // namespace osgTessLOD::bake
