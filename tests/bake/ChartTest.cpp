// SPDX-License-Identifier: MIT
// From charts to an asset: sampling, levels, difference vectors, normals, quantization, distances.
#include <bake/ProceduralMeshes.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/ControlMesh.h>
#include <osgTessLOD/bake/DifferenceVectors.h>
#include <osgTessLOD/bake/NormalBaker.h>
#include <osgTessLOD/bake/PatchChart.h>
#include <osgTessLOD/bake/PatternResampling.h>
#include <osgTessLOD/bake/SurfaceDistance.h>
#include <osgTessLOD/bake/UniformLevels.h>

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace osgTessLOD::bake {
namespace {

using Eigen::Vector3d;

Vector3d asItIs(const Vector3d& p) { return p; }
Vector3d outwards(const Vector3d& p) { return p.normalized(); }
Vector3d upwards(const Vector3d&) { return Vector3d::UnitZ(); }
/// A sphere with bumps, of about unit diagonal.
Vector3d bumpySphere(const Vector3d& p)
{
    const Vector3d d = p.normalized();
    return d * (0.28 + 0.02 * std::sin(9.0 * d.x()) * std::cos(7.0 * d.y() + 4.0 * d.z()));
}

/// A control mesh with straight patches, bent by a function of space.
class BentMap : public PatchMap {
public:
    BentMap(PatchTopology topology, std::vector<Vector3d> corners, Vector3d (*bend)(const Vector3d&),
            Vector3d (*normal)(const Vector3d&))
        : _corners(std::move(corners))
        , _bend(bend)
        , _normal(normal)
    {
        _topology = std::move(topology);
        _name = "bent";
    }
    void setFrame(const Vector3d& center, double scale)
    {
        _frame.center = center;
        _frame.scale = scale;
    }
    std::uint64_t sourceTriangles() const override { return 1000; }
    SurfacePoint evaluate(std::uint32_t patch, const Vector3d& b) const override
    {
        const auto& c = _topology.patches[patch];
        const Vector3d p = b[0] * _corners[c[0]] + b[1] * _corners[c[1]] + b[2] * _corners[c[2]];
        return {_bend(p), _normal(p)};
    }

private:
    std::vector<Vector3d> _corners;
    Vector3d (*_bend)(const Vector3d&);
    Vector3d (*_normal)(const Vector3d&);
};

std::unique_ptr<BentMap> makeBumpySphere()
{
    return std::make_unique<BentMap>(
        PatchTopology::build(6, {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}),
        std::vector<Vector3d>{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}, bumpySphere, outwards);
}

/// Two straight patches that form a skew quadrilateral in the plane z = 0.1.
std::unique_ptr<BentMap> makeFlat()
{
    return std::make_unique<BentMap>(
        PatchTopology::build(4, {{0, 1, 2}, {0, 2, 3}}),
        std::vector<Vector3d>{{-0.4, -0.3, 0.1}, {0.37, -0.31, 0.1}, {0.45, 0.29, 0.1}, {-0.33, 0.35, 0.1}}, asItIs, upwards);
}

std::unique_ptr<ControlMesh> makeScanLike()
{
    ControlMeshOptions options;
    options.patches = 16;
    Progress progress;
    return std::make_unique<ControlMesh>(noisy(openGrid(24), 0.01, 21), options, progress);
}

const std::vector<std::uint16_t> kLadder{1, 2, 4, 8};

/// Everything a bake makes of a map, at factors 1 to 8.
struct Baked {
    std::unique_ptr<PatchMap> map;
    ChartSet charts;
    LevelHierarchy hierarchy;
    LodAsset asset;
};

Baked bakeMap(std::unique_ptr<PatchMap> map)
{
    Progress progress;
    Baked baked;
    baked.map = std::move(map);
    baked.charts = makeCharts(*baked.map, 16, progress);
    baked.hierarchy = makeUniformLevels(baked.map->topology(), baked.charts, kLadder, progress);
    baked.asset = assembleAsset(*baked.map, baked.charts, baked.hierarchy, 0.0, progress);
    baked.asset.technique = "uniform";
    baked.asset.source = "test";
    baked.asset.sourceTriangles = baked.map->sourceTriangles();
    return baked;
}

struct NamedMap {
    const char* name;
    std::unique_ptr<PatchMap> (*make)();
};

class Charts : public testing::TestWithParam<NamedMap> {
protected:
    Baked bake() const { return bakeMap(GetParam().make()); }
};

INSTANTIATE_TEST_SUITE_P(Maps, Charts,
                         testing::Values(NamedMap{"BumpySphere", [] { return std::unique_ptr<PatchMap>(makeBumpySphere()); }},
                                         NamedMap{"Flat", [] { return std::unique_ptr<PatchMap>(makeFlat()); }},
                                         NamedMap{"ScanLike", [] { return std::unique_ptr<PatchMap>(makeScanLike()); }}),
                         [](const auto& test) { return std::string(test.param.name); });

// ---------------------------------------------------------------------------------------------------------- charts ---

TEST_P(Charts, SampleTheMapAtThePatternsVertices)
{
    const Baked baked = bake();
    for (std::uint32_t p = 0; p < baked.charts.charts.size(); ++p) {
        const PatchChart& chart = baked.charts.charts[p];
        ASSERT_EQ(chart.positions.size(), TessellationPattern::vertexCount(16));
        ASSERT_EQ(chart.normals.size(), chart.positions.size());
        for (std::uint32_t v = 0; v < chart.positions.size(); ++v) {
            const auto b = TessellationPattern::barycentric(16, v);
            const SurfacePoint at = baked.map->evaluate(p, Vector3d(b[0], b[1], b[2]) / 48.0);
            EXPECT_LT((chart.positions[v] - at.position).norm(), 1e-9);
            EXPECT_NEAR(static_cast<double>(chart.normals[v].norm()), 1.0, 1e-6);
        }
    }
}

/// Values of both patches along each shared edge, and of all patches at each base vertex, are the same bits.
template <typename ValuesOf>
void expectSharedBitsEqual(const PatchTopology& topology, unsigned factor, ValuesOf valuesOf)
{
    for (const auto& edge : topology.edges) {
        if (edge.patches[1] == kNoPatch) { continue; }
        for (unsigned step = 0; step <= factor; ++step) {
            ASSERT_EQ(valuesOf(edge.patches[0])[borderVertex(edge, 0, factor, step)],
                      valuesOf(edge.patches[1])[borderVertex(edge, 1, factor, step)])
                << "step " << step << " of factor " << factor;
        }
    }
    using Value = std::decay_t<decltype(valuesOf(0)[0])>;
    std::map<std::uint32_t, Value> atBase;
    for (std::uint32_t p = 0; p < topology.patches.size(); ++p) {
        for (std::uint32_t k = 0; k < 3; ++k) {
            const auto [known, ignored] = atBase.try_emplace(topology.patches[p][k], valuesOf(p)[k * factor]);
            ASSERT_EQ(known->second, valuesOf(p)[k * factor]);
        }
    }
}

TEST_P(Charts, SharedBordersHaveTheSameBits)
{
    const Baked baked = bake();
    const PatchTopology& topology = baked.map->topology();
    expectSharedBitsEqual(topology, 16, [&](std::uint32_t p) -> auto& { return baked.charts.charts[p].positions; });
    expectSharedBitsEqual(topology, 16, [&](std::uint32_t p) -> auto& { return baked.charts.charts[p].normals; });
    for (std::size_t level = 0; level < kLadder.size(); ++level) {
        expectSharedBitsEqual(topology, kLadder[level],
                              [&](std::uint32_t p) -> auto& { return baked.hierarchy.patches[p].positions[level]; });
    }
}

TEST(BorderVertex, RunsAlongTheEdgeFromEitherSide)
{
    const PatchTopology topology = PatchTopology::build(4, {{0, 1, 2}, {0, 2, 3}});
    const auto& edge = topology.edges[2]; // side 2 of patch 0, from vertex 2 to vertex 0; side 0 of patch 1
    EXPECT_EQ(borderVertex(edge, 0, 8, 0), 16U);
    EXPECT_EQ(borderVertex(edge, 0, 8, 5), 21U);
    EXPECT_EQ(borderVertex(edge, 0, 8, 8), 0U) << "corner 0 closes the ring";
    EXPECT_EQ(borderVertex(edge, 1, 8, 0), 8U);
    EXPECT_EQ(borderVertex(edge, 1, 8, 5), 3U);
    EXPECT_EQ(borderVertex(edge, 1, 8, 8), 0U);
}

// ---------------------------------------------------------------------------------------------------------- levels ---

TEST_P(Charts, FinestLevelIsTheChartAtItsVertices)
{
    const Baked baked = bake();
    for (std::size_t p = 0; p < baked.charts.charts.size(); ++p) {
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(8); ++v) {
            auto b = TessellationPattern::barycentric(8, v);
            for (auto& weight : b) { weight *= 2; }
            const Vector3d& chart = baked.charts.charts[p].positions[TessellationPattern::index(16, b)];
            EXPECT_LT((baked.hierarchy.patches[p].positions.back()[v] - chart).norm(), 1e-15);
        }
    }
}

TEST_P(Charts, EveryLevelKeepsTheCorners)
{
    const Baked baked = bake();
    for (std::size_t p = 0; p < baked.charts.charts.size(); ++p) {
        for (std::size_t level = 0; level < kLadder.size(); ++level) {
            for (std::size_t k = 0; k < 3; ++k) {
                EXPECT_EQ(baked.hierarchy.patches[p].positions[level][k * kLadder[level]],
                          baked.hierarchy.patches[p].positions.back()[k * kLadder.back()]);
            }
        }
    }
}

TEST_P(Charts, ParentsStayOnTheBorderOfTheirChildren)
{
    const Baked baked = bake();
    for (const PatchLevels& levels : baked.hierarchy.patches) {
        EXPECT_TRUE(levels.parents[0].empty());
        for (std::size_t level = 1; level < kLadder.size(); ++level) {
            const unsigned fine = kLadder[level];
            const unsigned coarse = kLadder[level - 1];
            ASSERT_EQ(levels.parents[level].size(), TessellationPattern::vertexCount(fine));
            for (std::uint32_t v = 0; v < levels.parents[level].size(); ++v) {
                const std::uint32_t parent = levels.parents[level][v];
                ASSERT_LT(parent, TessellationPattern::vertexCount(coarse));
                const auto b = TessellationPattern::barycentric(fine, v);
                const auto c = TessellationPattern::barycentric(coarse, parent);
                for (std::size_t k = 0; k < 3; ++k) {
                    if (b[k] == 0) { EXPECT_EQ(c[k], 0U) << "off its border"; }
                    if (b[k] == 3 * fine) { EXPECT_EQ(c[k], 3 * coarse) << "a corner moved"; }
                }
            }
        }
    }
}

// ------------------------------------------------------------------------------------------------ difference vectors ---

std::vector<Vector3d> flatPattern(unsigned factor)
{
    std::vector<Vector3d> positions;
    for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
        const auto b = TessellationPattern::barycentric(factor, v);
        positions.emplace_back(b[1] / (3.0 * factor), b[2] / (3.0 * factor), 0.0);
    }
    return positions;
}

