// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace osgDB {
class Options;
}

namespace osgTessLOD {

struct LodAsset;
class TessLODDrawable;

// How scene files refer to the .tlod files of their models. The scene's folder is the first of the options' database
// paths, where OSG's plugin for scene files puts it, both for reading and for writing.

/// The name to store for the file `fileName`: relative to the scene's folder, or to one of OSG's data folders
/// (OSG_FILE_PATH), where the file is in it; else absolute. Names that are not found stay as they are.
std::string referenceTo(const std::string& fileName, const osgDB::Options* options);

/// Gives `drawable` the asset of the file that a scene file has stored as `name`. Where that fails, says why in a warning;
/// the drawable then has no asset, but the name.
void loadReferenced(TessLODDrawable& drawable, const std::string& name, const osgDB::Options* options);

/// Writes the asset to a file in the scene's folder and returns the name to store: that of the drawable or of the asset's
/// source, with a number where another file has it. Throws AssetError.
std::string writeBeside(const TessLODDrawable& drawable, const osgDB::Options* options);

/// The bytes of a .tlod file.
std::string bytesOf(const LodAsset& asset);

} // namespace osgTessLOD
