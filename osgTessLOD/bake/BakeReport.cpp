// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/Baker.h>

#include <nlohmann/json.hpp>

namespace osgTessLOD::bake {

std::string BakeReport::toJson() const
{
    nlohmann::ordered_json json;
    json["source"] = source;
    if (tile) { json["tile"] = {tile->column, tile->row, tile->count}; }
    json["source_triangles"] = sourceTriangles;
    json["patches"] = patches;
    json["diagonal"] = diagonal;
    if (isMesh) {
        json["cleaning"] = {{"welded_vertices", cleaning.weldedVertices},
                            {"unreferenced_vertices", cleaning.unreferencedVertices},
                            {"degenerate_faces", cleaning.degenerateFaces},
                            {"duplicate_faces", cleaning.duplicateFaces},
                            {"flipped_faces", cleaning.flippedFaces},
                            {"non_manifold_edges", cleaning.nonManifoldEdges},
                            {"non_manifold_vertices", cleaning.nonManifoldVertices},
                            {"boundary_edges", cleaning.boundaryEdges},
                            {"components", cleaning.components},
                            {"faces_without_uvs", cleaning.facesWithoutUvs}};
    }
    if (!repairs.empty()) { json["repairs"] = repairs; }
    if (!warnings.empty()) { json["warnings"] = warnings; }
    if (elevationRounds > 0) { json["elevation"] = {{"rounds", elevationRounds}, {"own_triangles", ownTriangles}}; }
    if (voids + filledVoids > 0) { json["voids"] = {{"filled", filledVoids}, {"left_open", voids}}; }
    if (largestChartError > 0.0) { json["largest_chart_error"] = largestChartError; }
    for (const AssetSummary::Level& level : stored.levels) {
        json["levels"].push_back({{"factor", level.factor},
                                  {"patches", level.patches},
                                  {"finest_patches", level.finestPatches},
                                  {"vertices", level.vertices},
                                  {"triangles", level.triangles},
                                  {"largest_error", level.largestError},
                                  {"mean_error", level.meanError}});
        if (hasUvs) { json["levels"].back()["largest_uv_error"] = level.largestUvError; }
    }
    if (hasUvs) { json["uv_step"] = uvStep; }
    for (const NormalMapReport& map : normalMaps) {
        json["normal_maps"].push_back(
            {{"image", map.image}, {"bytes", map.bytes}, {"coverage", map.coverage}, {"covered_twice", map.coveredTwice}});
    }
    json["finest_vertices"] = stored.finestVertices;
    json["finest_triangles"] = stored.finestTriangles;
    json["largest_finest_error"] = stored.largestFinestError;
    for (const Stage& stage : stages) { json["stages"].push_back({{"name", stage.name}, {"seconds", stage.seconds}}); }
    if (strips.contractions != 0) {
        json["strips"] = {{"contractions", strips.contractions},
                          {"relayouts", strips.relayouts},
                          {"thread_seconds",
                           {{"placement", strips.placementSeconds},
                            {"error_fits", strips.fitSeconds},
                            {"c_edge", strips.costSeconds},
                            {"edge_intersections", strips.overlaySeconds},
                            {"refits", strips.refitSeconds}}}};
    }
    json["seconds"] = seconds;
    json["peak_bytes"] = peakBytes;
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace); // names of files are any bytes
}

} // namespace osgTessLOD::bake
