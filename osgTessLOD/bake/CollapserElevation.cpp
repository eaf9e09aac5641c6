// SPDX-License-Identifier: MIT
// Collapses after which the faces are still elevations of what lies over them (ElevationGuide).
#include <osgTessLOD/bake/Collapser.h>

#include <osgTessLOD/bake/VertexNormals.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

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

} // namespace osgTessLOD::bake
