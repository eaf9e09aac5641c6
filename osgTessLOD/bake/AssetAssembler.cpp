// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/AssetAssembler.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/FinestLevels.h>
#include <osgTessLOD/bake/LevelErrors.h>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace osgTessLOD::bake {

namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using LatticePoint = std::array<std::int32_t, 3>;
using LatticeLevels = std::vector<std::vector<LatticePoint>>;

/// A model farther from the origin than this many times its size gets a frame of its own.
constexpr double kFarAway = 2.0;

/// Working frame → asset frame → lattice.
class LatticeFrame {
public:
    LatticeFrame(const PatchMap& map, const LevelHierarchy& hierarchy)
    {
        const WorkingFrame& frame = map.frame();
        const bool isFar = frame.center.norm() > kFarAway * frame.scale;
        const std::optional<Lattice>& shared = map.lattice();
        _origin = shared  ? Vector3d(shared->origin[0], shared->origin[1], shared->origin[2])
                  : isFar ? frame.center
                          : Vector3d::Zero();
        _shift = frame.center - _origin;
        _scale = frame.scale;
        const AlignedBox3d whole = measure(hierarchy);
        // One lattice for all: fine enough for 17 bits across the largest patch, within 32 bits across the model.
        // Two steps of room for rounding at both ends.
        const double least = std::max(_largestPatch / (Lattice::kMaxOffset - 2), farthest(whole) / kInt32Room);
        _step = shared ? shared->step : static_cast<float>(least);
        if (shared && static_cast<double>(_step) < least) {
            throw AssetError(map.name() + ": a patch is too large for the lattice that tiles share");
        }
        if (!(_step >= std::numeric_limits<float>::min()) || !std::isfinite(_step)) {
            throw AssetError(map.name() + ": its size cannot be expressed in single precision");
        }
    }

    Lattice lattice() const
    {
        Lattice lattice;
        lattice.origin = {_origin.x(), _origin.y(), _origin.z()};
        lattice.step = _step;
        return lattice;
    }
    double scale() const { return _scale; }
    Vector3d toAsset(const Vector3d& working) const { return _shift + _scale * working; }
    LatticePoint toLattice(const Vector3d& working) const
    {
        const Vector3d p = toAsset(working) / static_cast<double>(_step);
        return {static_cast<std::int32_t>(std::lround(p.x())), static_cast<std::int32_t>(std::lround(p.y())),
                static_cast<std::int32_t>(std::lround(p.z()))};
    }
    Vector3d fromLattice(const LatticePoint& p) const
    {
        return static_cast<double>(_step) * Vector3d(p[0], p[1], p[2]);
    }

private:
    static constexpr double kInt32Room = 1 << 30;

    /// The working frame's box around all levels; finds the largest patch.
    AlignedBox3d measure(const LevelHierarchy& hierarchy)
    {
        AlignedBox3d whole;
        for (const PatchLevels& levels : hierarchy.patches) {
            AlignedBox3d box;
            for (const auto& level : levels.positions) {
                for (const Vector3d& p : level) { box.extend(p); }
            }
            _largestPatch = std::max(_largestPatch, box.sizes().maxCoeff() * _scale);
            whole.extend(box);
        }
        return whole;
    }

    /// Of any coordinate, asset frame.
    double farthest(const AlignedBox3d& whole) const
    {
        return std::max(toAsset(whole.min()).cwiseAbs().maxCoeff(), toAsset(whole.max()).cwiseAbs().maxCoeff());
    }

    Vector3d _origin;
    Vector3d _shift;
    double _scale = 1.0;
    double _largestPatch = 0.0; ///< asset frame
    float _step = 0.0F;
};

