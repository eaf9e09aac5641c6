// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>

#include <string>

namespace osgTessLOD {

// The images that the materials of an asset refer to.

/// Makes `image` the colour of all materials, of a new one where there is none. Throws AssetError where the asset has no texture
/// coordinates.
OSGTESSLOD_EXPORT void setColorImage(LodAsset& asset, const std::string& image);

/// Puts files, as seen from where the process is, into the asset, each once, under their names without folders, numbered where two are alike. What is not there
/// stays a file. Throws AssetError naming one that cannot be read.
OSGTESSLOD_EXPORT void embedImages(LodAsset& asset);

/// Makes names of files that are seen from the folder `from` such that are seen from `to`. Empty: where the process is.
OSGTESSLOD_EXPORT void moveReferences(LodAsset& asset, const std::string& from, const std::string& to);

} // namespace osgTessLOD
