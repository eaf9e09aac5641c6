// SPDX-License-Identifier: MIT
#include "Yardsticks.h"

#include <meshoptimizer.h>
#include <osg/Geometry>
#include <osgUtil/Simplifier>

#include <chrono>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

constexpr std::size_t kFewestTriangles = 64;
/// A level that keeps more than this of the former one's triangles is none: the library cannot go on.
constexpr double kMostKept = 0.9;

/// Calls `halve`, which makes the next level and returns its number of triangles, until there are few or it cannot go on.
template <typename Halve>
LevelChain makeChain(std::size_t sourceTriangles, const Halve& halve)
{
    LevelChain chain{{sourceTriangles}};
    const auto start = std::chrono::steady_clock::now();
    while (chain.triangles.back() > kFewestTriangles) {
        const std::size_t triangles = halve();
        if (static_cast<double>(triangles) > kMostKept * static_cast<double>(chain.triangles.back())) { break; }
        chain.triangles.push_back(triangles);
    }
    chain.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return chain;
}

} // namespace

LevelChain meshoptimizerChain(const Triangles& source)
{
    constexpr float kAnyError = 1.0F; // of the mesh's extent
    constexpr std::size_t kStride = 3 * sizeof(float);
    std::vector<float> positions;
    for (const Eigen::Vector3d& p : source.positions) {
        for (const double x : p) { positions.push_back(static_cast<float>(x)); }
    }
    std::vector<unsigned> indices;
    for (const auto& triangle : source.triangles) { indices.insert(indices.end(), triangle.begin(), triangle.end()); }

    return makeChain(source.triangles.size(), [&] {
        const std::size_t target = indices.size() / 6 * 3;
        std::vector<unsigned> level(indices.size());
        level.resize(meshopt_simplify(level.data(), indices.data(), indices.size(), positions.data(),
                                      positions.size() / 3, kStride, target, kAnyError, 0, nullptr));
        indices = std::move(level);
        // Drops unused vertices, so that the next level takes time by its own size.
        const std::size_t used = meshopt_optimizeVertexFetch(positions.data(), indices.data(), indices.size(),
                                                             positions.data(), positions.size() / 3, kStride);
        positions.resize(3 * used);
        return indices.size() / 3;
    });
}

LevelChain osgSimplifierChain(const Triangles& source)
{
    const osg::ref_ptr<osg::Vec3Array> vertices = new osg::Vec3Array;
    for (const Eigen::Vector3d& p : source.positions) { vertices->push_back(osg::Vec3(osg::Vec3d(p.x(), p.y(), p.z()))); }
    const osg::ref_ptr<osg::DrawElementsUInt> faces = new osg::DrawElementsUInt(GL_TRIANGLES);
    for (const auto& triangle : source.triangles) { faces->insert(faces->end(), triangle.begin(), triangle.end()); }
    const osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
    geometry->setVertexArray(vertices);
    geometry->addPrimitiveSet(faces);

    osgUtil::Simplifier simplifier(0.5);
    simplifier.setDoTriStrip(false);
    simplifier.setSmoothing(false);
    return makeChain(source.triangles.size(), [&] {
        simplifier.simplify(*geometry);
        return static_cast<std::size_t>(geometry->getPrimitiveSet(0)->getNumIndices() / 3);
    });
}

} // namespace osgTessLOD::benchmarks
