// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/RefinedPatches.h>

#include <osgTessLOD/asset/TessellationPattern.h>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace osgTessLOD::bake {

namespace {

using Eigen::Vector3d;

/// No limits: roots only.
constexpr BisectionForest::Limits kWhole{std::numeric_limits<double>::infinity(), std::numeric_limits<unsigned>::max()};

double distanceToSegment(const Vector3d& p, const Vector3d& a, const Vector3d& b)
{
    const Vector3d along = b - a;
    const double squared = along.squaredNorm();
    const double t = squared > 0.0 ? std::clamp((p - a).dot(along) / squared, 0.0, 1.0) : 0.0;
    return (a + t * along - p).norm();
}

} // namespace

/// An edge of the pattern half as fine, by its ends and its middle in the pattern itself.
struct RefinedPatches::HalvedEdge {
    std::array<std::uint32_t, 2> ends;
    std::uint32_t middle;
};

std::vector<RefinedPatches::HalvedEdge> RefinedPatches::halvedEdges(unsigned factor)
{
    const TessellationPattern coarse(factor / 2);
    std::vector<HalvedEdge> edges;
    for (const auto& t : coarse.triangles()) {
        for (std::size_t k = 0; k < 3; ++k) {
            auto a = TessellationPattern::barycentric(factor / 2, t[k]);
            auto b = TessellationPattern::barycentric(factor / 2, t[(k + 1) % 3]);
            // Weights over 3·factor: those of the coarse pattern doubled; the middle's need not lie on a vertex.
            TessellationPattern::Barycentric middle{};
            for (std::size_t c = 0; c < 3; ++c) {
                middle[c] = a[c] + b[c];
                a[c] *= 2;
                b[c] *= 2;
            }
            const std::uint32_t vertex = TessellationPattern::index(factor, middle);
            if (vertex < TessellationPattern::vertexCount(factor) && TessellationPattern::barycentric(factor, vertex) == middle) {
                edges.push_back({{TessellationPattern::index(factor, a), TessellationPattern::index(factor, b)}, vertex});
            }
        }
    }
    return edges;
}

RefinedPatches::RefinedPatches(std::unique_ptr<PatchMap> base, unsigned factor, double tolerance, Progress& progress)
    : _base(std::move(base))
    , _surface([this](std::uint32_t patch, const Vector3d& b) { return _base->evaluate(patch, b).position; })
    , _forest(_base->topology(), _surface, {}, kWhole)
{
    _frame = _base->frame();
    _name = _base->name();
    refine(factor, tolerance, progress);
    std::vector<std::array<std::uint32_t, 3>> patches;
    _patchOfLeaf.assign(_forest.nodeCount(), BisectionForest::kNone);
    for (std::uint32_t n = 0; n < _forest.nodeCount(); ++n) {
        if (!_forest.isLeaf(n)) { continue; }
        _patchOfLeaf[n] = static_cast<std::uint32_t>(patches.size());
        _leafOfPatch.push_back(n);
        patches.push_back(_forest.corners(n));
    }
    _topology = PatchTopology::build(static_cast<std::uint32_t>(_forest.vertices().size()), std::move(patches));
}

/// Largest distance of a sample of the pattern from the piece between its neighbours in the pattern half as fine, halved: what
/// the pattern itself deviates by at a sharp feature. (Smooth surface deviates by a quarter.)
double RefinedPatches::deviation(std::uint32_t leaf, unsigned factor, const std::vector<HalvedEdge>& edges) const
{
    std::vector<Vector3d> positions(TessellationPattern::vertexCount(factor));
    for (std::uint32_t v = 0; v < positions.size(); ++v) {
        const auto b = TessellationPattern::barycentric(factor, v);
        const FacePoint at = _forest.toPatch({leaf, Vector3d(b[0], b[1], b[2]) / (3.0 * factor)});
        positions[v] = _surface(at.face, at.barycentric);
    }
    double largest = 0.0;
    for (const HalvedEdge& edge : edges) {
        largest = std::max(largest, distanceToSegment(positions[edge.middle], positions[edge.ends[0]], positions[edge.ends[1]]));
    }
    return 0.5 * largest;
}

void RefinedPatches::refine(unsigned factor, double tolerance, Progress& progress)
{
    const std::vector<HalvedEdge> edges = halvedEdges(factor);
    std::vector<std::uint32_t> fresh;
    for (std::uint32_t n = 0; n < _forest.nodeCount(); ++n) { fresh.push_back(n); }
    const std::size_t roots = fresh.size();
    const std::size_t mostLeaves = std::max(kMostGrowth * roots, kAlwaysAllowed);
    progress.begin("refine patches", roots, "patches");
    for (unsigned round = 0; round < kMostBisections && !fresh.empty(); ++round) {
        std::vector<std::pair<double, std::uint32_t>> rough(fresh.size()); // less the deviation, and the leaf
        tbb::parallel_for(std::size_t{0}, fresh.size(), [&](std::size_t i) {
            rough[i] = {-deviation(fresh[i], factor, edges), fresh[i]};
            progress.step(round == 0 ? 1 : 0);
        });
        std::sort(rough.begin(), rough.end());
        const std::size_t before = _forest.nodeCount();
        for (const auto& [lessDeviation, leaf] : rough) {
            const std::size_t leaves = (_forest.nodeCount() + roots) / 2; // every bisection makes two nodes of a leaf
            if (-lessDeviation < tolerance || leaves >= mostLeaves) { break; }
            _forest.bisect({leaf}, _surface);
        }
        fresh.clear();
        for (std::size_t n = before; n < _forest.nodeCount(); ++n) {
            if (_forest.isLeaf(static_cast<std::uint32_t>(n))) { fresh.push_back(static_cast<std::uint32_t>(n)); }
        }
    }
    progress.end();
}

SurfacePoint RefinedPatches::evaluate(std::uint32_t patch, const Vector3d& barycentric) const
{
    const FacePoint at = _forest.toPatch({_leafOfPatch[patch], barycentric});
    return _base->evaluate(at.face, at.barycentric);
}

FacePoint RefinedPatches::fromBase(const FacePoint& basePoint) const
{
    FacePoint inLeaf = _forest.toLeaf(basePoint);
    inLeaf.face = _patchOfLeaf[inLeaf.face];
    return inLeaf;
}

} // namespace osgTessLOD::bake
