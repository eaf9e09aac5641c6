// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/SurfaceMesh.h>

#include <osg/Matrixd>
#include <osg/Vec3d>
#include <osg/Vec3f>

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

namespace osgTessLOD {

/// Triangles captured from the GPU, in world space, vertices of exactly equal position welded. Triangles that have two
/// equal corners, as morphing makes them where a vertex has reached its parent, are counted and left out: they have
/// no area, and leaving one out opens no border.
class CapturedMesh {
public:
    struct Counts {
        std::uint64_t triangles = 0;           ///< added
        std::uint64_t degenerateTriangles = 0; ///< of them, left out
        std::uint64_t faces = 0;
        std::uint64_t vertices = 0;
    };

    /// `corners`: three per triangle, in the space that `localToWorld` leads from. Throws std::runtime_error for more
    /// vertices than a PLY file's 31-bit indices can name.
    void add(const std::vector<osg::Vec3f>& corners, const osg::Matrixd& localToWorld);

    Counts counts() const;
    const SurfaceMesh& surface() const { return _surface; }

private:
    using Key = std::array<std::uint64_t, 3>;
    struct KeyHash {
        std::size_t operator()(const Key& key) const;
    };
    std::uint32_t vertexAt(const osg::Vec3d& position);

    std::unordered_map<Key, std::uint32_t, KeyHash> _vertexOf;
    SurfaceMesh _surface;
    std::uint64_t _degenerateTriangles = 0;
};

} // namespace osgTessLOD
