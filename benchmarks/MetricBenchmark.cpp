// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §2.3 and fig. 2.4.
#include "Benchmark.h"

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/LevelErrors.h>

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

/// Directions that are looked along at once: as many as stay in the cache.
constexpr std::size_t kBlock = 4000;

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

bake::Directions randomDirections(Eigen::Index count, std::mt19937_64& random)
{
    std::normal_distribution<double> normal;
    bake::Directions directions(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
        for (Eigen::Index k = 0; k < 3; ++k) { directions(i, k) = normal(random); }
    }
    directions.rowwise().normalize();
    return directions;
}

Accuracy measure(const bake::LevelVectors& level, const std::vector<bake::Directions>& blocks)
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
    for (const bake::Directions& block : blocks) {
        const ArrayXd squared = bake::squaredErrors(level.bare, block);
        const ArrayXd errors = squared.max(0.0).sqrt();
        const auto add = [&](Approximation which, const ArrayXd& values) { excess[which].add(values, squared, errors); };
        add(kIsotropic, ArrayXd::Constant(block.rows(), isotropic * isotropic));
        add(kVolume, bake::squaredErrors(volume, block));
        add(kLeastSquares, bake::squaredErrors(leastSquares, block));
        add(kQuadratic, bake::squaredErrors(quadratic.error, block));
        add(kDrawn, bake::squaredErrors(drawn.error, block));
        const ArrayXd squaredDrawn = bake::squaredErrors(level.drawn, block);
        ofDrawn.add(bake::squaredErrors(drawn.error, block), squaredDrawn, squaredDrawn.max(0.0).sqrt());
        count += static_cast<std::size_t>(block.rows());
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

std::vector<Json> measureScene(const Scene& scene, const std::vector<bake::Directions>& blocks)
{
    bake::Progress progress;
    bake::BakeReport report;
    const bake::PatchedSurface surface = bake::makeLevels(scene.source, bake::BakeOptions(), progress, report);
    const bake::LevelErrors errors(surface.hierarchy.ladder, surface.charts.factor);
    const std::size_t patches = surface.hierarchy.patches.size();
    std::vector<std::vector<Accuracy>> levels(surface.hierarchy.ladder.size(), std::vector<Accuracy>(patches));
    tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t p) {
        const auto vectors = errors.measure(surface.hierarchy.patches[p], surface.charts.charts[p].positions);
        for (std::size_t level = 0; level < levels.size(); ++level) { levels[level][p] = measure(vectors[level], blocks); }
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
    std::mt19937_64 random(2017);
    std::vector<bake::Directions> blocks;
    for (std::size_t left = directions; left > 0; left -= std::min(left, kBlock)) {
        blocks.push_back(randomDirections(static_cast<Eigen::Index>(std::min(left, kBlock)), random));
    }
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene", "factor",           "isotropic %", "max", "min. volume %", "max",
                                            "least sq. ellipsoid %", "max", "quadratic %", "max", "drawn %", "max",
                                            "drawn : bare", "cuts", "underestimates"};
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: metric\n", scene.name);
        try {
            for (const Json& row : measureScene(scene, blocks)) {
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
