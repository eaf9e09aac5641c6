// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/RefinedPatches.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/SourceSurface.h>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

/// No limits: roots only.
BisectionForest::Limits wholePatches()
{
    BisectionForest::Limits limits{};
    limits.longestEdge = std::numeric_limits<double>::infinity();
    limits.mostPoints = std::numeric_limits<unsigned>::max();
    return limits;
}

/// How errors went from a patch of the base to a piece of a piece of it.
struct Descent {
    double error = 0.0; ///< of the last
    double least = std::numeric_limits<double>::infinity();
    unsigned since = 0; ///< rounds

    void add(double ofPiece)
    {
        constexpr double kFall = 0.8;
        error = ofPiece;
        ++since;
        if (error < kFall * least) {
            least = error;
            since = 0;
        }
    }
    /// A piece that a fold is in may be as bad as the whole for some rounds, but not for ever.
    bool goesDown() const
    {
        constexpr unsigned kPatience = 6;
        return since < kPatience;
    }
};

} // namespace

std::uint32_t RefinedPatches::Round::patchBefore(std::uint32_t patch) const
{
    return cuts.toPatch({leafOfPatch[patch], Vector3d::Constant(1.0 / 3.0)}).face;
}

FacePoint RefinedPatches::Round::from(const FacePoint& before) const
{
    const FacePoint inLeaf = cuts.toLeaf(before);
    if (isWhole[patchOfLeaf[inLeaf.face]] != 0) { return {patchOfLeaf[inLeaf.face], inLeaf.barycentric}; }
    return even->toEven({patchOfLeaf[inLeaf.face], inLeaf.barycentric});
}

FacePoint RefinedPatches::Round::to(const FacePoint& after) const
{
    if (isWhole[after.face] != 0) { return {leafOfPatch[after.face], after.barycentric}; }
    const FacePoint inPatch = even->fromEven(after);
    return cuts.toPatch({leafOfPatch[inPatch.face], inPatch.barycentric});
}

RefinedPatches::RefinedPatches(std::unique_ptr<ControlMesh> base, unsigned factor, double tolerance, Progress& progress)
    : _base(std::move(base))
{
    _frame = _base->frame();
    _name = _base->name();
    _attributes = _base->attributes();
    _materials = _base->materials();
    _topology = _base->topology();
    const std::size_t ofBase = _topology.patches.size();
    const std::size_t ofFew = std::max(kMostGrowthOfFew * ofBase, std::size_t{_base->sourceTriangles()});
    const std::size_t mostPatches = std::max(kMostGrowth * ofBase, std::min(ofFew, kAlwaysAllowed));
    std::vector<FacePoint> samples = samplePoints(_base->source());
    _samples.positions.resize(samples.size());
    _samples.patches.resize(samples.size());
    tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
        _samples.positions[i] = _base->position(samples[i]);
        samples[i] = _base->toPatch(samples[i]);
        _samples.patches[i] = samples[i].face;
    });

    const PatchDistance distance(_base->source());
    const TessellationPattern pattern(factor);
    std::vector<char> isMeasured(_topology.patches.size(), 0);
    std::vector<Descent> descents(_topology.patches.size());
    progress.begin("refine patches", _topology.patches.size(), "patches");
    for (unsigned round = 0; round <= kMostRounds; ++round) {
        const SamplesByPatch byPatch(_samples, _topology.patches.size());
        tbb::parallel_for(std::size_t{0}, descents.size(), [&](std::size_t p) {
            if (isMeasured[p] != 0) { return; }
            std::vector<Vector3d> positions(pattern.vertexCount());
            for (std::uint32_t v = 0; v < positions.size(); ++v) {
                const auto b = TessellationPattern::barycentric(factor, v);
                positions[v] = position({static_cast<std::uint32_t>(p), Vector3d(b[0], b[1], b[2]) / (3.0 * factor)});
            }
            descents[p].add(distance.twoSided(positions, pattern, byPatch, p, tolerance));
            progress.step(round == 0 ? 1 : 0);
        });
        std::vector<std::uint32_t> rough;
        _roughest = 0.0;
        for (std::uint32_t p = 0; p < descents.size(); ++p) {
            _roughest = std::max(_roughest, descents[p].error);
            if (descents[p].error > tolerance && descents[p].goesDown()) { rough.push_back(p); }
        }
        if (rough.empty() || round == kMostRounds || _topology.patches.size() >= mostPatches) { break; }
        std::stable_sort(rough.begin(), rough.end(),
                         [&](std::uint32_t a, std::uint32_t b) { return descents[a].error > descents[b].error; });
        isMeasured = bisect(rough, mostPatches, samples, progress);
        std::vector<Descent> ofPieces;
        for (std::uint32_t p = 0; p < _topology.patches.size(); ++p) {
            ofPieces.push_back(descents[_rounds.back().patchBefore(p)]);
        }
        descents = std::move(ofPieces);
    }
    progress.end();
}