void copyTopology(const PatchTopology& topology, const std::vector<FinestLevels>& finest, LodAsset& asset)
{
    asset.edges.resize(topology.edges.size());
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
        const PatchTopology::Edge& edge = topology.edges[e];
        asset.edges[e].baseVertices = edge.vertices;
        asset.edges[e].patches = edge.patches;
        asset.edges[e].finestLevel = finest[edge.patches[0]].borders[edge.sides[0]];
        asset.edges[e].coarsestLevel = edge.seamFactor != 0 ? asset.edges[e].finestLevel : std::uint8_t{0};
    }
    asset.patches.resize(topology.patches.size());
    for (std::size_t p = 0; p < topology.patches.size(); ++p) {
        asset.patches[p].baseVertices = topology.patches[p];
        asset.patches[p].edges = topology.patchEdges[p];
        asset.patches[p].finestLevel = finest[p].patch;
    }
}

void copyMaterials(const PatchMap& map, LodAsset& asset)
{
    asset.materials = map.materials();
    if (asset.materials.size() < 2) { return; }
    for (std::uint32_t p = 0; p < asset.patches.size(); ++p) { asset.patchMaterials.push_back(map.materialOf(p)); }
}

/// Sizes the levels for the patches that reach them. Returns the patches' slots in each.
std::vector<std::vector<std::uint32_t>> makeRoom(const LevelHierarchy& hierarchy, LodAsset& asset)
{
    std::vector<std::vector<std::uint32_t>> slots;
    for (std::size_t l = 0; l < hierarchy.ladder.size(); ++l) {
        slots.push_back(asset.levelSlots(l));
        LodLevel& level = asset.levels.emplace_back();
        bool needParameters = false;
        for (std::size_t p = 0; p < slots[l].size(); ++p) {
            if (slots[l][p] == kNoPatch) { continue; }
            level.errors.emplace_back();
            needParameters = needParameters || hierarchy.patches[p].hasParameters(l);
        }
        level.vertices.resize(level.errors.size() * TessellationPattern::vertexCount(hierarchy.ladder[l]));
        if (needParameters) { level.parameters.resize(level.vertices.size()); }
    }
    return slots;
}

/// Everything about one patch that needs its stored positions: vertices, errors, bounds, cone.
class PatchAssembler {
public:
    PatchAssembler(const LatticeFrame& frame, const ChartSet& charts, const LevelHierarchy& hierarchy)
        : _frame(frame)
        , _charts(charts)
        , _hierarchy(hierarchy)
        , _errors(hierarchy.ladder, charts.factor)
    {
        for (const std::uint16_t factor : hierarchy.ladder) { _patterns.emplace_back(factor); }
    }

    /// E_iso of the patch at its finest as it would be stored, without chartError; object units.
    double errorAtFinest(std::size_t p, const FinestLevels& finest) const
    {
        return _errors.atFinest(decoded(p, quantized(p, finest)), reference(p), finest);
    }

    /// `slots`: per level, of each patch that reaches it. Returns the box of all that is ever drawn of the patch: morphs lie
    /// between vertices of levels.
    AlignedBox3d assemble(std::size_t p, const FinestLevels& finest,
                          const std::vector<std::vector<std::uint32_t>>& slots, LodAsset& asset) const
    {
        LodPatch& patch = asset.patches[p];
        patch.chartError = roundUp(chartError(p));
        const LatticeLevels lattice = quantized(p, finest);
        LatticePoint low{};
        low.fill(std::numeric_limits<std::int32_t>::max());
        for (const auto& level : lattice) {
            for (const LatticePoint& point : level) {
                for (std::size_t k = 0; k < 3; ++k) { low[k] = std::min(low[k], point[k]); }
            }
        }
        patch.latticeOrigin = low;

        const PatchLevels stored = decoded(p, lattice);
        const std::vector<LevelVectors> vectors = _errors.measure(stored, reference(p), finest);
        for (std::size_t l = 0; l < lattice.size(); ++l) {
            LodLevel& level = asset.levels[l];
            const std::size_t slot = slots[l][p];
            const std::size_t first = slot * lattice[l].size();
            storeVertices(lattice[l], low, l == 0 ? nullptr : &stored.parents[l], &level.vertices[first]);
            if (!level.parameters.empty()) { storeParameters(stored, l, &level.parameters[first]); }
            level.errors[slot] = errorOf(vectors[l], chartError(p));
        }
        const std::vector<float> cosines = boundNormals(stored.positions, patch);
        for (std::size_t l = 0; l < cosines.size(); ++l) {
            asset.levels[l].errors[slots[l][p]].coneCosine = cosines[l];
        }
        return boundSphere(stored.positions, patch);
    }

private:
    double chartError(std::size_t p) const { return _charts.charts[p].chartError * _frame.scale(); }

