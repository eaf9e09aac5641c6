// SPDX-License-Identifier: MIT
#include "GpuBytes.h"

#include <osgTessLOD/render/AssetPages.h>

#include <limits>

namespace osgTessLOD::benchmarks {

GpuBytes gpuBytes(const LodAsset& asset)
{
    const osg::ref_ptr<AssetPages> pages = new AssetPages(asset, std::numeric_limits<std::int32_t>::max());
    GpuBytes bytes;
    for (const AssetPage& page : pages->pages()) {
        for (const TexelBuffer& buffer : page.buffers) {
            std::uint64_t& sum = buffer.unit == AssetPages::kNormalsUnit      ? bytes.normals
                                 : buffer.unit == AssetPages::kParametersUnit ? bytes.parameters
                                 : buffer.unit == AssetPages::kUvsUnit || buffer.unit == AssetPages::kColorsUnit
                                     ? bytes.attributes
                                     : bytes.vertices;
            sum += buffer.data->getTotalDataSize();
        }
    }
    return bytes;
}

} // namespace osgTessLOD::benchmarks
