// SPDX-License-Identifier: MIT
// Michael Garland, Paul Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 1997.
#include <osgTessLOD/bake/SurfaceCollapser.h>

#include <osgTessLOD/bake/StarFlattening.h>
#include <osgTessLOD/bake/VertexNormals.h>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>

#include <OpenMesh/Core/Geometry/QuadricT.hh>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <queue>
#include <unordered_map>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

struct MeshTraits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
    VertexAttributes(OpenMesh::Attributes::Status);
    FaceAttributes(OpenMesh::Attributes::Status);
    EdgeAttributes(OpenMesh::Attributes::Status);
    HalfedgeAttributes(OpenMesh::Attributes::Status);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<MeshTraits>;
using Quadric = OpenMesh::Geometry::Quadricd;

/// Below this (4√3·area / sum of squared sides, 1 for an equilateral triangle) a triangle is a needle, and a collapse
/// may not make one that is worse than what was there.
constexpr double kNeedle = 0.1;
/// New faces may turn away from the old by less than this cosine.
constexpr double kLargestTurn = 0.2;
/// How much a patch's size counts beside its distance from the surface: flat regions go by size.
constexpr double kSizeWeight = 0.1;
/// Boundaries and creases are kept in place by planes through them of this many times their neighbourhood's weight.
constexpr double kFeatureWeight = 10.0;

/// A feature edge may stand for so many times its own length of the source's: where a boundary comes back to a vertex's other
/// side, what lies in between would hang on no length at all.
constexpr double kMostWinding = 2.0;

double triangleQuality(const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
    const double sides = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return sides > 0.0 ? 2.0 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / sides : 0.0;
}

/// What an edge can be, as bits: it collapses along itself only.
enum Feature : std::uint8_t {
    kCrease = 1, ///< of the shape: given up where there is no other way
    kSeam = 2    ///< a boundary, a seam of the texture coordinates, or a border between materials: always kept
};

/// Limits that are loosened when nothing may collapse while there are far too many faces.
struct Limits {
    double largestWeight;
    double needle = kNeedle;
    double turn = kLargestTurn;
};

class Collapser {
public:
    Collapser(const SourceMesh& source, const ControlMeshOptions& options, std::size_t target, CollapseHistory& history,
              const ElevationGuide* guide);

    void run(Progress& progress);
    std::vector<RemainingFace> remainingFaces() const;

private:
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
    const Vector3d& position(Mesh::VertexHandle v) const { return _source.positions[at(v)]; }
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
    Vector3d normalAfter(Mesh::VertexHandle x, Mesh::VertexHandle v, Mesh::VertexHandle w) const;
    const Vector3d& changedNormal(Mesh::VertexHandle x) const;
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
    std::vector<Vector3d> _pointInFace;         // per source vertex: coordinates in its face
    std::vector<double> _pointWeight;           // per source vertex
    std::vector<CarriedPoint> _carried;         // of the collapse being tried
    std::vector<std::uint32_t> _number;         // per face: in the history
    std::vector<std::uint32_t> _firstVertex;    // per face: its history corner 0
    std::vector<std::uint32_t> _version;        // per vertex: of its queue entry
    std::priority_queue<Entry> _queue;
    const ElevationGuide* _guide;               // null: none, and the rest is unused
    std::vector<Vector3d> _normals;             // per vertex: of the mesh as it is
    /// Vertices around the collapse being tried, by number, and their normals after it.
    std::vector<std::pair<int, Vector3d>> _changed;
    /// Per vertex: those that it must not collapse into while its neighbourhood is as it is.
    std::unordered_map<std::uint32_t, std::vector<int>> _refused;
};

Collapser::Collapser(const SourceMesh& source, const ControlMeshOptions& options, std::size_t target,
                     CollapseHistory& history, const ElevationGuide* guide)
    : _source(source)
    , _options(options)
    , _target(target)
    , _history(history)
    , _guide(guide)
{
    buildMesh();
    markFeatures();
    measureArcs();
    initializeQuadrics();
    const double area = std::accumulate(_quadricArea.begin(), _quadricArea.end(), 0.0);
    _patchSize = std::sqrt(area / static_cast<double>(target));
    _patchWeight = static_cast<double>(_faces) / static_cast<double>(target);
    _target = std::max(target, facesHeldBySeams());
    placePoints(area);
    _limits.largestWeight = options.largestShare * _patchWeight;
    if (_guide != nullptr) { _normals = vertexNormals(source.positions, source.triangles); }
}

