// SPDX-License-Identifier: MIT
#include "AssetInfo.h"

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/asset/TlodFile.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace osgTessLOD {

namespace {

nlohmann::ordered_json describeLevel(const LodAsset& asset, std::size_t level)
{
    const unsigned factor = asset.ladder[level];
    const std::vector<LevelError>& errors = asset.levels[level].errors;
    double largest = 0.0;
    double sum = 0.0;
    for (const LevelError& error : errors) {
        largest = std::max(largest, static_cast<double>(error.isotropic));
        sum += static_cast<double>(error.isotropic);
    }
    return {{"factor", factor},
            {"patches", errors.size()},
            {"vertices", asset.levels[level].vertices.size()},
            {"triangles", errors.size() * TessellationPattern::triangleCount(factor)},
            {"largest_error", largest},
            {"mean_error", errors.empty() ? 0.0 : sum / static_cast<double>(errors.size())}};
}

std::uint64_t finestVertexCount(const LodAsset& asset)
{
    std::uint64_t count = 0;
    for (const LodPatch& patch : asset.patches) { count += TessellationPattern::vertexCount(asset.ladder[patch.finestLevel]); }
    return count;
}

} // namespace

std::string describeTlod(const std::string& path)
{
    const LodAsset asset = readTlod(path);
    nlohmann::ordered_json json;
    json["file"] = path;
    json["technique"] = asset.technique;
    json["source"] = asset.source;
    json["source_triangles"] = asset.sourceTriangles;
    json["patches"] = asset.patches.size();
    json["edges"] = asset.edges.size();
    json["base_vertices"] = asset.baseVertices.size();
    json["ladder"] = asset.ladder;
    json["origin"] = asset.lattice.origin;
    json["lattice_step"] = asset.lattice.step;
    json["bounds"] = {{"min", asset.boundsMin}, {"max", asset.boundsMax}};
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        json["levels"].push_back(describeLevel(asset, level));
    }
    json["normal_resolution"] = asset.normals.resolution;

    std::uint64_t fileBytes = 0;
    std::uint64_t levelBytes = 0;
    for (const TlodChunk& chunk : readTlodContents(path)) {
        json["chunks"].push_back({{"type", chunk.type},
                                  {"level", chunk.level},
                                  {"stored_bytes", chunk.storedBytes},
                                  {"content_bytes", chunk.contentBytes}});
        fileBytes = std::max(fileBytes, chunk.offset + chunk.storedBytes);
        if (chunk.type == "LVLV" || chunk.type == "LVLP") { levelBytes += chunk.storedBytes; }
    }
    const auto finest = static_cast<double>(finestVertexCount(asset));
    json["file_bytes"] = fileBytes;
    json["file_bytes_per_finest_vertex"] = static_cast<double>(fileBytes) / finest;
    json["vertex_bytes_per_finest_vertex"] = static_cast<double>(levelBytes) / finest;
    return json.dump(2);
}

} // namespace osgTessLOD
