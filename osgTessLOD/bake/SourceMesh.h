// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodMaterial.h>
#include <osgTessLOD/bake/PatchMap.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// Red, green, blue, alpha; 255 is 1.
using Rgba = std::array<std::uint8_t, 4>;

/// An indexed triangle mesh as read from a file.
struct SourceMesh {
    std::string name;                                      ///< for messages: the file's path
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// Texture coordinates of the triangles' corners, any finite numbers: outside of 0 … 1 the texture's wrap mode decides.
    /// A triangle without has NaN in all of them. Empty: no triangle has any.
    std::vector<std::array<Eigen::Vector2f, 3>> uvs;
    std::vector<Rgba> colors;                              ///< of the positions; empty: there are none
    /// Images are files, as seen from where the process is.
    std::vector<LodMaterial> materials;
    std::vector<std::uint16_t> triangleMaterials;          ///< of each triangle, an index; empty: of all the first, if any
    std::vector<std::string> warnings;                     ///< what the file refers to and was not found
    WorkingFrame frame;                                    ///< identity until normalizeFrame()

    std::uint16_t materialOf(std::size_t triangle) const
    {
        return triangleMaterials.empty() ? std::uint16_t{0} : triangleMaterials[triangle];
    }
    bool hasUvs(std::size_t triangle) const { return !uvs.empty() && uvs[triangle][0].x() == uvs[triangle][0].x(); }
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
    std::uint64_t facesWithoutUvs = 0;       ///< of a mesh that has texture coordinates elsewhere
};

/// What of it is a repair of something wrong, as words for people: all but welded and unreferenced vertices, which files have
/// for want of indices or of tidiness. "200 faces without an area dropped", …
OSGTESSLOD_EXPORT std::vector<std::string> repairsOf(const CleaningReport& report);

/// Reads PLY, OBJ, OFF or STL; polygons are triangulated. Vertices and faces come as the file has them, unconnected and
/// non-manifold ones included. Throws AssetError naming the file and the fault: unreadable, unknown format, truncated, no
/// vertices or faces, a coordinate that is not finite or beyond what can be squared in double (which vertex), an index
/// out of range (which face).
///
/// Texture coordinates: OBJ vt, per corner; PLY vertex properties s t, u v, texture_u texture_v or texture_s texture_t, or a
/// list texcoord of each face. A face has none where not all its corners have, where one is not finite or beyond ±10⁶, and
/// where all are (−1, −1), by which scanning software marks faces that no photograph shows.
/// Colours: PLY red green blue and alpha, integers up to their type's largest or floats up to 1; OBJ "v x y z r g b" up to 1;
/// a vertex of an OBJ file without is white where others have one.
/// Materials: OBJ usemtl and the MTL files of mtllib, see parseMtl. Faces before the first usemtl have one without name. What is
/// not found leaves a warning.
OSGTESSLOD_EXPORT SourceMesh importMesh(const std::string& path);

/// The same mesh, of polygons, after `steps` Catmull–Clark steps (subdivideCatmullClark). Vertices of equal position are one,
/// colours are left out. Throws likewise, and for more faces than fit into memory.
OSGTESSLOD_EXPORT SourceMesh importSmoothedMesh(const std::string& path, unsigned steps);

/// Throws AssetError naming mesh.name and the fault: no vertices or faces, a coordinate that is not finite or beyond what can
/// be squared in double, an index out of range. What importMesh() returns has been checked.
OSGTESSLOD_EXPORT void checkMesh(const SourceMesh& mesh);

/// True when every directed edge occurs once and every vertex has one fan of faces around it, open or closed: what
/// cleanMesh() brings about. Also false for an index out of range or a face with two equal corners.
OSGTESSLOD_EXPORT bool isOrientedManifold(const SourceMesh& mesh);

/// Makes the mesh an oriented 2-manifold with boundary: welds equal positions, drops degenerate and duplicate faces and
/// unreferenced vertices, orients each component consistently, cuts non-manifold edges open and splits non-manifold
/// vertices. Corners keep their texture coordinates; vertices that are welded get the mean of their colours. Deterministic. Throws AssetError when no face is left.
OSGTESSLOD_EXPORT CleaningReport cleanMesh(SourceMesh& mesh);

/// What the mesh has. Texture coordinates differ where they do by more than a step of UvLattice.
SurfaceAttributes attributesOf(const SourceMesh& mesh);

/// Moves the positions into the working frame, and remembers it in mesh.frame. Throws AssetError when the bounding box is a point.
OSGTESSLOD_EXPORT void normalizeFrame(SourceMesh& mesh);

} // namespace osgTessLOD::bake
