// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/StripMesh.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace osgTessLOD::bake {

/// The patch corners around a base vertex, each reached from the one before by crossing its side corner − 1 (mod 3), so
/// that strip `corner` of one patch goes on as strip `corner` of the next. A base vertex where patches touch without sharing
/// a border has several fans.
struct CornerFan {
    struct Corner {
        std::uint32_t patch;
        unsigned corner;
    };
    std::vector<Corner> corners;
    bool closed = false;
};

/// The fans of all base vertices, in the order of their first patch corners.
OSGTESSLOD_EXPORT std::vector<CornerFan> cornerFans(const PatchTopology& topology);

/// What contracting an edge costs: `error` first, `residual` where that is equal (Lambert §4.6).
struct StripCost {
    double error = 0.0;
    double residual = 0.0;

    /// Of an edge that must not be contracted.
    static StripCost forbidden() { return {std::numeric_limits<double>::infinity(), 0.0}; }
    bool isForbidden() const { return error == std::numeric_limits<double>::infinity(); }
    StripCost operator+(StripCost o) const { return {error + o.error, residual + o.residual}; }
    bool operator<(StripCost o) const { return error != o.error ? error < o.error : residual < o.residual; }
};

/// The x-strips of one fan (Lambert §4.3–4.4): one edge on each lattice line that they cross, the lines of all patches in
/// turn. Lines that two patches share, the borders, are one layer. A strip is given by the edge's index on each layer.
class OSGTESSLOD_EXPORT StripGraph {
public:
    /// A line as a patch of the fan sees it.
    struct Layer {
        std::uint32_t patch;
        unsigned corner;
        unsigned row;
        unsigned width; ///< edges on it
        int shift;      ///< edge i is followed by i + shift or i + shift + 1 on the next layer
    };

    StripGraph(const StripMesh& mesh, const CornerFan& fan);

    /// Of a closed fan the last layer is followed by the first.
    const std::vector<Layer>& layers() const { return _layers; }
    bool closed() const { return _closed; }
    /// Position in a list of all edges of all layers.
    std::size_t edge(std::size_t layer, unsigned index) const { return _offsets[layer] + index; }
    std::size_t edgeCount() const { return _offsets.back(); }

    /// The x-strip of the least total cost (App. A); empty if all pass through forbidden edges. `costs` by edge().
    std::vector<unsigned> optimal(const std::vector<StripCost>& costs) const;
    /// The x-strip that the tessellator's own fractional transition contracts.
    std::vector<unsigned> straight() const;
    StripCost total(const std::vector<unsigned>& strip, const std::vector<StripCost>& costs) const;
    bool isStrip(const std::vector<unsigned>& strip) const;

    /// The part of an x-strip within corner `which` of the fan, as StripLattice::contract takes it.
    std::vector<unsigned> within(std::size_t which, const std::vector<unsigned>& strip) const;

private:
    class Search;

    std::vector<Layer> _layers;
    std::vector<std::size_t> _offsets;
    std::vector<std::size_t> _firstLayers; ///< per corner of the fan
    std::vector<unsigned> _rows;           ///< per corner of the fan
    bool _closed;
};

} // namespace osgTessLOD::bake