    std::vector<Vector3d> reference(std::size_t p) const
    {
        std::vector<Vector3d> positions;
        for (const Vector3d& position : _charts.charts[p].positions) { positions.push_back(_frame.toAsset(position)); }
        return positions;
    }

    LatticeLevels quantized(std::size_t p, const FinestLevels& finest) const
    {
        LatticeLevels lattice(finest.patch + std::size_t{1});
        for (std::size_t level = 0; level < lattice.size(); ++level) {
            for (const Vector3d& position : _hierarchy.patches[p].positions[level]) {
                lattice[level].push_back(_frame.toLattice(position));
            }
        }
        return lattice;
    }

    /// The levels as they decode, asset frame.
    PatchLevels decoded(std::size_t p, const LatticeLevels& lattice) const
    {
        PatchLevels levels = _hierarchy.patches[p];
        levels.positions.resize(lattice.size());
        for (std::size_t level = 0; level < lattice.size(); ++level) {
            std::transform(lattice[level].begin(), lattice[level].end(), levels.positions[level].begin(),
                           [&](const LatticePoint& point) { return _frame.fromLattice(point); });
        }
        return levels;
    }

    static LevelError errorOf(const LevelVectors& vectors, double chartError)
    {
        const double offset = vectors.betweenSamples + chartError;
        LevelError error;
        error.isotropic = fitIsotropic(vectors.drawn, offset);
        error.quadratic = fitQuadratic(vectors.drawn, offset).error;
        return error;
    }

    static float roundUp(double value)
    {
        return std::nextafter(static_cast<float>(value), std::numeric_limits<float>::infinity());
    }

    static void storeVertices(const std::vector<LatticePoint>& points, const LatticePoint& low,
                              const std::vector<std::uint32_t>* parents, LodVertex* vertices)
    {
        for (std::size_t v = 0; v < points.size(); ++v) {
            const LatticePoint offset{points[v][0] - low[0], points[v][1] - low[1], points[v][2] - low[2]};
            vertices[v] = LodVertex::pack(offset, parents != nullptr ? (*parents)[v] : 0);
        }
    }

    void storeParameters(const PatchLevels& levels, std::size_t level, std::uint32_t* parameters) const
    {
        const TessellationPattern& pattern = _patterns[level];
        for (std::uint32_t v = 0; v < pattern.vertexCount(); ++v) {
            const ChartPoint point = levels.hasParameters(level) ? levels.parameters[level][v]
                                                                 : TessellationPattern::chartPoint(pattern.factor(), v);
            parameters[v] = point.bits();
        }
    }

    /// Morphed vertices lie between stored ones, so the stored ones' sphere holds them too.
    static AlignedBox3d boundSphere(const std::vector<std::vector<Vector3d>>& levels, LodPatch& patch)
    {
        AlignedBox3d box;
        for (const auto& level : levels) {
            for (const Vector3d& p : level) { box.extend(p); }
        }
        const Eigen::Vector3f center = box.center().cast<float>();
        double squared = 0.0;
        for (const auto& level : levels) {
            for (const Vector3d& p : level) { squared = std::max(squared, (p - center.cast<double>()).squaredNorm()); }
        }
        patch.boundCenter = {center.x(), center.y(), center.z()};
        // The GPU's single precision positions are within a few ulps of these.
        const double rounding =
            4.0 * std::numeric_limits<float>::epsilon() * box.max().cwiseAbs().cwiseMax(box.min().cwiseAbs()).norm();
        patch.boundRadius = roundUp(std::sqrt(squared) + rounding);
        return {box.min().array() - rounding, box.max().array() + rounding};
    }