TEST(DifferenceVectors, EqualSurfacesDoNotDiffer)
{
    for (const unsigned chart : {2U, 4U, 16U}) {
        for (const unsigned level : {1U, 2U, 4U, 6U}) {
            // Of factor 6 the parameter lattice has the vertices up to half a unit.
            const double rounding = level == 6 ? 1.0 / ChartPoint::kUnits : 1e-15;
            EXPECT_LT(DifferenceVectors(chart, level).largest(flatPattern(chart), flatPattern(level)), rounding);
        }
    }
}

TEST(DifferenceVectors, FindsABumpOfTheChart)
{
    // One inner vertex of the chart is lifted; at factor 1 and 2 the level is flat below it.
    for (const unsigned level : {1U, 2U}) {
        auto chart = flatPattern(4);
        chart[14].z() = 0.375;
        EXPECT_NEAR(DifferenceVectors(4, level).largest(chart, flatPattern(level)), 0.375, 1e-15);
    }
}

TEST(DifferenceVectors, FindsABumpOfTheLevel)
{
    auto level = flatPattern(2);
    level[6] += Vector3d(0.3, 0.0, 0.4); // the centre
    EXPECT_NEAR(DifferenceVectors(4, 2).largest(flatPattern(4), level), 0.5, 1e-15);
    // Even where no vertex of the chart lies: the chart is a single triangle.
    EXPECT_NEAR(DifferenceVectors(1, 2).largest(flatPattern(1), level), 0.5, 1e-15);
}

