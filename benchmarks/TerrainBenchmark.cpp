// SPDX-License-Identifier: MIT
#include "Benchmark.h"

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/HeightField.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <exception>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;
using bake::HeightField;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Errors asked for, from the least on in geometric progression, in terms of the diagonal.
constexpr double kLeastError = 0.00025;
constexpr int kErrors = 6;

/// Triangles over a height field: fractional columns, rows, and heights.
struct GridMesh {
    std::vector<Vector3d> positions;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// How far triangles are above or below the samples of a height field.
struct HeightError {
    double largest = 0.0;
    double meanSquare = 0.0;
    std::uint64_t missed = 0; ///< samples that no triangle is above or below
};

/// Calls visit(sample, height) for the samples that a triangle is above or below, those on its sides included.
template <typename Visit>
void forEachSample(const HeightField& field, const std::array<Vector3d, 3>& corners, const Visit& visit)
{
    constexpr double kRounding = 1e-6; // of positions in single precision, in samples
    const auto limits = [&](Eigen::Index axis, std::uint32_t count) {
        const auto [low, high] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
        return std::pair(std::max(0.0, std::ceil(low - kRounding)),
                         std::min(count - 1.0, std::floor(high + kRounding)));
    };
    const Vector2d a = corners[0].head<2>();
    const Vector2d ab = corners[1].head<2>() - a;
    const Vector2d ac = corners[2].head<2>() - a;
    const double area = ab.x() * ac.y() - ab.y() * ac.x();
    if (area == 0.0) { return; }
    const double slack = kRounding * (ab.norm() + ac.norm()) / std::fabs(area);
    const auto [left, right] = limits(0, field.columns);
    const auto [top, bottom] = limits(1, field.rows);
    for (double row = top; row <= bottom; ++row) {
        for (double column = left; column <= right; ++column) {
            const Vector2d p = Vector2d(column, row) - a;
            const double b = (p.x() * ac.y() - p.y() * ac.x()) / area;
            const double c = (ab.x() * p.y() - ab.y() * p.x()) / area;
            if (b < -slack || c < -slack || b + c > 1.0 + slack) { continue; }
            visit(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row),
                  corners[0].z() + b * (corners[1].z() - corners[0].z()) + c * (corners[2].z() - corners[0].z()));
        }
    }
}

HeightError compare(const HeightField& field, const GridMesh& mesh)
{
    std::vector<float> errors(field.heights.size(), -1.0F); // the least of the triangles that meet there
    for (const auto& t : mesh.triangles) {
        forEachSample(field, {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]},
                      [&](std::uint32_t column, std::uint32_t row, double height) {
                          const auto error =
                              static_cast<float>(std::fabs(height - static_cast<double>(field.at(column, row))));
                          float& known = errors[std::size_t{row} * field.columns + column];
                          known = known < 0.0F ? error : std::min(known, error);
                      });
    }
    HeightError result;
    for (const float error : errors) {
        if (error < 0.0F) {
            ++result.missed;
            continue;
        }
        result.largest = std::max(result.largest, static_cast<double>(error));
        result.meanSquare += static_cast<double>(error) * static_cast<double>(error);
    }
    result.meanSquare /= static_cast<double>(errors.size() - result.missed);
    return result;
}

/// What the run time draws where the error may be `errorObject` everywhere; nothing where the finest levels are not enough.
GridMesh drawnMesh(const HeightField& field, const LodAsset& asset, double errorObject)
{
    SelectionView view;
    view.orthographic = true;
    view.pixelScale = 1.0;
    SelectionOptions options;
    options.errorPixels = errorObject;
    options.metric = SelectionOptions::Metric::Isotropic;
    const PatchSelector::Result selected = PatchSelector(asset).select(view, options, {});
    GridMesh mesh;
    if (selected.statistics.saturatedPatches > 0) { return mesh; }
    const MorphedSurface surface(asset);
    for (const PatchRecord& record : selected.records) {
        const TessellationPattern pattern(asset.ladder[MorphedSurface::drawnLevel(record.edgeLevels)]);
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(pattern.factor()); ++v) {
            const auto p = surface.tessLodSurfacePoint(record.patch, record.edgeLevels, v).position;
            const auto at = [&](std::size_t k) { return asset.lattice.origin[k] + static_cast<double>(p[k]); };
            mesh.positions.emplace_back((at(0) - field.corner[0]) / field.spacing[0],
                                        (field.corner[1] - at(1)) / field.spacing[1], at(2));
        }
        for (const auto& t : pattern.triangles()) {
            mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
        }
    }
    return mesh;
}

