// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/DifferenceVectors.h>

#include <algorithm>
#include <cmath>

namespace osgTessLOD::bake {

DifferenceVectors::DifferenceVectors(unsigned chartFactor, unsigned levelFactor)
    : _levelAtChart(PatternResampling::betweenPatterns(levelFactor, chartFactor))
    , _chartAtLevel(PatternResampling::betweenPatterns(chartFactor, levelFactor))
{
}

double DifferenceVectors::largest(const std::vector<Eigen::Vector3d>& chart,
                                  const std::vector<Eigen::Vector3d>& level) const
{
    double squared = 0.0;
    for (std::size_t v = 0; v < chart.size(); ++v) {
        squared = std::max(squared, (_levelAtChart.sample(level, v) - chart[v]).squaredNorm());
    }
    for (std::size_t v = 0; v < level.size(); ++v) {
        squared = std::max(squared, (level[v] - _chartAtLevel.sample(chart, v)).squaredNorm());
    }
    return std::sqrt(squared);
}

} // namespace osgTessLOD::bake