TEST(PatternResampling, IsLinearOnThePattern)
{
    // A linear function is reproduced everywhere, onto patterns and onto grids.
    const auto from = flatPattern(8);
    const auto toPattern = PatternResampling::betweenPatterns(8, 6);
    const auto expected = flatPattern(6);
    ASSERT_EQ(toPattern.size(), expected.size());
    for (std::size_t i = 0; i < expected.size(); ++i) { EXPECT_LT((toPattern.sample(from, i) - expected[i]).norm(), 1e-15); }
    const auto toGrid = PatternResampling::ontoGrid(8, 4);
    ASSERT_EQ(toGrid.size(), NormalTexture::texelCount(4));
    std::size_t at = 0;
    for (unsigned j = 0; j <= 4; ++j) {
        for (unsigned i = 0; i + j <= 4; ++i) {
            EXPECT_LT((toGrid.sample(from, at++) - Vector3d(i / 4.0, j / 4.0, 0.0)).norm(), 1e-15);
        }
    }
}

// --------------------------------------------------------------------------------------------------------- normals ---

TEST(OctahedralNormals, DecodeToWhatWasEncoded)
{
    std::mt19937 random(31);
    std::normal_distribution<double> normal;
    double worst = 0.0;
    const auto check = [&](const Vector3d& n) {
        const Vector3d back = decodeOctahedral(encodeOctahedral(n));
        EXPECT_NEAR(back.norm(), 1.0, 1e-12);
        worst = std::max(worst, (back - n).norm());
    };
    for (int i = 0; i < 200000; ++i) { check(Vector3d(normal(random), normal(random), normal(random)).normalized()); }
    for (int x = -1; x <= 1; ++x) { // axes, diagonals, and the folds between them
        for (int y = -1; y <= 1; ++y) {
            for (int z = -1; z <= 1; ++z) {
                if (x != 0 || y != 0 || z != 0) { check(Vector3d(x, y, z).normalized()); }
            }
        }
    }
    EXPECT_LT(worst, 1e-4);
}

