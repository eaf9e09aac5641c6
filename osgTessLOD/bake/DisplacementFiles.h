// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/DisplacedMap.h>
#include <osgTessLOD/bake/DisplacementSampling.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>

#include <string>

namespace osgTessLOD::bake {

/// A displacement map and its base mesh, as files that DisplacedMap takes: an image, and beside it an OBJ file of the same name.
///
/// Every patch is a triangle of the base mesh with texture coordinates of its own, and has a right triangle of the image: a lattice of
/// `steps` along each side whose points are the middles of pixels. Two patches share a square:
///
///     B B B B B        The pixels around a triangle go on with its values, and those just beyond its long side so that
///     A . B B B        bilinear lookups there are straight lines between the side's own pixels, as they are on the other two. So
///     A A . B B        both sides of a border give the same point.
///     A A A . B
struct DisplacementFiles {
    std::string imagePath;
    std::string imageBytes;
    std::string meshPath;
    std::string meshText;
    DisplacementOptions options; ///< what the image's numbers mean
    std::uint32_t width = 0;
    std::uint32_t height = 0;

    /// The arguments of osgtesslodbake that give the surface back.
    OSGTESSLOD_EXPORT std::string command() const;
    /// Both files, or none: everything is on the disk before the first one is given its name. Throws AssetError.
    OSGTESSLOD_EXPORT void write() const;
};

/// Throws AssetError for a path of which no image can be made: .exr (floating-point numbers, source units), .png, .tif and .tiff
/// (16 bits, scaled to the range of the displacements) can. Throws, too, where the base mesh beside it would replace `source`.
OSGTESSLOD_EXPORT void checkDisplacementPath(const std::string& imagePath, const std::string& source);

/// The displacement of the flat triangles of `map`: scalar if it is an ElevationMap, else a vector in object space.
/// Throws AssetError for patches that a mesh file cannot hold (two with the same corners, one without area) and
/// more pixels than an image may have.
OSGTESSLOD_EXPORT DisplacementFiles makeDisplacementFiles(const PatchMap& map, const std::string& imagePath,
                                                          unsigned steps, DisplacementSampling sampling,
                                                          Progress& progress);

} // namespace osgTessLOD::bake
