// SPDX-License-Identifier: MIT
#include "GeometryMesh.h"

#include <osg/TriangleIndexFunctor>

#include <algorithm>
#include <array>
#include <cstdint>
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
    return mesh;
}

} // namespace osgTessLOD