TEST(OctahedralNormals, TheZeroVectorGivesSomeUnitVector)
{
    EXPECT_NEAR(decodeOctahedral(encodeOctahedral(Vector3d::Zero())).norm(), 1.0, 1e-12);
}

std::uint32_t gridIndex(std::uint32_t r, std::uint32_t i, std::uint32_t j) { return j * (2 * r + 3 - j) / 2 + i; }

/// Grid point `step` of `r` steps along side `side`.
std::uint32_t sideTexel(std::uint32_t r, unsigned side, std::uint32_t step)
{
    return side == 0 ? gridIndex(r, step, 0) : side == 1 ? gridIndex(r, r - step, step) : gridIndex(r, 0, r - step);
}

TEST_P(Charts, SharedNormalsHaveTheSameBits)
{
    const Baked baked = bake();
    Progress progress;
    const NormalTexture texture = bakeNormals(baked.map->topology(), baked.charts, 16, progress);
    EXPECT_EQ(texture.resolution, 16U);
    ASSERT_EQ(texture.levels.size(), 5U);
    for (std::size_t level = 0; level < texture.levels.size(); ++level) {
        const std::uint32_t r = 1U << level;
        const std::size_t count = NormalTexture::texelCount(r);
        ASSERT_EQ(texture.levels[level].size(), count * baked.charts.charts.size());
        const auto texel = [&](std::uint32_t patch, std::uint32_t index) { return texture.levels[level][patch * count + index]; };
        std::map<std::uint32_t, std::uint32_t> atBase;
        for (const auto& edge : baked.map->topology().edges) {
            for (std::uint32_t step = 0; step <= r && edge.patches[1] != kNoPatch; ++step) {
                EXPECT_EQ(texel(edge.patches[0], sideTexel(r, edge.sides[0], step)),
                          texel(edge.patches[1], sideTexel(r, edge.sides[1], r - step)));
            }
        }
        for (std::uint32_t p = 0; p < baked.charts.charts.size(); ++p) {
            for (unsigned k = 0; k < 3; ++k) {
                const std::uint32_t corner = texel(p, sideTexel(r, k, 0));
                EXPECT_EQ(atBase.try_emplace(baked.map->topology().patches[p][k], corner).first->second, corner);
            }
        }
    }
}