/// Every source vertex starts in one of its faces, and weighs one half by itself and one half by the area around it.
void Collapser::placePoints(double area)
{
    const std::size_t vertices = _source.positions.size();
    _pointInFace.resize(vertices);
    _pointWeight.resize(vertices);
    _nextPoint.assign(vertices, kNone);
    _firstPoint.assign(_faces, kNone);
    _weight.assign(_faces, 0.0);
    const double mean = static_cast<double>(_faces) / static_cast<double>(vertices);
    for (std::uint32_t v = 0; v < vertices; ++v) {
        const Mesh::VertexHandle vertex(static_cast<int>(v));
        if (_mesh.is_isolated(vertex)) { continue; }
        const std::size_t f = at(*_mesh.cvf_iter(vertex));
        for (unsigned k = 0; k < 3; ++k) {
            if (_source.triangles[f][k] == v) { _pointInFace[v] = Vector3d::Unit(k); }
        }
        _pointWeight[v] = 0.5 * mean + 0.5 * static_cast<double>(_faces) * _quadricArea[v] / area;
        _nextPoint[v] = _firstPoint[f];
        _firstPoint[f] = v;
        _weight[f] += _pointWeight[v];
    }
}

void Collapser::buildMesh()
{
    const std::size_t vertices = _source.positions.size();
    const std::size_t triangles = _source.triangles.size();
    _mesh.reserve(vertices, triangles * 3 / 2 + vertices / 8, triangles);
    for (const Vector3d& p : _source.positions) { _mesh.add_vertex({p.x(), p.y(), p.z()}); }
    const auto handle = [](std::uint32_t v) { return Mesh::VertexHandle(static_cast<int>(v)); };
    for (const auto& t : _source.triangles) { _mesh.add_face(handle(t[0]), handle(t[1]), handle(t[2])); }
    _faces = triangles;
    _number.resize(triangles);
    std::iota(_number.begin(), _number.end(), 0U);
    _firstVertex.resize(triangles);
    for (std::size_t f = 0; f < triangles; ++f) { _firstVertex[f] = _source.triangles[f][0]; }
    _version.assign(vertices, 0);
}

unsigned Collapser::featureCount(Mesh::VertexHandle v) const
{
    unsigned count = 0;
    for (auto e = _mesh.cve_iter(v); e.is_valid(); ++e) { count += isFeature(*e) ? 1U : 0U; }
    return count;
}

void Collapser::markFeatures()
{
    _feature.assign(_mesh.n_edges(), 0);
    const double cosine = std::cos(_options.creaseAngleRadians);
    const auto normal = [&](Mesh::FaceHandle f) -> Vector3d {
        const auto& t = _source.triangles[at(f)];
        const Vector3d& a = _source.positions[t[0]];
        return (_source.positions[t[1]] - a).cross(_source.positions[t[2]] - a);
    };
    for (const auto e : _mesh.edges()) {
        if (_mesh.is_boundary(e)) {
            _feature[at(e)] = kSeam;
            continue;
        }
        const Vector3d a = normal(_mesh.face_handle(_mesh.halfedge_handle(e, 0)));
        const Vector3d b = normal(_mesh.face_handle(_mesh.halfedge_handle(e, 1)));
        const double lengths = a.norm() * b.norm();
        if (lengths > 0.0 && a.dot(b) < cosine * lengths) { _feature[at(e)] = kCrease; }
    }
    dropShortCreases();
    if (!_source.uvs.empty()) { markSeams(); }
    if (!_source.triangleMaterials.empty()) { markMaterialBorders(); }
}

