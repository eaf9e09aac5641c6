// SPDX-License-Identifier: MIT
#pragma once

#include "CapturedMesh.h"
#include "SelectionTotals.h"

#include <osgTessLOD/render/VideoMemory.h>

#include <osg/Matrixd>

#include <iosfwd>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace osgTessLOD {

/// Times of one frame in milliseconds.
struct FrameTime {
    double cull = 0.0;
    double draw = 0.0;  ///< until the GPU has finished
    double frame = 0.0; ///< all of osgViewer::Viewer::frame(), the GPU finished
};

/// What a headless run drew, as measured in its last frame, and the times of the frames before it.
struct FrameStatistics {
    std::string glVendor;
    std::string glRenderer;
    std::string glVersion;
    int width = 0; ///< of the viewport, pixels
    int height = 0;
    osg::Matrixd view;                 ///< as OSG multiplies: row vectors from the left
    osg::Matrixd projection;           ///< with the near and far planes that were used
    std::optional<double> errorPixels; ///< the largest asked of any drawable; none: no drawables
    SelectionSums selected;
    std::set<std::string> backends; ///< that drew what was selected, by name
    std::optional<CapturedMesh::Counts> captured;
    VideoMemory::Statistics videoMemory;
    std::vector<FrameTime> times;
};

/// Component-wise medians.
FrameTime medianTime(const std::vector<FrameTime>& times);

/// As one JSON object. Matrices are arrays of 16 numbers in OpenGL's order: the translation is numbers 12 to 14.
void writeJson(std::ostream& stream, const FrameStatistics& statistics);
/// A line or two for people.
void writeSummary(std::ostream& stream, const FrameStatistics& statistics);

} // namespace osgTessLOD
