// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/AssetAssembler.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/ErrorFit.h>
#include <osgTessLOD/bake/LevelErrors.h>

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;
using LatticePoint = std::array<std::int32_t, 3>;

/// A model farther from the origin than this many times its size gets a frame of its own.
constexpr double kFarAway = 2.0;

/// Working frame → asset frame → lattice.
class LatticeFrame {
public:
    LatticeFrame(const PatchMap& map, const LevelHierarchy& hierarchy)
    {
        const WorkingFrame& frame = map.frame();
        const bool isFar = frame.center.norm() > kFarAway * frame.scale;
        _origin = isFar ? frame.center : Vector3d::Zero();
        _shift = frame.center - _origin;
        _scale = frame.scale;
        // One lattice for all: fine enough for 17 bits across the largest patch, within 32 bits across the model.
        double largestPatch = 0.0;
        AlignedBox3d whole;
        for (const PatchLevels& levels : hierarchy.patches) {
            AlignedBox3d box;
            for (const auto& level : levels.positions) {
                for (const Vector3d& p : level) { box.extend(p); }
            }
            largestPatch = std::max(largestPatch, box.sizes().maxCoeff());
            whole.extend(box);
        }
        const double farthest = std::max(toAsset(whole.min()).cwiseAbs().maxCoeff(),
                                         toAsset(whole.max()).cwiseAbs().maxCoeff());
        constexpr double kInt32Room = 1 << 30;
        // Two steps of room for rounding at both ends.
        _step = static_cast<float>(std::max(largestPatch * _scale / (Lattice::kMaxOffset - 2), farthest / kInt32Room));
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
    Vector3d fromLattice(const LatticePoint& p) const { return static_cast<double>(_step) * Vector3d(p[0], p[1], p[2]); }

private:
    Vector3d _origin;
    Vector3d _shift;
    double _scale = 1.0;
    float _step = 0.0F;
};

void copyTopology(const PatchTopology& topology, std::uint8_t finestLevel, LodAsset& asset)
{
    asset.edges.resize(topology.edges.size());
    for (std::size_t e = 0; e < topology.edges.size(); ++e) {
        asset.edges[e].baseVertices = topology.edges[e].vertices;
        asset.edges[e].patches = topology.edges[e].patches;
        asset.edges[e].finestLevel = finestLevel;
    }
    asset.patches.resize(topology.patches.size());
    for (std::size_t p = 0; p < topology.patches.size(); ++p) {
        asset.patches[p].baseVertices = topology.patches[p];
        asset.patches[p].edges = topology.patchEdges[p];
        asset.patches[p].finestLevel = finestLevel;
    }
}

bool hasParameters(const PatchLevels& levels, std::size_t level)
{
    return level < levels.parameters.size() && !levels.parameters[level].empty();
}

/// Everything about one patch that needs its stored positions: vertices, errors, bounds, cone.
class PatchAssembler {
public:
    PatchAssembler(const LatticeFrame& frame, const std::vector<std::uint16_t>& ladder, unsigned chartFactor)
        : _frame(frame)
        , _errors(ladder, chartFactor)
    {
        for (const std::uint16_t factor : ladder) { _patterns.emplace_back(factor); }
    }

    void assemble(const PatchChart& chart, const PatchLevels& levels, std::size_t p, LodAsset& asset) const
    {
        LodPatch& patch = asset.patches[p];
        patch.chartError = roundUp(chart.chartError * _frame.scale());
        std::vector<std::vector<LatticePoint>> lattice(levels.positions.size());
        LatticePoint low{};
        low.fill(std::numeric_limits<std::int32_t>::max());
        for (std::size_t level = 0; level < lattice.size(); ++level) {
            for (const Vector3d& position : levels.positions[level]) {
                lattice[level].push_back(_frame.toLattice(position));
                for (std::size_t k = 0; k < 3; ++k) { low[k] = std::min(low[k], lattice[level].back()[k]); }
            }
        }
        patch.latticeOrigin = low;

        PatchLevels stored = levels; // as they decode
        for (std::size_t level = 0; level < lattice.size(); ++level) {
            storeVertices(lattice[level], low, level == 0 ? nullptr : &levels.parents[level],
                          &asset.levels[level].vertices[p * lattice[level].size()]);
            std::vector<std::uint32_t>& parameters = asset.levels[level].parameters;
            if (!parameters.empty()) { storeParameters(levels, level, &parameters[p * lattice[level].size()]); }
            for (std::size_t v = 0; v < lattice[level].size(); ++v) {
                stored.positions[level][v] = _frame.fromLattice(lattice[level][v]);
            }
        }
        measureErrors(chart, stored, p, asset);
        boundSphere(stored.positions, patch);
        boundNormals(stored.positions, patch);
    }

private:
    void measureErrors(const PatchChart& chart, const PatchLevels& stored, std::size_t p, LodAsset& asset) const
    {
        std::vector<Vector3d> reference(chart.positions.size());
        for (std::size_t v = 0; v < reference.size(); ++v) { reference[v] = _frame.toAsset(chart.positions[v]); }
        const std::vector<LevelVectors> vectors = _errors.measure(stored, reference);
        for (std::size_t level = 0; level < vectors.size(); ++level) {
            const double offset = vectors[level].betweenSamples + chart.chartError * _frame.scale();
            LevelError& error = asset.levels[level].errors[p];
            error.isotropic = fitIsotropic(vectors[level].drawn, offset);
            error.quadratic = fitQuadratic(vectors[level].drawn, offset).error;
        }
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
            const ChartPoint point = hasParameters(levels, level)
                                         ? levels.parameters[level][v]
                                         : TessellationPattern::chartPoint(pattern.factor(), v);
            parameters[v] = point.bits();
        }
    }

