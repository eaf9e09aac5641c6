// SPDX-License-Identifier: MIT
#include "Scenes.h"

#include <osgTessLOD/bake/BuiltinSurface.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

constexpr char kBuiltinPrefix[] = "builtin:";

Scene fileScene(const std::filesystem::path& path)
{
    return {path.stem().string(), path.string()};
}

std::vector<Scene> scansOf(const std::filesystem::path& folder)
{
    if (!std::filesystem::is_directory(folder)) {
        throw std::runtime_error("OSGTESSLOD_DATA: " + folder.string() + " is no folder");
    }
    std::vector<Scene> scenes;
    for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
        const std::string extension = entry.path().extension().string();
        if (extension == ".ply" || extension == ".obj") { scenes.push_back(fileScene(entry.path())); }
    }
    std::sort(scenes.begin(), scenes.end(), [](const Scene& a, const Scene& b) { return a.source < b.source; });
    return scenes;
}

} // namespace

bool isBaked(const Scene& scene)
{
    return std::filesystem::path(scene.source).extension() == ".tlod";
}

bool isBuiltin(const Scene& scene)
{
    return scene.source.rfind(kBuiltinPrefix, 0) == 0;
}

std::vector<Scene> allScenes()
{
    std::vector<Scene> scenes;
    for (const std::string& name : bake::builtinSurfaceNames()) { scenes.push_back({name, kBuiltinPrefix + name}); }
    const char* data = std::getenv("OSGTESSLOD_DATA");
    if (data != nullptr && *data != '\0') {
        const std::vector<Scene> scans = scansOf(std::filesystem::path(data) / "scans");
        scenes.insert(scenes.end(), scans.begin(), scans.end());
    }
    return scenes;
}

std::vector<Scene> quickScenes()
{
    return {findScene("builtin:asteroid"), findScene("builtin:bricks")};
}

Scene findScene(const std::string& nameOrFile)
{
    const std::vector<Scene> scenes = allScenes();
    std::string names;
    for (const Scene& scene : scenes) {
        if (nameOrFile == scene.name || nameOrFile == scene.source) { return scene; }
        names += (names.empty() ? "" : ", ") + scene.name;
    }
    if (std::filesystem::is_regular_file(nameOrFile)) { return fileScene(nameOrFile); }
    throw std::runtime_error(nameOrFile + ": neither a file nor one of " + names);
}

} // namespace osgTessLOD::benchmarks