TEST(BakeNormals, FinestGridHoldsTheMapsNormals)
{
    const auto map = makeBumpySphere();
    Progress progress;
    const ChartSet charts = makeCharts(*map, 32, progress);
    const NormalTexture texture = bakeNormals(map->topology(), charts, 32, progress);
    for (std::uint32_t p = 0; p < charts.charts.size(); ++p) {
        for (std::uint32_t j = 0; j <= 32; ++j) {
            for (std::uint32_t i = 0; i + j <= 32; ++i) {
                const std::size_t at = p * NormalTexture::texelCount(32) + gridIndex(32, i, j);
                const Vector3d stored = decodeOctahedral(texture.levels.back()[at]);
                const Vector3d expected = map->evaluate(p, Vector3d(32.0 - i - j, i, j) / 32.0).normal;
                // Linear interpolation over an arc of 1/16 rad at the most errs by less than its square.
                EXPECT_LT((stored - expected).norm(), 4e-3);
            }
        }
    }
}

// ----------------------------------------------------------------------------------------------------------- asset ---

TEST_P(Charts, AssetIsValid) { EXPECT_NO_THROW(bake().asset.validate()); }

/// Stored positions are the nearest ones of the lattice: half a step off on each axis.
void expectNearestLatticePoints(const Baked& baked)
{
    const LodAsset& asset = baked.asset;
    const double step = static_cast<double>(asset.lattice.step);
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        const std::size_t count = TessellationPattern::vertexCount(asset.ladder[level]);
        for (std::size_t p = 0; p < asset.patches.size(); ++p) {
            for (std::size_t v = 0; v < count; ++v) {
                const LodVertex vertex = asset.levels[level].vertices[p * count + v];
                const auto position = asset.position(asset.patches[p], vertex);
                const Vector3d exact = baked.map->frame().center +
                                       baked.map->frame().scale * baked.hierarchy.patches[p].positions[level][v];
                for (std::size_t k = 0; k < 3; ++k) {
                    const double wanted = exact[static_cast<Eigen::Index>(k)] - asset.lattice.origin[k];
                    const double stored = step * (asset.patches[p].latticeOrigin[k] + vertex.offset()[k]);
                    ASSERT_LE(std::fabs(stored - wanted), 0.5 * step * (1.0 + 1e-6));
                    ASSERT_LE(std::fabs(static_cast<double>(position[k]) - stored), 1.2e-7 * std::fabs(stored));
                }
            }
        }
    }
}

TEST_P(Charts, StoredPositionsAreWithinHalfAStep) { expectNearestLatticePoints(bake()); }

TEST(AssembleAsset, QuantizesAtAnyScaleAndOffset)
{
    for (const double scale : {1e-6, 1.0, 1e9}) {
        for (const double offset : {0.0, 1.0, 1e5}) {
            auto map = makeBumpySphere();
            map->setFrame(scale * offset * Vector3d(1.0, -2.0, 0.5), scale);
            const Baked baked = bakeMap(std::move(map));
            EXPECT_NO_THROW(baked.asset.validate());
            expectNearestLatticePoints(baked);
            EXPECT_LT(static_cast<double>(baked.asset.lattice.step), 1e-5 * scale) << "17 bits over the largest patch";
        }
    }
}