/// Edges at one of whose ends the texture coordinates of the two faces differ, by what 16 bits can tell apart at all.
void Collapser::markSeams()
{
    const Eigen::Vector2f least = attributesOf(_source).uvTolerance;
    const auto uvAt = [&](Mesh::HalfedgeHandle h, Mesh::VertexHandle v) -> const Eigen::Vector2f& {
        const std::size_t f = at(_mesh.face_handle(h));
        const auto& t = _source.triangles[f];
        std::size_t k = 0;
        while (t[k] != static_cast<std::uint32_t>(v.idx())) { ++k; }
        return _source.uvs[f][k];
    };
    for (const auto e : _mesh.edges()) {
        if (_mesh.is_boundary(e)) { continue; }
        const auto h = _mesh.halfedge_handle(e, 0);
        const auto g = _mesh.halfedge_handle(e, 1);
        const bool hasUvs = _source.hasUvs(at(_mesh.face_handle(h)));
        bool differ = hasUvs != _source.hasUvs(at(_mesh.face_handle(g)));
        for (const auto v : {_mesh.to_vertex_handle(h), _mesh.to_vertex_handle(g)}) {
            differ = differ || (hasUvs && ((uvAt(h, v) - uvAt(g, v)).cwiseAbs().array() > least.array()).any());
        }
        if (differ) { _feature[at(e)] |= kSeam; }
    }
}

void Collapser::markMaterialBorders()
{
    for (const auto e : _mesh.edges()) {
        if (_mesh.is_boundary(e)) { continue; }
        const auto materialBeside = [&](unsigned side) {
            return _source.materialOf(at(_mesh.face_handle(_mesh.halfedge_handle(e, side))));
        };
        if (materialBeside(0) != materialBeside(1)) { _feature[at(e)] |= kSeam; }
    }
}

/// About as few faces as seams allow, so that limits are not loosened in vain: where seams end or meet no vertex can go, and a
/// triangulation has two faces per vertex.
std::size_t Collapser::facesHeldBySeams() const
{
    std::size_t held = 0;
    for (const auto v : _mesh.vertices()) {
        unsigned seams = 0;
        for (auto e = _mesh.cve_iter(v); e.is_valid(); ++e) { seams += (_feature[at(*e)] & kSeam) != 0 ? 1U : 0U; }
        held += seams != 0 && seams != 2 ? 1 : 0;
    }
    return 2 * held;
}

/// Connected sets of crease edges whose total length is below the shortest crease are measurement noise.
void Collapser::dropShortCreases()
{
    std::vector<char> seen(_mesh.n_edges(), 0);
    std::vector<Mesh::EdgeHandle> chain;
    for (const auto start : _mesh.edges()) {
        if (!isFeature(start) || _mesh.is_boundary(start) || seen[at(start)] != 0) { continue; }
        chain.assign(1, start);
        seen[at(start)] = 1;
        double length = 0.0;
        for (std::size_t i = 0; i < chain.size(); ++i) {
            length += _mesh.calc_edge_length(chain[i]);
            const auto h = _mesh.halfedge_handle(chain[i], 0);
            for (const auto v : {_mesh.to_vertex_handle(h), _mesh.from_vertex_handle(h)}) {
                for (auto e = _mesh.cve_iter(v); e.is_valid(); ++e) {
                    if (isFeature(*e) && !_mesh.is_boundary(*e) && seen[at(*e)] == 0) {
                        seen[at(*e)] = 1;
                        chain.push_back(*e);
                    }
                }
            }
        }
        if (length < _options.shortestCrease) {
            for (const auto e : chain) { _feature[at(e)] = 0; }
        }
    }
}

void Collapser::dropCreases()
{
    for (std::uint8_t& features : _feature) { features &= static_cast<std::uint8_t>(~kCrease); }
}

void Collapser::measureArcs()
{
    _arc.assign(_mesh.n_edges(), 0.0);
    for (const auto e : _mesh.edges()) {
        if (isFeature(e)) { _arc[at(e)] = _mesh.calc_edge_length(e); }
    }
}

void Collapser::initializeQuadrics()
{
    _quadrics.assign(_mesh.n_vertices(), Quadric(0.0));
    _quadricArea.assign(_mesh.n_vertices(), 0.0);
    const auto addPlane = [&](Mesh::VertexHandle v, const Vector3d& unitNormal, const Vector3d& point, double weight) {
        Quadric q(unitNormal.x(), unitNormal.y(), unitNormal.z(), -unitNormal.dot(point));
        _quadrics[at(v)] += q *= weight;
    };
    for (const auto f : _mesh.faces()) {
        const auto& t = _source.triangles[at(f)];
        const Vector3d& a = _source.positions[t[0]];
        const Vector3d n = (_source.positions[t[1]] - a).cross(_source.positions[t[2]] - a);
        const double twiceArea = n.norm();
        if (!(twiceArea > 0.0)) { continue; }
        for (auto h = _mesh.cfh_iter(f); h.is_valid(); ++h) {
            const auto v = _mesh.to_vertex_handle(*h);
            addPlane(v, n / twiceArea, a, twiceArea / 6.0);
            _quadricArea[at(v)] += twiceArea / 6.0;
            if (!isFeature(_mesh.edge_handle(*h))) { continue; }
            // A plane through the feature edge, upright on this face.
            const auto u = _mesh.from_vertex_handle(*h);
            const Vector3d upright = (position(v) - position(u)).cross(n);
            const double length = upright.norm();
            if (!(length > 0.0)) { continue; }
            addPlane(v, upright / length, position(v), kFeatureWeight * twiceArea / 6.0);
            addPlane(u, upright / length, position(v), kFeatureWeight * twiceArea / 6.0);
        }
    }
}

