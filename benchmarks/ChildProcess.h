// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <functional>

namespace osgTessLOD::benchmarks {

/// Runs `work` in a process of its own, so that its peak memory is its own and nothing it leaves behind changes the next
/// measurement, and returns what it returned. The calling process must not have other threads. Throws
/// std::runtime_error with the message of what `work` threw, or saying how the process ended.
nlohmann::ordered_json runInChild(const std::function<nlohmann::ordered_json()>& work);

} // namespace osgTessLOD::benchmarks
