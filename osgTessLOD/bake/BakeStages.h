// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/Progress.h>

#include <chrono>
#include <string>

namespace osgTessLOD::bake {

// Stages of a bake as its report has them. Private to the bake room.

/// Adds the seconds that `work` takes to the report.
template <typename Work> auto timed(BakeReport& report, const std::string& name, Work&& work)
{
    struct Timer {
        BakeReport& report;
        const std::string& name;
        std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
        ~Timer()
        {
            const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
            report.stages.push_back({name, elapsed.count()});
        }
    } timer{report, name};
    return work();
}

/// `work` as a stage of one step.
template <typename Work>
auto inOneStep(const std::string& stage, const std::string& unit, Progress& progress, BakeReport& report, Work&& work)
{
    progress.begin(stage, 1, unit);
    auto result = timed(report, stage, work);
    progress.step(1);
    progress.end();
    return result;
}

} // namespace osgTessLOD::bake
