// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/PatchMap.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// An indexed triangle mesh as read from a file.
struct SourceMesh {
    std::string name;                                      ///< for messages: the file's path
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    WorkingFrame frame;                                    ///< identity until normalizeFrame()
};

/// What cleanMesh() did, and what it found to be there afterwards.
struct CleaningReport {
    std::uint64_t weldedVertices = 0;        ///< vertices merged into one of equal position
    std::uint64_t unreferencedVertices = 0;  ///< dropped
    std::uint64_t degenerateFaces = 0;       ///< dropped: two equal corners, or no area
    std::uint64_t duplicateFaces = 0;        ///< dropped: same three corners as another, in either orientation
    std::uint64_t flippedFaces = 0;          ///< turned to agree with their neighbours
    std::uint64_t nonManifoldEdges = 0;      ///< with more than two faces, or between faces that cannot agree: cut open
    std::uint64_t nonManifoldVertices = 0;   ///< with several fans of faces: split into one vertex per fan
    std::uint64_t boundaryEdges = 0;
    std::uint64_t components = 0;
};

/// Reads PLY, OBJ, OFF or STL; polygons are triangulated. Vertices and faces come as the file has them, unconnected and
/// non-manifold ones included. Throws AssetError naming the file and the fault: unreadable, unknown format, truncated, no
/// vertices or faces, a coordinate that is not finite or beyond what can be squared in double (which vertex), an index
/// out of range (which face).
OSGTESSLOD_EXPORT SourceMesh importMesh(const std::string& path);

/// Throws AssetError naming mesh.name and the fault: no vertices or faces, a coordinate that is not finite or beyond what can
/// be squared in double, an index out of range. What importMesh() returns has been checked.
OSGTESSLOD_EXPORT void checkMesh(const SourceMesh& mesh);

/// True when every directed edge occurs once and every vertex has one fan of faces around it, open or closed: what
/// cleanMesh() brings about. Also false for an index out of range or a face with two equal corners.
OSGTESSLOD_EXPORT bool isOrientedManifold(const SourceMesh& mesh);

/// Makes the mesh an oriented 2-manifold with boundary: welds equal positions, drops degenerate and duplicate faces and
/// unreferenced vertices, orients each component consistently, cuts non-manifold edges open and splits non-manifold
/// vertices. Deterministic. Throws AssetError when no face is left.
OSGTESSLOD_EXPORT CleaningReport cleanMesh(SourceMesh& mesh);

/// Moves the positions into the working frame, and remembers it in mesh.frame. Throws AssetError when the bounding box is a point.
OSGTESSLOD_EXPORT void normalizeFrame(SourceMesh& mesh);

} // namespace osgTessLOD::bake
