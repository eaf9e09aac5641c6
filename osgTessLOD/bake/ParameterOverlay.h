// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/ChartPoint.h>
#include <osgTessLOD/bake/Triangulation.h>

#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// One triangulation of the parameter triangle: who is joined to whom, and where they are. Keeps references.
struct PlacedTriangulation {
    const Triangulation& topology;
    const std::vector<ChartPoint>& points; ///< one per vertex
};

/// A point of the parameter triangle as both triangulations have it: a triangle and its corners' weights, sum 1.
struct OverlaySample {
    std::uint32_t levelTriangle;
    std::uint32_t chartTriangle;
    std::array<double, 3> levelWeights;
    std::array<double, 3> chartWeights;
};

/// Where functions that are linear on the triangles of a level and of a chart can differ most (Lambert fig. 2.2): at the
/// vertices of both and where their edges cross. The chart is a triangulation of the whole parameter triangle, all
/// triangles counter-clockwise. The level need not be one: part of a triangulation, or triangles that are turned over,
/// degenerate or over one another (as while it morphs) give the samples of each triangle's map into the parameter
/// triangle. Decisions are exact; weights are rounded quotients of exact integers. Each vertex and each crossing gives
/// one sample, also where edges lie on one another, unless triangles of the level do.
/// Walks along the level's edges through the chart: linear in the number of samples.
OSGTESSLOD_EXPORT std::vector<OverlaySample> overlay(const PlacedTriangulation& level, const PlacedTriangulation& chart);

} // namespace osgTessLOD::bake
