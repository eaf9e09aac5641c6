// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

namespace osgTessLOD::bake {

/// Finds the points of a mesh by their texture coordinates: a grid over its triangles in the texture plane. Private to the
/// bake room.
class UvLocator {
public:
    /// Keeps a reference to `mesh`, some of whose triangles have texture coordinates.
    explicit UvLocator(const SourceMesh& mesh);

    /// The point with texture coordinates `uv`: inside or on the border of a triangle up to rounding, else the nearest
    /// one, if it is no farther than `tolerance`. Where charts lie over one another there are several; the one nearest
    /// in space to `near` is it. Thread safe.
    std::optional<FacePoint> find(const Eigen::Vector2d& uv, double tolerance, const Eigen::Vector3d& near) const;

private:
    struct Found;

    Eigen::Vector2i cellAt(const Eigen::Vector2d& uv) const;
    template <typename Visit> void forEachIn(const Eigen::AlignedBox2d& box, Visit visit) const;
    void build();

    const SourceMesh& _mesh;
    Eigen::AlignedBox2d _box;
    Eigen::Vector2i _cells = Eigen::Vector2i::Ones();
    std::vector<std::uint32_t> _firstInCell;
    std::vector<std::uint32_t> _faces;
};

} // namespace osgTessLOD::bake
