// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/ParameterOverlay.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// The difference vectors V = level − chart wherever they can be largest: at the samples of an overlay (Lambert §2.1).
/// One table serves every patch whose vertices lie at the same parameters.
class OSGTESSLOD_EXPORT DifferenceVectors {
public:
    /// V = Σ levelWeights · level − Σ chartWeights · chart: one sample, a row of eq. 4.7.
    struct Row {
        std::uint32_t levelTriangle;
        std::array<std::uint32_t, 3> levelVertices;
        std::array<std::uint32_t, 3> chartVertices;
        std::array<double, 3> levelWeights;
        std::array<double, 3> chartWeights;
    };

    DifferenceVectors(const PlacedTriangulation& level, const PlacedTriangulation& chart);
    /// Of two patterns with their vertices where the patterns have them.
    DifferenceVectors(unsigned chartFactor, unsigned levelFactor);

    const std::vector<Row>& rows() const { return _rows; }

    /// All of them, from the positions of both meshes' vertices. In the order of rows().
    void evaluate(const std::vector<Eigen::Vector3d>& chart, const std::vector<Eigen::Vector3d>& level,
                  std::vector<Eigen::Vector3d>& vectors) const;

    /// Largest length of a difference vector: E_iso (Lambert §2.3).
    double largest(const std::vector<Eigen::Vector3d>& chart, const std::vector<Eigen::Vector3d>& level) const;

private:
    static Eigen::Vector3d difference(const Row& row, const std::vector<Eigen::Vector3d>& chart,
                                      const std::vector<Eigen::Vector3d>& level);

    std::vector<Row> _rows;
};

} // namespace osgTessLOD::bake