bool Collapser::isAllowed(Mesh::HalfedgeHandle h, unsigned features) const
{
    const auto v = _mesh.from_vertex_handle(h);
    const auto w = _mesh.to_vertex_handle(h);
    if (features != 0 && (features != 2 || !isFeature(_mesh.edge_handle(h)))) { return false; }
    if (_guide != nullptr && _mesh.is_boundary(v)) { return false; }
    const unsigned valence = _mesh.valence(v);
    if (valence < 3 || valence > CollapseHistory::kMaxRing - 1) { return false; }
    // A tetrahedron is the least that closes; OpenMesh would let it become two triangles back to back.
    if (valence == 3 && _mesh.valence(w) == 3 && !_mesh.is_boundary(v)) { return false; }
    const unsigned after = valence + _mesh.valence(w) - 4;
    if (after > std::max(_options.maxValence, _mesh.valence(w))) { return false; }
    return !(features != 0 && winds(h)) && _mesh.is_collapse_ok(h);
}

/// Would the collapse along a feature leave an edge much shorter than what it stands for?
bool Collapser::winds(Mesh::HalfedgeHandle h) const
{
    const auto v = _mesh.from_vertex_handle(h);
    const auto w = _mesh.to_vertex_handle(h);
    for (auto out = _mesh.cvoh_ccwiter(v); out.is_valid(); ++out) {
        const auto x = _mesh.to_vertex_handle(*out);
        if (x == w || !isFeature(_mesh.edge_handle(*out))) { continue; }
        const double arc = _arc[at(_mesh.edge_handle(h))] + _arc[at(_mesh.edge_handle(*out))];
        if (arc > kMostWinding * (position(x) - position(w)).norm()) { return true; }
    }
    return false;
}

/// Cost of a collapse that isAllowed, infinite if its shape is not.
double Collapser::cost(Mesh::HalfedgeHandle h) const
{
    constexpr double kForbidden = std::numeric_limits<double>::infinity();
    const auto v = _mesh.from_vertex_handle(h);
    const auto w = _mesh.to_vertex_handle(h);
    double weight = 0.0;
    double area = 0.0;
    double largestArea = 0.0;
    double worst = 1.0;
    for (auto out = _mesh.cvoh_ccwiter(v); out.is_valid(); ++out) {
        const auto f = _mesh.face_handle(*out);
        if (!f.is_valid()) { continue; }
        weight += _weight[at(f)];
        const auto a = _mesh.to_vertex_handle(*out);
        const auto b = _mesh.to_vertex_handle(_mesh.next_halfedge_handle(*out));
        if (a == w || b == w) { continue; }
        const Vector3d side = position(b) - position(a);
        const Vector3d before = side.cross(position(v) - position(a));
        const Vector3d after = side.cross(position(w) - position(a));
        const double beforeLength = before.norm();
        const double afterLength = after.norm();
        if (beforeLength > 0.0 && before.dot(after) <= _limits.turn * beforeLength * afterLength) { return kForbidden; }
        const double quality = triangleQuality(position(w), position(a), position(b));
        if (quality < _limits.needle && quality <= triangleQuality(position(v), position(a), position(b))) {
            return kForbidden;
        }
        worst = std::min(worst, quality);
        area += afterLength;
        largestArea = std::max(largestArea, afterLength);
    }
    // Before the star is flattened its weight is taken to follow the new faces' areas,.
    const double gathered = area > 0.0 ? weight * largestArea / area : weight;
    if (gathered > _limits.largestWeight) { return kForbidden; }
    const Quadric q = _quadrics[at(v)] + _quadrics[at(w)];
    const Vector3d& p = position(w);
    const double squared = std::max(0.0, q(OpenMesh::Vec3d(p.x(), p.y(), p.z()))) /
                           std::max(_quadricArea[at(v)] + _quadricArea[at(w)], 1e-300);
    return (std::sqrt(squared) / _patchSize + kSizeWeight * gathered / _patchWeight) / (worst + 0.1);
}

