// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/PatternResampling.h>

#include <Eigen/Core>
#include <vector>

namespace osgTessLOD::bake {

/// The difference vectors between a level and its chart at the vertices of both (Lambert §2.1), for one pair of patterns;
/// the same tables serve every patch.
class DifferenceVectors {
public:
    DifferenceVectors(unsigned chartFactor, unsigned levelFactor);

    /// Largest length of a difference vector: E_iso (Lambert §2.3) over these samples.
    double largest(const std::vector<Eigen::Vector3d>& chart, const std::vector<Eigen::Vector3d>& level) const;

private:
    PatternResampling _levelAtChart;
    PatternResampling _chartAtLevel;
};

} // namespace osgTessLOD::bake
