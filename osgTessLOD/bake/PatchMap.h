// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/LodMaterial.h>
#include <osgTessLOD/bake/PatchTopology.h>

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD::bake {

/// A point of the detailed surface.
struct SurfacePoint {
    Eigen::Vector3d position;  ///< working frame
    Eigen::Vector3d normal;    ///< unit
    /// Texture coordinates, NaN where there are none.
    Eigen::Vector2f uv = Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN());
    Eigen::Vector4f color = Eigen::Vector4f::Ones(); ///< red, green, blue, alpha, 0 … 1
};

/// What a detailed surface has beside its shape.
struct SurfaceAttributes {
    bool uvs = false;
    bool colors = false;
    bool materials = false; ///< more than one
    Eigen::Vector2f uvTolerance = Eigen::Vector2f::Zero(); ///< texture coordinates no farther apart than this are no seam
};

/// Working frame: centred on the source's bounding box and scaled so that the box's diagonal is 1.
/// source position = centre + scale · working position.
struct WorkingFrame {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    double scale = 1.0;
};

/// A detailed surface as a continuous, piecewise smooth map from the triangles of a control mesh: what every kind of
/// input becomes before charts are made of it.
class OSGTESSLOD_EXPORT PatchMap {
public:
    virtual ~PatchMap() = default;

    const PatchTopology& topology() const { return _topology; }
    const WorkingFrame& frame() const { return _frame; }
    /// That the asset is to have, because others that meet it have it, too; none: its own.
    const std::optional<Lattice>& lattice() const { return _lattice; }
    const std::string& name() const { return _name; }
    const SurfaceAttributes& attributes() const { return _attributes; }
    const std::vector<LodMaterial>& materials() const { return _materials; }
    /// Number in materials() of all of the patch.
    virtual std::uint16_t materialOf(std::uint32_t /*patch*/) const { return 0; }
    /// Triangles of the detailed surface.
    virtual std::uint64_t sourceTriangles() const = 0;
    /// Pattern factor at which sampling every patch gives those triangles; 0: the map has none of its own, choose.
    virtual unsigned referenceFactor() const { return 0; }

    /// The surface point at `barycentric` (weights of the patch's corners, ≥ 0, sum 1) of `patch`. Thread safe.
    /// On a border the two patches' results agree up to rounding; on a corner likewise. Texture coordinates are those of the
    /// patch's own side, and so differ where the border is a seam of them.
    virtual SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const = 0;

protected:
    PatchTopology _topology;
    WorkingFrame _frame;
    std::optional<Lattice> _lattice;
    std::string _name;
    SurfaceAttributes _attributes;
    std::vector<LodMaterial> _materials;
};

} // namespace osgTessLOD::bake