void Collapser::queueVertex(Mesh::VertexHandle v)
{
    const std::uint32_t version = ++_version[at(v)];
    const unsigned features = featureCount(v);
    Entry best{std::numeric_limits<double>::infinity(), static_cast<std::uint32_t>(v.idx()), version,
               Mesh::HalfedgeHandle()};
    const auto refused = _refused.find(best.vertex);
    for (auto h = _mesh.cvoh_ccwiter(v); h.is_valid(); ++h) {
        if (!isAllowed(*h, features)) { continue; }
        if (refused != _refused.end() && std::count(refused->second.begin(), refused->second.end(),
                                                    _mesh.to_vertex_handle(*h).idx()) != 0) {
            continue;
        }
        const double c = cost(*h);
        if (c < best.cost || (c == best.cost && best.halfedge.is_valid() && h->idx() < best.halfedge.idx())) {
            best.cost = c;
            best.halfedge = *h;
        }
    }
    if (best.halfedge.is_valid()) { _queue.push(best); }
}

void Collapser::initializeQueue()
{
    _queue = {};
    _refused.clear();
    for (const auto v : _mesh.vertices()) {
        if (!_mesh.status(v).deleted() && !_mesh.is_isolated(v)) { queueVertex(v); }
    }
}

bool Collapser::gatherStar(Mesh::HalfedgeHandle h, Star& star, CollapseHistory::Step& step,
                           std::array<Mesh::FaceHandle, CollapseHistory::kMaxRing>& faces) const
{
    const auto v = _mesh.from_vertex_handle(h);
    star.center = position(v);
    star.gap = CollapseHistory::Step::kNoGap;
    star.crease = 0;
    unsigned n = 0;
    auto out = h;
    const bool onCrease = isFeature(_mesh.edge_handle(h)) && !_mesh.is_boundary(v);
    do {
        const auto f = _mesh.face_handle(out);
        star.ring[n] = position(_mesh.to_vertex_handle(out));
        faces[n] = f;
        if (f.is_valid()) {
            unsigned corner = 0;
            auto around = _mesh.halfedge_handle(f);
            while (_mesh.from_vertex_handle(around).idx() != static_cast<int>(_firstVertex[at(f)])) {
                around = _mesh.next_halfedge_handle(around);
            }
            for (; _mesh.from_vertex_handle(around) != v; around = _mesh.next_halfedge_handle(around)) { ++corner; }
            step.oldFace[n] = _number[at(f)];
            step.corner[n] = static_cast<std::uint8_t>(corner);
        } else {
            star.gap = n;
        }
        if (n != 0 && onCrease && isFeature(_mesh.edge_handle(out))) { star.crease = n; }
        ++n;
        out = _mesh.ccw_rotated_halfedge_handle(out);
    } while (out != h);
    star.ringSize = n;
    step.crease = star.crease;
    // A crease's two ends that share a face cannot be laid on one line.
    return n >= 3 && !(onCrease && (star.crease <= 1 || star.crease == n - 1));
}

/// The edges from the vertex that h points to whose features the collapse of h must set: those beside h, which
/// survive as one of two handles, and the continuation of a feature along h.
std::vector<Collapser::FeatureEdge> Collapser::featuresAfter(Mesh::HalfedgeHandle h) const
{
    std::vector<FeatureEdge> edges;
    const auto v = _mesh.from_vertex_handle(h);
    const auto w = _mesh.to_vertex_handle(h);
    const std::uint8_t along = _feature[at(_mesh.edge_handle(h))];
    const double arcAlong = _arc[at(_mesh.edge_handle(h))];
    for (auto out = _mesh.cvoh_ccwiter(v); out.is_valid(); ++out) {
        const auto x = _mesh.to_vertex_handle(*out);
        if (x == w) { continue; }
        const std::uint8_t own = _feature[at(_mesh.edge_handle(*out))];
        // Where a seam goes on as a crease, what is left of both is a seam.
        const auto carried = static_cast<std::uint8_t>(along != 0 && own != 0 ? along | own : 0);
        const double arc = carried != 0 ? arcAlong + _arc[at(_mesh.edge_handle(*out))] : 0.0;
        const auto shared = _mesh.find_halfedge(w, x);
        if (shared.is_valid()) {
            const std::size_t other = at(_mesh.edge_handle(shared));
            edges.push_back({x, static_cast<std::uint8_t>(carried | _feature[other]), std::max(arc, _arc[other])});
        } else if (carried != 0) {
            edges.push_back({x, carried, arc});
        }
    }
    return edges;
}

