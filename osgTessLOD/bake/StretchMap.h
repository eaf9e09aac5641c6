// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/bake/BisectionForest.h>
#include <osgTessLOD/bake/CollapseHistory.h>
#include <osgTessLOD/bake/PatchTopology.h>
#include <osgTessLOD/bake/Progress.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace osgTessLOD::bake {

/// A bijective, piecewise linear map of every patch onto itself after which the patches' parameters are spread evenly over
/// the surface: what collapses squeezed together is given room again. Borders are parametrized by their length on
/// the surface, the same for both patches, and the inside is embedded evenly (StretchEmbedding). Where rounding does not let that be
/// bijective, a patch keeps its parameters.
class StretchMap {
public:
    /// `forest` is the triangulation on whose leaves the map is linear. Patches with `isKept` (empty: none) keep their
    /// parameters.
    StretchMap(const PatchTopology& topology, BisectionForest forest, const std::vector<char>& isKept, Progress& progress);

    /// From the parameters given by the collapses to even ones, and back (face = patch).
    FacePoint toEven(const FacePoint& point) const;
    FacePoint fromEven(const FacePoint& point) const;

    /// Patches that keep their parameters.
    std::size_t keptPatches() const { return _keptPatches; }

    /// Throws std::logic_error if a leaf is turned over or a patch's leaves do not cover it.
    void validate() const;

private:
    /// Leaves of one patch by the cells of a regular grid over its parameters.
    struct Locator {
        unsigned resolution = 1;
        std::vector<std::uint32_t> firstInCell;
        std::vector<std::uint32_t> leaves;
    };

    using Leaves = std::vector<std::uint32_t>;

    void spreadBorder(const PatchTopology::Edge& edge, const Leaves& leaves);
    void keepBorder(const PatchTopology::Edge& edge, const Leaves& leaves);
    bool embedPatch(const PatchTopology& topology, std::uint32_t patch, const Leaves& leaves);
    void keepPatch(const Leaves& leaves);
    void embedPatches(const PatchTopology& topology, const std::vector<Leaves>& leaves, const std::vector<char>& isKept,
                      Progress& progress);
    Locator makeLocator(const Leaves& leaves) const;
    static unsigned cell(const Locator& locator, double coordinate);

    BisectionForest _forest;
    std::vector<std::array<Eigen::Vector2d, 3>>
        _even;                      ///< per node: its corners' even parameters (weights of corners 1, 2)
    std::vector<double> _alongEdge; ///< per forest vertex on a border: share of the border's length before it
    std::vector<Locator> _locators;
    std::size_t _keptPatches = 0;
};

} // namespace osgTessLOD::bake
