// SPDX-License-Identifier: MIT
#include <fuzz/Targets.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <support/FileBytes.h>
#include <support/TemporaryDirectory.h>

#include <optional>
#include <string>

namespace osgTessLOD::fuzz {

namespace {

using bake::SourceMesh;

/// Nothing if it is refused.
std::optional<SourceMesh> tryToImport(const std::string& path, bool isSmoothed)
{
    try {
        return isSmoothed ? bake::importSmoothedMesh(path, 1) : bake::importMesh(path);
    } catch (const AssetError&) {
        return std::nullopt;
    }
}

/// False where no face is left.
bool tryToClean(SourceMesh& mesh)
{
    try {
        bake::cleanMesh(mesh);
        return true;
    } catch (const AssetError&) {
        return false;
    }
}

} // namespace

void examineMesh(const std::uint8_t* data, std::size_t size)
{
    if (size == 0) { return; }
    static const TemporaryDirectory folder;
    static constexpr std::array<const char*, 4> kNames{"mesh.ply", "mesh.obj", "mesh.off", "mesh.stl"};
    const std::string path = folder.file(kNames[data[0] & 3U]);
    writeBytes(path, std::string(data + 1, data + size));
    std::optional<SourceMesh> mesh = tryToImport(path, (data[0] & 4U) != 0);
    if (!mesh) { return; }
    bake::checkMesh(*mesh);
    if (!tryToClean(*mesh)) { return; }
    bake::checkMesh(*mesh);
    if (!bake::isOrientedManifold(*mesh)) { throw Finding("a mesh is not clean after cleaning"); }
    bake::normalizeFrame(*mesh);
    for (const Eigen::Vector3d& p : mesh->positions) {
        if (!(p.cwiseAbs().maxCoeff<Eigen::PropagateNaN>() <= 1.0)) {
            throw Finding("a vertex is outside the working frame");
        }
    }
}

} // namespace osgTessLOD::fuzz
