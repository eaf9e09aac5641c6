// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SurfaceDistance.h>

#include <Eigen/Geometry>
#include <embree3/rtcore.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

/// The point of the segment ab that is nearest to the origin.
Vector3d nearestOnSegment(const Vector3d& a, const Vector3d& b)
{
    const Vector3d ab = b - a;
    const double length = ab.squaredNorm();
    const double at = length > 0.0 ? std::clamp(-a.dot(ab) / length, 0.0, 1.0) : 0.0;
    return a + at * ab;
}

/// Squared distance from the origin to the segment ab.
double squaredDistanceToSegment(const Vector3d& a, const Vector3d& b)
{
    return nearestOnSegment(a, b).squaredNorm();
}

/// Does the perpendicular from the origin to the plane of abc, whose normal is `normal`, meet it in the triangle?
bool isAboveTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& normal)
{
    return normal.dot(a.cross(b)) >= 0.0 && normal.dot(b.cross(c)) >= 0.0 && normal.dot(c.cross(a)) >= 0.0;
}

/// Distance from the origin to the triangle abc: to its plane if the foot of the perpendicular is inside, else to its
/// nearest side. The sides are asked in any case, so that a sliver, whose plane rounding turns, is still measured well.
double distanceToTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
    const double toSides =
        std::min({squaredDistanceToSegment(a, b), squaredDistanceToSegment(b, c), squaredDistanceToSegment(c, a)});
    const Vector3d normal = (b - a).cross(c - a);
    const double area = normal.norm();
    if (!isAboveTriangle(a, b, c, normal) || !(area > 0.0)) { return std::sqrt(toSides); }
    return std::min(std::sqrt(toSides), std::fabs(normal.dot(a)) / area);
}

/// Where distanceToTriangle() goes to.
Vector3d nearestOnTriangle(const Vector3d& a, const Vector3d& b, const Vector3d& c)
{
    const Vector3d normal = (b - a).cross(c - a);
    std::array<Vector3d, 4> candidates{nearestOnSegment(a, b), nearestOnSegment(b, c), nearestOnSegment(c, a)};
    candidates[3] = candidates[0];
    if (isAboveTriangle(a, b, c, normal) && normal.norm() > 0.0) {
        candidates[3] = normal.dot(a) / normal.squaredNorm() * normal;
    }
    return *std::min_element(candidates.begin(), candidates.end(),
                             [](const Vector3d& p, const Vector3d& q) { return p.squaredNorm() < q.squaredNorm(); });
}

RTCDevice sharedDevice()
{
    struct Device {
        RTCDevice handle = rtcNewDevice(nullptr);
        ~Device() { rtcReleaseDevice(handle); }
    };
    static const Device device;
    if (device.handle == nullptr) { throw std::bad_alloc(); }
    return device.handle;
}

} // namespace

struct SurfaceDistance::Scene {
    RTCScene handle = nullptr;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    const float* vertices = nullptr;
    const std::uint32_t* indices = nullptr;

    ~Scene()
    {
        if (handle != nullptr) { rtcReleaseScene(handle); }
    }
    Vector3d vertex(std::uint32_t v) const
    {
        return Vector3f(vertices[3 * v], vertices[3 * v + 1], vertices[3 * v + 2]).cast<double>();
    }

    /// The corners of a triangle, from `p`.
    std::array<Vector3d, 3> cornersFrom(const Vector3d& p, std::uint32_t triangle) const
    {
        const std::uint32_t* corners = indices + 3 * static_cast<std::size_t>(triangle);
        return {vertex(corners[0]) - p, vertex(corners[1]) - p, vertex(corners[2]) - p};
    }

    /// What a search for the nearest triangle needs.
    struct Search {
        const Scene& scene;
        Vector3d point; ///< from the centre; not rounded to single precision as Embree's query is
        double enough;  ///< distance that nothing nearer is looked for at
        double nearest;
        std::uint32_t triangle = 0; ///< that is `nearest`, once one is
    };
    void find(Search& search) const
    {
        const Vector3f p = search.point.cast<float>();
        RTCPointQuery query{};
        query.x = p.x();
        query.y = p.y();
        query.z = p.z();
        query.radius = std::nextafter(static_cast<float>(search.nearest), std::numeric_limits<float>::infinity());
        RTCPointQueryContext context{};
        rtcInitPointQueryContext(&context);
        rtcPointQuery(handle, &query, &context, &Scene::visit, &search);
    }
    double distance(const Search& search, std::uint32_t triangle) const
    {
        const std::array<Vector3d, 3> corners = cornersFrom(search.point, triangle);
        return distanceToTriangle(corners[0], corners[1], corners[2]);
    }