bool Collapser::collapse(Mesh::HalfedgeHandle h)
{
    Star star;
    CollapseHistory::Step step;
    std::array<Mesh::FaceHandle, CollapseHistory::kMaxRing> faces;
    if (!gatherStar(h, star, step, faces)) { return false; }
    flattenStar(star, step);
    if (!(step.quality() > 1e-4)) { return false; }

    const auto v = _mesh.from_vertex_handle(h);
    const auto w = _mesh.to_vertex_handle(h);
    const unsigned n = star.ringSize;
    const std::vector<FeatureEdge> edges = featuresAfter(h);
    _carried.clear();
    std::array<double, CollapseHistory::kMaxRing> newWeights{};
    for (unsigned i = 0; i < n; ++i) {
        for (std::uint32_t s = faces[i].is_valid() ? _firstPoint[at(faces[i])] : kNone; s != kNone; s = _nextPoint[s]) {
            const Vector3d& b = _pointInFace[s];
            const auto corner = static_cast<Eigen::Index>(step.corner[i]);
            const FacePoint to = step.carry(i, Vector3d(b[corner], b[(corner + 1) % 3], b[(corner + 2) % 3]));
            newWeights[to.face] += _pointWeight[s];
            _carried.push_back({s, to});
        }
    }
    if (*std::max_element(newWeights.begin(), newWeights.begin() + n - 2) > _limits.largestWeight) { return false; }
    if (_guide != nullptr && !(mayWeigh(faces, newWeights) && keepsElevation(h, n))) { return false; }
    const std::uint32_t first = _history.add(step);
    _mesh.collapse(h);
    _quadrics[at(w)] += _quadrics[at(v)];
    _quadricArea[at(w)] += _quadricArea[at(v)];
    for (const FeatureEdge& edge : edges) {
        const std::size_t e = at(_mesh.edge_handle(_mesh.find_halfedge(w, edge.vertex)));
        _feature[e] = edge.features;
        _arc[e] = edge.arc;
    }
    for (unsigned j = 0; j + 2 < n; ++j) {
        const std::size_t f = at(faces[j + 1]);
        _number[f] = first + j;
        _firstVertex[f] = static_cast<std::uint32_t>(w.idx());
        _weight[f] = newWeights[j];
        _firstPoint[f] = kNone;
    }
    for (const CarriedPoint& point : _carried) {
        std::uint32_t& head = _firstPoint[at(faces[point.to.face + 1])];
        _pointInFace[point.vertex] = point.to.barycentric;
        _nextPoint[point.vertex] = head;
        head = point.vertex;
    }
    _faces -= star.gap == CollapseHistory::Step::kNoGap ? 2 : 1;
    if (_guide != nullptr) {
        for (const auto& [x, normal] : _changed) {
            _normals[static_cast<std::size_t>(x)] = normal;
            _refused.erase(static_cast<std::uint32_t>(x));
        }
    }

    queueVertex(w);
    for (auto x = _mesh.cvv_iter(w); x.is_valid(); ++x) { queueVertex(*x); }
    return true;
}

Collapser::Corners Collapser::cornersOf(Mesh::FaceHandle f) const
{
    const auto h = _mesh.halfedge_handle(f);
    return {_mesh.from_vertex_handle(h), _mesh.to_vertex_handle(h),
            _mesh.to_vertex_handle(_mesh.next_halfedge_handle(h))};
}

