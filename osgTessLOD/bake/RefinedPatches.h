// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/BisectionForest.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/StretchMap.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

/// The patches of a control mesh, bisected where the finest level would not follow the surface closely enough. The pieces
/// of a bisected patch are parametrized evenly anew, measured, and bisected again if that did not do, so that a deep
/// fold in a patch ends up with patches of its own.
class OSGTESSLOD_EXPORT RefinedPatches : public PatchMap {
public:
    /// Bisects patches while their surface, sampled at the pattern of `factor`, is farther than `tolerance` (of the model's
    /// size) from the source either way, the worst first; but not in more than kMostRounds rounds, no more once there
    /// are kMostGrowth times as many patches and either kAlwaysAllowed or kMostGrowthOfFew times as many (of small meshes: as many as
    /// triangles), and not what is no nearer for many rounds. After kEvenRounds the
    /// pieces keep their parameters.
    RefinedPatches(std::unique_ptr<ControlMesh> base, unsigned factor, double tolerance, Progress& progress);

    static constexpr unsigned kMostRounds = 24;
    static constexpr unsigned kEvenRounds = 2;
    static constexpr std::size_t kMostGrowth = 4;
    static constexpr std::size_t kMostGrowthOfFew = 16;
    static constexpr std::size_t kAlwaysAllowed = 1024;

    const ControlMesh& base() const { return *_base; }
    /// The largest distance that is left between any patch and the source, of the model's size; the tolerance if all are nearer.
    double roughest() const { return _roughest; }
    std::uint64_t sourceTriangles() const override { return _base->sourceTriangles(); }
    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;
    std::uint16_t materialOf(std::uint32_t patch) const override;

    /// The point of this map that a point of the base map is (face = patch), and the inverse.
    FacePoint fromBase(const FacePoint& basePoint) const;
    FacePoint toBase(const FacePoint& point) const;

    /// The source's vertices, in their order, then its edges' middles and its faces' centroids, with the patch of each.
    const SourceSamples& sourceSamples() const { return _samples; }

private:
    /// Patches bisected, and the bijective map of each piece onto itself that makes its parameters even.
    struct Round {
        BisectionForest cuts;
        std::vector<std::uint32_t> leafOfPatch;
        std::vector<std::uint32_t> patchOfLeaf; ///< by node
        std::vector<char> isWhole;              ///< per patch: the same as before
        std::unique_ptr<StretchMap> even;

        std::uint32_t patchBefore(std::uint32_t patch) const;
        FacePoint from(const FacePoint& before) const;
        FacePoint to(const FacePoint& after) const;
    };

    Eigen::Vector3d position(const FacePoint& point) const { return _base->position(_base->toSource(toBase(point))); }
    std::vector<char> bisect(const std::vector<std::uint32_t>& rough, std::size_t mostPatches,
                             std::vector<FacePoint>& samples, Progress& progress);

    std::unique_ptr<ControlMesh> _base;
    std::vector<Round> _rounds;
    SourceSamples _samples;
    double _roughest = 0.0;
};

} // namespace osgTessLOD::bake
