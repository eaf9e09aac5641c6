// SPDX-License-Identifier: MIT
// Yotam Livny, Gilad Bauman, Jihad El-Sana, "Displacement patches for view-dependent rendering", The Visual Computer, 2012, table 5.
#include "Benchmark.h"
#include "ReferenceSurface.h"

#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/DisplacementSampling.h>
#include <osgTessLOD/bake/ElevationMap.h>
#include <osgTessLOD/bake/SurfaceDistance.h>
#include <support/RayHits.h>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <exception>
#include <random>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;
using Eigen::Vector3d;

struct Technique {
    const char* name;
    bake::DisplacementSampling sampling;
};
constexpr std::array<Technique, 3> kTechniques{{{"intersection", bake::DisplacementSampling::Intersection},
                                                {"interpolation", bake::DisplacementSampling::Interpolation},
                                                {"fit", bake::DisplacementSampling::Fit}}};

bake::SourceMesh sourceMesh(const Scene& scene)
{
    constexpr unsigned kBuiltinFactor = 8;
    Triangles triangles = sourceTriangles(scene, kBuiltinFactor);
    bake::SourceMesh mesh;
    mesh.name = scene.name;
    mesh.positions = std::move(triangles.positions);
    mesh.triangles = std::move(triangles.triangles);
    bake::normalizeFrame(mesh);
    return mesh;
}

template <typename Work> double secondsOf(Work&& work)
{
    const auto start = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Random rays, evenly over the patches' areas in their parameters, that meet other than one triangle.
std::size_t strayRays(const bake::ElevationMap& map, std::size_t rays)
{
    const std::size_t patches = map.topology().patches.size();
    std::atomic<std::size_t> stray{0};
    tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t p) {
        const std::size_t own = rays / patches + (p < rays % patches ? 1 : 0);
        const auto patch = static_cast<std::uint32_t>(p);
        const std::vector<std::uint32_t> triangles = map.trianglesOf(patch);
        if (triangles.size() == 1) { return; } // of the source: there are no rays
        std::mt19937 random(patch);
        std::uniform_real_distribution<double> unit(0.0, 1.0);
        for (std::size_t i = 0; i < own; ++i) {
            double a = unit(random);
            double b = unit(random);
            if (a + b > 1.0) {
                a = 1.0 - a;
                b = 1.0 - b;
            }
            if (rayHits(map, patch, triangles, {1.0 - a - b, a, b}) != 1) { ++stray; }
        }
    });
    return stray;
}

/// The tiles of all patches.
Triangles tilesOf(const bake::ElevationMap& map, unsigned factor, bake::DisplacementSampling sampling)
{
    bake::Progress progress;
    const bake::TriangleLattice lattice{factor};
    const auto samples =
        bake::sampleDisplacement(map.topology(), bake::displacementOf(map, true), lattice, sampling, progress);
    Triangles tiles;
    for (std::uint32_t p = 0; p < samples.size(); ++p) {
        const auto first = static_cast<std::uint32_t>(tiles.positions.size());
        const auto at = [&](unsigned i, unsigned j) { return first + static_cast<std::uint32_t>(lattice.index(i, j)); };
        for (unsigned j = 0; j <= factor; ++j) {
            for (unsigned i = 0; i + j <= factor; ++i) {
                const Vector3d b = lattice.weights(i, j);
                const Vector3d ray = map.prism(p).rayAt(b);
                const double height = samples[p][lattice.index(i, j)].x() / map.frame().scale;
                const double length = ray.norm();
                tiles.positions.emplace_back(map.prism(p).pointAt(b) + (length > 0.0 ? height / length : 0.0) * ray);
                if (i + j < factor) { tiles.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)}); }
                if (i + j + 1 < factor) { tiles.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}); }
            }
        }
    }
    return tiles;
}

/// Distances of tiles from the source in % of the diagonal: the largest either way, and over the tiles' area the mean and mean square,
/// of each triangle at its centroid and its sides' middles.
Json distances(const Triangles& tiles, const bake::SourceMesh& source)
{
    constexpr double kPercent = 100.0; // of the working frame's unit
    const bake::HausdorffDistance largest =
        bake::hausdorffDistance({tiles.positions, tiles.triangles}, {source.positions, source.triangles});
    const bake::SurfaceDistance toSource(source.positions, source.triangles);
    std::vector<std::array<double, 3>> sums(tiles.triangles.size()); // area, · mean, · mean square
    tbb::parallel_for(std::size_t{0}, sums.size(), [&](std::size_t t) {
        const Vector3d& a = tiles.positions[tiles.triangles[t][0]];
        const Vector3d& b = tiles.positions[tiles.triangles[t][1]];
        const Vector3d& c = tiles.positions[tiles.triangles[t][2]];
        const double area = 0.5 * (b - a).cross(c - a).norm();
        sums[t] = {area, 0.0, 0.0};
        const std::array<Vector3d, 4> points{(a + b + c) / 3.0, 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)};
        for (const Vector3d& point : points) {
            const double distance = toSource.distance(point);
            sums[t][1] += area * distance / 4.0;
            sums[t][2] += area * distance * distance / 4.0;
        }
    });
    std::array<double, 3> total{};
    for (const auto& sum : sums) {
        for (std::size_t k = 0; k < 3; ++k) { total[k] += sum[k]; }
    }
    return {{"largestPercent", kPercent * largest.symmetric()},
            {"meanPercent", kPercent * total[1] / total[0]},
            {"meanSquarePercent2", kPercent * kPercent * total[2] / total[0]}};
}