/// Unit, or zero, of vertex x once v has collapsed into w: of the faces around x, and around v if x is w, without the two that go.
Vector3d Collapser::normalAfter(Mesh::VertexHandle x, Mesh::VertexHandle v, Mesh::VertexHandle w) const
{
    Vector3d sum = Vector3d::Zero();
    const auto addFaces = [&](Mesh::VertexHandle around) {
        for (auto f = _mesh.cvf_iter(around); f.is_valid(); ++f) {
            const Corners corners = cornersOf(*f);
            const auto has = [&](Mesh::VertexHandle y) { return std::count(corners.begin(), corners.end(), y) != 0; };
            if (has(v) && has(w)) { continue; }
            std::array<Vector3d, 3> p;
            std::size_t own = 0;
            for (std::size_t k = 0; k < 3; ++k) {
                p[k] = position(corners[k] == v ? w : corners[k]);
                if (corners[k] == around) { own = k; }
            }
            sum += angleWeightedNormal(p[own], p[(own + 1) % 3], p[(own + 2) % 3]);
        }
    };
    addFaces(x);
    if (x == w) { addFaces(v); }
    const double length = sum.norm();
    return length > 0.0 ? Vector3d(sum / length) : sum;
}

/// Of a vertex, after the collapse being tried.
const Vector3d& Collapser::changedNormal(Mesh::VertexHandle x) const
{
    for (const auto& [vertex, normal] : _changed) {
        if (vertex == x.idx()) { return normal; }
    }
    return _normals[at(x)];
}

RayPrism Collapser::prismAfter(const Corners& corners) const
{
    RayPrism prism;
    for (std::size_t k = 0; k < 3; ++k) {
        prism.positions[k] = position(corners[k]);
        prism.normals[k] = changedNormal(corners[k]);
    }
    return prism;
}

/// Of the collapse being tried, whose new face j comes in the place of faces[j + 1].
bool Collapser::mayWeigh(const std::array<Mesh::FaceHandle, CollapseHistory::kMaxRing>& faces,
                         const std::array<double, CollapseHistory::kMaxRing>& newWeights) const
{
    for (const CarriedPoint& point : _carried) {
        if (newWeights[point.to.face] > _guide->largestWeight(point.vertex)) { return false; }
    }
    for (const auto f : faces) {
        if (!f.is_valid()) { break; } // a vertex on a boundary does not collapse: the ring's faces come first
        for (const auto x : cornersOf(f)) {
            if (_guide->largestWeight(static_cast<std::uint32_t>(x.idx())) == 0.0) { return false; }
        }
    }
    return true;
}

bool Collapser::newFacesKeepElevation(Mesh::HalfedgeHandle h, unsigned ringSize)
{
    std::vector<Mesh::VertexHandle> ring;
    auto out = h;
    for (unsigned i = 0; i < ringSize; ++i) {
        ring.push_back(_mesh.to_vertex_handle(out));
        out = _mesh.ccw_rotated_halfedge_handle(out);
    }
    std::vector<RayPrism> prisms;
    for (unsigned j = 0; j + 2 < ringSize; ++j) {
        prisms.push_back(prismAfter({ring[0], ring[j + 1], ring[j + 2]}));
        if (!ElevationGuide::isOpen(prisms.back(), {})) { return false; }
    }
    std::vector<ElevationGuide::Reach> reaches(prisms.size());
    for (const CarriedPoint& point : _carried) {
        if (!_guide->faces(prisms[point.to.face], point.vertex, point.to.barycentric, reaches[point.to.face])) {
            return false;
        }
    }
    for (std::size_t j = 0; j < prisms.size(); ++j) {
        if (!ElevationGuide::isOpen(prisms[j], reaches[j])) { return false; }
    }
    return true;
}

