// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/ImageFiles.h>

#include <cstdint>
#include <memory>
#include <string>

namespace osgTessLOD::bake {

/// The heights of a file, a few rows at a time.
class HeightRows {
public:
    /// Throws AssetError naming the file and the fault.
    HeightRows(const std::string& path, const HeightOptions& options);
    ~HeightRows();

    /// The field but for its heights.
    const HeightField& whole() const { return _whole; }
    /// Rows that are best read together.
    std::uint32_t band() const { return _rows->band; }
    /// Heights of rows `first` … `first` + `count` − 1 in object units, voids NaN. Throws AssetError naming the file and the fault.
    void read(std::uint32_t first, std::uint32_t count, float* heights);

private:
    void place();

    HeightField _whole;
    HeightOptions _options;
    Georeference _where;
    std::unique_ptr<ImageRows> _rows;
};

} // namespace osgTessLOD::bake
