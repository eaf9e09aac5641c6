// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/PatchTopology.h>
#include <osgTessLOD/bake/RayPrism.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

/// A control mesh whose vertices are vertices of a source.
struct ElevationBase {
    static constexpr std::uint32_t kNone = 0xFFFFFFFFU;

    PatchTopology topology;
    std::vector<RayPrism> prisms;           ///< per patch
    std::vector<std::uint32_t> vertices;    ///< source vertex of each base vertex
    std::vector<std::uint32_t> ownTriangle; ///< per patch: the source triangle that it is; kNone: several
    std::vector<FacePoint> guesses;         ///< per source vertex: about where it is (face = patch)
};

/// Which patches of a control mesh the triangles of its source lie over along the rays, and whether the source is an
/// elevation of them (Livny et al. 2012, §3.3): met exactly once by the ray from each of their points. It is where
///
///  1. vertices are found on rays, and walking from one along an edge, from prism to prism across the rays of their sides, ends
///     where the other one was found: so the rays project the source's surface continuously onto the control mesh;
///  2. every triangle faces all rays of its region in every patch that it is walked through by its edges, ray · normal ≥
///     kLeastCosine: so the projection turns nothing over. For a patch whose corners' normals all do there is nothing more
///     to show. Else ray · normal is linear in the patch's weights, and so least on the region's outline: on straight pieces along
///     the patch's sides, at their ends; on the pieces of the triangle's edges, which are conics, nowhere less if it is not
///     at their ends and no ray at which it equals kLeastCosine meets the piece;
///  3. rays of a patch do not meet each other within its reach (RayPrism::opening), which is a quarter longer than it takes, as the conics may bend beyond their ends: so the projection has the orientation that 2 says;
///  4. the ray from the patch's middle meets one triangle: the degree of such a projection is the same everywhere.
///
/// Patches that are triangles of the source themselves need no rays, and pass.
class ElevationRegions {
public:
    static constexpr double kLeastCosine = 0.05;

    struct Location {
        std::uint32_t patch = ElevationBase::kNone; ///< kNone: not found
        PrismPoint point;
    };
    /// A source triangle over a patch, with a box around the ends of its outline's pieces in the patch's weights and heights.
    struct Overlap {
        std::uint32_t triangle;
        Eigen::Vector3d low;
        Eigen::Vector3d high;
        double lowest;
        double highest;
    };

    /// `source` is an oriented manifold in the working frame. Parallel; keeps references to both.
    ElevationRegions(const SourceMesh& source, const ElevationBase& base);

    /// Where each source vertex lies.
    const std::vector<Location>& vertices() const { return _vertices; }
    const std::vector<std::vector<Overlap>>& overlaps() const { return _overlaps; }
    /// Heights from 0 that a patch reaches up and down to, and a quarter of that farther.
    std::array<double, 2> reach(std::uint32_t patch) const;
    /// Per patch: what does not hold there; never of a patch that is a triangle of the source.
    const std::vector<char>& fails() const { return _fails; }
    bool isElevation() const;

    /// The ray through a point of the source near one whose ray is known.
    Location locate(const Eigen::Vector3d& point, const Location& near) const;

private:
    /// Part of a source edge within a patch.
    struct Piece {
        Location first;
        Location last;
        double from;
        double to;
    };
    using Pieces = std::vector<Piece>;

    Location cross(const Location& at, unsigned side, double share, double height) const;
    void locateVertices();
    Location startOf(std::uint32_t vertex, const Eigen::Vector3d& direction) const;
    bool endsAt(const Location& last, std::uint32_t vertex) const;
    bool findExit(const Piece& piece, unsigned entered, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                  unsigned& side, RayPrism::Crossing& exit) const;
    bool walk(std::uint32_t from, std::uint32_t to, Pieces& pieces) const;
    void failAround(std::uint32_t triangle, std::uint32_t patch, std::vector<std::uint32_t>& failed) const;
    bool isOpen(std::uint32_t patch) const;
    bool facesRays(std::uint32_t triangle, std::uint32_t patch) const;
    void gather(std::uint32_t triangle, std::vector<std::pair<std::uint32_t, Overlap>>& overlaps,
                std::vector<std::uint32_t>& failed) const;
    void gatherTriangles();
    void countHits();

    const SourceMesh& _source;
    const ElevationBase& _base;
    PatchTopology _sourceTopology;
    std::vector<std::vector<std::pair<std::uint32_t, unsigned>>> _patchesAround; ///< per base vertex: patch, corner
    std::vector<std::uint32_t> _baseOf; ///< per source vertex: base vertex, or kNone
    std::vector<char> _isOwn;           ///< per source triangle: it is a patch
    std::vector<Location> _vertices;
    std::vector<Pieces> _pieces; ///< per source edge
    std::vector<char> _isWalked; ///< per source edge: condition 1 holds
    std::vector<std::vector<Overlap>> _overlaps;
    std::vector<char> _fails;
};

/// Weights of a source triangle's corners where the line of a ray, either way, meets its plane: none negative where it meets the
/// triangle. −∞ if the triangle does not face the ray.
Eigen::Vector3d rayWeights(const SourceMesh& source, std::uint32_t triangle, const Eigen::Vector3d& start,
                           const Eigen::Vector3d& ray);

} // namespace osgTessLOD::bake
