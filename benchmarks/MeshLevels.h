// SPDX-License-Identifier: MIT
#pragma once

#include "ReferenceSurface.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// What a vertex and an index buffer hold.
struct ShadedMesh {
    std::vector<Eigen::Vector3f> positions;
    std::vector<Eigen::Vector3f> normals; ///< of the positions
    std::vector<std::uint32_t> indices;   ///< three per triangle

    std::size_t triangles() const { return indices.size() / 3; }
};

/// The surface, with means of the faces' normals by their areas.
ShadedMesh shadedMesh(const Triangles& surface);

/// A level of detail and how far it is said to be from the surface.
struct MeshLevel {
    ShadedMesh mesh;
    double error = 0.0;
};
using MeshLevels = std::vector<MeshLevel>; ///< the surface itself first, errors rising

/// By meshopt_simplify, each of the surface itself and with half of the triangles of the one before, down to 64 or as far as topology lets
/// it go; errors are those that it reports.
MeshLevels meshoptimizerLevels(const ShadedMesh& surface);

/// The same of each of the pieces of up to 8,192 triangles that the surface is halved into at its longest side again and again. Vertices
/// on the borders of pieces stay, so that levels of neighbours fit.
std::vector<MeshLevels> meshoptimizerClusters(const ShadedMesh& surface);

/// By osgUtil::Simplifier, each of the one before and with half of its triangles; writes one after the other to the file, so that those
/// are there that are made when the process is ended.
void writeSimplifierLevels(const std::string& path, const ShadedMesh& surface);
/// These levels after the surface itself. The simplifier reports no errors: theirs are the distances to the surface and back
/// (hausdorffDistance).
MeshLevels readSimplifierLevels(const std::string& path, const ShadedMesh& surface);

} // namespace osgTessLOD::benchmarks
