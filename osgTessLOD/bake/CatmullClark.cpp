// SPDX-License-Identifier: MIT
// Catmull and Clark 1978. A vertex of n faces F̄ = average of its faces' points, R̄ = average of its edges' middles:
//
//      face point  average of the corners
//      edge point  average of both ends and both face points          (boundary: its middle)
//      vertex      (F̄ + 2 R̄ + (n − 3) P) / n                          (boundary: ⅛, ¾, ⅛ along it)
//
//        3 ─────── e ─────── 2
//        │    ⋮    │    ⋮    │        the corner k of a face becomes the quadrilateral
//        e ┈┈┈┈┈┈┈ f ┈┈┈┈┈┈┈ e        vertex k, edge k → k + 1, face, edge k − 1 → k
//        │    ⋮    │    ⋮    │
//        0 ─────── e ─────── 1
#include <osgTessLOD/bake/CatmullClark.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2f;
using Eigen::Vector3d;

struct Edge {
    std::array<std::uint32_t, 2> ends{};
    std::uint32_t faces = 0;
    Vector3d facePoints = Vector3d::Zero(); ///< sum

    bool isBoundary() const { return faces != 2; }
};

/// What is summed up around a vertex.
struct Ring {
    std::uint32_t faces = 0;
    std::uint32_t edges = 0;
    std::uint32_t boundaryEdges = 0;
    Vector3d facePoints = Vector3d::Zero();
    Vector3d middles = Vector3d::Zero();
    Vector3d boundaryEnds = Vector3d::Zero(); ///< sum of the other ends of boundary edges
};

class Step {
public:
    explicit Step(const PolygonMesh& mesh)
        : _mesh(mesh)
        , _rings(mesh.positions.size())
    {
        findEdges();
        sumRings();
    }

    PolygonMesh subdivided() const
    {
        PolygonMesh fine;
        for (std::size_t v = 0; v < _mesh.positions.size(); ++v) { fine.positions.push_back(vertexPoint(v)); }
        for (const Edge& edge : _edges) { fine.positions.push_back(edgePoint(edge)); }
        fine.positions.insert(fine.positions.end(), _facePoints.begin(), _facePoints.end());
        for (std::size_t f = 0; f < _mesh.faceCount(); ++f) { addQuads(f, fine); }
        return fine;
    }

private:
    std::uint32_t next(std::size_t face, std::uint32_t corner) const
    {
        return corner + 1 < _mesh.starts[face + 1] ? corner + 1 : _mesh.starts[face];
    }
    std::uint32_t previous(std::size_t face, std::uint32_t corner) const
    {
        return corner > _mesh.starts[face] ? corner - 1 : _mesh.starts[face + 1] - 1;
    }

    void findEdges()
    {
        std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> numbers;
        _edgeOfCorner.resize(_mesh.corners.size());
        for (std::size_t f = 0; f < _mesh.faceCount(); ++f) {
            Vector3d point = Vector3d::Zero();
            for (std::uint32_t c = _mesh.starts[f]; c < _mesh.starts[f + 1]; ++c) {
                point += _mesh.positions[_mesh.corners[c]];
            }
            point /= static_cast<double>(_mesh.starts[f + 1] - _mesh.starts[f]);
            _facePoints.push_back(point);
            for (std::uint32_t c = _mesh.starts[f]; c < _mesh.starts[f + 1]; ++c) {
                const std::uint32_t a = _mesh.corners[c];
                const std::uint32_t b = _mesh.corners[next(f, c)];
                const auto number = static_cast<std::uint32_t>(_edges.size());
                const auto [at, isNew] = numbers.try_emplace(std::minmax(a, b), number);
                if (isNew) { _edges.push_back({{a, b}}); }
                _edgeOfCorner[c] = at->second;
                Edge& edge = _edges[at->second];
                ++edge.faces;
                edge.facePoints += point;
            }
        }
    }

    void sumRings()
    {
        for (const Edge& edge : _edges) {
            const Vector3d middle = 0.5 * (_mesh.positions[edge.ends[0]] + _mesh.positions[edge.ends[1]]);
            for (std::size_t end = 0; end < 2; ++end) {
                Ring& ring = _rings[edge.ends[end]];
                ++ring.edges;
                ring.middles += middle;
                if (edge.isBoundary()) {
                    ++ring.boundaryEdges;
                    ring.boundaryEnds += _mesh.positions[edge.ends[1 - end]];
                }
            }
        }
        for (std::size_t f = 0; f < _mesh.faceCount(); ++f) {
            for (std::uint32_t c = _mesh.starts[f]; c < _mesh.starts[f + 1]; ++c) {
                Ring& ring = _rings[_mesh.corners[c]];
                ++ring.faces;
                ring.facePoints += _facePoints[f];
            }
        }
    }

    Vector3d vertexPoint(std::size_t v) const
    {
        const Vector3d& position = _mesh.positions[v];
        const Ring& ring = _rings[v];
        if (ring.boundaryEdges == 2) { return 0.75 * position + 0.125 * ring.boundaryEnds; }
        // More fans of faces than one meet where faces and edges are not as many.
        if (ring.boundaryEdges != 0 || ring.faces != ring.edges || ring.faces == 0) { return position; }
        const double n = ring.faces;
        return (ring.facePoints / n + 2.0 * ring.middles / n + (n - 3.0) * position) / n;
    }

    Vector3d edgePoint(const Edge& edge) const
    {
        const Vector3d ends = _mesh.positions[edge.ends[0]] + _mesh.positions[edge.ends[1]];
        return edge.isBoundary() ? Vector3d(0.5 * ends) : Vector3d(0.25 * (ends + edge.facePoints));
    }

    void addQuads(std::size_t face, PolygonMesh& fine) const
    {
        const auto edgePoints = static_cast<std::uint32_t>(_mesh.positions.size());
        const auto facePoint = static_cast<std::uint32_t>(edgePoints + _edges.size() + face);
        Vector2f middle = Vector2f::Zero();
        if (!_mesh.uvs.empty()) {
            for (std::uint32_t c = _mesh.starts[face]; c < _mesh.starts[face + 1]; ++c) { middle += _mesh.uvs[c]; }
            middle /= static_cast<float>(_mesh.starts[face + 1] - _mesh.starts[face]);
        }
        for (std::uint32_t c = _mesh.starts[face]; c < _mesh.starts[face + 1]; ++c) {
            const std::uint32_t before = previous(face, c);
            fine.corners.insert(fine.corners.end(), {_mesh.corners[c], edgePoints + _edgeOfCorner[c], facePoint,
                                                     edgePoints + _edgeOfCorner[before]});
            fine.starts.push_back(static_cast<std::uint32_t>(fine.corners.size()));
            if (_mesh.uvs.empty()) { continue; }
            const Vector2f& uv = _mesh.uvs[c];
            const Vector2f ahead = 0.5F * (uv + _mesh.uvs[next(face, c)]);
            const Vector2f behind = 0.5F * (uv + _mesh.uvs[before]);
            fine.uvs.insert(fine.uvs.end(), {uv, ahead, middle, behind});
        }
    }

    const PolygonMesh& _mesh;
    std::vector<Edge> _edges;
    std::vector<std::uint32_t> _edgeOfCorner; ///< that from the corner to the next one of its face
    std::vector<Vector3d> _facePoints;
    std::vector<Ring> _rings;
};

} // namespace

PolygonMesh subdivideCatmullClark(const PolygonMesh& mesh)
{
    return Step(mesh).subdivided();
}

} // namespace osgTessLOD::bake
