// SPDX-License-Identifier: MIT
#include "CurveSummary.h"

#include "Benchmark.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kEqualPixels = 1.0;
constexpr double kLeastError = 1e-3; ///< pixels; what is nearer counts as so near, for logarithms

double numberOf(const Json& value)
{
    return value.is_null() ? 0.0 : value.get<double>();
}

double timeOf(const Json& frame)
{
    return numberOf(frame["cullMilliseconds"]) + numberOf(frame["drawMilliseconds"]);
}

double trianglesOf(const Json& frame)
{
    return numberOf(frame["triangles"]);
}

bool isOneOf(const std::vector<std::string>& names, const std::string& name)
{
    return std::find(names.begin(), names.end(), name) != names.end();
}

double geometricMean(const std::vector<double>& values)
{
    std::vector<double> logarithms;
    for (const double value : values) { logarithms.push_back(std::log(value)); }
    return std::exp(mean(logarithms));
}

Json meanOrNull(const std::vector<double>& ratios)
{
    if (ratios.empty()) { return nullptr; }
    return geometricMean(ratios);
}

/// The rows of one path of one scene.
struct Contest {
    std::string scene;
    std::string path;
    std::map<std::string, std::vector<const Json*>> rows; ///< by contestant
};

std::vector<Contest> contestsOf(const Json& rows)
{
    std::vector<Contest> contests;
    for (const Json& row : rows) {
        const std::string scene = row["scene"];
        const std::string path = row["path"];
        if (contests.empty() || contests.back().scene != scene || contests.back().path != path) {
            contests.push_back({scene, path, {}});
        }
        contests.back().rows[row["contestant"]].push_back(&row);
    }
    return contests;
}

using CostOf = std::function<double(const Json& frame)>;

/// Per frame the cost at equal errors; nothing where that is not reached.
std::vector<std::optional<double>> costsPerFrame(const std::vector<const Json*>& rows, const std::string& error,
                                                 const CostOf& costOf)
{
    std::vector<std::optional<double>> costs;
    for (std::size_t f = 0; f < rows.front()->at("frames").size(); ++f) {
        std::vector<CurvePoint> curve;
        for (const Json* row : rows) {
            const Json& frame = row->at("frames")[f];
            curve.push_back({numberOf(frame[error]), costOf(frame)});
        }
        costs.push_back(costAt(kEqualPixels, curve));
    }
    return costs;
}

/// Ratio of sums over the frames in which both reach the error.
struct Comparison {
    std::size_t frames = 0;
    double ratio = 0.0;
};

Comparison compare(const std::vector<std::optional<double>>& ours, const std::vector<std::optional<double>>& other)
{
    Comparison comparison;
    double our = 0.0;
    double their = 0.0;
    for (std::size_t f = 0; f < ours.size(); ++f) {
        if (!ours[f] || !other[f]) { continue; }
        ++comparison.frames;
        our += *ours[f];
        their += *other[f];
    }
    if (their > 0.0) { comparison.ratio = our / their; }
    return comparison;
}

/// Of one of ours with the other that it has the largest ratio to.
Json compareWithBest(const Contest& contest, const std::string& our, const std::vector<std::string>& ours,
                     const std::string& error, const CostOf& costOf)
{
    Json best;
    const auto costs = costsPerFrame(contest.rows.at(our), error, costOf);
    for (const auto& [name, rows] : contest.rows) {
        if (isOneOf(ours, name)) { continue; }
        const Comparison comparison = compare(costs, costsPerFrame(rows, error, costOf));
        if (comparison.frames == 0 || comparison.ratio == 0.0) { continue; }
        if (best.is_null() || comparison.ratio > best["ratio"].get<double>()) {
            best = {{"other", name}, {"ratio", comparison.ratio}, {"frames", comparison.frames}};
        }
    }
    return best;
}

/// The least sum over the frames of any other at the error asked to ours; null without any.
Json ratioAtAsked(const Contest& contest, const std::vector<std::string>& ours, double asked, const CostOf& costOf)
{
    double our = 0.0;
    double least = 0.0;
    for (const auto& [name, rows] : contest.rows) {
        for (const Json* row : rows) {
            if (row->at("errorPixels") != asked) { continue; }
            double sum = 0.0;
            for (const Json& frame : row->at("frames")) { sum += costOf(frame); }
            if (name == ours.front()) {
                our = sum;
            } else if (!isOneOf(ours, name)) {
                least = least == 0.0 ? sum : std::min(least, sum);
            }
        }
    }
    if (our == 0.0 || least == 0.0) { return nullptr; }
    return our / least;
}