    /// Of each level and all coarser ones about one axis.
    std::vector<float> boundNormals(const std::vector<std::vector<Vector3d>>& levels, LodPatch& patch) const
    {
        const auto forEachNormal = [&](std::size_t level, auto&& visit) {
            for (const auto& t : _patterns[level].triangles()) {
                const Vector3d& a = levels[level][t[0]];
                visit(Vector3d((levels[level][t[1]] - a).cross(levels[level][t[2]] - a)));
            }
        };
        Vector3d sum = Vector3d::Zero();
        for (std::size_t level = 0; level < levels.size(); ++level) {
            forEachNormal(level, [&](const Vector3d& n) { sum += n; });
        }
        std::vector<float> cosines(levels.size(), -1.0F);
        if (!(sum.norm() > 0.0)) { return cosines; }
        const Vector3d axis = sum.normalized();
        const Eigen::Vector3f rounded = axis.cast<float>();
        patch.coneAxis = {rounded.x(), rounded.y(), rounded.z()};
        double cosine = 1.0;
        for (std::size_t level = 0; level < levels.size(); ++level) {
            forEachNormal(level, [&](const Vector3d& n) {
                if (n.norm() > 0.0) { cosine = std::min(cosine, axis.dot(n) / n.norm()); }
            });
            // The axis' rounding turns it by less than 1e-6.
            cosines[level] = static_cast<float>(std::max(-1.0, cosine - 1e-6));
        }
        return cosines;
    }

    const LatticeFrame& _frame;
    const ChartSet& _charts;
    const LevelHierarchy& _hierarchy;
    LevelErrors _errors;
    std::vector<TessellationPattern> _patterns;
};

} // namespace

LodAsset assembleAsset(const PatchMap& map, const ChartSet& charts, const LevelHierarchy& hierarchy, double tolerance,
                       Progress& progress)
{
    const PatchTopology& topology = map.topology();
    const LatticeFrame frame(map, hierarchy);
    const PatchAssembler assembler(frame, charts, hierarchy);
    const std::vector<FinestLevels> finest = chooseFinestLevels(
        topology, static_cast<std::uint8_t>(hierarchy.ladder.size() - 1), tolerance * frame.scale(),
        [&](std::uint32_t p, const FinestLevels& levels) { return assembler.errorAtFinest(p, levels); }, progress);

    const std::size_t patches = hierarchy.patches.size();
    progress.begin("errors", patches, "patches");
    LodAsset asset;
    asset.ladder = hierarchy.ladder;
    asset.lattice = frame.lattice();
    copyTopology(topology, finest, asset);
    copyMaterials(map, asset);
    asset.baseVertices.resize(topology.vertexCount);
    for (std::size_t p = 0; p < patches; ++p) {
        for (std::size_t k = 0; k < 3; ++k) {
            asset.baseVertices[topology.patches[p][k]] = frame.toLattice(hierarchy.patches[p].positions[0][k]);
        }
    }
    const std::vector<std::vector<std::uint32_t>> slots = makeRoom(hierarchy, asset);
    std::vector<AlignedBox3d> boxes(patches);
    tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t p) {
        boxes[p] = assembler.assemble(p, finest[p], slots, asset);
        progress.step(1);
    });
    AlignedBox3d box;
    for (const AlignedBox3d& each : boxes) { box.extend(each); }
    for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        asset.boundsMin[k] = std::nextafter(static_cast<float>(box.min()[axis]), -std::numeric_limits<float>::max());
        asset.boundsMax[k] = std::nextafter(static_cast<float>(box.max()[axis]), std::numeric_limits<float>::max());
    }
    progress.end();
    return asset;
}

} // namespace osgTessLOD::bake
