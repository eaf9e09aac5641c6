// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/DifferenceVectors.h>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

using Eigen::Vector3d;

DifferenceVectors::DifferenceVectors(const PlacedTriangulation& level, const PlacedTriangulation& chart)
{
    const std::vector<OverlaySample> samples = overlay(level, chart);
    _rows.reserve(samples.size());
    for (const OverlaySample& s : samples) {
        _rows.push_back({s.levelTriangle, level.topology.triangles()[s.levelTriangle], chart.topology.triangles()[s.chartTriangle],
                         s.levelWeights, s.chartWeights});
    }
}

DifferenceVectors::DifferenceVectors(unsigned chartFactor, unsigned levelFactor)
    : DifferenceVectors({Triangulation::ofPattern(levelFactor), patternPoints(levelFactor)},
                        {Triangulation::ofPattern(chartFactor), patternPoints(chartFactor)})
{
}

Vector3d DifferenceVectors::difference(const Row& row, const std::vector<Vector3d>& chart,
                                       const std::vector<Vector3d>& level)
{
    const auto blend = [](const auto& vertices, const auto& weights, const std::vector<Vector3d>& positions) -> Vector3d {
        return weights[0] * positions[vertices[0]] + weights[1] * positions[vertices[1]] +
               weights[2] * positions[vertices[2]];
    };
    return blend(row.levelVertices, row.levelWeights, level) - blend(row.chartVertices, row.chartWeights, chart);
}

void DifferenceVectors::evaluate(const std::vector<Vector3d>& chart, const std::vector<Vector3d>& level,
                                 std::vector<Vector3d>& vectors) const
{
    vectors.resize(_rows.size());
    for (std::size_t i = 0; i < _rows.size(); ++i) { vectors[i] = difference(_rows[i], chart, level); }
}

double DifferenceVectors::largest(const std::vector<Vector3d>& chart, const std::vector<Vector3d>& level) const
{
    double squared = 0.0;
    for (const Row& row : _rows) { squared = std::max(squared, difference(row, chart, level).squaredNorm()); }
    return std::sqrt(squared);
}

} // namespace osgTessLOD::bake
