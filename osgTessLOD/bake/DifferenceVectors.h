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
    DifferenceVectors(const PlacedTriangulation& level, const PlacedTriangulation& chart);
    /// Of two patterns with their vertices where the patterns have them.
    DifferenceVectors(unsigned chartFactor, unsigned levelFactor);

    std::size_t size() const { return _rows.size(); }

    /// All of them, from the positions of both meshes' vertices. They keep the order of the overlay.
    void evaluate(const std::vector<Eigen::Vector3d>& chart, const std::vector<Eigen::Vector3d>& level,
                  std::vector<Eigen::Vector3d>& vectors) const;

    /// Largest length of a difference vector: E_iso (Lambert §2.3).
    double largest(const std::vector<Eigen::Vector3d>& chart, const std::vector<Eigen::Vector3d>& level) const;

private:
    struct Row {
        std::array<std::uint32_t, 3> levelVertices;
        std::array<std::uint32_t, 3> chartVertices;
        std::array<double, 3> levelWeights;
        std::array<double, 3> chartWeights;
    };
    static Eigen::Vector3d difference(const Row& row, const std::vector<Eigen::Vector3d>& chart,
                                      const std::vector<Eigen::Vector3d>& level);

    std::vector<Row> _rows;
};

} // namespace osgTessLOD::bake
