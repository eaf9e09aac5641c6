// SPDX-License-Identifier: MIT
#pragma once

#include "ResultTable.h"

#include <nlohmann/json.hpp>

#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// What a contestant draws for some error asked: the largest error measured, and what it costs.
struct CurvePoint {
    double error;
    double cost;
};

/// The cost of a largest error of `error`, between those measured: where log cost is linear in log error from the cheapest point
/// that keeps the error to the most exact one that does not and costs less. That of the cheapest one, where all keep it; nothing where
/// none does.
std::optional<double> costAt(double error, const std::vector<CurvePoint>& curve);

/// Of rows of the benchmark `curve`, each with its frames. `ours`: names of contestants that are compared with all others, the first of
/// them that of the totals.
nlohmann::ordered_json summarizeCurves(const nlohmann::ordered_json& rows, const std::vector<std::string>& ours);

/// The summary's comparisons at equal errors as a table.
ResultTable equalErrorTable(const nlohmann::ordered_json& summary);

} // namespace osgTessLOD::benchmarks
