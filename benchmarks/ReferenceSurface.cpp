// SPDX-License-Identifier: MIT
#include "ReferenceSurface.h"

#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/BuiltinSurface.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/SourceMesh.h>

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

namespace osgTessLOD::benchmarks {

namespace {

struct Triangles {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

Triangles meshTriangles(const std::string& path)
{
    bake::SourceMesh mesh = bake::importMesh(path);
    bake::cleanMesh(mesh);
    return {std::move(mesh.positions), std::move(mesh.triangles)};
}

Triangles builtinTriangles(const std::string& name, unsigned factor)
{
    const std::unique_ptr<bake::PatchMap> map = bake::makeBuiltinSurface(name);
    bake::Progress progress;
    const bake::ChartSet charts = bake::makeCharts(*map, factor, progress);
    const TessellationPattern pattern(factor);
    Triangles all;
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

Triangles finestLevel(const LodAsset& asset)
{
    SurfaceMesh mesh = extractSurface(asset, asset.ladder.back());
    Triangles level;
    for (const std::array<double, 3>& p : mesh.positions) { level.positions.emplace_back(p[0], p[1], p[2]); }
    level.triangles = std::move(mesh.triangles);
    return level;
}

} // namespace

bake::HausdorffDistance distanceToSource(const LodAsset& asset, const Scene& scene)
{
    const std::string builtin = isBuiltin(scene) ? scene.source.substr(scene.source.find(':') + 1) : "";
    const Triangles source =
        builtin.empty() ? meshTriangles(scene.source) : builtinTriangles(builtin, 2U * asset.ladder.back());
    const Triangles level = finestLevel(asset);
    return bake::hausdorffDistance({level.positions, level.triangles}, {source.positions, source.triangles});
}

} // namespace osgTessLOD::benchmarks
