// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/FinestLevels.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

namespace osgTessLOD::bake {

namespace {

/// In a ladder of powers of two, which surfaces with seams have.
std::uint8_t levelOfFactor(unsigned factor)
{
    std::uint8_t level = 0;
    while (factor >> (level + 1U) != 0) { ++level; }
    return level;
}

class FinestLevelChoice {
public:
    FinestLevelChoice(const PatchTopology& topology, std::uint8_t last, double tolerance,
                      const ErrorAtFinest& errorAtFinest, Progress& progress)
        : _topology(topology)
        , _last(last)
        , _errorAtFinest(errorAtFinest)
        , _progress(progress)
        , _seams(topology.patches.size())
        , _finest(topology.patches.size(), last)
        , _allowed(topology.patches.size(), tolerance)
    {
        for (const PatchTopology::Edge& edge : topology.edges) {
            if (edge.seamFactor == 0) { continue; }
            _seams[edge.patches[0]][edge.sides[0]] = levelOfFactor(edge.seamFactor);
        }
    }

    std::vector<FinestLevels> choose()
    {
        forAll([&](std::uint32_t p) {
            _finest[p] = std::max(ownFinest(p), coarsest(p));
            _progress.step(1);
        });
        std::vector<char> isUnsettled(_finest.size(), 1);
        while (raiseNeighbours(isUnsettled)) {}
        return present();
    }

    /// At first all levels.
    std::vector<FinestLevels> present() const
    {
        std::vector<FinestLevels> result;
        for (std::uint32_t p = 0; p < _finest.size(); ++p) { result.push_back(withBorders(p)); }
        return result;
    }

private:
    template <class Visit> void forAll(const Visit& visit) const
    {
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(_finest.size()), visit);
    }

    /// A patch is no coarser than its seams.
    std::uint8_t coarsest(std::uint32_t p) const
    {
        std::uint8_t level = 0;
        for (const std::optional<std::uint8_t>& seam : _seams[p]) { level = std::max(level, seam.value_or(0)); }
        return level;
    }

    /// While its neighbours are as fine. Seams stay at their level.
    double errorAt(std::uint32_t p, std::uint8_t level) const
    {
        FinestLevels finest = FinestLevels::all(level);
        for (std::size_t side = 0; side < 3; ++side) {
            finest.borders[side] = std::min(level, _seams[p][side].value_or(level));
        }
        return _errorAtFinest(p, finest);
    }

    /// The coarsest level from which on a patch is within the tolerance while its neighbours are as fine.
    std::uint8_t ownFinest(std::uint32_t p)
    {
        const double tolerance = _allowed[p];
        _allowed[p] = std::max(tolerance, errorAt(p, _last));
        if (_allowed[p] > tolerance) { return _last; }
        std::uint8_t level = _last;
        while (level > 0 && errorAt(p, static_cast<std::uint8_t>(level - 1)) <= tolerance) { --level; }
        return level;
    }

    /// kNoPatch: open.
    std::uint32_t neighbour(std::uint32_t p, std::size_t side) const
    {
        const std::array<std::uint32_t, 2>& patches = _topology.edges[_topology.patchEdges[p][side]].patches;
        return patches[0] == p ? patches[1] : patches[0];
    }

    FinestLevels withBorders(std::uint32_t p) const
    {
        FinestLevels finest = FinestLevels::all(_finest[p]);
        for (std::size_t side = 0; side < 3; ++side) {
            const std::uint32_t other = neighbour(p, side);
            if (other != kNoPatch) { finest.borders[side] = std::min(_finest[p], _finest[other]); }
            if (_seams[p][side]) { finest.borders[side] = *_seams[p][side]; }
        }
        return finest;
    }

    using Sides = std::array<bool, 3>;

    /// Those borders that have to become finer for the patch. All of them end before the patch and keep it from being
    /// drawn at its finest: a finest one. Lagging, they make it too bad: those that do by themselves, if there are such.
    Sides sidesToRaise(std::uint32_t p) const
    {
        const FinestLevels finest = withBorders(p);
        Sides isLagging{};
        std::optional<std::size_t> best; // of those that can be raised
        for (std::size_t side = 0; side < 3; ++side) {
            if (_seams[p][side]) { continue; }
            isLagging[side] = finest.borders[side] < finest.patch;
            if (!best || finest.borders[side] >= finest.borders[*best]) { best = side; }
        }
        Sides sides{};
        if (*std::max_element(finest.borders.begin(), finest.borders.end()) < finest.patch) {
            if (best) { sides[*best] = true; }
        } else if (isLagging != Sides{} && _errorAtFinest(p, finest) > _allowed[p]) {
            for (std::size_t side = 0; side < 3; ++side) {
                FinestLevels alone = FinestLevels::all(finest.patch);
                alone.borders[side] = finest.borders[side];
                sides[side] = isLagging[side] && _errorAtFinest(p, alone) > _allowed[p];
            }
            if (sides == Sides{}) { return isLagging; }
        }
        return sides;
    }

    /// One round over the unsettled patches: those around which something changed. True if there are any afterwards.
    bool raiseNeighbours(std::vector<char>& isUnsettled)
    {
        std::vector<Sides> toRaise(_finest.size());
        forAll([&](std::uint32_t p) {
            toRaise[p] = isUnsettled[p] != 0 ? sidesToRaise(p) : Sides{};
            _progress.step(0);
        });
        std::vector<char> isRaised(_finest.size(), 0);
        for (std::uint32_t p = 0; p < toRaise.size(); ++p) {
            for (std::size_t side = 0; side < 3; ++side) {
                if (toRaise[p][side]) { isRaised[neighbour(p, side)] = 1; }
            }
        }
        isUnsettled = isRaised;
        for (std::uint32_t p = 0; p < isRaised.size(); ++p) {
            if (isRaised[p] == 0) { continue; }
            ++_finest[p];
            for (std::size_t side = 0; side < 3; ++side) {
                const std::uint32_t other = neighbour(p, side);
                if (other != kNoPatch) { isUnsettled[other] = 1; }
            }
        }
        return std::any_of(isRaised.begin(), isRaised.end(), [](char raised) { return raised != 0; });
    }

    const PatchTopology& _topology;
    std::uint8_t _last;
    const ErrorAtFinest& _errorAtFinest;
    Progress& _progress;
    std::vector<std::array<std::optional<std::uint8_t>, 3>> _seams; ///< their levels, by side
    std::vector<std::uint8_t> _finest;
    std::vector<double> _allowed; ///< error of each patch
};

} // namespace

std::vector<FinestLevels> chooseFinestLevels(const PatchTopology& topology, std::uint8_t last, double tolerance,
                                             const ErrorAtFinest& errorAtFinest, Progress& progress)
{
    FinestLevelChoice choice(topology, last, tolerance, errorAtFinest, progress);
    if (tolerance == 0.0) { return choice.present(); }
    progress.begin("finest levels", topology.patches.size(), "patches");
    std::vector<FinestLevels> finest = choice.choose();
    progress.end();
    return finest;
}

} // namespace osgTessLOD::bake
