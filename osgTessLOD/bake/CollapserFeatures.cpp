// SPDX-License-Identifier: MIT
// Edges along which alone a mesh collapses: boundaries, seams, borders between materials, creases.
#include <osgTessLOD/bake/Collapser.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

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

} // namespace osgTessLOD::bake
