// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/PatchMap.h>
#include <osgTessLOD/bake/Progress.h>
#include <osgTessLOD/bake/SourceMesh.h>
#include <osgTessLOD/bake/StretchMap.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

/// How a control mesh is made of a source mesh.
struct ControlMeshOptions {
    /// Patches to stop at; 0: sourceTriangles / trianglesPerPatch, at least 1. More remain where topology, creases or
    /// shape forbid further collapses.
    std::size_t patches = 0;
    double trianglesPerPatch = 1024.0;
    /// No patch takes the place of more than this many times the average number of source triangles.
    double largestShare = 2.0;
    /// Edges whose faces' normals differ by more are creases, which collapse only along themselves.
    double creaseAngleRadians = 1.05;
    /// Chains of crease edges shorter than this, in units of the model's size, are noise and no creases.
    double shortestCrease = 0.02;
    unsigned maxValence = 12;
    /// Make patches that are elevations of their triangles (ElevationMap): usually more than asked for.
    bool elevation = false;
};

/// The patches of an arbitrary source mesh: what is left after half-edge collapses in the order of quadric error
/// (Garland and Heckbert 1997), each of which carried the bijective map from the source along (CollapseHistory), followed by
/// a bijective map of every patch onto itself that spreads its parameters evenly (StretchMap).
/// Base vertices are source vertices. Boundaries, creases and borders between materials map to patch borders.
class OSGTESSLOD_EXPORT ControlMesh : public PatchMap {
public:
    /// `source` is an oriented manifold (cleanMesh) in the working frame (normalizeFrame). Deterministic.
    /// Throws AssetError when the source has more faces than can be numbered, Interrupted as `progress` asks.
    ControlMesh(SourceMesh source, const ControlMeshOptions& options, Progress& progress);

    const SourceMesh& source() const { return _source; }
    std::uint64_t sourceTriangles() const override { return _source.triangles.size(); }
    /// Source vertex of each base vertex.
    const std::vector<std::uint32_t>& baseVertices() const { return _baseVertices; }

    SurfacePoint evaluate(std::uint32_t patch, const Eigen::Vector3d& barycentric) const override;
    std::uint16_t materialOf(std::uint32_t patch) const override;

    /// The patch point (face = patch) of a point on a source triangle, and the inverse.
    FacePoint toPatch(const FacePoint& sourcePoint) const;
    FacePoint toSource(const FacePoint& patchPoint) const;
    /// The patch point of a source vertex.
    FacePoint patchPointOf(std::uint32_t vertex) const;

    Eigen::Vector3d position(const FacePoint& sourcePoint) const;

    /// A bisection within these limits is about as fine as the source wherever the source is.
    BisectionForest::Limits parametrizationLimits() const;

    const CollapseHistory& history() const { return _history; }
    const StretchMap& stretchMap() const { return *_stretchMap; }

private:
    struct PatchFace {
        std::uint32_t face;    ///< number in the history
        std::uint8_t corner;   ///< corner of that face which is the patch's corner 0
    };

    FacePoint sourceVertex(std::uint32_t vertex) const;
    FacePoint toCollapsed(const FacePoint& sourcePoint) const;
    FacePoint fromCollapsed(const FacePoint& patchPoint) const;
    BisectionForest bisectPatches(Progress& progress) const;

    SourceMesh _source;
    CollapseHistory _history;
    std::vector<std::uint32_t> _baseVertices;
    std::vector<PatchFace> _patchFaces;
    std::unique_ptr<StretchMap> _stretchMap;
    std::vector<std::uint32_t> _patchOfFace;                     ///< by face number, kNone if replaced
    std::vector<std::uint32_t> _faceOfVertex;                    ///< a source face of each source vertex
    std::vector<std::array<Eigen::Vector3f, 3>> _cornerNormals;  ///< per source triangle
};

} // namespace osgTessLOD::bake
