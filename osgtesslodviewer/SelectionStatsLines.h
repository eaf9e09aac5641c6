// SPDX-License-Identifier: MIT
#pragma once

#include "SelectionTotals.h"

namespace osg {
class Stats;
}
namespace osgViewer {
class StatsHandler;
}

namespace osgTessLOD {

/// Adds lines to the viewer statistics of osgViewer's StatsHandler (key s, second time): patches, triangles, saturated patches and
/// the error asked. They show what recordSelection() puts into the viewer's Stats.
void addSelectionLines(osgViewer::StatsHandler& handler);

/// Enters what was drawn for one frame. Once per frame, from any thread.
void recordSelection(osg::Stats& viewerStats, unsigned frameNumber, const SelectionSums& sums, double errorPixels);

} // namespace osgTessLOD
