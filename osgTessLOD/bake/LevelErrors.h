// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/Triangulation.h>

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

namespace osgTessLOD::bake {

/// How far one level of one patch is from its chart: difference vectors reduced to their symmetric hull.
struct LevelVectors {
    std::vector<Eigen::Vector3d> bare; ///< of the level's mesh, its borders as near to the level as they get
    /// Of what the run time draws while no border of the patch is below this level, or below its own finest where that
    /// is coarser: the level's mesh, its morphs into the next, borders that stay behind while the inside is finer, and
    /// the same of all finer levels.
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

    /// One entry per level up to the patch's finest. `levels` and the chart's positions are in any one frame, the result
    /// is too.
    std::vector<LevelVectors> measure(const PatchLevels& levels, const std::vector<Eigen::Vector3d>& chart,
                                      const FinestLevels& finest) const;
    /// Of a patch that has all levels, as its neighbours do.
    std::vector<LevelVectors> measure(const PatchLevels& levels, const std::vector<Eigen::Vector3d>& chart) const;

    /// E_iso of the finest level alone: length of the longest of measure(…).back().drawn.
    double atFinest(const PatchLevels& levels, const std::vector<Eigen::Vector3d>& chart,
                    const FinestLevels& finest) const;

private:
    struct Cache;

    /// A mesh that is drawn, and the samples at which it can differ most from the chart.
    struct DrawnMesh {
        std::shared_ptr<const DifferenceVectors> table;
        std::vector<Eigen::Vector3d> positions;

        /// Symmetric hull of the difference vectors.
        std::vector<Eigen::Vector3d> hull(const std::vector<Eigen::Vector3d>& chart) const;
    };

    std::vector<std::uint16_t> _ladder;
    Triangulation _chart;
    std::vector<ChartPoint> _chartPoints;
    std::vector<Triangulation> _patterns;              ///< per level
    std::vector<Triangulation> _rims;                  ///< per level: the triangles that have a border vertex
    std::vector<std::vector<ChartPoint>> _places;      ///< per level: of the pattern's vertices
    /// Per level, with its vertices there.
    std::vector<std::shared_ptr<const DifferenceVectors>> _atPlaces;
    std::unique_ptr<Cache> _cache;

    /// These triangles of the pattern that `patchLevel` is drawn with.
    DrawnMesh morph(const PatchLevels& levels, const Triangulation& triangles, double patchLevel,
                    const std::array<double, 3>& borderLevels) const;
    /// All of a level.
    DrawnMesh whole(const PatchLevels& levels, std::size_t level, const FinestLevels& finest) const;
};

} // namespace osgTessLOD::bake
