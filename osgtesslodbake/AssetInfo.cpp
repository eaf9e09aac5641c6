// SPDX-License-Identifier: MIT
#include "AssetInfo.h"

#include <osgTessLOD/asset/AssetSummary.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodFile.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace osgTessLOD {

namespace {

nlohmann::ordered_json describeLevel(const AssetSummary::Level& level, bool hasUvs)
{
    nlohmann::ordered_json json = {{"factor", level.factor},
                                   {"patches", level.patches},
                                   {"finest_patches", level.finestPatches},
                                   {"vertices", level.vertices},
                                   {"triangles", level.triangles},
                                   {"largest_error", level.largestError},
                                   {"mean_error", level.meanError}};
    if (hasUvs) { json["largest_uv_error"] = level.largestUvError; }
    return json;
}

const char* nameOf(LodTexture::Role role)
{
    switch (role) {
    case LodTexture::Role::Color: return "color";
    case LodTexture::Role::Normal: return "normal";
    case LodTexture::Role::ObjectNormal: return "object-normal";
    case LodTexture::Role::Other: break;
    }
    return "other";
}

nlohmann::ordered_json describeMaterial(const LodAsset& asset, std::size_t number)
{
    const LodMaterial& material = asset.materials[number];
    const auto& numbers = asset.patchMaterials;
    nlohmann::ordered_json json;
    json["name"] = material.name;
    json["patches"] = numbers.empty() ? static_cast<std::ptrdiff_t>(asset.patches.size())
                                      : std::count(numbers.begin(), numbers.end(), number);
    for (const LodTexture& texture : material.textures) {
        const LodImage* embedded = asset.imageOf(texture);
        json["textures"].push_back({{"role", nameOf(texture.role)},
                                    {"name", texture.name},
                                    {"image", texture.image},
                                    {"embedded", embedded != nullptr}});
        if (embedded != nullptr) { json["textures"].back()["bytes"] = embedded->bytes.size(); }
    }
    return json;
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
    const AssetSummary summary = summarize(asset);
    for (const AssetSummary::Level& level : summary.levels) { json["levels"].push_back(describeLevel(level, asset.hasUvs())); }
    json["finest_vertices"] = summary.finestVertices;
    json["finest_triangles"] = summary.finestTriangles;
    json["largest_finest_error"] = summary.largestFinestError;
    json["normal_resolution"] = asset.normals.resolution;
    json["texture_coordinates"] = asset.hasUvs();
    if (asset.hasUvs()) {
        const auto& [origin, step] = asset.uvLattice;
        json["uv_box"] = {{"min", origin},
                          {"max", {origin[0] + UvLattice::kUnits * step[0], origin[1] + UvLattice::kUnits * step[1]}},
                          {"step", step}};
    }
    for (std::size_t m = 0; m < asset.materials.size(); ++m) { json["materials"].push_back(describeMaterial(asset, m)); }
    json["colors"] = asset.hasColors();

    std::uint64_t fileBytes = 0;
    std::uint64_t levelBytes = 0;
    std::uint64_t attributeBytes = 0;
    for (const TlodChunk& chunk : readTlodContents(path)) {
        json["chunks"].push_back({{"type", chunk.type},
                                  {"level", chunk.level},
                                  {"stored_bytes", chunk.storedBytes},
                                  {"content_bytes", chunk.contentBytes}});
        fileBytes = std::max(fileBytes, chunk.offset + chunk.storedBytes);
        if (chunk.type == "LVLV" || chunk.type == "LVLP") { levelBytes += chunk.storedBytes; }
        if (chunk.type == "LVLU" || chunk.type == "LVLC") { attributeBytes += chunk.storedBytes; }
    }
    const auto finest = static_cast<double>(summary.finestVertices);
    json["file_bytes"] = fileBytes;
    json["file_bytes_per_finest_vertex"] = static_cast<double>(fileBytes) / finest;
    json["vertex_bytes_per_finest_vertex"] = static_cast<double>(levelBytes) / finest;
    json["attribute_bytes_per_finest_vertex"] = static_cast<double>(attributeBytes) / finest;
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace); // texts are any bytes
}

} // namespace osgTessLOD
