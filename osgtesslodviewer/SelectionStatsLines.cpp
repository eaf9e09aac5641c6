// SPDX-License-Identifier: MIT
#include "SelectionStatsLines.h"

#include <osg/Stats>
#include <osgViewer/ViewerEventHandlers>

namespace osgTessLOD {

namespace {

struct Line {
    const char* label;
    const char* attribute;
    double full; ///< what fills the graph
};

constexpr Line kPatches{"Surface patches", "Surface patches", 1e4};
constexpr Line kTriangles{"Surface triangles", "Surface triangles", 1e6};
constexpr Line kSaturated{"Saturated patches", "Surface saturated patches", 1e4};
constexpr Line kError{"Error asked [px]", "Surface error asked", 16.0};

} // namespace

void addSelectionLines(osgViewer::StatsHandler& handler)
{
    const osg::Vec4 textColor(0.6F, 1.0F, 0.6F, 1.0F);
    const osg::Vec4 barColor(0.6F, 1.0F, 0.6F, 0.5F);
    for (const Line& line : {kPatches, kTriangles, kSaturated, kError}) {
        handler.addUserStatsLine(line.label, textColor, barColor, line.attribute, 1.0F, true, false, "", "",
                                 static_cast<float>(line.full));
    }
}

void recordSelection(osg::Stats& viewerStats, unsigned frameNumber, const SelectionSums& sums, double errorPixels)
{
    viewerStats.setAttribute(frameNumber, kPatches.attribute, static_cast<double>(sums.patches));
    viewerStats.setAttribute(frameNumber, kTriangles.attribute, static_cast<double>(sums.triangles));
    viewerStats.setAttribute(frameNumber, kSaturated.attribute, static_cast<double>(sums.saturatedPatches));
    viewerStats.setAttribute(frameNumber, kError.attribute, errorPixels);
}

} // namespace osgTessLOD