TEST(AssembleAsset, FlatPatchesHaveNoErrorButTheLattices)
{
    const Baked baked = bakeMap(makeFlat());
    for (const LodLevel& level : baked.asset.levels) {
        for (const LevelError& error : level.errors) {
            // Half a step on each of three axes.
            EXPECT_LE(error.isotropic, baked.asset.lattice.step);
            EXPECT_LE(error.quadratic.evaluate({0.0, 0.0, 1.0}), static_cast<double>(baked.asset.lattice.step));
        }
    }
}

std::vector<Vector3d> storedPositions(const LodAsset& asset, std::size_t level, std::size_t patch)
{
    const std::size_t count = TessellationPattern::vertexCount(asset.ladder[level]);
    std::vector<Vector3d> positions;
    for (std::size_t v = 0; v < count; ++v) {
        const auto p = asset.position(asset.patches[patch], asset.levels[level].vertices[patch * count + v]);
        positions.emplace_back(static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2]));
    }
    return positions;
}

TEST_P(Charts, ErrorsAreAtLeastTheDistancesAtVertices)
{
    const Baked baked = bake();
    const TessellationPattern fine(16);
    for (std::size_t p = 0; p < baked.charts.charts.size(); ++p) {
        std::vector<Vector3d> reference;
        for (const Vector3d& x : baked.charts.charts[p].positions) {
            reference.emplace_back(baked.map->frame().center + baked.map->frame().scale * x);
        }
        const SurfaceDistance toReference(reference, fine.triangles());
        for (std::size_t level = 0; level < kLadder.size(); ++level) {
            const auto stored = storedPositions(baked.asset, level, p);
            const SurfaceDistance toLevel(stored, TessellationPattern(kLadder[level]).triangles());
            double distance = 0.0;
            for (const Vector3d& x : stored) { distance = std::max(distance, toReference.distance(x)); }
            for (const Vector3d& x : reference) { distance = std::max(distance, toLevel.distance(x)); }
            const LevelError& error = baked.asset.levels[level].errors[p];
            // Distances are measured in single precision.
            EXPECT_GE(static_cast<double>(error.isotropic), distance - 1e-6);
            for (const Vector3d& d : {Vector3d(1, 0, 0), Vector3d(0, 0.6, 0.8), Vector3d(0.48, 0.64, -0.6)}) {
                double seen = 0.0;
                for (std::uint32_t v = 0; v < stored.size(); ++v) {
                    auto b = TessellationPattern::barycentric(kLadder[level], v);
                    for (unsigned& weight : b) { weight *= 16U / kLadder[level]; }
                    seen = std::max(seen, (stored[v] - reference[TessellationPattern::index(16, b)]).cross(d).norm());
                }
                EXPECT_GE(error.quadratic.evaluate({d.x(), d.y(), d.z()}), seen - 1e-7 * baked.map->frame().scale) << "of positions in single precision";
                EXPECT_LE(error.quadratic.evaluate({d.x(), d.y(), d.z()}), 1.5 * static_cast<double>(error.isotropic));
            }
        }
    }
}

TEST_P(Charts, ErrorsContainTheChartError)
{
    Progress progress;
    Baked baked = bake();
    for (PatchChart& chart : baked.charts.charts) { chart.chartError = 0.25; }
    const LodAsset with = assembleAsset(*baked.map, baked.charts, baked.hierarchy, 0.0, progress);
    for (std::size_t level = 0; level < kLadder.size(); ++level) {
        for (std::size_t p = 0; p < with.patches.size(); ++p) {
            EXPECT_NEAR(static_cast<double>(with.levels[level].errors[p].isotropic),
                        static_cast<double>(baked.asset.levels[level].errors[p].isotropic) + 0.25 * baked.map->frame().scale,
                        1e-6);
        }
    }
}

