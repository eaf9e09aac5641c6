// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/MeshReader.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <string>

namespace osgTessLOD::bake {

/// Gives `mesh` the materials of `raw`, which is from the file `path`, as the MTL files beside it describe them, with images as
/// seen from where the process is. Warnings of files and materials that are not there. Private to the bake room.
void addMaterials(const RawMesh& raw, const std::string& path, SourceMesh& mesh);

/// The content of a file. Throws AssetError with the fault alone.
std::string readFile(const std::string& path);

} // namespace osgTessLOD::bake