    static bool visit(RTCPointQueryFunctionArguments* arguments)
    {
        Search& search = *static_cast<Search*>(arguments->userPtr);
        const double distance = search.scene.distance(search, arguments->primID);
        if (!(distance < search.nearest)) { return false; }
        search.nearest = distance;
        search.triangle = arguments->primID;
        arguments->query->radius = distance <= search.enough ? 0.0F : static_cast<float>(distance);
        return true;
    }
};

SurfaceDistance::SurfaceDistance(const std::vector<Eigen::Vector3d>& positions,
                                 const std::vector<std::array<std::uint32_t, 3>>& triangles)
    : _scene(std::make_unique<Scene>())
{
    Eigen::AlignedBox3d box;
    for (const auto& p : positions) { box.extend(p); }
    if (!positions.empty()) { _scene->center = box.center(); }

    RTCDevice device = sharedDevice();
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), positions.size()));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), triangles.size()));
    if ((vertices == nullptr && !positions.empty()) || (indices == nullptr && !triangles.empty())) {
        rtcReleaseGeometry(geometry);
        throw std::bad_alloc();
    }
    for (std::size_t v = 0; v < positions.size(); ++v) {
        const Vector3f p = (positions[v] - _scene->center).cast<float>();
        std::copy_n(p.data(), 3, vertices + 3 * v);
    }
    for (std::size_t t = 0; t < triangles.size(); ++t) { std::copy_n(triangles[t].data(), 3, indices + 3 * t); }
    _scene->vertices = vertices;
    _scene->indices = indices;
    rtcCommitGeometry(geometry);
    _scene->handle = rtcNewScene(device);
    rtcSetSceneFlags(_scene->handle, RTC_SCENE_FLAG_COMPACT);
    rtcAttachGeometry(_scene->handle, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(_scene->handle);
}

SurfaceDistance::~SurfaceDistance() = default;
SurfaceDistance::SurfaceDistance(SurfaceDistance&&) noexcept = default;
SurfaceDistance& SurfaceDistance::operator=(SurfaceDistance&&) noexcept = default;

double SurfaceDistance::distance(const Eigen::Vector3d& point) const
{
    return distanceBeyond(point, 0.0, std::numeric_limits<double>::infinity());
}

double SurfaceDistance::distanceBeyond(const Eigen::Vector3d& point, double enough, double most) const
{
    Scene::Search search{*_scene, point - _scene->center, enough, most};
    _scene->find(search);
    return search.nearest;
}

double SurfaceDistance::distanceBeyond(const Eigen::Vector3d& point, double enough, double most,
                                       std::uint32_t& triangle) const
{
    Scene::Search search{*_scene, point - _scene->center, enough, most, triangle};
    search.nearest = std::min(most, _scene->distance(search, triangle));
    if (search.nearest > enough) { _scene->find(search); }
    triangle = search.triangle;
    return search.nearest;
}

SurfaceDistance::Nearest SurfaceDistance::nearest(const Eigen::Vector3d& point) const
{
    Scene::Search search{*_scene, point - _scene->center, 0.0, std::numeric_limits<double>::infinity()};
    _scene->find(search);
    if (!std::isfinite(search.nearest)) { return {point, search.nearest, 0}; }
    const std::array<Vector3d, 3> corners = _scene->cornersFrom(search.point, search.triangle);
    return {point + nearestOnTriangle(corners[0], corners[1], corners[2]), search.nearest, search.triangle};
}

namespace {

double oneSided(const SurfaceView& from, const SurfaceDistance& to)
{
    const auto largest = [](double a, double b) { return std::max(a, b); };
    const double atVertices = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, from.positions.size(), 1024), 0.0,
        [&](const auto& range, double result) {
            for (std::size_t v = range.begin(); v != range.end(); ++v) {
                result = std::max(result, to.distance(from.positions[v]));
            }
            return result;
        },
        largest);
    const double atFaces = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, from.triangles.size(), 1024), 0.0,
        [&](const auto& range, double result) {
            for (std::size_t t = range.begin(); t != range.end(); ++t) {
                const auto& corner = from.triangles[t];
                const Eigen::Vector3d& a = from.positions[corner[0]];
                const Eigen::Vector3d& b = from.positions[corner[1]];
                const Eigen::Vector3d& c = from.positions[corner[2]];
                const std::array<Eigen::Vector3d, 4> samples{(a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c),
                                                             0.5 * (c + a)};
                for (const auto& p : samples) { result = std::max(result, to.distance(p)); }
            }
            return result;
        },
        largest);
    return std::max(atVertices, atFaces);
}

} // namespace

HausdorffDistance hausdorffDistance(const SurfaceView& first, const SurfaceView& second)
{
    HausdorffDistance result;
    result.forward = oneSided(first, SurfaceDistance(second.positions, second.triangles));
    result.backward = oneSided(second, SurfaceDistance(first.positions, first.triangles));
    return result;
}

} // namespace osgTessLOD::bake
