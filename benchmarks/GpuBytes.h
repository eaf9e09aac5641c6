// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>

#include <cstdint>

namespace osgTessLOD::benchmarks {

/// Bytes of the texture buffers of an asset, as they are uploaded.
struct GpuBytes {
    std::uint64_t vertices = 0; ///< of all levels, and the patches' table
    std::uint64_t parameters = 0;
    std::uint64_t normals = 0;
    std::uint64_t attributes = 0; ///< texture coordinates and colours

    std::uint64_t all() const { return vertices + parameters + normals + attributes; }
};

GpuBytes gpuBytes(const LodAsset& asset);

} // namespace osgTessLOD::benchmarks
