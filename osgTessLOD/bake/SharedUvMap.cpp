// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SharedUvMap.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/PlaneTriangle.h>
#include <osgTessLOD/bake/SourceSurface.h>
#include <osgTessLOD/bake/UvLocator.h>

#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

void requireUvs(const SourceMesh& mesh)
{
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        if (!mesh.hasUvs(t)) {
            throw AssetError(mesh.name + ": triangle " + std::to_string(t) +
                             " (counted from 0 after cleaning) has no texture coordinates to share");
        }
    }
}

void requireAreas(const SourceMesh& mesh)
{
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& uv = mesh.uvs[t];
        const double area = twiceArea(uv[0].cast<double>(), uv[1].cast<double>(), uv[2].cast<double>());
        if (!(std::fabs(area) > 0.0)) {
            throw AssetError(mesh.name + ": triangle " + std::to_string(t) +
                             " (counted from 0 after cleaning) has no area in the texture");
        }
    }
}

} // namespace

SharedUvMap::SharedUvMap(SourceMesh coarse, SourceMesh detailed, const SharedUvOptions& options)
    : _coarse(std::move(coarse))
    , _detailed(std::move(detailed))
    , _options(options)
{
    requireUvs(_coarse);
    requireUvs(_detailed);
    requireAreas(_coarse);
    _frame = _detailed.frame;
    _name = _detailed.name;
    for (Vector3d& p : _coarse.positions) { p = (p - _frame.center) / _frame.scale; }
    _topology = PatchTopology::build(static_cast<std::uint32_t>(_coarse.positions.size()), _coarse.triangles);
    _attributes = attributesOf(_coarse);
    _materials = _coarse.materials;
    _attributes.colors = !_detailed.colors.empty();
    _normals = cornerNormals(_detailed, options.creaseAngleRadians);
    _locator = std::make_unique<UvLocator>(_detailed);
    sampleSource();
}

SharedUvMap::~SharedUvMap() = default;

Vector2d SharedUvMap::uvAt(std::uint32_t patch, const Vector3d& b) const
{
    const auto& uv = _coarse.uvs[patch];
    return b[0] * uv[0].cast<double>() + b[1] * uv[1].cast<double>() + b[2] * uv[2].cast<double>();
}

SurfacePoint SharedUvMap::evaluate(std::uint32_t patch, const Vector3d& barycentric) const
{
    const Vector2d uv = uvAt(patch, barycentric);
    const auto found = _locator->find(uv, _options.tolerance, positionAt(_coarse, {patch, barycentric}));
    if (!found) {
        throw AssetError(_coarse.name + ": triangle " + std::to_string(patch) + " at texture coordinates " +
                         std::to_string(uv.x()) + " " + std::to_string(uv.y()) + " is farther than " +
                         std::to_string(_options.tolerance) + " from all of " + _name);
    }
    SurfacePoint point = surfaceAt(_detailed, _normals, *found);
    point.uv = uv.cast<float>();
    return point;
}

void SharedUvMap::sampleSource()
{
    const std::vector<FacePoint> points = samplePoints(_detailed);
    const UvLocator patches(_coarse);
    _samples.positions.resize(points.size());
    _samples.patches.resize(points.size());
    tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
        const auto& uvs = _detailed.uvs[points[i].face];
        const Vector3d& b = points[i].barycentric;
        const Vector2d uv = b[0] * uvs[0].cast<double>() + b[1] * uvs[1].cast<double>() + b[2] * uvs[2].cast<double>();
        _samples.positions[i] = positionAt(_detailed, points[i]);
        constexpr double kAnywhere = std::numeric_limits<double>::max();
        _samples.patches[i] = patches.find(uv, kAnywhere, _samples.positions[i])->face;
    });
}

} // namespace osgTessLOD::bake
