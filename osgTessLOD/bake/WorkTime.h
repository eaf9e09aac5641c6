// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <utility>

namespace osgTessLOD::bake {

/// Sums up the time that some work takes, on all threads together.
class WorkTime {
public:
    /// Does `work`, adds its time and returns what it returns.
    template <typename Work>
    auto measure(Work&& work)
    {
        const Timer timer{*this};
        return std::forward<Work>(work)();
    }

    double seconds() const { return 1e-9 * static_cast<double>(_nanoseconds.load()); }

private:
    struct Timer {
        WorkTime& time;
        std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
        ~Timer()
        {
            const auto elapsed = std::chrono::steady_clock::now() - start;
            time._nanoseconds += static_cast<std::uint64_t>(
                std::chrono::duration_cast<std::chrono::nanoseconds>(elapsed).count());
        }
    };

    std::atomic<std::uint64_t> _nanoseconds{0};
};

} // namespace osgTessLOD::bake
