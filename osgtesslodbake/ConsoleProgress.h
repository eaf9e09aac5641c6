// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/Progress.h>

#include <atomic>
#include <chrono>
#include <mutex>

namespace osgTessLOD {

/// Shows stages, how far they are and at what rate on the standard error: a bar that is redrawn on a terminal, a line
/// per stage elsewhere. Stops the work once the process was asked to end (SIGINT, SIGTERM).
class ConsoleProgress : public bake::Progress {
public:
    /// `quiet` prints nothing, but still stops. Takes over SIGINT and SIGTERM.
    explicit ConsoleProgress(bool quiet);

    void begin(const std::string& stage, std::uint64_t total, const std::string& unit) override;
    void advance(std::uint64_t amount) override;
    void end() override;
    bool stopRequested() const override;

private:
    void draw(double seconds) const;

    bool _quiet;
    bool _terminal;
    std::string _stage;
    std::string _unit;
    std::uint64_t _total = 0;
    std::atomic<std::uint64_t> _done{0};
    std::chrono::steady_clock::time_point _start;
    std::mutex _mutex;
    std::chrono::steady_clock::time_point _lastDrawn;
};

} // namespace osgTessLOD
