// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/DisplacedMap.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/bake/VertexNormals.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

namespace osgTessLOD::bake {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr unsigned kLargestFactor = 64;
/// The share of patches that may be sampled more coarsely than their texels.
constexpr double kRoughShare = 0.01;

template <typename Value> Value blend(const std::array<Value, 3>& corners, const Vector3d& weights)
{
    return Value(weights[0] * corners[0] + weights[1] * corners[1] + weights[2] * corners[2]);
}

double cross(const Vector2d& a, const Vector2d& b)
{
    return a.x() * b.y() - a.y() * b.x();
}

Vector3d normalizedOr(const Vector3d& v, const Vector3d& otherwise)
{
    const double length = v.norm();
    return length > 0.0 ? Vector3d(v / length) : otherwise;
}

/// Unit, at a right angle to the unit vector n.
Vector3d anyTangent(const Vector3d& n)
{
    Eigen::Index smallest = 0;
    n.cwiseAbs().minCoeff(&smallest);
    return n.cross(Vector3d::Unit(smallest)).normalized();
}

double angleAt(const std::array<Vector3d, 3>& p, std::size_t corner)
{
    const Vector3d a = p[(corner + 1) % 3] - p[corner];
    const Vector3d b = p[(corner + 2) % 3] - p[corner];
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

} // namespace

/// The base surface's axes at a point, as columns: tangent, bitangent, normal; and how the normal changes with the second and
/// third weight, the first one taking the difference.
struct DisplacedMap::Frame {
    Matrix3d axes;
    std::array<Vector3d, 2> normalSlopes;
};

DisplacedMap::DisplacedMap(const SourceMesh& base, DisplacementImage image, const DisplacementOptions& options)
    : _image(std::move(image))
    , _options(options)
    , _patches(base.triangles.size())
{
    _name = base.name;
    _attributes.uvs = true;
    _attributes.materials = !base.triangleMaterials.empty();
    _materials = base.materials;
    _topology = PatchTopology::build(static_cast<std::uint32_t>(base.positions.size()), base.triangles);
    for (std::size_t t = 0; t < _patches.size(); ++t) {
        if (!base.hasUvs(t)) {
            throw AssetError(base.name + ": triangle " + std::to_string(t) +
                             " (counted from 0) has no texture coordinates to look up a displacement map by");
        }
        _patches[t].material = base.materialOf(t);
        for (std::size_t k = 0; k < 3; ++k) {
            _patches[t].positions[k] = base.positions[base.triangles[t][k]];
            _patches[t].uvs[k] = base.uvs[t][k].cast<double>();
        }
    }
    addNormals(base);
    addTangents(base);
    measureTexels();
    fitFrame();
}

void DisplacedMap::addNormals(const SourceMesh& base)
{
    const std::vector<Vector3d> normals = vertexNormals(base.positions, base.triangles);
    for (std::size_t t = 0; t < _patches.size(); ++t) {
        const auto& p = _patches[t].positions;
        const Vector3d ofFace = normalizedOr((p[1] - p[0]).cross(p[2] - p[0]), Vector3d::Zero());
        for (std::size_t k = 0; k < 3; ++k) {
            _patches[t].normals[k] = normalizedOr(normals[base.triangles[t][k]], ofFace);
        }
    }
}

/// Angle-weighted means, too, of the faces around a vertex that have the same texture coordinates there.
void DisplacedMap::addTangents(const SourceMesh& base)
{
    using Key = std::tuple<std::uint32_t, double, double, bool>;
    const auto key = [&](std::size_t t, std::size_t k) {
        const Patch& patch = _patches[t];
        return Key{base.triangles[t][k], patch.uvs[k].x(), patch.uvs[k].y(), patch.handedness < 0.0};
    };
    std::map<Key, Vector3d> sums;
    for (std::size_t t = 0; t < _patches.size(); ++t) {
        Patch& patch = _patches[t];
        const Vector2d du = patch.uvs[1] - patch.uvs[0];
        const Vector2d dv = patch.uvs[2] - patch.uvs[0];
        const double area = cross(du, dv);
        patch.handedness = area < 0.0 ? -1.0 : 1.0;
        const Vector3d tangent = normalizedOr(patch.handedness * ((patch.positions[1] - patch.positions[0]) * dv.y() -
                                                                  (patch.positions[2] - patch.positions[0]) * du.y()),
                                              Vector3d::Zero());
        for (std::size_t k = 0; k < 3; ++k) {
            const auto at = sums.try_emplace(key(t, k), Vector3d::Zero()).first;
            at->second += angleAt(patch.positions, k) * tangent;
        }
    }
    for (std::size_t t = 0; t < _patches.size(); ++t) {
        for (std::size_t k = 0; k < 3; ++k) { _patches[t].tangents[k] = sums.at(key(t, k)); }
    }
}

void DisplacedMap::measureTexels()
{
    const Vector2d size(_image.width(), _image.height());
    std::vector<double> longest;
    for (const Patch& patch : _patches) {
        std::array<Vector2d, 3> at;
        for (std::size_t k = 0; k < 3; ++k) { at[k] = patch.uvs[k].cwiseProduct(size); }
        _texels += 0.5 * std::fabs(cross(at[1] - at[0], at[2] - at[0]));
        longest.push_back(std::max({(at[1] - at[0]).norm(), (at[2] - at[1]).norm(), (at[0] - at[2]).norm()}));
    }
    const auto rank = static_cast<std::ptrdiff_t>((1.0 - kRoughShare) * static_cast<double>(longest.size() - 1));
    std::nth_element(longest.begin(), longest.begin() + rank, longest.end());
    const double wanted = longest[static_cast<std::size_t>(rank)];
    while (_finestFactor < kLargestFactor && _finestFactor < wanted) { _finestFactor *= 2; }
}

/// The bounding box as a regular sampling of the patches sees it.
void DisplacedMap::fitFrame()
{
    const int steps = static_cast<int>(_finestFactor);
    Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
    Vector3d high = -low;
    for (std::uint32_t p = 0; p < _patches.size(); ++p) {
        for (int j = 0; j <= steps; ++j) {
            for (int i = 0; i + j <= steps; ++i) {
                const Vector3d at = evaluate(p, Vector3d(steps - i - j, i, j) / steps).position;
                low = low.cwiseMin(at);
                high = high.cwiseMax(at);
            }
        }
    }
    if (!((high - low).norm() > 0.0)) { throw AssetError(_name + ": the displaced surface is a point"); }
    _frame.center = 0.5 * (low + high);
    _frame.scale = (high - low).norm();
}

std::uint64_t DisplacedMap::sourceTriangles() const
{
    return std::max<std::uint64_t>(_patches.size(), static_cast<std::uint64_t>(2.0 * _texels));
}

DisplacedMap::Frame DisplacedMap::frameAt(const Patch& patch, const Vector3d& barycentric) const
{
    Frame frame;
    const Vector3d mean = blend(patch.normals, barycentric);
    const Vector3d normal = normalizedOr(mean, patch.normals[0]);
    const Vector3d tangent = blend(patch.tangents, barycentric);
    const Vector3d across = normalizedOr(tangent - normal * normal.dot(tangent), anyTangent(normal));
    frame.axes << across, patch.handedness * normal.cross(across), normal;
    const double length = std::max(mean.norm(), std::numeric_limits<double>::min());
    for (std::size_t k = 0; k < 2; ++k) {
        const Vector3d slope = (patch.normals[k + 1] - patch.normals[0]) / length;
        frame.normalSlopes[k] = slope - normal * normal.dot(slope);
    }
    return frame;
}

/// In the axes that the map is meant in.
Vector3d DisplacedMap::displacementAt(const Vector2d& uv) const
{
    if (_options.kind == DisplacementOptions::Kind::Scalar) {
        return {0.0, 0.0, _options.scale * (_image.scalarAt(uv) - _options.midlevel)};
    }
    return _options.scale * (_image.vectorAt(uv) - Vector3d::Constant(_options.midlevel));
}

SurfacePoint DisplacedMap::evaluate(std::uint32_t number, const Vector3d& barycentric) const
{
    const Patch& patch = _patches[number];
    const Frame frame = frameAt(patch, barycentric);
    const bool inObject = _options.kind == DisplacementOptions::Kind::ObjectVector;
    const Matrix3d axes = inObject ? Matrix3d::Identity().eval() : frame.axes;
    const Vector3d normal = frame.axes.col(2);
    const Vector2d uv = blend(patch.uvs, barycentric);
    const Vector3d displacement = axes * displacementAt(uv);
    const double height = normal.dot(displacement);
    const Vector2d texel(1.0 / _image.width(), 1.0 / _image.height());
    std::array<Vector3d, 2> perUv; // half a texel either way: as the filter is, continuous
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
        const Vector2d step = 0.5 * texel[axis] * Vector2d::Unit(axis);
        perUv[static_cast<std::size_t>(axis)] =
            axes * (displacementAt(uv + step) - displacementAt(uv - step)) / texel[axis];
    }
    std::array<Vector3d, 2> slopes;
    for (std::size_t k = 0; k < 2; ++k) {
        const Vector3d along = patch.positions[k + 1] - patch.positions[0];
        const Vector2d uvAlong = patch.uvs[k + 1] - patch.uvs[0];
        slopes[k] = along - normal * normal.dot(along) + height * frame.normalSlopes[k] + perUv[0] * uvAlong.x() +
                    perUv[1] * uvAlong.y();
    }
    const Vector3d position = blend(patch.positions, barycentric) + displacement;
    SurfacePoint point;
    point.position = (position - _frame.center) / _frame.scale;
    point.normal = normalizedOr(slopes[0].cross(slopes[1]), normal);
    point.uv = uv.cast<float>();
    return point;
}

} // namespace osgTessLOD::bake
