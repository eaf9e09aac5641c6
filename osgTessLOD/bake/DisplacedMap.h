// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/DisplacementImage.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// What the numbers of a displacement map mean.
struct DisplacementOptions {
    enum class Kind {
        Scalar,        ///< along the base surface's normal, channel 0
        TangentVector, ///< red along the tangent (growing u), green along the bitangent (growing v), blue along the normal
        ObjectVector ///< red, green, blue along x, y, z
    };
    Kind kind = Kind::Scalar;
    double scale = 1.0;    ///< object units per unit of the map
    double midlevel = 0.0; ///< value of the map that displaces nothing
};

/// A base mesh with a displacement map, every triangle a patch: p + scale · (map − midlevel) along the interpolated normal,
/// or as a vector (Lambert §1.4.1). Normals of the base are the angle-weighted means of the faces around each vertex;
/// normals of the displaced surface are those of the map over a base taken to be as smooth as its normals are (J. Blinn,
/// "Simulation of wrinkled surfaces", 1978), so that they are continuous over its edges. Where texture coordinates have a
/// seam, the surface there is that of the first side.
class OSGTESSLOD_EXPORT DisplacedMap : public PatchMap {
public:
    /// `base` is an oriented manifold (cleanMesh) in its own space. Throws AssetError naming it and the first triangle without
    /// texture coordinates, and where the displaced surface is a point.
    DisplacedMap(const SourceMesh& base, DisplacementImage image, const DisplacementOptions& options);

    /// Two for each texel of the map that the patches cover, about.
    std::uint64_t sourceTriangles() const override;
    /// The power of two up to 64 at which vertices lie as densely as the map's texels on all but a hundredth of the patches,
    /// or as densely as they can.
    unsigned finestFactor() const { return _finestFactor; }

    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;
    /// The base mesh's.
    std::uint16_t materialOf(std::uint32_t patch) const override { return _patches[patch].material; }

private:
    struct Patch {
        std::array<Eigen::Vector3d, 3> positions;
        std::array<Eigen::Vector3d, 3> normals;
        std::array<Eigen::Vector3d, 3> tangents;
        std::array<Eigen::Vector2d, 3> uvs;
        double handedness = 1.0; ///< −1 where texture coordinates are mirrored
        std::uint16_t material = 0;
    };
    struct Frame;

    void addNormals(const SourceMesh& base);
    void addTangents(const SourceMesh& base);
    void measureTexels();
    void fitFrame();
    Frame frameAt(const Patch& patch, const Eigen::Vector3d& barycentric) const;
    Eigen::Vector3d displacementAt(const Eigen::Vector2d& uv) const;

    DisplacementImage _image;
    DisplacementOptions _options;
    std::vector<Patch> _patches;
    unsigned _finestFactor = 1;
    double _texels = 0.0; ///< that all patches cover
};

} // namespace osgTessLOD::bake
