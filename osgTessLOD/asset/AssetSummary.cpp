// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/AssetSummary.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>

#include <algorithm>

namespace osgTessLOD {

AssetSummary summarize(const LodAsset& asset)
{
    AssetSummary summary;
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        const unsigned factor = asset.ladder[l];
        const std::vector<std::uint32_t> slots = asset.levelSlots(l);
        AssetSummary::Level level;
        level.factor = factor;
        level.patches = asset.levels[l].errors.size();
        level.vertices = asset.levels[l].vertices.size();
        level.triangles = level.patches * TessellationPattern::triangleCount(factor);
        for (const float error : asset.levels[l].uvErrors) {
            level.largestUvError = std::max(level.largestUvError, static_cast<double>(error));
        }
        for (std::size_t p = 0; p < slots.size(); ++p) {
            if (slots[p] == kNoPatch) { continue; }
            const auto error = static_cast<double>(asset.levels[l].errors[slots[p]].isotropic);
            level.largestError = std::max(level.largestError, error);
            level.meanError += error / static_cast<double>(level.patches);
            if (asset.patches[p].finestLevel != l) { continue; }
            ++level.finestPatches;
            summary.largestFinestError = std::max(summary.largestFinestError, error);
        }
        summary.finestVertices += level.finestPatches * TessellationPattern::vertexCount(factor);
        summary.finestTriangles += level.finestPatches * TessellationPattern::triangleCount(factor);
        summary.levels.push_back(level);
    }
    return summary;
}

} // namespace osgTessLOD
