// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.3 and fig. 2.4.
#include "Benchmark.h"

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/LevelErrors.h>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <random>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;
using Eigen::ArrayXd;
using Vectors = std::vector<Eigen::Vector3d>;

/// Directions that differ by little.
struct DirectionCone {
    bake::Directions directions;
    Eigen::Vector3d axis;
    double angle = 0.0; ///< between the axis and any of them at most, radians
};

/// Random directions of a hemisphere, which is enough as errors are even, by the cells of a cube's faces they go through.
std::vector<DirectionCone> randomDirections(std::size_t count)
{
    constexpr int kCells = 12; // along a face's side: a cone of a million directions stays in the cache
    std::mt19937_64 random(2017);
    std::normal_distribution<double> normal;
    std::vector<std::vector<Eigen::Vector3d>> cells(3 * kCells * kCells);
    for (std::size_t i = 0; i < count; ++i) {
        Eigen::Vector3d direction;
        for (Eigen::Index k = 0; k < 3; ++k) { direction[k] = normal(random); }
        direction.normalize();
        Eigen::Index face = 0;
        direction.cwiseAbs().maxCoeff(&face);
        if (direction[face] < 0.0) { direction = -direction; }
        const auto cell = [&](Eigen::Index axis) {
            const double place = 0.5 * (direction[axis % 3] / direction[face] + 1.0);
            return std::min(kCells - 1, static_cast<int>(place * kCells));
        };
        const auto at = (static_cast<int>(face) * kCells + cell(face + 1)) * kCells + cell(face + 2);
        cells[static_cast<std::size_t>(at)].push_back(direction);
    }
    std::vector<DirectionCone> cones;
    for (const std::vector<Eigen::Vector3d>& cell : cells) {
        if (cell.empty()) { continue; }
        DirectionCone cone{bake::Directions(cell.size(), 3), Eigen::Vector3d::Zero()};
        for (std::size_t i = 0; i < cell.size(); ++i) { cone.directions.row(static_cast<Eigen::Index>(i)) = cell[i]; }
        cone.axis = cone.directions.colwise().mean().normalized();
        const double cosine = (cone.directions * cone.axis).minCoeff();
        cone.angle = std::acos(std::min(1.0, cosine)) + 1e-6; // rounding of acos near 1 is of the root of an ulp
        cones.push_back(std::move(cone));
    }
    return cones;
}

/// Those of the vectors that can be the longest seen along any direction of the cone.
Vectors longestAlong(const Vectors& vectors, const DirectionCone& cone)
{
    constexpr double kRightAngle = 1.57079632679489661923;
    double least = 0.0; // E is no less than this along any direction of the cone
    std::vector<double> largest(vectors.size());
    for (std::size_t i = 0; i < vectors.size(); ++i) {
        const double length = vectors[i].norm();
        const double angle = std::atan2(vectors[i].cross(cone.axis).norm(), std::abs(vectors[i].dot(cone.axis)));
        largest[i] = length * std::sin(std::min(kRightAngle, angle + cone.angle));
        if (angle > cone.angle) {
            least = std::max(least, length * std::min(std::sin(angle - cone.angle), std::sin(angle + cone.angle)));
        }
    }
    Vectors longest;
    for (std::size_t i = 0; i < vectors.size(); ++i) {
        if (largest[i] >= (1.0 - 1e-9) * least) { longest.push_back(vectors[i]); }
    }
    return longest;
}

/// How far an approximation is above E along many directions, relative to the largest E.
struct Excess {
    double sum = 0.0;
    double largest = 0.0;
    std::uint64_t underestimates = 0;

    void add(const ArrayXd& squaredApproximation, const ArrayXd& squaredErrors, const ArrayXd& errors)
    {
        const ArrayXd excess = squaredApproximation.max(0.0).sqrt() - errors;
        sum += excess.sum();
        largest = std::max(largest, excess.maxCoeff());
        underestimates += static_cast<std::uint64_t>((squaredApproximation < squaredErrors).count());
    }
};

enum Approximation { kIsotropic, kVolume, kLeastSquares, kQuadratic, kDrawn, kApproximations };
constexpr std::array<const char*, kApproximations> kNames{"isotropic", "minimumVolume", "leastSquaresEllipsoid",
                                                          "quadratic", "drawn"};

