// SPDX-License-Identifier: MIT
#include "FrameStatistics.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iomanip>
#include <ostream>

namespace osgTessLOD {

namespace {

double median(std::vector<double> values)
{
    if (values.empty()) { return 0.0; }
    std::sort(values.begin(), values.end());
    const std::size_t middle = values.size() / 2;
    return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2.0;
}

/// The sixteen numbers as they lie in memory: OSG's rows are OpenGL's columns.
nlohmann::ordered_json toJson(const osg::Matrixd& matrix)
{
    return std::vector<double>(matrix.ptr(), matrix.ptr() + 16);
}

} // namespace

FrameTime medianTime(const std::vector<FrameTime>& times)
{
    const auto medianOf = [&](double FrameTime::*part) {
        std::vector<double> values;
        for (const FrameTime& time : times) { values.push_back(time.*part); }
        return median(values);
    };
    return {medianOf(&FrameTime::cull), medianOf(&FrameTime::draw), medianOf(&FrameTime::frame)};
}

void writeJson(std::ostream& stream, const FrameStatistics& statistics)
{
    nlohmann::ordered_json json;
    json["gl"] = {
        {"vendor", statistics.glVendor}, {"renderer", statistics.glRenderer}, {"version", statistics.glVersion}};
    json["viewport"] = {{"width", statistics.width}, {"height", statistics.height}};
    json["view"] = toJson(statistics.view);
    json["projection"] = toJson(statistics.projection);
    json["errorPixels"] = nullptr;
    if (statistics.errorPixels) { json["errorPixels"] = *statistics.errorPixels; }

    const SelectionSums& selected = statistics.selected;
    json["patchesDrawn"] = selected.patches;
    json["patchesCulled"] = selected.culledPatches;
    json["patchesSaturated"] = selected.saturatedPatches;
    json["triangles"] = selected.triangles;
    json["upperBound"] = selected.isUpperBound;
    json["patchesByFactor"] = nlohmann::ordered_json::object();
    for (const auto& [factor, patches] : selected.patchesByFactor) {
        json["patchesByFactor"][std::to_string(factor)] = patches;
    }
    json["backends"] = statistics.backends;
    if (statistics.captured) {
        json["capture"] = {{"triangles", statistics.captured->triangles},
                           {"degenerateTriangles", statistics.captured->degenerateTriangles},
                           {"faces", statistics.captured->faces},
                           {"vertices", statistics.captured->vertices}};
    }
    json["videoMemory"] = {{"bytes", statistics.videoMemory.bytes},
                           {"wholeBytes", statistics.videoMemory.wholeBytes},
                           {"waitingPages", statistics.videoMemory.waitingPages}};
    const FrameTime time = medianTime(statistics.times);
    json["times"] = {{"frames", statistics.times.size()},
                     {"cullMilliseconds", time.cull},
                     {"drawMilliseconds", time.draw},
                     {"frameMilliseconds", time.frame}};
    stream << json.dump(2) << '\n';
}

void writeSummary(std::ostream& stream, const FrameStatistics& statistics)
{
    const SelectionSums& selected = statistics.selected;
    const FrameTime time = medianTime(statistics.times);
    stream << (selected.isUpperBound ? "at most " : "") << selected.triangles << " triangles in " << selected.patches
           << " patches (" << selected.culledPatches << " culled, " << selected.saturatedPatches << " saturated)";
    if (statistics.errorPixels) { stream << " for an error of " << *statistics.errorPixels << " pixels"; }
    stream << ", " << statistics.width << "x" << statistics.height << '\n';
    stream << "patches per factor:";
    for (const auto& [factor, patches] : selected.patchesByFactor) { stream << "  " << factor << ": " << patches; }
    stream << '\n'
           << std::fixed << std::setprecision(2) << "cull " << time.cull << " ms, draw " << time.draw << " ms, frame "
           << time.frame << " ms; ";
    for (const std::string& backend : statistics.backends) { stream << backend << ", "; }
    stream << statistics.glRenderer << '\n';
}

} // namespace osgTessLOD
