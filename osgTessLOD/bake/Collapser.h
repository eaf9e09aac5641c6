// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/StarFlattening.h>
#include <osgTessLOD/bake/SurfaceCollapser.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <OpenMesh/Core/Geometry/QuadricT.hh>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {

// How collapseSurface() works, in three files: this one's name, CollapserFeatures.cpp and CollapserElevation.cpp. Private to the bake room.

struct CollapserMeshTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
    VertexAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::Status);
};
class Collapser {
public:
    Collapser(const SourceMesh& source, const ControlMeshOptions& options, std::size_t target, CollapseHistory& history,
              const ElevationGuide* guide);

    void run(Progress& progress);
    std::vector<RemainingFace> remainingFaces() const;

private:
    using Mesh = OpenMesh::TriMesh_ArrayKernelT<CollapserMeshTraits>;
    using Quadric = OpenMesh::Geometry::Quadricd;

    /// What an edge can be, as bits: it collapses along itself only.
    enum Feature : std::uint8_t {
        kCrease = 1, ///< of the shape: given up where there is no other way
        kSeam = 2    ///< a boundary, a seam of the texture coordinates, or a border between materials: always kept
    };

    /// Limits that are loosened when nothing may collapse while there are far too many faces.
    struct Limits {
        double largestWeight;
        /// Below this (4√3·area / sum of squared sides, 1 for an equilateral triangle) a triangle is a needle, and a collapse
        /// may not make one that is worse than what was there.
        double needle = 0.1;
        /// New faces may turn away from the old by less than this cosine.
        double turn = 0.2;
    };

    struct Entry {
        double cost;
        std::uint32_t vertex;
        std::uint32_t version;
        Mesh::HalfedgeHandle halfedge;
        bool operator<(const Entry& o) const { return cost != o.cost ? cost > o.cost : vertex > o.vertex; }
    };

    struct FeatureEdge {
        Mesh::VertexHandle vertex;
        std::uint8_t features;
        double arc;
    };

    /// A source vertex with the new face (by its index in the collapse) that takes it over.
    struct CarriedPoint {
        std::uint32_t vertex;
        FacePoint to;
    };
    static constexpr std::uint32_t kNone = CollapseHistory::kNone;

    static std::size_t at(OpenMesh::BaseHandle h) { return static_cast<std::size_t>(h.idx()); }
    const Eigen::Vector3d& position(Mesh::VertexHandle v) const { return _source.positions[at(v)]; }
    bool isFeature(Mesh::EdgeHandle e) const { return _feature[at(e)] != 0; }
    unsigned featureCount(Mesh::VertexHandle v) const;

    void buildMesh();
    void placePoints(double area);
    void markFeatures();
    void markSeams();
    void markMaterialBorders();
    std::size_t facesHeldBySeams() const;
    void dropShortCreases();
    void dropCreases();
    void measureArcs();
    void initializeQuadrics();
    void initializeQueue();
    void queueVertex(Mesh::VertexHandle v);
    bool isAllowed(Mesh::HalfedgeHandle h, unsigned features) const;
    bool winds(Mesh::HalfedgeHandle h) const;
    double cost(Mesh::HalfedgeHandle h) const;
    bool gatherStar(Mesh::HalfedgeHandle h, Star& star, CollapseHistory::Step& step,
                    std::array<Mesh::FaceHandle, CollapseHistory::kMaxRing>& faces) const;
    std::vector<FeatureEdge> featuresAfter(Mesh::HalfedgeHandle h) const;
    bool collapse(Mesh::HalfedgeHandle h);
    using Corners = std::array<Mesh::VertexHandle, 3>;
    Corners cornersOf(Mesh::FaceHandle f) const;
    Eigen::Vector3d normalAfter(Mesh::VertexHandle x, Mesh::VertexHandle v, Mesh::VertexHandle w) const;
    const Eigen::Vector3d& changedNormal(Mesh::VertexHandle x) const;
    RayPrism prismAfter(const Corners& corners) const;
    bool mayWeigh(const std::array<Mesh::FaceHandle, CollapseHistory::kMaxRing>& faces,
                  const std::array<double, CollapseHistory::kMaxRing>& newWeights) const;
    bool newFacesKeepElevation(Mesh::HalfedgeHandle h, unsigned ringSize);
    bool keepsElevation(Mesh::HalfedgeHandle h, unsigned ringSize);
    void refuse(Mesh::HalfedgeHandle h);
    void collapseAll(Progress& progress);

    const SourceMesh& _source;
    const ControlMeshOptions& _options;
    std::size_t _target;
    CollapseHistory& _history;
    mutable Mesh _mesh; // OpenMesh's circulators and is_collapse_ok (which sets tags) want it mutable
    std::size_t _faces = 0;
    double _patchSize = 1.0;                    // square root of the mean patch's area
    double _patchWeight = 1.0;                  // share of the source of the mean patch
    Limits _limits{};
    std::vector<std::uint8_t> _feature;         // per edge: bits of Feature
    std::vector<double> _arc;                   // per edge: length of the source's feature that it stands for
    std::vector<Quadric> _quadrics;             // per vertex
    std::vector<double> _quadricArea;           // per vertex: what the quadric is weighted by
    std::vector<double> _weight;                // per face: of the source vertices it holds, whose mean is 1 per source face
    std::vector<std::uint32_t> _firstPoint;     // per face: chain of the source vertices it holds
    std::vector<std::uint32_t> _nextPoint;      // per source vertex
    std::vector<Eigen::Vector3d> _pointInFace;         // per source vertex: coordinates in its face
    std::vector<double> _pointWeight;           // per source vertex
    std::vector<CarriedPoint> _carried;         // of the collapse being tried
    std::vector<std::uint32_t> _number;         // per face: in the history
    std::vector<std::uint32_t> _firstVertex;    // per face: its history corner 0
    std::vector<std::uint32_t> _version;        // per vertex: of its queue entry
    std::priority_queue<Entry> _queue;
    const ElevationGuide* _guide;               // null: none, and the rest is unused
    std::vector<Eigen::Vector3d> _normals;             // per vertex: of the mesh as it is
    /// Vertices around the collapse being tried, by number, and their normals after it.
    std::vector<std::pair<int, Eigen::Vector3d>> _changed;
    /// Per vertex: those that it must not collapse into while its neighbourhood is as it is.
    std::unordered_map<std::uint32_t, std::vector<int>> _refused;
};

} // namespace osgTessLOD::bake
