// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/ElevationRegions.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/RayPrism.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The patches of an arbitrary source mesh as elevations of flat triangles (Livny et al. 2012, §3.2, §3.3): every ray from a
/// triangle along its corners' interpolated normals meets the patch exactly once, and every point of the source is met by
/// exactly one ray. So heights along the rays are all that it takes to have the source back.
///
/// Corners are source vertices, normals there are the vertexNormals() of the triangles themselves, as DisplacedMap has them. Collapses are
/// guided (ElevationGuide), what they leave is checked (ElevationRegions), and where the check fails the collapses are done anew with
/// smaller patches there, down to the source's own triangles, until none fails. Vertices on boundaries stay.
class OSGTESSLOD_EXPORT ElevationMap : public PatchMap {
public:
    /// `source` is an oriented manifold (cleanMesh) in the working frame (normalizeFrame); its texture coordinates and
    /// materials do not count. There are at least options.patches patches, usually more. Deterministic. Throws Interrupted as `progress` asks.
    ElevationMap(SourceMesh source, const ControlMeshOptions& options, Progress& progress);

    const SourceMesh& source() const { return _source; }
    std::uint64_t sourceTriangles() const override { return _source.triangles.size(); }
    /// The source's samplePoints(), with the patch of each.
    const SourceSamples& sourceSamples() const { return _samples; }
    /// How often collapses were done, 1 at least.
    unsigned rounds() const { return _rounds; }
    /// Patches that are triangles of the source.
    std::size_t ownTriangles() const;

    /// The rays of a patch. Those of a patch that is a triangle of the source may not face it, and are met at height 0.
    const RayPrism& prism(std::uint32_t patch) const { return _patches[patch].prism; }
    /// Heights, in terms of RayPrism, within which the patch is; what rays meet beyond is none of it.
    const std::array<double, 2>& reach(std::uint32_t patch) const { return _patches[patch].reach; }
    /// The source triangles that rays of the patch meet; those beyond its borders that touch these may be among them.
    std::vector<std::uint32_t> trianglesOf(std::uint32_t patch) const;
    /// The patch point (face = patch) whose ray meets a vertex of the source.
    const FacePoint& patchPointOf(std::uint32_t vertex) const { return _vertices[vertex]; }
    /// The source point that the ray of a patch point meets.
    FacePoint toSource(const FacePoint& patchPoint) const;

    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;

private:
    struct Patch {
        RayPrism prism;
        std::array<double, 2> reach{};
        std::uint32_t ownTriangle;              ///< kNone: several
        std::uint8_t ownCorner = 0;             ///< of that triangle: the patch's corner 0
        unsigned resolution = 1;                ///< of a grid over the weights of corners 1 and 2
        std::vector<std::uint32_t> firstInCell; ///< into `triangles`
        std::vector<std::uint32_t> triangles;
    };

    void adopt(const ElevationBase& base, const ElevationRegions& regions);
    static void fillGrid(const std::vector<ElevationRegions::Overlap>& overlaps, Patch& patch);
    void locateSamples(const ElevationRegions& regions);

    SourceMesh _source;
    std::vector<std::array<Eigen::Vector3f, 3>> _cornerNormals; ///< per source triangle
    std::vector<Patch> _patches;
    std::vector<FacePoint> _vertices; ///< per source vertex: where it is (face = patch)
    SourceSamples _samples;
    unsigned _rounds = 0;
};

} // namespace osgTessLOD::bake
