// SPDX-License-Identifier: MIT
#include "MeshLevels.h"

#include <Eigen/Geometry>
#include <meshoptimizer.h>
#include <osg/Geometry>
#include <osgUtil/Simplifier>

#include <algorithm>
#include <fstream>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

using Eigen::Vector3f;

constexpr std::size_t kFewestTriangles = 64;
/// A level that keeps more than this of the former one's triangles is none: the library cannot go on.
constexpr double kMostKept = 0.9;
constexpr std::size_t kClusterTriangles = 8192;

/// These triangles and their vertices alone, in an order that a GPU likes.
ShadedMesh compact(const ShadedMesh& mesh, std::vector<std::uint32_t> indices)
{
    meshopt_optimizeVertexCache(indices.data(), indices.data(), indices.size(), mesh.positions.size());
    constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> newNumber(mesh.positions.size(), kUnused);
    ShadedMesh result;
    for (std::uint32_t& index : indices) {
        if (newNumber[index] == kUnused) {
            newNumber[index] = static_cast<std::uint32_t>(result.positions.size());
            result.positions.push_back(mesh.positions[index]);
            result.normals.push_back(mesh.normals[index]);
        }
        index = newNumber[index];
    }
    result.indices = std::move(indices);
    return result;
}

bool isHalved(std::size_t triangles, std::size_t before)
{
    return triangles > 0 && static_cast<double>(triangles) <= kMostKept * static_cast<double>(before);
}

MeshLevels chainOf(const ShadedMesh& surface, unsigned options)
{
    constexpr float kAnyError = 1.0F; // of the mesh's extent
    const float* positions = surface.positions.front().data();
    const double scale =
        static_cast<double>(meshopt_simplifyScale(positions, surface.positions.size(), sizeof(Vector3f)));
    MeshLevels levels{{compact(surface, surface.indices), 0.0}};
    while (levels.back().mesh.triangles() > kFewestTriangles) {
        std::vector<std::uint32_t> indices(surface.indices.size());
        float error = 0.0F;
        indices.resize(meshopt_simplify(indices.data(), surface.indices.data(), surface.indices.size(), positions,
                                        surface.positions.size(), sizeof(Vector3f),
                                        levels.back().mesh.indices.size() / 6 * 3, kAnyError, options, &error));
        if (!isHalved(indices.size() / 3, levels.back().mesh.triangles())) { break; }
        const double larger = std::max(levels.back().error, scale * static_cast<double>(error));
        levels.push_back({compact(surface, std::move(indices)), larger});
    }
    return levels;
}

/// Reorders the triangles first … last so that pieces of up to kClusterTriangles of them lie together; calls visit(first, last) for each.
template <typename Visit>
void splitIntoClusters(std::vector<std::uint32_t>& triangles, const std::vector<Vector3f>& centroids, std::size_t first,
                       std::size_t last, const Visit& visit)
{
    if (last - first <= kClusterTriangles) {
        visit(first, last);
        return;
    }
    Eigen::AlignedBox3f box;
    for (std::size_t t = first; t < last; ++t) { box.extend(centroids[triangles[t]]); }
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::size_t middle = first + (last - first) / 2;
    const auto at = [&](std::size_t t) { return triangles.begin() + static_cast<std::ptrdiff_t>(t); };
    std::nth_element(at(first), at(middle), at(last), [&](std::uint32_t a, std::uint32_t b) {
        return centroids[a][axis] != centroids[b][axis] ? centroids[a][axis] < centroids[b][axis] : a < b;
    });
    splitIntoClusters(triangles, centroids, first, middle, visit);
    splitIntoClusters(triangles, centroids, middle, last, visit);
}

osg::ref_ptr<osg::Vec3Array> toOsg(const std::vector<Vector3f>& vectors)
{
    osg::ref_ptr<osg::Vec3Array> array = new osg::Vec3Array(osg::Array::BIND_PER_VERTEX);
    for (const Vector3f& v : vectors) { array->push_back(osg::Vec3(v.x(), v.y(), v.z())); }
    return array;
}

std::vector<Vector3f> toEigen(const osg::Array& array)
{
    std::vector<Vector3f> vectors;
    for (const osg::Vec3& v : static_cast<const osg::Vec3Array&>(array)) { vectors.emplace_back(v.x(), v.y(), v.z()); }
    return vectors;
}

// Levels on their way from one process to another: each part is a 64-bit count and its elements.

template <typename Element> void write(std::ostream& stream, const std::vector<Element>& elements)
{
    const std::uint64_t count = elements.size();
    stream.write(reinterpret_cast<const char*>(&count), sizeof(count));
    stream.write(reinterpret_cast<const char*>(elements.data()), static_cast<std::streamsize>(count * sizeof(Element)));
}

