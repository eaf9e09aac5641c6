// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

namespace osgTessLOD::bake {

/// How displacement is sampled at the points of a lattice (Livny et al. 2012, §3.7).
enum class DisplacementSampling {
    /// Where the point's ray meets the surface.
    Intersection,
    /// The mean around there, weighted by the hat function that is 1 at the point and 0 at its neighbours in the lattice: detail finer than
    /// the lattice evens out instead of being hit or missed, but what bulges lies inside. The paper averages the centres of the triangles
    /// in the cells of a grid over the neighbourhood; here each cell has a ray, so that none is empty.
    Interpolation,
    /// The values whose own means, of the triangles between them, are those of Interpolation: the least mean square error along the rays.
    Fit
};

/// The regular lattice over a triangle: point (i, j), i + j ≤ steps, has the weights (steps − i − j, i, j) / steps.
struct TriangleLattice {
    unsigned steps;

    std::size_t size() const { return std::size_t{steps + 1} * (steps + 2) / 2; }
    /// Row by row, i running.
    std::size_t index(unsigned i, unsigned j) const { return (std::size_t{j} * (2 * steps + 3 - j)) / 2 + i; }
    Eigen::Vector3d weights(double i, double j) const { return Eigen::Vector3d(steps - i - j, i, j) / steps; }
};

/// What is sampled at a point of a patch.
using Displacement = std::function<Eigen::Vector3d(std::uint32_t patch, const Eigen::Vector3d& barycentric)>;

/// Displacement of the flat triangles of a map's corners: `scalar`, (along the interpolated normal, 0, 0), of an ElevationMap only, else
/// the vector from the flat triangle's point. Source units. Keeps a reference to `map`.
OSGTESSLOD_EXPORT Displacement displacementOf(const PatchMap& map, bool scalar);

/// Every patch's displacement at the points of its lattice. Corners are 0: they are on the surface. Points on a border are sampled
/// along the border alone and once, so both sides have the same bits. Parallel, deterministic.
OSGTESSLOD_EXPORT std::vector<std::vector<Eigen::Vector3d>>
sampleDisplacement(const PatchTopology& topology, const Displacement& displacement, const TriangleLattice& lattice,
                   DisplacementSampling sampling, Progress& progress);

} // namespace osgTessLOD::bake
