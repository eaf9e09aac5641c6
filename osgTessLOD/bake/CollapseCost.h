// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/CollapseStar.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/StripMesh.h>
#include <osgTessLOD/bake/VertexPlacement.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// Squared errors in a fixed set of directions, spread evenly over a hemisphere (E(d) = E(−d)).
class OSGTESSLOD_EXPORT DirectionalErrors {
public:
    static constexpr std::size_t kDirections = 200;
    using Table = std::array<float, kDirections>;

    /// The components of all directions.
    struct Directions {
        Table x, y, z;
    };
    static const Directions& directions();

    /// Raises each direction's entry to at least |v × d|².
    void include(const Eigen::Vector3f& v);
    const Table& squared() const { return _squared; }
    /// Least entry: a vector no longer than its root raises none.
    float least() const;
    /// Mean over the directions of max(0, other's error − this error).
    double meanExcess(const DirectionalErrors& other) const;

private:
    alignas(64) Table _squared{};
};

/// How much contracting an edge raises a patch's error (Lambert §4.6): C_edge of eq. 4.5, with the error of the current mesh
/// itself, max |v × d| over its difference vectors, in place of its fit. Knows for each vertex of the charts which triangle
/// of the strip mesh it lies in; difference vectors at crossings of edges are left out, as there.
class OSGTESSLOD_EXPORT CollapseCost {
public:
    /// Both must outlive it.
    CollapseCost(const StripMesh& mesh, const ChartSet& charts);
    ~CollapseCost();
    CollapseCost(const CollapseCost&) = delete;
    CollapseCost& operator=(const CollapseCost&) = delete;

    /// To be called once StripMesh::contract has returned `after` for a patch whose lattice was `before`.
    void contracted(std::uint32_t patch, const StripLattice& before, const std::vector<std::uint32_t>& after);
    /// Brings up to date which triangles the chart's vertices lie in, after vertices have moved.
    void relocate(std::uint32_t patch);
    /// Takes the patch's current error, relocated, as what edges are compared with.
    void measure(std::uint32_t patch);

    /// C_edge: summed over the patches that the star reaches into, which must be relocated and measured. `fitted`: for the
    /// merged vertex moved to where it fits the charts best.
    double evaluate(const CollapseStar& star, const Placement& placement, bool fitted = false) const;

    /// Where a vertex, no corner, should be for the difference vectors around it to have the least squares, nothing else
    /// moving (one row of §4.7's equations). The patches that have it must be relocated.
    Eigen::Vector3d fittedPosition(StripMesh::Site vertex) const;

    /// Triangle of the strip mesh that a chart vertex lies in, and the difference vector there.
    std::uint32_t triangleOf(std::uint32_t patch, std::uint32_t chartVertex) const;
    Eigen::Vector3d difference(std::uint32_t patch, std::uint32_t chartVertex) const;
    const DirectionalErrors& errors(std::uint32_t patch) const;

private:
    struct PatchState;

    struct Fit;

    std::uint32_t locate(std::uint32_t patch, ChartPoint point, std::uint32_t start) const;
    void fitAround(StripMesh::Site vertex, Fit& fit) const;

    const StripMesh& _mesh;
    const ChartSet& _charts;
    TessellationPattern _chartPattern;
    std::vector<ChartPoint> _chartPoints;
    std::vector<PatchState> _patches;
};

} // namespace osgTessLOD::bake
