// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

namespace osgTessLOD::fuzz {

// What reads files, as functions of arbitrary bytes: for libFuzzer (LibFuzzer.cpp) and for tests/fuzz. Each returns where the
// bytes are refused by an AssetError and where they are read and all that is promised of the result holds. It throws Finding
// where a promise is broken; whatever else leaves it, a crash included, is a finding too.

class Finding : public std::logic_error {
public:
    using std::logic_error::logic_error;
};

/// A .tlod file: as it is, and with header, table and checksums made right, so that any change reaches what lies behind them.
/// What was read is described, its surface extracted, written, and read again as the same.
void examineTlod(const std::uint8_t* data, std::size_t size);

/// A mesh file behind one byte that tells its kind: its two lowest bits are PLY, OBJ, OFF or STL, 0 to 3, and the third asks for
/// a step of smoothing. "0" to "7" will do. An OBJ file is its own MTL file, named mesh.obj. What was read is cleaned.
void examineMesh(const std::uint8_t* data, std::size_t size);

/// An image behind one byte that tells its kind: its two lowest bits are HGT, PNG, TIFF or OpenEXR, 0 to 3, and the third asks
/// for a displacement map of three channels instead of heights. Of heights, voids are filled and triangles made. Contents that
/// do not begin as their kind does are left alone: readers that OpenImageIO then tries are not the project's.
void examineImage(const std::uint8_t* data, std::size_t size);

struct Target {
    const char* name; ///< of its folder in fuzz/seeds
    void (*examine)(const std::uint8_t* data, std::size_t size);
};
constexpr std::array<Target, 3> kTargets{{{"tlod", examineTlod}, {"mesh", examineMesh}, {"image", examineImage}}};

} // namespace osgTessLOD::fuzz