/// False at the end of what was written whole.
template <typename Element> bool read(std::istream& stream, std::vector<Element>& elements)
{
    std::uint64_t count = 0;
    if (!stream.read(reinterpret_cast<char*>(&count), sizeof(count))) { return false; }
    elements.resize(count);
    return !!stream.read(reinterpret_cast<char*>(elements.data()),
                         static_cast<std::streamsize>(count * sizeof(Element)));
}

Triangles toTriangles(const ShadedMesh& mesh)
{
    Triangles triangles;
    for (const Vector3f& p : mesh.positions) { triangles.positions.emplace_back(p.cast<double>()); }
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
        triangles.triangles.push_back({mesh.indices[t], mesh.indices[t + 1], mesh.indices[t + 2]});
    }
    return triangles;
}

} // namespace

ShadedMesh shadedMesh(const Triangles& surface)
{
    std::vector<Eigen::Vector3d> sums(surface.positions.size(), Eigen::Vector3d::Zero());
    ShadedMesh mesh;
    for (const auto& t : surface.triangles) {
        const auto at = [&](std::size_t k) -> const Eigen::Vector3d& { return surface.positions[t[k]]; };
        const Eigen::Vector3d normal = (at(1) - at(0)).cross(at(2) - at(0));
        for (const std::uint32_t v : t) {
            sums[v] += normal;
            mesh.indices.push_back(v);
        }
    }
    for (std::size_t v = 0; v < sums.size(); ++v) {
        mesh.positions.emplace_back(surface.positions[v].cast<float>());
        mesh.normals.emplace_back(sums[v].normalized().cast<float>());
    }
    return mesh;
}

MeshLevels meshoptimizerLevels(const ShadedMesh& surface)
{
    return chainOf(surface, 0);
}

std::vector<MeshLevels> meshoptimizerClusters(const ShadedMesh& surface)
{
    std::vector<std::uint32_t> triangles(surface.triangles());
    std::iota(triangles.begin(), triangles.end(), 0U);
    std::vector<Vector3f> centroids;
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const std::uint32_t* corners = &surface.indices[3 * t];
        centroids.emplace_back(
            (surface.positions[corners[0]] + surface.positions[corners[1]] + surface.positions[corners[2]]) / 3.0F);
    }
    std::vector<MeshLevels> clusters;
    splitIntoClusters(triangles, centroids, 0, triangles.size(), [&](std::size_t first, std::size_t last) {
        std::vector<std::uint32_t> indices;
        for (std::size_t t = first; t < last; ++t) {
            const auto corners = surface.indices.begin() + static_cast<std::ptrdiff_t>(3 * triangles[t]);
            indices.insert(indices.end(), corners, corners + 3);
        }
        clusters.push_back(chainOf(compact(surface, std::move(indices)), meshopt_SimplifyLockBorder));
    });
    return clusters;
}

void writeSimplifierLevels(const std::string& path, const ShadedMesh& surface)
{
    const osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setVertexArray(toOsg(surface.positions));
    geometry->setNormalArray(toOsg(surface.normals));
    geometry->addPrimitiveSet(new osg::DrawElementsUInt(GL_TRIANGLES, surface.indices.begin(), surface.indices.end()));
    osgUtil::Simplifier simplifier(0.5);
    simplifier.setDoTriStrip(false);
    simplifier.setSmoothing(false);
    std::ofstream file(path, std::ios::binary);
    for (std::size_t triangles = surface.triangles(); triangles > kFewestTriangles;) {
        simplifier.simplify(*geometry);
        const auto& faces = static_cast<const osg::DrawElementsUInt&>(*geometry->getPrimitiveSet(0));
        if (!isHalved(faces.size() / 3, triangles)) { break; }
        triangles = faces.size() / 3;
        write(file, toEigen(*geometry->getVertexArray()));
        write(file, toEigen(*geometry->getNormalArray()));
        write(file, std::vector<std::uint32_t>(faces.begin(), faces.end()));
        file.flush();
    }
}

MeshLevels readSimplifierLevels(const std::string& path, const ShadedMesh& surface)
{
    MeshLevels levels{{compact(surface, surface.indices), 0.0}};
    const Triangles source = toTriangles(surface);
    std::ifstream file(path, std::ios::binary);
    ShadedMesh level;
    while (read(file, level.positions) && read(file, level.normals) && read(file, level.indices)) {
        const double error = distanceBetween(toTriangles(level), source).symmetric();
        levels.push_back({compact(level, level.indices), std::max(error, levels.back().error)});
    }
    return levels;
}

} // namespace osgTessLOD::benchmarks