/// Of one patch at one level.
struct Accuracy {
    std::array<double, kApproximations> mean{};
    std::array<double, kApproximations> largest{};
    std::uint64_t underestimates = 0;
    double certificate = std::numeric_limits<double>::infinity();
    double drawnRatio = 1.0; ///< largest error of what is drawn to that of the level itself
    unsigned cuts = 0;
    bool measured = false;   ///< has an error at all
};

Accuracy measure(const bake::LevelVectors& level, const std::vector<DirectionCone>& cones)
{
    Accuracy accuracy;
    const double isotropic = bake::fitIsotropic(level.bare);
    if (level.bare.empty()) { return accuracy; }
    const bake::EllipsoidError volume = bake::fitMinimumVolumeEllipsoid(level.bare);
    const bake::EllipsoidError leastSquares = bake::fitLeastSquaresEllipsoid(level.bare);
    const bake::QuadraticFit quadratic = bake::fitQuadratic(level.bare);
    const bake::QuadraticFit drawn = bake::fitQuadratic(level.drawn, level.betweenSamples);
    std::array<Excess, kApproximations> excess;
    Excess ofDrawn;
    std::size_t count = 0;
    for (const DirectionCone& cone : cones) {
        const bake::Directions& directions = cone.directions;
        const ArrayXd squared = bake::squaredErrors(longestAlong(level.bare, cone), directions);
        const ArrayXd errors = squared.max(0.0).sqrt();
        const auto add = [&](Approximation which, const ArrayXd& values) { excess[which].add(values, squared, errors); };
        add(kIsotropic, ArrayXd::Constant(directions.rows(), isotropic * isotropic));
        add(kVolume, bake::squaredErrors(volume, directions));
        add(kLeastSquares, bake::squaredErrors(leastSquares, directions));
        add(kQuadratic, bake::squaredErrors(quadratic.error, directions));
        add(kDrawn, bake::squaredErrors(drawn.error, directions));
        const ArrayXd squaredDrawn = bake::squaredErrors(longestAlong(level.drawn, cone), directions);
        ofDrawn.add(bake::squaredErrors(drawn.error, directions), squaredDrawn, squaredDrawn.max(0.0).sqrt());
        count += static_cast<std::size_t>(directions.rows());
    }
    for (std::size_t which = 0; which < kApproximations; ++which) {
        accuracy.mean[which] = excess[which].sum / static_cast<double>(count) / isotropic;
        accuracy.largest[which] = excess[which].largest / isotropic;
        accuracy.underestimates += excess[which].underestimates;
    }
    accuracy.underestimates += ofDrawn.underestimates;
    accuracy.certificate = std::min(quadratic.certificate, drawn.certificate);
    accuracy.drawnRatio = (static_cast<double>(bake::fitIsotropic(level.drawn)) + level.betweenSamples) / isotropic;
    accuracy.cuts = quadratic.cuts;
    accuracy.measured = true;
    return accuracy;
}

/// One row: one factor of a scene, over all its patches.
Json summarize(const Scene& scene, unsigned factor, const std::vector<Accuracy>& patches)
{
    std::array<double, kApproximations> mean{};
    std::array<double, kApproximations> meanLargest{};
    std::array<double, kApproximations> largest{};
    std::uint64_t underestimates = 0;
    std::uint64_t cuts = 0;
    double certificate = std::numeric_limits<double>::infinity();
    double ratio = 0.0;
    std::size_t measured = 0;
    for (const Accuracy& patch : patches) {
        if (!patch.measured) { continue; }
        ++measured;
        for (std::size_t which = 0; which < kApproximations; ++which) {
            mean[which] += patch.mean[which];
            meanLargest[which] += patch.largest[which];
            largest[which] = std::max(largest[which], patch.largest[which]);
        }
        underestimates += patch.underestimates;
        cuts += patch.cuts;
        certificate = std::min(certificate, patch.certificate);
        ratio += patch.drawnRatio;
    }
    const double count = static_cast<double>(std::max<std::size_t>(measured, 1));
    Json row{{"scene", scene.name}, {"factor", factor}, {"patches", measured}};
    for (std::size_t which = 0; which < kApproximations; ++which) {
        row[kNames[which]] = {{"mean", mean[which] / count},
                              {"largest", largest[which]},
                              {"meanLargest", meanLargest[which] / count}};
    }
    row["drawnToBare"] = ratio / count;
    row["underestimates"] = underestimates;
    row["smallestCertificateEigenvalue"] = measured > 0 ? certificate : 0.0;
    row["cuts"] = static_cast<double>(cuts) / count;
    return row;
}

