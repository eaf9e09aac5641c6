// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/Triangulation.h>

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

/// How far one level of one patch is from its chart: difference vectors reduced to their symmetric hull.
struct LevelVectors {
    std::vector<Eigen::Vector3d> bare;  ///< of the level's own mesh
    /// Of what the run time draws while no border of the patch is below this level: the level's mesh, its morphs
    /// into the next, borders that stay behind while the inside is finer, and the same of all finer levels.
    std::vector<Eigen::Vector3d> drawn;
    /// By how much E of a morph between the sampled ones may exceed that of `drawn`, seen from any direction: the
    /// parabola through three successive samples. An estimate, exact where E is quadratic in the morph's progress.
    double betweenSamples = 0.0;
};

/// Measures the levels of patches. Tables that do not depend on the patch are made once; measuring is thread-safe.
class OSGTESSLOD_EXPORT LevelErrors {
public:
    LevelErrors(std::vector<std::uint16_t> ladder, unsigned chartFactor);
    ~LevelErrors();

    /// One entry per level. `levels` and the chart's positions are in any one frame, the result is too.
    std::vector<LevelVectors> measure(const PatchLevels& levels, const std::vector<Eigen::Vector3d>& chart) const;

    /// Only `bare`: without what the run time makes of the levels.
    std::vector<std::vector<Eigen::Vector3d>> measureBare(const PatchLevels& levels,
                                                          const std::vector<Eigen::Vector3d>& chart) const;

private:
    struct Cache;

    std::vector<std::uint16_t> _ladder;
    Triangulation _chart;
    std::vector<ChartPoint> _chartPoints;
    std::vector<Triangulation> _patterns;              ///< per level
    std::vector<Triangulation> _rims;                  ///< per level: the triangles that have a border vertex
    std::vector<std::vector<ChartPoint>> _places;      ///< per level: of the pattern's vertices
    std::vector<DifferenceVectors> _atPlaces;          ///< per level, with its vertices there
    std::unique_ptr<Cache> _cache;

    std::vector<Eigen::Vector3d> bareVectors(const PatchLevels& levels, std::size_t level,
                                             const std::vector<Eigen::Vector3d>& chart) const;
};

} // namespace osgTessLOD::bake