/// Bisects these patches, and others as far as no vertex may hang. Returns which patches are as they were.
std::vector<char> RefinedPatches::bisect(const std::vector<std::uint32_t>& rough, std::size_t mostPatches,
                                         std::vector<FacePoint>& samples, Progress& progress)
{
    const BisectionForest::Surface before = [this](std::uint32_t patch, const Vector3d& b) {
        return position({patch, b});
    };
    BisectionForest cuts(_topology, before, {}, wholePatches());
    const std::size_t roots = cuts.nodeCount();
    for (const std::uint32_t patch : rough) {
        // Every bisection makes two nodes of a leaf.
        if ((cuts.nodeCount() + roots) / 2 >= mostPatches) { break; }
        if (cuts.isLeaf(patch)) { cuts.bisect({patch}, before); }
    }

    std::vector<std::array<std::uint32_t, 3>> patches;
    std::vector<std::uint32_t> leafOfPatch;
    std::vector<std::uint32_t> patchOfLeaf(cuts.nodeCount(), BisectionForest::kNone);
    std::vector<char> isWhole;
    for (std::uint32_t n = 0; n < cuts.nodeCount(); ++n) {
        if (!cuts.isLeaf(n)) { continue; }
        patchOfLeaf[n] = static_cast<std::uint32_t>(patches.size());
        leafOfPatch.push_back(n);
        isWhole.push_back(n < roots ? 1 : 0);
        patches.push_back(cuts.corners(n));
    }
    const BisectionForest::Surface ofLeaf = [&](std::uint32_t patch, const Vector3d& b) {
        progress.step(0);
        return position(cuts.toPatch({leafOfPatch[patch], b}));
    };
    tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
        samples[i] = cuts.toLeaf(samples[i]);
        samples[i].face = patchOfLeaf[samples[i].face];
    });
    std::vector<FacePoint> points;
    const auto vertices = static_cast<std::ptrdiff_t>(_base->source().positions.size());
    std::copy_if(samples.begin(), samples.begin() + vertices, std::back_inserter(points),
                 [&](const FacePoint& point) { return isWhole[point.face] == 0; });
    PatchTopology topology =
        PatchTopology::build(static_cast<std::uint32_t>(cuts.vertices().size()), std::move(patches));
    BisectionForest::Limits limits = _base->parametrizationLimits();
    std::vector<char> isKept = isWhole;
    // Where even parameters have not helped by now, they will not; halving the old ones does.
    if (_rounds.size() >= kEvenRounds) { isKept.assign(isKept.size(), 1); }
    limits.isSpared = isKept;
    auto even =
        std::make_unique<StretchMap>(topology, BisectionForest(topology, ofLeaf, points, limits), isKept, progress);
    tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
        if (isWhole[samples[i].face] == 0) { samples[i] = even->toEven(samples[i]); }
        _samples.patches[i] = samples[i].face;
    });
    _rounds.push_back({std::move(cuts), std::move(leafOfPatch), std::move(patchOfLeaf), isWhole, std::move(even)});
    _topology = std::move(topology);
    return isWhole;
}

SurfacePoint RefinedPatches::evaluate(std::uint32_t patch, const Vector3d& barycentric) const
{
    const FacePoint at = toBase({patch, barycentric});
    return _base->evaluate(at.face, at.barycentric);
}

std::uint16_t RefinedPatches::materialOf(std::uint32_t patch) const
{
    return _base->materialOf(toBase({patch, Vector3d::Constant(1.0 / 3.0)}).face);
}

FacePoint RefinedPatches::fromBase(const FacePoint& basePoint) const
{
    FacePoint point = basePoint;
    for (const Round& round : _rounds) { point = round.from(point); }
    return point;
}

FacePoint RefinedPatches::toBase(const FacePoint& point) const
{
    FacePoint inBase = point;
    for (auto round = _rounds.rbegin(); round != _rounds.rend(); ++round) { inBase = round->to(inBase); }
    return inBase;
}

} // namespace osgTessLOD::bake
