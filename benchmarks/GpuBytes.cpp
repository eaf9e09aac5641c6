// SPDX-License-Identifier: MIT
#include "GpuBytes.h"

#include <osgTessLOD/render/AssetPages.h>

#include <limits>
#include <memory>

namespace osgTessLOD::benchmarks {

GpuBytes gpuBytes(const LodAsset& asset)
{
    const StreamedAsset whole(std::shared_ptr<const LodAsset>(std::shared_ptr<const LodAsset>(), &asset)); // the caller's
    const osg::ref_ptr<AssetPages> pages = new AssetPages(whole, std::numeric_limits<std::int32_t>::max());
    GpuBytes bytes;
    for (std::size_t k = 0; k < pages->size(); ++k) {
        const std::shared_ptr<const AssetPage> page = pages->make(k, pages->whole());
        for (const TexelBuffer& buffer : page->buffers) {
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
