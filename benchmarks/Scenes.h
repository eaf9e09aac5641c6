// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// A surface to measure.
struct Scene {
    std::string name;   ///< for tables
    std::string source; ///< "builtin:NAME" or a file's path
};

/// True for a source that is a .tlod file already.
bool isBaked(const Scene& scene);
/// True for a procedural surface.
bool isBuiltin(const Scene& scene);

/// The built-in surfaces and, where the environment's OSGTESSLOD_DATA names a folder, its scans/*.ply and *.obj in the
/// order of their names.
std::vector<Scene> allScenes();
/// Where OSGTESSLOD_DATA names a folder, its terrain/*.tif in the order of their names.
std::vector<Scene> terrainScenes();
/// Those that a quick run measures.
std::vector<Scene> quickScenes();
/// A scene by its name, with or without "builtin:", or a file. Throws std::runtime_error, listing the names, if it is
/// neither.
Scene findScene(const std::string& nameOrFile);

} // namespace osgTessLOD::benchmarks
