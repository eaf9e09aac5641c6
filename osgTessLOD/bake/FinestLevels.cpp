// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/FinestLevels.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace osgTessLOD::bake {

namespace {

class FinestLevelChoice {
public:
    FinestLevelChoice(const PatchTopology& topology, std::uint8_t last, double tolerance,
                      const ErrorAtFinest& errorAtFinest, Progress& progress)
        : _topology(topology)
        , _last(last)
        , _errorAtFinest(errorAtFinest)
        , _progress(progress)
        , _finest(topology.patches.size(), last)
        , _allowed(topology.patches.size(), tolerance)
    {
    }

    std::vector<FinestLevels> choose()
    {
        forAll([&](std::uint32_t p) {
            _finest[p] = ownFinest(p);
            _progress.step(1);
        });
        std::vector<char> isUnsettled(_finest.size(), 1);
        while (raiseNeighbours(isUnsettled)) {}
        std::vector<FinestLevels> result;
        for (std::uint32_t p = 0; p < _finest.size(); ++p) { result.push_back(withBorders(p)); }
        return result;
    }

private:
    template <class Visit> void forAll(const Visit& visit) const
    {
        tbb::parallel_for(std::uint32_t{0}, static_cast<std::uint32_t>(_finest.size()), visit);
    }

    /// The coarsest level from which on a patch is within the tolerance while its neighbours are as fine.
    std::uint8_t ownFinest(std::uint32_t p)
    {
        const double tolerance = _allowed[p];
        _allowed[p] = std::max(tolerance, _errorAtFinest(p, FinestLevels::all(_last)));
        if (_allowed[p] > tolerance) { return _last; }
        std::uint8_t level = _last;
        while (level > 0 && _errorAtFinest(p, FinestLevels::all(level - 1U)) <= tolerance) { --level; }
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
        }
        return finest;
    }

    using Sides = std::array<bool, 3>;

    /// Those borders that have to become finer for the patch. All of them end before the patch and keep it from being
    /// drawn at its finest: a finest one. Lagging, they make it too bad: those that do by themselves, if there are such.
    Sides sidesToRaise(std::uint32_t p) const
    {
        const FinestLevels finest = withBorders(p);
        const auto [coarsest, best] = std::minmax_element(finest.borders.begin(), finest.borders.end());
        Sides sides{};
        if (*best < finest.patch) {
            sides[static_cast<std::size_t>(best - finest.borders.begin())] = true;
        } else if (*coarsest < finest.patch && _errorAtFinest(p, finest) > _allowed[p]) {
            Sides isLagging{};
            for (std::size_t side = 0; side < 3; ++side) {
                isLagging[side] = finest.borders[side] < finest.patch;
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
    std::vector<std::uint8_t> _finest;
    std::vector<double> _allowed; ///< error of each patch
};

} // namespace

std::vector<FinestLevels> chooseFinestLevels(const PatchTopology& topology, std::uint8_t last, double tolerance,
                                             const ErrorAtFinest& errorAtFinest, Progress& progress)
{
    if (tolerance == 0.0) { return std::vector<FinestLevels>(topology.patches.size(), FinestLevels::all(last)); }
    progress.begin("finest levels", topology.patches.size(), "patches");
    std::vector<FinestLevels> finest = FinestLevelChoice(topology, last, tolerance, errorAtFinest, progress).choose();
    progress.end();
    return finest;
}

} // namespace osgTessLOD::bake