std::vector<Json> measureScene(const Scene& scene, const std::vector<DirectionCone>& cones)
{
    bake::Progress progress;
    bake::BakeReport report;
    const bake::PatchedSurface surface = bake::makeLevels(scene.source, bake::BakeOptions(), progress, report);
    const bake::LevelErrors errors(surface.hierarchy.ladder, surface.charts.factor);
    const std::size_t patches = surface.hierarchy.patches.size();
    std::vector<std::vector<Accuracy>> levels(surface.hierarchy.ladder.size(), std::vector<Accuracy>(patches));
    tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t p) {
        const auto vectors = errors.measure(surface.hierarchy.patches[p], surface.charts.charts[p].positions);
        for (std::size_t level = 0; level < levels.size(); ++level) { levels[level][p] = measure(vectors[level], cones); }
    });
    std::vector<Json> rows;
    for (std::size_t level = 0; level < levels.size(); ++level) {
        rows.push_back(summarize(scene, surface.hierarchy.ladder[level], levels[level]));
    }
    return rows;
}

std::vector<std::string> tableRow(const Json& row)
{
    const auto percent = [](const Json& value) { return fmt::format("{:.1f}", 100.0 * value.get<double>()); };
    std::vector<std::string> cells{row["scene"].get<std::string>(), std::to_string(row["factor"].get<unsigned>())};
    for (const char* name : kNames) {
        cells.push_back(percent(row[name]["mean"]));
        cells.push_back(percent(row[name]["largest"]));
    }
    cells.push_back(fmt::format("{:.2f}", row["drawnToBare"].get<double>()));
    cells.push_back(fmt::format("{:.1f}", row["cuts"].get<double>()));
    cells.push_back(grouped(row["underestimates"].get<std::uint64_t>()));
    return cells;
}

Json summaryOf(const Json& rows, std::size_t directions)
{
    double mean = 0.0;
    double meanLargest = 0.0;
    double largest = 0.0;
    double certificate = std::numeric_limits<double>::max();
    std::uint64_t underestimates = 0;
    for (const Json& row : rows) {
        mean += row["quadratic"]["mean"].get<double>() / static_cast<double>(rows.size());
        meanLargest += row["quadratic"]["meanLargest"].get<double>() / static_cast<double>(rows.size());
        largest = std::max(largest, row["quadratic"]["largest"].get<double>());
        certificate = std::min(certificate, row["smallestCertificateEigenvalue"].get<double>());
        underestimates += row["underestimates"].get<std::uint64_t>();
    }
    return {{"quadratic_mean_over", mean},
            {"quadratic_max_over", largest},
            {"quadratic_mean_max_over", meanLargest},
            {"underestimates", underestimates},
            {"smallest_certificate_eigenvalue", rows.empty() ? 0.0 : certificate},
            {"directions", directions}};
}

} // namespace

BenchmarkResult benchmarkMetric(const std::vector<Scene>& scenes, std::size_t directions)
{
    const std::vector<DirectionCone> cones = randomDirections(directions);
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene", "factor",           "isotropic %", "max", "min. volume %", "max",
                                            "least sq. ellipsoid %", "max", "quadratic %", "max", "drawn %", "max",
                                            "drawn : bare", "cuts", "underestimates"};
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: metric\n", scene.name);
        try {
            for (const Json& row : measureScene(scene, cones)) {
                result.rows.push_back(row);
                result.tables.front().rows.push_back(tableRow(row));
                if (row["underestimates"].get<std::uint64_t>() > 0) {
                    result.failures.push_back(fmt::format("{}: the error at factor {} is underestimated", scene.name,
                                                          row["factor"].get<unsigned>()));
                }
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = summaryOf(result.rows, directions);
    return result;
}

} // namespace osgTessLOD::benchmarks
