// SPDX-License-Identifier: MIT
#include "BakedScene.h"
#include "Benchmark.h"
#include "Orbit.h"

#include <osgTessLOD/render/PatchSelector.h>

#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <functional>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kViews = 16;

/// Places to select from.
struct Situation {
    const char* name;
    double diagonals; ///< from the middle of the model
    bool looksAway;
};
constexpr Situation kSituations[] = {
    {"home", 3.0, false}, {"close", 0.6, false}, {"far", 3000.0, false}, {"off screen", 3.0, true}};

/// Nanoseconds of one selection: the median over `runs` of the mean over the views.
double nanoseconds(const PatchSelector& selector, const SelectionOptions& options, const Situation& situation,
                   const std::vector<ScreenCamera>& cameras, unsigned runs, SelectionStatistics& statistics)
{
    struct Prepared {
        SelectionView view;
        std::vector<osg::Plane> sides;
    };
    std::vector<Prepared> prepared;
    for (ScreenCamera camera : cameras) {
        if (situation.looksAway) { camera.localToEye.postMult(osg::Matrixd::rotate(osg::PI, 0.0, 1.0, 0.0)); }
        prepared.push_back({camera.view(), camera.sides()});
    }
    std::vector<double> times;
    for (unsigned run = 0; run < runs; ++run) {
        statistics = SelectionStatistics();
        const auto start = std::chrono::steady_clock::now();
        for (const Prepared& p : prepared) { statistics.add(selector.select(p.view, options, p.sides).statistics); }
        const std::chrono::duration<double, std::nano> time = std::chrono::steady_clock::now() - start;
        times.push_back(time.count() / static_cast<double>(prepared.size()));
    }
    return median(times);
}

struct Way {
    const char* name;
    SelectionOptions::Metric metric;
    SelectionOptions::Bound bound;
};
constexpr Way kWays[] = {
    {"conservative", SelectionOptions::Metric::View, SelectionOptions::Bound::Conservative},
    {"first order", SelectionOptions::Metric::View, SelectionOptions::Bound::FirstOrder},
    {"conservative, isotropic", SelectionOptions::Metric::Isotropic, SelectionOptions::Bound::Conservative}};

} // namespace

BenchmarkResult benchmarkSelection(const std::vector<Scene>& scenes, unsigned runs)
{
    BenchmarkResult result;
    result.tables.emplace_back().headers = {"scene", "patches", "from", "selection", "drawn", "µs", "ns / patch"};
    std::vector<double> atHome;
    for (const Scene& scene : scenes) {
        fmt::print(stderr, "{}: select\n", scene.name);
        try {
            const LodAsset asset = loadOrBake(scene);
            const PatchSelector selector(asset);
            for (const Situation& situation : kSituations) {
                const std::vector<ScreenCamera> cameras = orbitOf(asset, situation.diagonals, kViews);
                for (const Way& way : kWays) {
                    SelectionOptions options;
                    options.metric = way.metric;
                    options.bound = way.bound;
                    SelectionStatistics statistics;
                    const double time = nanoseconds(selector, options, situation, cameras, runs, statistics);
                    const double perPatch = time / static_cast<double>(asset.patches.size());
                    if (&situation == &kSituations[0] && &way == &kWays[0]) { atHome.push_back(perPatch); }
                    result.rows.push_back({{"scene", scene.name},
                                           {"patches", asset.patches.size()},
                                           {"from", situation.name},
                                           {"selection", way.name},
                                           {"drawn", statistics.patches / kViews},
                                           {"nanoseconds", time},
                                           {"nanosecondsPerPatch", perPatch}});
                    result.tables.front().rows.push_back({scene.name, grouped(asset.patches.size()), situation.name,
                                                          way.name, grouped(statistics.patches / kViews),
                                                          fmt::format("{:.2f}", time / 1000.0),
                                                          fmt::format("{:.1f}", perPatch)});
                }
            }
        } catch (const std::exception& error) {
            result.failures.push_back(scene.name + ": " + error.what());
        }
    }
    result.summary = {{"ns_per_patch", mean(atHome)}, {"runs", runs}};
    return result;
}

} // namespace osgTessLOD::benchmarks
