// SPDX-License-Identifier: MIT
#include "Scenes.h"

#include <osgTessLOD/bake/BuiltinSurface.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <set>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

constexpr char kBuiltinPrefix[] = "builtin:";

Scene fileScene(const std::filesystem::path& path)
{
    return {path.stem().string(), path.string()};
}

/// Files of these extensions in a folder of OSGTESSLOD_DATA, in the order of their names; none without the variable.
std::vector<Scene> dataScenes(const char* folderName, const std::set<std::string>& extensions)
{
    const char* data = std::getenv("OSGTESSLOD_DATA");
    if (data == nullptr || *data == '\0') { return {}; }
    const std::filesystem::path folder = std::filesystem::path(data) / folderName;
    if (!std::filesystem::is_directory(folder)) {
        throw std::runtime_error("OSGTESSLOD_DATA: " + folder.string() + " is no folder");
    }
    std::vector<Scene> scenes;
    for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder)) {
        if (extensions.count(entry.path().extension().string()) != 0) { scenes.push_back(fileScene(entry.path())); }
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
    const std::vector<Scene> scans = dataScenes("scans", {".ply", ".obj"});
    scenes.insert(scenes.end(), scans.begin(), scans.end());
    return scenes;
}

std::vector<Scene> terrainScenes()
{
    return dataScenes("terrain", {".tif"});
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