/// The largest deviation of what is promised to the error asked, by contestant.
std::map<std::string, double> largestOverAsked(const Json& rows)
{
    std::map<std::string, double> largest;
    for (const Json& row : rows) {
        if (row["errorPixels"].is_null()) { continue; }
        double& ratio = largest[row["contestant"]];
        ratio = std::max(ratio, row["largestPromised"].get<double>() / row["errorPixels"].get<double>());
    }
    return largest;
}

} // namespace

std::optional<double> costAt(double error, const std::vector<CurvePoint>& curve)
{
    const CurvePoint* kept = nullptr;
    for (const CurvePoint& point : curve) {
        if (point.error <= error && (kept == nullptr || point.cost < kept->cost)) { kept = &point; }
    }
    if (kept == nullptr) { return std::nullopt; }
    const CurvePoint* beyond = nullptr;
    for (const CurvePoint& point : curve) {
        if (point.error > error && point.cost < kept->cost && (beyond == nullptr || point.error < beyond->error)) {
            beyond = &point;
        }
    }
    if (beyond == nullptr || !(beyond->cost > 0.0)) { return kept->cost; }
    const double from = std::log(std::max(kept->error, kLeastError));
    const double progress = (std::log(error) - from) / (std::log(beyond->error) - from);
    return std::exp(std::log(kept->cost) + progress * (std::log(beyond->cost) - std::log(kept->cost)));
}

nlohmann::ordered_json summarizeCurves(const nlohmann::ordered_json& rows, const std::vector<std::string>& ours)
{
    const std::vector<Contest> contests = contestsOf(rows);
    const std::vector<std::tuple<const char*, const char*, CostOf>> kinds{
        {"triangles", "largestPixels", trianglesOf},
        {"time", "largestPixels", timeOf},
        {"trianglesInSpace", "largestInSpace", trianglesOf}};
    Json equal{{"pixels", kEqualPixels}, {"rows", Json::array()}};
    std::map<std::string, std::vector<double>> ratios;
    std::vector<double> trianglesAtAsked;
    std::vector<double> timesAtAsked;
    for (const Contest& contest : contests) {
        for (const std::string& our : ours) {
            if (contest.rows.count(our) == 0) { continue; }
            Json row{{"scene", contest.scene},
                     {"path", contest.path},
                     {"contestant", our},
                     {"frames", contest.rows.at(our).front()->at("frames").size()}};
            for (const auto& [kind, error, costOf] : kinds) {
                row[kind] = compareWithBest(contest, our, ours, error, costOf);
                if (our == ours.front() && !row[kind].is_null()) { ratios[kind].push_back(row[kind]["ratio"]); }
            }
            equal["rows"].push_back(row);
        }
        const Json triangles = ratioAtAsked(contest, ours, kEqualPixels, trianglesOf);
        const Json times = ratioAtAsked(contest, ours, kEqualPixels, timeOf);
        if (!triangles.is_null()) { trianglesAtAsked.push_back(triangles); }
        if (!times.is_null()) { timesAtAsked.push_back(times); }
    }
    equal["triangles_over_best_other"] = meanOrNull(ratios["triangles"]);
    equal["time_over_best_other"] = meanOrNull(ratios["time"]);
    equal["triangles_over_best_other_in_space"] = meanOrNull(ratios["trianglesInSpace"]);
    const std::map<std::string, double> largest = largestOverAsked(rows);
    const auto our = largest.find(ours.front());
    return {{"triangles_over_best_other_at_1px", meanOrNull(trianglesAtAsked)},
            {"time_over_best_other_at_1px", meanOrNull(timesAtAsked)},
            {"max_measured_over_asked", our == largest.end() ? Json() : Json(our->second)},
            {"max_measured_over_asked_by_contestant", largest},
            {"equal_error", equal}};
}

ResultTable equalErrorTable(const nlohmann::ordered_json& summary)
{
    ResultTable table;
    table.headers = {"scene",
                     "path",
                     "contestant",
                     "triangles : best other",
                     "which",
                     "frames",
                     "time : best other",
                     "which",
                     "triangles : best other, in space",
                     "which"};
    for (const Json& row : summary["equal_error"]["rows"]) {
        std::vector<std::string> cells{row["scene"], row["path"], row["contestant"]};
        for (const char* kind : {"triangles", "time", "trianglesInSpace"}) {
            const Json& found = row[kind];
            const bool isFound = !found.is_null();
            cells.push_back(isFound ? fmt::format("{:.3f}", found["ratio"].get<double>()) : "–");
            cells.push_back(isFound ? found["other"].get<std::string>() : "–");
            if (std::string(kind) == "triangles") {
                cells.push_back(fmt::format("{} of {}", isFound ? found["frames"].get<std::size_t>() : 0,
                                            row["frames"].get<std::size_t>()));
            }
        }
        table.rows.push_back(std::move(cells));
    }
    return table;
}

} // namespace osgTessLOD::benchmarks
