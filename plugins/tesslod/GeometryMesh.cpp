// SPDX-License-Identifier: MIT
#include "GeometryMesh.h"

#include <osg/TriangleIndexFunctor>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <typeinfo>
#include <utility>
#include <vector>

namespace osgTessLOD {

namespace {

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

struct AddTriangle {
    Triangles triangles;
    void operator()(unsigned a, unsigned b, unsigned c) { triangles.push_back({a, b, c}); }
};

bool isSurface(const osg::PrimitiveSet& primitives)
{
    switch (primitives.getMode()) {
    case GL_TRIANGLES:
    case GL_TRIANGLE_STRIP:
    case GL_TRIANGLE_FAN:
    case GL_QUADS:
    case GL_QUAD_STRIP:
    case GL_POLYGON: return primitives.getNumInstances() <= 1;
    default: return false;
    }
}

osg::Vec3d point(const osg::Vec2& p)
{
    return {p.x(), p.y(), 0.0};
}
osg::Vec3d point(const osg::Vec2d& p)
{
    return {p.x(), p.y(), 0.0};
}
osg::Vec3d point(const osg::Vec3& p)
{
    return p;
}
osg::Vec3d point(const osg::Vec3d& p)
{
    return p;
}
osg::Vec3d point(const osg::Vec4d& p)
{
    return osg::Vec3d(p.x(), p.y(), p.z()) / p.w();
}
osg::Vec3d point(const osg::Vec4& p)
{
    return point(osg::Vec4d(p));
}

/// Calls visit(i, point) for every element if the array is an `Array`; false if it is not.
template <typename Array, typename Visit> bool visitAs(const osg::Array& array, const Visit& visit)
{
    const auto* points = dynamic_cast<const Array*>(&array);
    if (points == nullptr) { return false; }
    for (const auto& p : *points) { visit(point(p)); }
    return true;
}

/// Calls visit(point) for every position; false for arrays of other types.
template <typename Visit> bool visitPoints(const osg::Array& array, const Visit& visit)
{
    return visitAs<osg::Vec3Array>(array, visit) || visitAs<osg::Vec3dArray>(array, visit) ||
           visitAs<osg::Vec4Array>(array, visit) || visitAs<osg::Vec4dArray>(array, visit) ||
           visitAs<osg::Vec2Array>(array, visit) || visitAs<osg::Vec2dArray>(array, visit);
}

/// The array if it is of this type and has an element for every vertex.
template <typename Array> const Array* perVertex(const osg::Array* array, std::size_t vertices)
{
    const auto* typed = dynamic_cast<const Array*>(array);
    const bool fits =
        typed != nullptr && typed->size() >= vertices && array->getBinding() == osg::Array::BIND_PER_VERTEX;
    return fits ? typed : nullptr;
}

/// Of triangles whose corners all have some that a bake can take; NaN for others.
void addUvs(const osg::Geometry& geometry, bake::SourceMesh& mesh)
{
    constexpr float kLargest = 1e6F;
    const auto* uvs = perVertex<osg::Vec2Array>(geometry.getTexCoordArray(0), mesh.positions.size());
    if (uvs == nullptr) { return; }
    for (const auto& triangle : mesh.triangles) {
        auto& corners = mesh.uvs.emplace_back();
        bool sound = true;
        for (std::size_t k = 0; k < 3; ++k) {
            const osg::Vec2& uv = (*uvs)[triangle[k]];
            corners[k] = Eigen::Vector2f(uv.x(), uv.y());
            sound = sound && std::fabs(uv.x()) <= kLargest && std::fabs(uv.y()) <= kLargest;
        }
        if (!sound) { corners.fill(Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN())); }
    }
}

bake::Rgba rgba(const osg::Vec4& color)
{
    const auto channel = [](float c) {
        return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(c, 0.0F, 1.0F)));
    };
    return {channel(color.r()), channel(color.g()), channel(color.b()), channel(color.a())};
}
bake::Rgba rgba(const osg::Vec3& color)
{
    return rgba(osg::Vec4(color, 1.0F));
}
bake::Rgba rgba(const osg::Vec4ub& color)
{
    return {color.r(), color.g(), color.b(), color.a()};
}

template <typename Array> void addColorsAs(const osg::Geometry& geometry, bake::SourceMesh& mesh)
{
    const std::size_t vertices = mesh.positions.size();
    if (const auto* colors = perVertex<Array>(geometry.getColorArray(), vertices)) {
        for (std::size_t v = 0; v < vertices; ++v) { mesh.colors.push_back(rgba((*colors)[v])); }
    }
    const auto* overall = dynamic_cast<const Array*>(geometry.getColorArray());
    if (overall == nullptr || overall->getBinding() != osg::Array::BIND_OVERALL || overall->empty()) { return; }
    const bake::Rgba color = rgba(overall->front());
    if (color != bake::Rgba{255, 255, 255, 255}) { mesh.colors.assign(vertices, color); }
}

/// True if it turns the outside of surfaces in.
bool isMirror(const osg::Matrixd& matrix)
{
    const auto axis = [&](int k) { return osg::Vec3d(matrix(k, 0), matrix(k, 1), matrix(k, 2)); };
    return (axis(0) ^ axis(1)) * axis(2) < 0.0;
}

} // namespace

bool canBeBaked(const osg::Geometry& geometry)
{
    const osg::Array* positions = geometry.getVertexArray();
    if (typeid(geometry) != typeid(osg::Geometry) || positions == nullptr || positions->getNumElements() == 0 ||
        !visitPoints(*positions, [](const osg::Vec3d&) {})) {
        return false;
    }
    const auto& sets = geometry.getPrimitiveSetList();
    return !sets.empty() && std::all_of(sets.begin(), sets.end(), [](const auto& set) { return isSurface(*set); });
}

bake::SourceMesh meshOf(const osg::Geometry& geometry, const osg::Matrixd& matrix, const std::string& name)
{
    bake::SourceMesh mesh;
    mesh.name = name;
    visitPoints(*geometry.getVertexArray(), [&](const osg::Vec3d& local) {
        const osg::Vec3d p = local * matrix;
        mesh.positions.emplace_back(p.x(), p.y(), p.z());
    });
    osg::TriangleIndexFunctor<AddTriangle> functor;
    geometry.accept(functor);
    mesh.triangles = std::move(functor.triangles);
    if (isMirror(matrix)) {
        for (auto& triangle : mesh.triangles) { std::swap(triangle[1], triangle[2]); }
    }
    addUvs(geometry, mesh);
    addColorsAs<osg::Vec4Array>(geometry, mesh);
    addColorsAs<osg::Vec4ubArray>(geometry, mesh);
    addColorsAs<osg::Vec3Array>(geometry, mesh);
    return mesh;
}

} // namespace osgTessLOD