TEST_P(Charts, BoundsHoldEveryLevel)
{
    const Baked baked = bake();
    Eigen::AlignedBox3d box;
    for (std::size_t p = 0; p < baked.asset.patches.size(); ++p) {
        const LodPatch& patch = baked.asset.patches[p];
        const Eigen::Vector3f center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
        const Vector3d axis = Eigen::Vector3f(patch.coneAxis[0], patch.coneAxis[1], patch.coneAxis[2]).cast<double>();
        EXPECT_NEAR(axis.norm(), 1.0, 1e-6);
        for (std::size_t level = 0; level < kLadder.size(); ++level) {
            const auto stored = storedPositions(baked.asset, level, p);
            for (const Vector3d& x : stored) {
                box.extend(x);
                EXPECT_LE((x - center.cast<double>()).norm(), static_cast<double>(patch.boundRadius));
                for (std::size_t k = 0; k < 3; ++k) {
                    EXPECT_GE(x[static_cast<Eigen::Index>(k)], static_cast<double>(baked.asset.boundsMin[k]));
                    EXPECT_LE(x[static_cast<Eigen::Index>(k)], static_cast<double>(baked.asset.boundsMax[k]));
                }
            }
            const TessellationPattern pattern(kLadder[level]);
            for (const auto& t : pattern.triangles()) {
                const Vector3d n = (stored[t[1]] - stored[t[0]]).cross(stored[t[2]] - stored[t[0]]);
                EXPECT_GE(n.dot(axis), (static_cast<double>(baked.asset.levels[level].errors[p].coneCosine) - 1e-5) * n.norm()) << "normal outside the cone";
            }
        }
    }
    for (std::size_t k = 0; k < 3; ++k) { // and no more, but for a few units in the last place of single precision
        const auto axis = static_cast<Eigen::Index>(k);
        const double rounding = 1e-6 * (box.max().norm() + box.min().norm());
        EXPECT_NEAR(static_cast<double>(baked.asset.boundsMin[k]), box.min()[axis], rounding);
        EXPECT_NEAR(static_cast<double>(baked.asset.boundsMax[k]), box.max()[axis], rounding);
    }
}

// -------------------------------------------------------------------------------------------------------- distances ---

std::vector<std::uint32_t> patchesOfVertices(const ControlMesh& map)
{
    std::vector<std::uint32_t> patches;
    for (std::uint32_t v = 0; v < map.source().positions.size(); ++v) { patches.push_back(map.patchPointOf(v).face); }
    return patches;
}

TEST(ChartError, IsAtLeastTheDistanceOfSourceVertices)
{
    const auto map = makeScanLike();
    Progress progress;
    std::vector<double> largest;
    for (const unsigned factor : {2U, 16U}) {
        ChartSet charts = makeCharts(*map, factor, progress);
        measureChartErrors(map->source(), {map->source().positions, patchesOfVertices(*map)}, charts, progress);
        const TessellationPattern pattern(factor);
        std::vector<SurfaceDistance> toChart;
        largest.push_back(0.0);
        for (const PatchChart& chart : charts.charts) {
            toChart.emplace_back(chart.positions, pattern.triangles());
            largest.back() = std::max(largest.back(), chart.chartError);
        }
        const SurfaceDistance toSource(map->source().positions, map->source().triangles);
        for (std::uint32_t v = 0; v < map->source().positions.size(); ++v) {
            const std::uint32_t patch = map->patchPointOf(v).face;
            EXPECT_GE(charts.charts[patch].chartError, toChart[patch].distance(map->source().positions[v]) - 1e-9);
        }
        for (const PatchChart& chart : charts.charts) {
            for (const Vector3d& x : chart.positions) { EXPECT_LT(toSource.distance(x), 1e-6) << "samples lie on the source"; }
            for (const auto& t : pattern.triangles()) {
                const Vector3d center = (chart.positions[t[0]] + chart.positions[t[1]] + chart.positions[t[2]]) / 3.0;
                EXPECT_GE(chart.chartError, toSource.distance(center) - 1e-9);
            }
        }
    }
    EXPECT_LT(largest[1], 0.5 * largest[0]) << "finer charts are nearer";
}

TEST(ChartError, FlatMeshesHaveNone)
{
    ControlMeshOptions options;
    options.patches = 2;
    Progress progress;
    const ControlMesh map(flatGrid(16), options, progress);
    ChartSet charts = makeCharts(map, 16, progress);
    measureChartErrors(map.source(), {map.source().positions, patchesOfVertices(map)}, charts, progress);
    for (const PatchChart& chart : charts.charts) { EXPECT_LT(chart.chartError, 1e-6); }
}

} // namespace
} // namespace osgTessLOD::bake
