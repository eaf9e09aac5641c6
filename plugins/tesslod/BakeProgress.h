// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/Progress.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>

namespace osgTessLOD {

/// Tells of a bake through osg::notify: each stage's end at level INFO, and how far it is at level NOTICE every few seconds.
class BakeProgress : public bake::Progress {
public:
    explicit BakeProgress(std::string name);

    void begin(const std::string& stage, std::uint64_t total, const std::string& unit) override;
    void advance(std::uint64_t amount) override;
    void end() override;

private:
    using Clock = std::chrono::steady_clock;

    std::string _name;
    std::string _stage;
    std::uint64_t _total = 0;
    std::atomic<std::uint64_t> _done{0};
    std::mutex _mutex;
    Clock::time_point _start;
    Clock::time_point _lastTold = Clock::now();
};

} // namespace osgTessLOD
