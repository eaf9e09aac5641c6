// SPDX-License-Identifier: MIT
// Michael Garland, Paul Heckbert, "Surface Simplification Using Quadric Error Metrics", SIGGRAPH 1997.
#include <osgTessLOD/bake/Collapser.h>

#include <osgTessLOD/bake/VertexNormals.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

namespace {

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

/// To 20 bits: costs that only rounding tells apart, as a turned source has others, are equal, and the numbers of vertices decide.
double withoutLastDigits(double cost)
{
    int exponent = 0;
    const double mantissa = std::frexp(cost, &exponent);
    return std::ldexp(std::round(std::ldexp(mantissa, 20)), exponent - 20);
}

} // namespace

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
    return withoutLastDigits((std::sqrt(squared) / _patchSize + kSizeWeight * gathered / _patchWeight) / (worst + 0.1));
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
