// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace osgTessLOD::benchmarks {

/// What the figures depend on: cores, cpu, compiler.
nlohmann::ordered_json describeMachine();

} // namespace osgTessLOD::benchmarks
