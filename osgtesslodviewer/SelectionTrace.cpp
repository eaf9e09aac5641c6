// SPDX-License-Identifier: MIT
#include "SelectionTrace.h"

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/GpuAsset.h>

#include <nlohmann/json.hpp>

#include <algorithm>

namespace osgTessLOD {

namespace {

nlohmann::ordered_json numbersOf(const osg::Matrixd& matrix)
{
    return std::vector<double>(matrix.ptr(), matrix.ptr() + 16);
}

/// Each [patch, level of side 0, 1, 2], by patch.
nlohmann::ordered_json patchesOf(std::vector<PatchRecord> records)
{
    std::sort(records.begin(), records.end(),
              [](const PatchRecord& a, const PatchRecord& b) { return a.patch < b.patch; });
    nlohmann::ordered_json patches = nlohmann::ordered_json::array();
    for (const PatchRecord& record : records) {
        patches.push_back({record.patch, record.edgeLevels[0], record.edgeLevels[1], record.edgeLevels[2]});
    }
    return patches;
}

nlohmann::ordered_json selectionOf(const FrameSelection& entry)
{
    const SelectionStatistics& statistics = entry.selection->statistics();
    const SelectionView& view = entry.selection->view();
    return {{"source", entry.drawable->getGpuAsset()->asset().source},
            {"errorPixels", entry.drawable->getOptions().errorPixels},
            {"localToWorld", numbersOf(entry.localToWorld)},
            {"eye", {view.eye.x(), view.eye.y(), view.eye.z()}},
            {"pixelScale", view.pixelScale},
            {"patchesDrawn", statistics.patches},
            {"patchesCulled", statistics.culledPatches},
            {"patchesSaturated", statistics.saturatedPatches},
            {"triangles", statistics.triangles},
            {"upperBound", statistics.isUpperBound},
            {"patches", patchesOf(entry.selection->records().vector())}};
}

} // namespace

SelectionTrace::SelectionTrace(const std::string& path)
    : _file(path)
{
}

void SelectionTrace::addFrame(unsigned number, const osg::Matrixd& view, const std::vector<FrameSelection>& selections)
{
    nlohmann::ordered_json frame{{"frame", number}, {"view", numbersOf(view)}};
    frame["selections"] = nlohmann::ordered_json::array();
    for (const FrameSelection& entry : selections) { frame["selections"].push_back(selectionOf(entry)); }
    _file.stream() << frame.dump() << '\n';
}

void SelectionTrace::commit()
{
    _file.commit();
}

} // namespace osgTessLOD