/// Every so many samples, about `triangles` triangles.
GridMesh uniformGrid(const HeightField& field, std::size_t triangles)
{
    const double width = field.columns - 1.0;
    const double height = field.rows - 1.0;
    const double cells = std::max(1.0, static_cast<double>(triangles) / 2.0);
    const auto across = static_cast<std::uint32_t>(std::max(1.0, std::round(std::sqrt(cells * width / height))));
    const auto down = static_cast<std::uint32_t>(std::max(1.0, std::round(cells / across)));
    GridMesh mesh;
    for (std::uint32_t j = 0; j <= down; ++j) {
        for (std::uint32_t i = 0; i <= across; ++i) {
            const double column = width * i / across;
            const double row = height * j / down;
            mesh.positions.emplace_back(column, row, field.heightAt(column, row));
        }
    }
    for (std::uint32_t j = 0; j < down; ++j) {
        for (std::uint32_t i = 0; i < across; ++i) {
            const std::uint32_t v = j * (across + 1) + i;
            mesh.triangles.push_back({v, v + across + 1, v + across + 2});
            mesh.triangles.push_back({v, v + across + 2, v + 1});
        }
    }
    return mesh;
}

/// The field's own triangles, for meshoptimizer to simplify.
class SimplifiedField {
public:
    explicit SimplifiedField(const HeightField& field)
        : _field(field)
    {
        const bake::SourceMesh source = triangulate(field);
        for (const auto& t : source.triangles) { _indices.insert(_indices.end(), t.begin(), t.end()); }
        for (const Vector3d& p : source.positions) { // centred, so that single precision will do
            _positions.push_back(static_cast<float>(p.x() - field.corner[0]));
            _positions.push_back(static_cast<float>(p.y() - field.corner[1]));
            _positions.push_back(static_cast<float>(p.z()));
        }
    }

    /// At most `triangles`, if it can.
    GridMesh simplified(std::size_t triangles) const
    {
        std::vector<unsigned> indices(_indices.size());
        indices.resize(meshopt_simplify(indices.data(), _indices.data(), _indices.size(), _positions.data(),
                                        _positions.size() / 3, 3 * sizeof(float), 3 * triangles, 1.0F, 0, nullptr));
        GridMesh mesh;
        for (std::size_t v = 0; v < _positions.size(); v += 3) {
            mesh.positions.emplace_back(static_cast<double>(_positions[v]) / _field.spacing[0],
                                        -static_cast<double>(_positions[v + 1]) / _field.spacing[1],
                                        static_cast<double>(_positions[v + 2]));
        }
        for (std::size_t i = 0; i < indices.size(); i += 3) {
            mesh.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
        }
        return mesh;
    }
    std::size_t triangles() const { return _indices.size() / 3; }

private:
    const HeightField& _field;
    std::vector<unsigned> _indices;
    std::vector<float> _positions;
};

/// Triangles of the coarsest mesh of those that `make(triangles)` makes that is nowhere farther than `most` from the field, as far as
/// halving the range of a ratio of two seven times finds it.
template <typename Make>
std::size_t trianglesFor(const HeightField& field, std::size_t start, std::size_t limit, double most, const Make& make)
{
    const auto suffices = [&](std::size_t triangles) { return compare(field, make(triangles)).largest <= most; };
    std::size_t low = start;
    std::size_t high = start;
    if (suffices(start)) {
        while (low > 16 && suffices(low / 2)) { low /= 2; }
        high = low;
        low /= 2;
    } else {
        do {
            low = high;
            high = std::min(2 * high, limit);
        } while (high < limit && !suffices(high));
    }
    for (int step = 0; step < 7 && low < high; ++step) {
        const std::size_t middle = (low + high) / 2;
        (suffices(middle) ? high : low) = middle;
    }
    return make(high).triangles.size();
}