/// Whether all faces that the collapse makes, or changes the normals of, still face what they carry. Faces of the source's own
/// carry nothing but themselves, whatever their normals.
bool Collapser::keepsElevation(Mesh::HalfedgeHandle h, unsigned ringSize)
{
    const auto v = _mesh.from_vertex_handle(h);
    const auto w = _mesh.to_vertex_handle(h);
    _changed.clear();
    for (auto x = _mesh.cvv_iter(v); x.is_valid(); ++x) { _changed.emplace_back(x->idx(), normalAfter(*x, v, w)); }
    if (!newFacesKeepElevation(h, ringSize)) { return false; }
    std::vector<Mesh::FaceHandle> around;
    for (const auto& changed : _changed) {
        for (auto f = _mesh.cvf_iter(Mesh::VertexHandle(changed.first)); f.is_valid(); ++f) {
            const Corners corners = cornersOf(*f);
            const bool goes = std::count(corners.begin(), corners.end(), v) != 0;
            if (!goes && _number[at(*f)] >= _history.sourceFaces()) { around.push_back(*f); }
        }
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    for (const auto f : around) {
        Corners corners = cornersOf(f);
        while (corners[0].idx() != static_cast<int>(_firstVertex[at(f)])) {
            std::rotate(corners.begin(), corners.begin() + 1, corners.end());
        }
        const RayPrism prism = prismAfter(corners);
        ElevationGuide::Reach reach;
        if (!ElevationGuide::isOpen(prism, reach)) { return false; }
        for (std::uint32_t s = _firstPoint[at(f)]; s != kNone; s = _nextPoint[s]) {
            if (!_guide->faces(prism, s, _pointInFace[s], reach)) { return false; }
        }
        if (!ElevationGuide::isOpen(prism, reach)) { return false; }
    }
    return true;
}

/// The next best collapse of the vertex comes in its place.
void Collapser::refuse(Mesh::HalfedgeHandle h)
{
    constexpr std::size_t kMostTried = 3;
    const auto v = _mesh.from_vertex_handle(h);
    std::vector<int>& refused = _refused[static_cast<std::uint32_t>(v.idx())];
    refused.push_back(_mesh.to_vertex_handle(h).idx());
    if (refused.size() < kMostTried) { queueVertex(v); }
}

void Collapser::collapseAll(Progress& progress)
{
    constexpr std::uint64_t kReportEvery = 4096;
    std::uint64_t done = 0;
    while (_faces > _target && !_queue.empty()) {
        const Entry entry = _queue.top();
        _queue.pop();
        const Mesh::VertexHandle v(static_cast<int>(entry.vertex));
        if (entry.version != _version[entry.vertex] || _mesh.status(v).deleted()) { continue; }
        // What lies two rings away may have changed since.
        if (!isAllowed(entry.halfedge, featureCount(v)) || !(cost(entry.halfedge) < std::numeric_limits<double>::infinity())) {
            continue;
        }
        if (!collapse(entry.halfedge)) {
            if (_guide != nullptr) { refuse(entry.halfedge); }
        } else if (++done % kReportEvery == 0) {
            progress.step(kReportEvery);
        }
    }
    progress.step(done % kReportEvery);
}

void Collapser::run(Progress& progress)
{
    progress.begin("collapse", _faces > _target ? (_faces - _target) / 2 : 0, "vertices");
    initializeQueue();
    collapseAll(progress);
    // What is left over for elevation's sake is not for these limits.
    for (int loosened = 1; _guide == nullptr && _faces > 3 * _target && loosened <= 3; ++loosened) {
        _limits.needle *= 0.5;
        _limits.turn = loosened == 1 ? 0.0 : -1.0;
        if (loosened == 3) { dropCreases(); }
        initializeQueue();
        collapseAll(progress);
    }
    progress.end();
}

std::vector<RemainingFace> Collapser::remainingFaces() const
{
    std::vector<RemainingFace> faces;
    faces.reserve(_faces);
    for (const auto f : _mesh.faces()) {
        if (_mesh.status(f).deleted()) { continue; }
        RemainingFace face{};
        unsigned k = 0;
        for (auto v = _mesh.cfv_ccwiter(f); v.is_valid(); ++v) {
            face.vertices[k++] = static_cast<std::uint32_t>(v->idx());
        }
        face.number = _number[at(f)];
        // The history's corner 0 is _firstVertex; vertices[0] is that many corners after it.
        for (unsigned c = 0; c < 3; ++c) {
            if (face.vertices[c] == _firstVertex[at(f)]) { face.corner = static_cast<std::uint8_t>((3 - c) % 3); }
        }
        faces.push_back(face);
    }
    return faces;
}

} // namespace

std::vector<RemainingFace> collapseSurface(const SourceMesh& source, const ControlMeshOptions& options,
                                           CollapseHistory& history, Progress& progress,
                                           const ElevationGuide* guide)
{
    const auto bySize = static_cast<std::size_t>(static_cast<double>(source.triangles.size()) / options.trianglesPerPatch);
    const std::size_t target = std::max<std::size_t>(1, options.patches != 0 ? options.patches : bySize);
    Collapser collapser(source, options, target, history, guide);
    collapser.run(progress);
    return collapser.remainingFaces();
}

} // namespace osgTessLOD::bake
