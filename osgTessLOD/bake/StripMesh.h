// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/bake/PatchTopology.h>
#include <osgTessLOD/bake/StripLattice.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The mesh that strips are contracted in: all patches, between the patterns of factors f and f − 2, with vertices that
/// lie anywhere in the charts. What patches share is kept in each of them, with the same position and, along a border,
/// mirrored parameters.
class OSGTESSLOD_EXPORT StripMesh {
public:
    struct Patch {
        StripLattice lattice;
        std::vector<Eigen::Vector3d> positions; ///< by point index; others than points mean nothing
        std::vector<ChartPoint> parameters;
        std::vector<std::uint32_t> images; ///< point index that each vertex of the marked pattern has become
    };
    /// A vertex as one patch sees it.
    struct Site {
        std::uint32_t patch = kNoPatch;
        StripLattice::Point point;
    };

    /// All patches at the pattern of `factor`, vertices at its places, positions zero; pattern marked.
    /// `topology` must outlive it.
    StripMesh(const PatchTopology& topology, unsigned factor);

    const PatchTopology& topology() const { return *_topology; }
    std::size_t patchCount() const { return _patches.size(); }
    const Patch& patch(std::uint32_t p) const { return _patches[p]; }

    const Eigen::Vector3d& position(Site s) const
    {
        return _patches[s.patch].positions[_patches[s.patch].lattice.index(s.point)];
    }
    ChartPoint parameter(Site s) const
    {
        return _patches[s.patch].parameters[_patches[s.patch].lattice.index(s.point)];
    }

    /// The same border vertex in the patch across `side`, `step` edges along it; patch kNoPatch on an open border.
    Site twin(std::uint32_t patch, unsigned side, unsigned step) const;

    /// Moves a vertex; one on a border, no corner, in both patches. A border vertex' parameter must be on that border.
    void place(Site vertex, const Eigen::Vector3d& position, ChartPoint parameter);
    /// Moves a vertex in the one patch only, without regard to twins.
    void placeAlone(Site vertex, const Eigen::Vector3d& position, ChartPoint parameter);

    /// Contracts strip k of one patch (see StripLattice::contract, whose result it returns). The ends of every edge must
    /// have been given the same place; where only one end is on a border, that one's counts. The patches around the corner must be contracted alike before anything else.
    std::vector<std::uint32_t> contract(std::uint32_t patch, unsigned k, const std::vector<unsigned>& strip);

    /// Remembers the current pattern of a patch: what images counts from.
    void mark(std::uint32_t patch);

    /// In the order of the current pattern's vertices.
    std::vector<Eigen::Vector3d> patternPositions(std::uint32_t patch) const;
    std::vector<ChartPoint> patternParameters(std::uint32_t patch) const;
    /// Vertex of the current pattern that each vertex of the marked one has become.
    std::vector<std::uint32_t> patternImages(std::uint32_t patch) const;

    /// Throws std::logic_error naming the fault unless all patches are at one factor, every triangle is positive in the
    /// parameter plane, border vertices lie on their borders, and patches agree on what they share.
    void check() const;

private:
    void checkPatch(std::uint32_t p) const;
    void checkSide(std::uint32_t p, unsigned side) const;

    const PatchTopology* _topology;
    std::vector<Patch> _patches;
};

} // namespace osgTessLOD::bake