Json jsonOf(const HeightError& error)
{
    return {{"largest", error.largest}, {"rms", std::sqrt(error.meanSquare)}, {"missed", error.missed}};
}

std::vector<Json> measureScene(const Scene& scene)
{
    HeightField field = bake::readHeightField(scene.source, {});
    bake::fillVoids(field, bake::HeightOptions().largestFilledVoid);
    if (field.voids() > 0) { throw AssetError("has voids, which grids cannot leave out"); }
    bake::Progress progress;
    bake::BakeReport report;
    bake::BakeOptions options;
    options.normals = false;
    const LodAsset asset = bake::bakeSource(scene.source, options, progress, report);
    const SimplifiedField source(field);
    const auto grid = [&](std::size_t triangles) { return uniformGrid(field, triangles); };
    const auto simplified = [&](std::size_t triangles) { return source.simplified(triangles); };
    std::vector<Json> rows;
    double error = kLeastError * report.diagonal;
    for (int i = 0; i < kErrors; ++i, error *= 2.0) {
        const GridMesh drawn = drawnMesh(field, asset, error);
        const std::size_t count = drawn.triangles.size();
        if (count == 0) { continue; }
        const HeightError ours = compare(field, drawn);
        const std::size_t gridCount = trianglesFor(field, count, source.triangles(), ours.largest, grid);
        const std::size_t simplifiedCount = trianglesFor(field, count, source.triangles(), ours.largest, simplified);
        rows.push_back({{"scene", scene.name},
                        {"sourceTriangles", source.triangles()},
                        {"asked", error},
                        {"triangles", count},
                        {"ours", jsonOf(ours)},
                        {"grid", jsonOf(compare(field, grid(count)))},
                        {"meshoptimizer", jsonOf(compare(field, simplified(count)))},
                        {"gridTriangles", gridCount},
                        {"meshoptimizerTriangles", simplifiedCount}});
        fmt::print(stderr, "{}: {} triangles\n", scene.name, count);
    }
    return rows;
}

double overOurs(const Json& row, const char* triangles)
{
    return row[triangles].get<double>() / row["triangles"].get<double>();
}

std::vector<std::string> tableRow(const Json& row)
{
    std::vector<std::string> cells{row["scene"].get<std::string>(), fmt::format("{:.1f}", row["asked"].get<double>()),
                                   grouped(row["triangles"].get<std::uint64_t>())};
    for (const char* contestant : {"ours", "grid", "meshoptimizer"}) {
        for (const char* figure : {"largest", "rms"}) {
            cells.push_back(fmt::format("{:.2f}", row[contestant][figure].get<double>()));
        }
    }
    for (const char* triangles : {"gridTriangles", "meshoptimizerTriangles"}) {
        cells.push_back(fmt::format("{:.2f}", overOurs(row, triangles)));
    }
    return cells;
}

double meanOver(const Json& rows, const char* triangles)
{
    std::vector<double> ratios;
    for (const Json& row : rows) { ratios.push_back(overOurs(row, triangles)); }
    return mean(ratios);
}

} // namespace

BenchmarkResult benchmarkTerrain(const std::vector<Scene>& scenes)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"terrain",
                                            "error asked",
                                            "triangles",
                                            "largest",
                                            "rms",
                                            "grid largest",
                                            "rms",
                                            "meshoptimizer largest",
                                            "rms",
                                            "grid : ours",
                                            "meshoptimizer : ours"};
    for (const Scene& scene : scenes) {
        try {
            for (const Json& row : measureScene(scene)) {
                result.rows.push_back(row);
                result.tables.front().rows.push_back(tableRow(row));
                if (row["ours"]["largest"].get<double>() > row["asked"].get<double>()) {
                    result.failures.push_back(scene.name + ": what is drawn is farther from the heights than asked");
                }
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"grid_over_ours_triangles", meanOver(result.rows, "gridTriangles")},
                      {"meshoptimizer_over_ours_triangles", meanOver(result.rows, "meshoptimizerTriangles")}};
    return result;
}

} // namespace osgTessLOD::benchmarks
