// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/SourceSurface.h>

#include <Eigen/Geometry>

#include <cmath>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

CornerNormals cornerNormals(const SourceMesh& source, double creaseAngleRadians)
{
    const std::size_t triangles = source.triangles.size();
    const auto cosine = static_cast<float>(std::cos(creaseAngleRadians));
    std::vector<Eigen::Vector3f> faceNormals(triangles);
    std::vector<std::array<float, 3>> angles(triangles);
    std::vector<std::uint32_t> first(source.positions.size() + 1, 0);
    for (std::size_t t = 0; t < triangles; ++t) {
        const auto& corners = source.triangles[t];
        std::array<Eigen::Vector3d, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
            p[k] = source.positions[corners[k]];
            ++first[corners[k] + 1];
        }
        const Eigen::Vector3d n = (p[1] - p[0]).cross(p[2] - p[0]);
        faceNormals[t] = n.norm() > 0.0 ? n.normalized().cast<float>() : Eigen::Vector3f(0.0F, 0.0F, 0.0F);
        for (std::size_t k = 0; k < 3; ++k) {
            const Eigen::Vector3d a = p[(k + 1) % 3] - p[k];
            const Eigen::Vector3d b = p[(k + 2) % 3] - p[k];
            angles[t][k] = static_cast<float>(std::atan2(a.cross(b).norm(), a.dot(b)));
        }
    }
    for (std::size_t v = 0; v + 1 < first.size(); ++v) { first[v + 1] += first[v]; }
    std::vector<std::uint32_t> incident(3 * triangles); // triangle · 3 + corner, by vertex
    std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
    for (std::size_t t = 0; t < triangles; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            incident[next[source.triangles[t][k]]++] = static_cast<std::uint32_t>(3 * t + k);
        }
    }
    CornerNormals normals(triangles);
    for (std::size_t t = 0; t < triangles; ++t) {
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t v = source.triangles[t][k];
            Eigen::Vector3f sum = Eigen::Vector3f::Zero();
            for (std::uint32_t i = first[v]; i < first[v + 1]; ++i) {
                const Eigen::Vector3f& n = faceNormals[incident[i] / 3];
                if (n.dot(faceNormals[t]) >= cosine) { sum += angles[incident[i] / 3][incident[i] % 3] * n; }
            }
            const float length = sum.norm();
            normals[t][k] = length > 0.0F ? Eigen::Vector3f(sum / length) : faceNormals[t];
        }
    }
    return normals;
}

Vector3d positionAt(const SourceMesh& source, const FacePoint& point)
{
    const auto& t = source.triangles[point.face];
    return point.barycentric[0] * source.positions[t[0]] + point.barycentric[1] * source.positions[t[1]] +
           point.barycentric[2] * source.positions[t[2]];
}

SurfacePoint surfaceAt(const SourceMesh& source, const CornerNormals& normals, const FacePoint& point)
{
    Vector3d normal = Vector3d::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
        normal += point.barycentric[static_cast<Eigen::Index>(k)] * normals[point.face][k].cast<double>();
    }
    const double length = normal.norm();
    SurfacePoint result{positionAt(source, point), length > 0.0 ? Vector3d(normal / length) : Vector3d::UnitZ()};
    const Eigen::Vector3f weights = point.barycentric.cast<float>();
    if (!source.uvs.empty()) {
        const auto& uv = source.uvs[point.face];
        result.uv = weights[0] * uv[0] + weights[1] * uv[1] + weights[2] * uv[2];
    }
    if (!source.colors.empty()) {
        result.color.setZero();
        for (std::size_t k = 0; k < 3; ++k) {
            const Rgba& color = source.colors[source.triangles[point.face][k]];
            result.color += weights[static_cast<Eigen::Index>(k)] / 255.0F *
                            Eigen::Vector4f(color[0], color[1], color[2], color[3]);
        }
    }
    return result;
}

std::vector<FacePoint> samplePoints(const SourceMesh& source)
{
    std::vector<FacePoint> points(source.positions.size());
    for (std::uint32_t t = 0; t < source.triangles.size(); ++t) {
        for (Eigen::Index k = 0; k < 3; ++k) {
            const Vector3d corner = Vector3d::Unit(k);
            const Vector3d next = Vector3d::Unit((k + 1) % 3);
            const std::uint32_t v = source.triangles[t][static_cast<std::size_t>(k)];
            points[v] = {t, corner};
            if (v < source.triangles[t][static_cast<std::size_t>((k + 1) % 3)]) {
                points.push_back({t, 0.5 * (corner + next)});
            }
        }
        points.push_back({t, Vector3d::Constant(1.0 / 3.0)});
    }
    return points;
}

} // namespace osgTessLOD::bake