    /// Morphed vertices lie between stored ones, so the stored ones' sphere holds them too.
    static void boundSphere(const std::vector<std::vector<Vector3d>>& levels, LodPatch& patch)
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
        const double rounding = 4.0 * std::numeric_limits<float>::epsilon() * box.max().cwiseAbs().cwiseMax(box.min().cwiseAbs()).norm();
        patch.boundRadius = roundUp(std::sqrt(squared) + rounding);
    }

    void boundNormals(const std::vector<std::vector<Vector3d>>& levels, LodPatch& patch) const
    {
        const auto forEachNormal = [&](auto&& visit) {
            for (std::size_t level = 0; level < levels.size(); ++level) {
                for (const auto& t : _patterns[level].triangles()) {
                    const Vector3d& a = levels[level][t[0]];
                    visit(Vector3d((levels[level][t[1]] - a).cross(levels[level][t[2]] - a)));
                }
            }
        };
        Vector3d sum = Vector3d::Zero();
        forEachNormal([&](const Vector3d& n) { sum += n; });
        patch.coneCosine = -1.0F;
        patch.coneAxis = {0.0F, 0.0F, 1.0F};
        if (!(sum.norm() > 0.0)) { return; }
        const Vector3d axis = sum.normalized();
        double cosine = 1.0;
        forEachNormal([&](const Vector3d& n) {
            if (n.norm() > 0.0) { cosine = std::min(cosine, axis.dot(n) / n.norm()); }
        });
        const Eigen::Vector3f rounded = axis.cast<float>();
        patch.coneAxis = {rounded.x(), rounded.y(), rounded.z()};
        // The axis' rounding turns it by less than 1e-6.
        patch.coneCosine = static_cast<float>(std::max(-1.0, cosine - 1e-6));
    }

    const LatticeFrame& _frame;
    LevelErrors _errors;
    std::vector<TessellationPattern> _patterns;
};

} // namespace

LodAsset assembleAsset(const PatchMap& map, const ChartSet& charts, const LevelHierarchy& hierarchy, Progress& progress)
{
    const std::size_t patches = hierarchy.patches.size();
    progress.begin("errors", patches, "patches");
    const LatticeFrame frame(map, hierarchy);
    LodAsset asset;
    asset.ladder = hierarchy.ladder;
    asset.lattice = frame.lattice();
    copyTopology(map.topology(), static_cast<std::uint8_t>(hierarchy.ladder.size() - 1), asset);
    asset.baseVertices.resize(map.topology().vertexCount);
    for (std::size_t p = 0; p < patches; ++p) {
        for (std::size_t k = 0; k < 3; ++k) {
            asset.baseVertices[map.topology().patches[p][k]] = frame.toLattice(hierarchy.patches[p].positions[0][k]);
        }
    }
    asset.levels.resize(hierarchy.ladder.size());
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        asset.levels[level].vertices.resize(patches * TessellationPattern::vertexCount(hierarchy.ladder[level]));
        asset.levels[level].errors.resize(patches);
        if (std::any_of(hierarchy.patches.begin(), hierarchy.patches.end(),
                        [&](const PatchLevels& levels) { return hasParameters(levels, level); })) {
            asset.levels[level].parameters.resize(asset.levels[level].vertices.size());
        }
    }
    const PatchAssembler assembler(frame, hierarchy.ladder, charts.factor);
    tbb::parallel_for(std::size_t{0}, patches, [&](std::size_t p) {
        assembler.assemble(charts.charts[p], hierarchy.patches[p], p, asset);
        progress.step(1);
    });
    AlignedBox3d box;
    for (const LodPatch& patch : asset.patches) {
        const Vector3d center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
        box.extend(AlignedBox3d(center.array() - patch.boundRadius, center.array() + patch.boundRadius));
    }
    for (std::size_t k = 0; k < 3; ++k) {
        const auto axis = static_cast<Eigen::Index>(k);
        asset.boundsMin[k] = std::nextafter(static_cast<float>(box.min()[axis]), -std::numeric_limits<float>::max());
        asset.boundsMax[k] = std::nextafter(static_cast<float>(box.max()[axis]), std::numeric_limits<float>::max());
    }
    progress.end();
    return asset;
}

} // namespace osgTessLOD::bake
