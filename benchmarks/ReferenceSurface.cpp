// SPDX-License-Identifier: MIT
#include "ReferenceSurface.h"

#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <memory>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

/// Charts sample a patch at so many times its finest factor.
constexpr unsigned kReferenceOversampling = 2;

/// The samples of a height image, small voids filled as a bake does.
bake::SourceMesh triangulateHeights(const std::string& path)
{
    const bake::HeightOptions options;
    bake::HeightField field = bake::readHeightField(path, options);
    bake::fillVoids(field, options.largestFilledVoid);
    return bake::triangulate(field);
}

/// The built-in surface's map sampled on the pattern of `factor`, each patch for itself.
bake::SourceMesh sampleBuiltin(const Scene& scene, unsigned factor)
{
    const std::unique_ptr<bake::PatchMap> map =
        bake::makeBuiltinSurface(scene.source.substr(scene.source.find(':') + 1));
    bake::Progress progress;
    const bake::ChartSet charts = bake::makeCharts(*map, factor, progress);
    const TessellationPattern pattern(factor);
    bake::SourceMesh all;
    all.name = scene.source;
    for (const bake::PatchChart& chart : charts.charts) {
        const auto first = static_cast<std::uint32_t>(all.positions.size());
        for (const Eigen::Vector3d& position : chart.positions) {
            all.positions.emplace_back(map->frame().center + map->frame().scale * position);
        }
        for (const TessellationPattern::Triangle& t : pattern.triangles()) {
            all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        }
    }
    return all;
}

} // namespace

Triangles sourceTriangles(const Scene& scene, unsigned finestFactor)
{
    bake::SourceMesh mesh = isBuiltin(scene)                  ? sampleBuiltin(scene, kReferenceOversampling * finestFactor)
                            : bake::isHeightFile(scene.source) ? triangulateHeights(scene.source)
                                                               : bake::importMesh(scene.source);
    bake::cleanMesh(mesh);
    return {std::move(mesh.positions), std::move(mesh.triangles)};
}

Triangles levelTriangles(const LodAsset& asset, unsigned factor)
{
    SurfaceMesh mesh = extractSurface(asset, factor);
    Triangles level;
    for (const std::array<double, 3>& p : mesh.positions) { level.positions.emplace_back(p[0], p[1], p[2]); }
    level.triangles = std::move(mesh.triangles);
    return level;
}

bake::HausdorffDistance distanceBetween(const Triangles& level, const Triangles& source)
{
    return bake::hausdorffDistance({level.positions, level.triangles}, {source.positions, source.triangles});
}

bool keepsBound(double distancePercent, double boundPercent)
{
    constexpr double kTolerancePercent = 1e-4;
    return distancePercent <= boundPercent + kTolerancePercent;
}

} // namespace osgTessLOD::benchmarks
