// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "GpuBytes.h"

#include <osgTessLOD/asset/AssetSummary.h>
#include <osgTessLOD/asset/TlodFile.h>

#include <fmt/format.h>

#include <exception>
#include <limits>
#include <sstream>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

double fileBytes(const LodAsset& asset)
{
    std::ostringstream stream;
    writeTlod(stream, asset);
    return static_cast<double>(stream.tellp());
}

Json measure(const Scene& scene)
{
    LodAsset asset = loadOrBake(scene);
    const auto vertices = static_cast<double>(summarize(asset).finestVertices);
    const GpuBytes gpu = gpuBytes(asset);
    const auto perVertex = [&](std::uint64_t bytes) { return static_cast<double>(bytes) / vertices; };
    const double file = fileBytes(asset);
    asset.normals = NormalTexture();
    for (LodLevel& level : asset.levels) { level.parameters.clear(); } // only normals are looked up by them
    return {{"scene", scene.name},
            {"finestVertices", summarize(asset).finestVertices},
            {"gpuVertices", perVertex(gpu.vertices)},
            {"gpuParameters", perVertex(gpu.parameters)},
            {"gpuNormals", perVertex(gpu.normals)},
            {"gpuAttributes", perVertex(gpu.attributes)},
            {"file", file / vertices},
            {"fileWithoutNormals", fileBytes(asset) / vertices}};
}

} // namespace

BenchmarkResult benchmarkMemory(const std::vector<Scene>& scenes)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene",   "finest vertices", "GPU vertices", "parameters",
                                            "normals", "UVs and colours", "file",         "file without normals"};
    std::vector<double> gpu;
    std::vector<double> gpuParameters;
    std::vector<double> file;
    std::vector<double> fileWithout;
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: memory\n", scene.name);
        try {
            const Json row = measure(scene);
            std::vector<std::string> cells{scene.name, grouped(row["finestVertices"].get<std::uint64_t>())};
            for (const char* key :
                 {"gpuVertices", "gpuParameters", "gpuNormals", "gpuAttributes", "file", "fileWithoutNormals"}) {
                cells.push_back(fmt::format("{:.2f}", row[key].get<double>()));
            }
            result.tables.front().rows.push_back(cells);
            result.rows.push_back(row);
            gpu.push_back(row["gpuVertices"]);
            gpuParameters.push_back(row["gpuParameters"]);
            file.push_back(row["file"]);
            fileWithout.push_back(row["fileWithoutNormals"]);
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"gpu_bytes_per_finest_vertex", mean(gpu)},
                      {"gpu_parameter_bytes_per_finest_vertex", mean(gpuParameters)},
                      {"file_bytes_per_finest_vertex", mean(fileWithout)},
                      {"file_bytes_per_finest_vertex_with_normals", mean(file)}};
    return result;
}

} // namespace osgTessLOD::benchmarks
