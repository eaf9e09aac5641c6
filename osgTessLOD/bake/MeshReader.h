// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/SourceMesh.h>

#include <cstdint>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

// Readers of the four mesh formats, private to the bake room.
//
// OpenMesh's readers are not used. Tried on sound and broken files (OpenMesh 9) they
//  - deliver every coordinate as float, whatever the file holds, and drop OBJ vertices beyond float's range, which
//    shifts all later indices;
//  - return success for truncated ASCII PLY, OFF and STL files, inventing or leaving out faces;
//  - read NaN in ASCII PLY and comments in OFF as something else and carry on from the wrong place;
//  - allocate without bound on a PLY header or OFF polygon that is cut short, do not come back from a directory named
//    .stl, and lose OBJ lines continued with a backslash;
//  - keep their state in global objects, so that no two threads may read.

/// What a reader collects: triangles as the file has them, polygons fan-triangulated.
struct RawMesh {
    static constexpr std::uint32_t kNoUv = 0xFFFFFFFFU;

    std::vector<Eigen::Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
    std::vector<std::uint32_t> quads;       ///< first of the two triangles of each quadrilateral
    std::vector<Rgba> colors;               ///< of the positions; empty: the file has none
    std::vector<Eigen::Vector2f> uvs;       ///< texture coordinates, as the file has them; empty: none
    /// Per triangle the numbers of its corners' texture coordinates, kNoUv where it has none. Empty, with uvs: every vertex
    /// has the texture coordinates of its own number.
    std::vector<std::array<std::uint32_t, 3>> uvTriangles;
    std::vector<std::string> materialFiles; ///< that the file names, relative to its own folder
    std::vector<std::string> materials;     ///< names, in the order of their first use; empty: the file has none
    std::vector<std::uint16_t> triangleMaterials; ///< number in materials of each triangle, if there are any
    std::uint16_t material = 0;             ///< of polygons that are added

    /// Adds a polygon, as a fan around its first corner. One or two corners give a triangle without area, for cleanMesh()
    /// to drop and count; none gives nothing. `uvNumbers`, as many as corners, go to uvTriangles; empty: it has none.
    void addPolygon(const std::vector<std::uint32_t>& corners, const std::vector<std::uint32_t>& uvNumbers = {});
};

/// A colour's channel from 0 … 1 to 0 … 255; what is no number becomes 0.
std::uint8_t colorByte(double channel);

/// Each parses the whole content of a file. They throw AssetError with the fault alone: the caller adds the file's name.
/// Vertex references are checked, coordinates are not. No count is believed before the content was seen to be large
/// enough for it.
RawMesh parsePly(const std::string& content);
RawMesh parseObj(const std::string& content);
RawMesh parseOff(const std::string& content);
RawMesh parseStl(const std::string& content);

/// The materials of an MTL file (Wavefront; P. Bourke, "MTL material format"): Ka, Kd, Ks, Ke, Ns, d and Tr, and all map_…,
/// bump, norm and disp with the names of their images, options left out. The colour of light is map_Kd's alone where there is
/// one without Kd. The colour image is that of map_Kd; map_Bump, bump and norm are taken for normals where the image's name has
/// "norm" or "nrm" in it, or the keyword is norm. Unknown keywords are skipped.
std::vector<LodMaterial> parseMtl(const std::string& content);

} // namespace osgTessLOD::bake
