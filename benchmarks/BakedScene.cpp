// SPDX-License-Identifier: MIT
#include "BakedScene.h"

#include "ChildProcess.h"

#include <osgTessLOD/asset/TlodFile.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace osgTessLOD::benchmarks {

BakedScene bakeToFile(const Scene& scene, const bake::BakeOptions& options, const std::string& path)
{
    BakedScene baked;
    bake::Progress progress;
    baked.asset = bake::bakeSource(scene.source, options, progress, baked.report);
    writeTlod(path, baked.asset);
    baked.fileBytes = std::filesystem::file_size(path);
    baked.levelBytes.resize(baked.asset.levels.size());
    for (const TlodChunk& chunk : readTlodContents(path)) {
        if (chunk.type == "NRML") { baked.normalBytes += chunk.storedBytes; }
        if (chunk.type.rfind("LVL", 0) == 0) { baked.levelBytes.at(chunk.level) += chunk.storedBytes; }
    }
    return baked;
}

std::string bakedFile(const Scene& scene, const bake::BakeOptions& options, const std::string& path)
{
    if (isBaked(scene)) { return scene.source; }
    fmt::print(stderr, "{}: bake\n", scene.name);
    runInChild([&] {
        bakeToFile(scene, options, path);
        return nlohmann::ordered_json();
    });
    return path;
}

LodAsset loadOrBake(const Scene& scene)
{
    if (isBaked(scene)) { return readTlod(scene.source); }
    bake::BakeOptions options;
    options.normals = false;
    bake::Progress progress;
    bake::BakeReport report;
    return bake::bakeSource(scene.source, options, progress, report);
}

} // namespace osgTessLOD::benchmarks
