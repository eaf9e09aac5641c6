// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/UniformLevels.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/PatternResampling.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;
using Positions = std::vector<Vector3d>;

Vector3d onFlatPatch(const std::array<Vector3d, 3>& corners, unsigned factor, std::uint32_t vertex)
{
    const auto b = TessellationPattern::barycentric(factor, vertex);
    return (b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2]) / (3.0 * factor);
}

/// One step down the ladder, the same for every patch: where each coarse vertex lies in the fine pattern, and that
/// vertex's neighbours there.
class Coarsening {
public:
    Coarsening(unsigned fine, unsigned coarse)
        : _fine(fine)
        , _coarse(coarse)
        , _neighbours(TessellationPattern::vertexCount(fine))
    {
        const TessellationPattern pattern(fine);
        for (const auto& t : pattern.triangles()) {
            for (std::size_t k = 0; k < 3; ++k) {
                addNeighbour(t[k], t[(k + 1) % 3]);
                addNeighbour(t[(k + 1) % 3], t[k]);
            }
        }
        const unsigned scale = fine / coarse;
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(coarse); ++v) {
            auto b = TessellationPattern::barycentric(coarse, v);
            for (auto& weight : b) { weight *= scale; }
            _inFine.push_back(TessellationPattern::index(fine, b));
        }
    }

    /// Interior vertices of the coarse level: half of a fine vertex's displacement, half of its neighbours' mean.
    void filterInterior(const std::array<Vector3d, 3>& corners, const Positions& fine, Positions& coarse) const
    {
        const auto displacement = [&](std::uint32_t v) -> Vector3d { return fine[v] - onFlatPatch(corners, _fine, v); };
        for (std::uint32_t v = TessellationPattern::borderVertexCount(_coarse); v < coarse.size(); ++v) {
            const auto& around = _neighbours[_inFine[v]];
            Vector3d sum = Vector3d::Zero();
            for (const std::uint32_t neighbour : around) { sum += displacement(neighbour); }
            coarse[v] = onFlatPatch(corners, _coarse, v) + 0.5 * displacement(_inFine[v]) +
                        0.5 / static_cast<double>(around.size()) * sum;
        }
    }

    /// Border vertex `step` of the coarse level: ¼, ½, ¼ along the fine border. `fine` runs along it, ends included.
    static Vector3d filterBorder(const Positions& fine, unsigned step)
    {
        const std::size_t at = std::size_t{2} * step;
        // Filtering the displacements from the straight border is filtering the positions: the weights are symmetric.
        return 0.5 * fine[at] + 0.25 * (fine[at - 1] + fine[at + 1]);
    }

private:
    void addNeighbour(std::uint32_t v, std::uint32_t neighbour)
    {
        auto& list = _neighbours[v];
        if (std::find(list.begin(), list.end(), neighbour) == list.end()) { list.push_back(neighbour); }
    }

    unsigned _fine;
    unsigned _coarse;
    std::vector<std::vector<std::uint32_t>> _neighbours;
    std::vector<std::uint32_t> _inFine;
};

std::array<Vector3d, 3> cornersOf(const Positions& positions, unsigned factor)
{
    return {positions[0], positions[factor], positions[2 * factor]};
}

/// Filters every border once, for both of its patches.
void coarsenBorders(const PatchTopology& topology, unsigned fine, unsigned coarse, std::size_t level,
                    LevelHierarchy& hierarchy)
{
    tbb::parallel_for(std::size_t{0}, topology.edges.size(), [&](std::size_t e) {
        const PatchTopology::Edge& edge = topology.edges[e];
        const Positions& finer = hierarchy.patches[edge.patches[0]].positions[level + 1];
        Positions along(fine + 1);
        for (unsigned step = 0; step <= fine; ++step) { along[step] = finer[borderVertex(edge, 0, fine, step)]; }
        for (unsigned step = 1; step < coarse; ++step) {
            const Vector3d position =
                edge.seamFactor != 0 ? along[std::size_t{2} * step] : Coarsening::filterBorder(along, step);
            for (unsigned which = 0; which < 2; ++which) {
                if (edge.patches[which] == kNoPatch) { continue; }
                hierarchy.patches[edge.patches[which]].positions[level][borderVertex(edge, which, coarse, step)] = position;
            }
        }
    });
}

void linkLevels(const PatchTopology& topology, const std::vector<std::uint16_t>& ladder, std::uint32_t patch,
                const std::vector<std::vector<std::uint32_t>>& ancestors, PatchLevels& levels)
{
    levels.parents.resize(ladder.size());
    if (ladder.size() > 1) { levels.parents[1] = parentsInTriangle(topology, patch, levels.positions[1]); }
    for (std::size_t level = 2; level < ladder.size(); ++level) { levels.parents[level] = ancestors[level]; }
}

} // namespace

LevelHierarchy makeUniformLevels(const PatchTopology& topology, const ChartSet& charts,
                                 const std::vector<std::uint16_t>& ladder, Progress& progress)
{
    LevelHierarchy hierarchy;
    hierarchy.ladder = ladder;
    hierarchy.patches.resize(topology.patches.size());
    const std::size_t finest = ladder.size() - 1;
    progress.begin("levels", topology.patches.size() * ladder.size(), "patch levels");

    const auto finestSamples = PatternResampling::betweenPatterns(charts.factor, ladder[finest]);
    tbb::parallel_for(std::size_t{0}, hierarchy.patches.size(), [&](std::size_t p) {
        auto& positions = hierarchy.patches[p].positions;
        positions.resize(ladder.size());
        for (std::size_t level = 0; level <= finest; ++level) {
            positions[level].resize(TessellationPattern::vertexCount(ladder[level]));
        }
        for (std::size_t v = 0; v < finestSamples.size(); ++v) {
            positions[finest][v] = finestSamples.sample(charts.charts[p].positions, v);
        }
        progress.step(1);
    });

    for (const PatchTopology::Edge& edge : topology.edges) {
        for (unsigned step = 1; edge.seamFactor != 0 && step < ladder[finest]; ++step) {
            hierarchy.patches[edge.patches[0]].positions[finest][borderVertex(edge, 0, ladder[finest], step)] =
                borderPosition(charts, edge, ladder[finest], step);
        }
    }

    std::vector<std::vector<std::uint32_t>> ancestors(ladder.size());
    for (std::size_t level = finest; level-- > 0;) {
        const unsigned fine = ladder[level + 1];
        const unsigned coarse = ladder[level];
        const Coarsening coarsening(fine, coarse);
        coarsenBorders(topology, fine, coarse, level, hierarchy);
        tbb::parallel_for(std::size_t{0}, hierarchy.patches.size(), [&](std::size_t p) {
            auto& positions = hierarchy.patches[p].positions;
            const auto corners = cornersOf(positions[level + 1], fine);
            for (unsigned k = 0; k < 3; ++k) { positions[level][k * coarse] = corners[k]; }
            coarsening.filterInterior(corners, positions[level + 1], positions[level]);
            progress.step(1);
        });
        for (std::uint32_t v = 0; coarse >= 2 && v < TessellationPattern::vertexCount(fine); ++v) {
            ancestors[level + 1].push_back(TessellationPattern::tessellatorAncestor(fine, v, coarse));
        }
    }
    tbb::parallel_for(std::size_t{0}, hierarchy.patches.size(), [&](std::size_t p) {
        linkLevels(topology, ladder, static_cast<std::uint32_t>(p), ancestors, hierarchy.patches[p]);
    });
    progress.end();
    return hierarchy;
}

} // namespace osgTessLOD::bake
