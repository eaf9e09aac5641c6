// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/BisectionForest.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>

#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

/// The patches of another map, bisected where the finest level would not follow the surface closely enough. The surface is
/// the same; a patch of this map is a leaf of the bisection.
class OSGTESSLOD_EXPORT RefinedPatches : public PatchMap {
public:
    /// Bisects while a patch's surface, sampled at the pattern of `factor` (a power of two ≥ 2), deviates from its pieces
    /// by an estimated `tolerance` (of the model's size) or more, the roughest first; but no patch more than kMostBisections
    /// times because of itself, and no more once there are kMostGrowth times as many patches, or kAlwaysAllowed if that is more.
    RefinedPatches(std::unique_ptr<PatchMap> base, unsigned factor, double tolerance, Progress& progress);

    static constexpr unsigned kMostBisections = 7;
    static constexpr std::size_t kMostGrowth = 2;
    static constexpr std::size_t kAlwaysAllowed = 1500;

    std::uint64_t sourceTriangles() const override { return _base->sourceTriangles(); }
    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;

    /// The point of this map that a point of the base map is (face = patch).
    FacePoint fromBase(const FacePoint& basePoint) const;

private:
    struct HalvedEdge;

    static std::vector<HalvedEdge> halvedEdges(unsigned factor);
    double deviation(std::uint32_t leaf, unsigned factor, const std::vector<HalvedEdge>& edges) const;
    void refine(unsigned factor, double tolerance, Progress& progress);

    std::unique_ptr<PatchMap> _base;
    BisectionForest::Surface _surface;
    BisectionForest _forest;
    std::vector<std::uint32_t> _leafOfPatch;
    std::vector<std::uint32_t> _patchOfLeaf;   ///< by node
};

} // namespace osgTessLOD::bake
