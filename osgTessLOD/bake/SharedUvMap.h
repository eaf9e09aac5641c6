// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

class UvLocator;

/// How a coarse mesh's patches are looked up in a detailed one.
struct SharedUvOptions {
    /// A point of a patch that the detailed mesh's texture coordinates leave out is taken from the nearest ones, no farther
    /// than this from it; the texture's width and height are 1.
    double tolerance = 0.02;
    double creaseAngleRadians = 1.05; ///< as ControlMeshOptions
};

/// The map from the triangles of a coarse mesh to a detailed mesh that shares its texture coordinates (Lambert §4.2): a
/// patch's parameter plane is its triangle of the texture plane, and so the texture coordinates of what is drawn are exact
/// wherever they are linear. Where charts lie over one another, the one nearest in space to the coarse triangle counts.
class OSGTESSLOD_EXPORT SharedUvMap : public PatchMap {
public:
    /// Both are oriented manifolds (cleanMesh); `detailed` in the working frame (normalizeFrame), `coarse` in the source's
    /// own, which detailed.frame tells. Throws AssetError where one of them has a face without texture coordinates, and for a
    /// coarse face that has no area in the texture.
    SharedUvMap(SourceMesh coarse, SourceMesh detailed, const SharedUvOptions& options);
    ~SharedUvMap() override;

    const SourceMesh& source() const { return _detailed; }
    std::uint64_t sourceTriangles() const override { return _detailed.triangles.size(); }

    /// Throws AssetError where the detailed mesh has nothing within the tolerance.
    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;
    /// The coarse mesh's.
    std::uint16_t materialOf(std::uint32_t patch) const override { return _coarse.materialOf(patch); }

    /// The detailed mesh's vertices, edges' middles and faces' centroids, each with the patch that its texture coordinates
    /// lie in or are nearest to.
    const SourceSamples& sourceSamples() const { return _samples; }

private:
    void sampleSource();
    Eigen::Vector2d uvAt(std::uint32_t patch, const Eigen::Vector3d& barycentric) const;

    SourceMesh _coarse; ///< working frame
    SourceMesh _detailed;
    SharedUvOptions _options;
    std::vector<std::array<Eigen::Vector3f, 3>> _normals;
    std::unique_ptr<UvLocator> _locator; ///< of the detailed mesh
    SourceSamples _samples;
};

} // namespace osgTessLOD::bake