/// One row per factor; only the first has what they share.
std::vector<Json> measure(const Scene& scene, const std::vector<unsigned>& factors, std::size_t rays)
{
    bake::SourceMesh mesh = sourceMesh(scene);
    bake::Progress progress;
    std::size_t plainPatches = 0;
    const double plainSeconds =
        secondsOf([&] { plainPatches = bake::ControlMesh(mesh, {}, progress).topology().patches.size(); });
    std::unique_ptr<bake::ElevationMap> map;
    const double seconds = secondsOf(
        [&] { map = std::make_unique<bake::ElevationMap>(std::move(mesh), bake::ControlMeshOptions(), progress); });
    const std::size_t stray = strayRays(*map, rays);
    std::vector<Json> rows;
    for (const unsigned factor : factors) {
        fmt::print(stderr, "{}: factor {}\n", scene.name, factor);
        Json row{{"scene", scene.name},
                 {"factor", factor},
                 {"sourceTriangles", map->sourceTriangles()},
                 {"plainPatches", plainPatches},
                 {"plainSeconds", plainSeconds},
                 {"patches", map->topology().patches.size()},
                 {"ownTriangles", map->ownTriangles()},
                 {"rounds", map->rounds()},
                 {"seconds", seconds},
                 {"rays", rays},
                 {"strayRays", stray}};
        for (const Technique& technique : kTechniques) {
            row[technique.name] = distances(tilesOf(*map, factor, technique.sampling), map->source());
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

void addRows(const Json& row, bool isFirst, std::vector<ResultTable>& tables)
{
    if (isFirst) {
        std::vector<std::string> cells{row["scene"].get<std::string>()};
        for (const char* key : {"sourceTriangles", "plainPatches", "patches", "ownTriangles", "rounds", "strayRays"}) {
            cells.push_back(grouped(row[key].get<std::uint64_t>()));
        }
        for (const char* key : {"plainSeconds", "seconds"}) {
            cells.push_back(fmt::format("{:.1f}", row[key].get<double>()));
        }
        tables[0].rows.push_back(std::move(cells));
    }
    std::vector<std::string> cells{row["scene"].get<std::string>(), std::to_string(row["factor"].get<unsigned>())};
    for (const char* key : {"largestPercent", "meanPercent", "meanSquarePercent2"}) {
        for (const Technique& technique : kTechniques) {
            cells.push_back(fmt::format("{:.3g}", row[technique.name][key].get<double>()));
        }
    }
    tables[1].rows.push_back(std::move(cells));
}

/// Over all rows: mean ratios to intersection.
Json summaryOf(const Json& rows)
{
    Json summary = Json::object();
    std::uint64_t stray = 0;
    for (const Json& row : rows) { stray += row["strayRays"].get<std::uint64_t>(); }
    summary["stray_rays"] = stray;
    for (const Technique& technique : kTechniques) {
        std::vector<double> ratios;
        for (const Json& row : rows) {
            const double reference = row["intersection"]["meanSquarePercent2"].get<double>();
            ratios.push_back(reference > 0.0 ? row[technique.name]["meanSquarePercent2"].get<double>() / reference
                                             : 1.0);
        }
        summary[std::string(technique.name) + "_mean_square_over_intersection"] = mean(ratios);
    }
    return summary;
}

} // namespace

BenchmarkResult benchmarkDisplacement(const std::vector<Scene>& scenes, const std::vector<unsigned>& factors,
                                      std::size_t rays)
{
    BenchmarkResult result;
    result.tables.resize(2);
    result.tables[0].headers = {"scene",  "source triangles", "patches", "as elevations", "of these source triangles",
                                "rounds", "rays ≠ 1 hit",     "seconds", "as elevations"};
    result.tables[1].headers = {
        "scene",         "factor", "largest: intersection",     "interpolation", "fit", "mean: intersection",
        "interpolation", "fit",    "mean square: intersection", "interpolation", "fit"};
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: elevations\n", scene.name);
        try {
            bool isFirst = true;
            for (Json& row : measure(scene, factors, rays)) {
                if (isFirst && row["strayRays"].get<std::uint64_t>() != 0) {
                    result.failures.push_back(scene.name + ": rays meet their patches other than once");
                }
                addRows(row, isFirst, result.tables);
                isFirst = false;
                result.rows.push_back(std::move(row));
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = summaryOf(result.rows);
    return result;
}

} // namespace osgTessLOD::benchmarks
