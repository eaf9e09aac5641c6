// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <functional>
#include <stdexcept>

namespace osgTessLOD::benchmarks {

/// Runs `work` in a process of its own, so that its peak memory is its own and nothing it leaves behind changes the next
/// measurement, and returns what it returned. The calling process must not have other threads. Throws TimeLimitReached
/// if the work's own limit was, else std::runtime_error with the message of what `work` threw, or saying how the process
/// ended.
nlohmann::ordered_json runInChild(const std::function<nlohmann::ordered_json()>& work);

/// For the work that runInChild does: ends its process, whatever it is doing, if it is not done in so many seconds from
/// now.
void limitChild(unsigned seconds);

/// The work took longer than limitChild() allows.
struct TimeLimitReached : std::runtime_error {
    using std::runtime_error::runtime_error;
};

} // namespace osgTessLOD::benchmarks
