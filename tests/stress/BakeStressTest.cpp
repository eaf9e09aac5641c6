// SPDX-License-Identifier: MIT
// Whole bakes of small meshes that break geometry code, at any scale and offset.
#include <stress/RandomSource.h>
#include <stress/Stress.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/bake/AssetAssembler.h>
#include <osgTessLOD/bake/Baker.h>
#include <osgTessLOD/bake/ChartError.h>
#include <osgTessLOD/bake/StripSimplifier.h>
#include <osgTessLOD/bake/SurfaceDistance.h>
#include <osgTessLOD/bake/TerrainMap.h>
#include <osgTessLOD/bake/UniformLevels.h>

#include <gtest/gtest.h>

#include <optional>

namespace osgTessLOD::stress {
namespace {

using bake::BakeOptions;
using bake::PatchedSurface;

constexpr auto kKinds = static_cast<std::uint32_t>(Kind::kCount);

BakeOptions randomOptions(SourceRandom& random)
{
    BakeOptions options;
    options.maxFactor = 2U << random.below(3);
    options.controlMesh.patches = 1 + random.below(12);
    options.patchTolerance = random.magnitude(0.005, 0.1);
    options.tolerance = random.chance(0.5) ? 0.0 : 1e-4;
    options.technique = random.chance(0.7) ? "strips" : "uniform";
    options.normalResolution = 2;
    return options;
}

/// Nothing where the mesh is refused.
std::optional<LodAsset> bakeOrRefuse(const SourceMesh& mesh, const BakeOptions& options)
{
    bake::Progress progress;
    bake::BakeReport report;
    try {
        return bake::bakeMesh(mesh, options, progress, report);
    } catch (const AssetError& error) {
        EXPECT_EQ(std::string(error.what()).rfind(mesh.name + ": ", 0), 0U) << error.what();
        return {};
    }
}

double diagonalOf(const SourceMesh& mesh)
{
    Eigen::AlignedBox3d box;
    for (const Vector3d& p : mesh.positions) { box.extend(p); }
    return box.diagonal().norm();
}

/// Positions of a patch's vertices at a level, source's space less the lattice's origin.
std::vector<Vector3d> positionsOf(const LodAsset& asset, std::size_t level, std::size_t patch, std::uint32_t slot)
{
    const std::size_t count = TessellationPattern::vertexCount(asset.ladder[level]);
    std::vector<Vector3d> positions;
    for (std::size_t v = 0; v < count; ++v) {
        const auto p = asset.position(asset.patches[patch], asset.levels[level].vertices[slot * count + v]);
        positions.emplace_back(double{p[0]}, double{p[1]}, double{p[2]});
    }
    return positions;
}

/// Visits slot and error of every patch at every level that it has.
template <typename Visit> void forEachError(const LodAsset& asset, const Visit& visit)
{
    for (std::size_t level = 0; level < asset.levels.size(); ++level) {
        const std::vector<std::uint32_t> slots = asset.levelSlots(level);
        for (std::size_t p = 0; p < slots.size(); ++p) {
            if (slots[p] != kNoPatch) { visit(level, p, slots[p], asset.levels[level].errors[slots[p]]); }
        }
    }
}

void expectFiniteErrors(const LodAsset& asset, double diagonal)
{
    forEachError(asset, [&](std::size_t, std::size_t, std::uint32_t, const LevelError& error) {
        ASSERT_TRUE(std::isfinite(error.isotropic));
        ASSERT_GE(error.isotropic, 0.0F);
        // What is drawn stays within the source's box, but for how far fitted vertices overshoot.
        ASSERT_LE(double{error.isotropic}, 2.0 * diagonal);
        for (const float q : error.quadratic.q) { ASSERT_TRUE(std::isfinite(q)); }
        ASSERT_GE(error.coneCosine, -1.0F);
        ASSERT_LE(error.coneCosine, 1.0F);
    });
}

/// Of vertices, edges' middles and triangles' centres of every level to the source.
void expectNoErrorBelowTheDistance(const LodAsset& asset, const SourceMesh& mesh, Worst& worst)
{
    std::vector<Vector3d> source;
    const Vector3d origin(asset.lattice.origin[0], asset.lattice.origin[1], asset.lattice.origin[2]);
    for (const Vector3d& p : mesh.positions) { source.push_back(p - origin); }
    const bake::SurfaceDistance toSource(source, mesh.triangles);
    // Distances to the source are good to 10⁻⁷ of its size, here and where the chart's error was measured; positions far from the
    // origin to half a unit in the last place.
    double rounding = 4e-7 * diagonalOf(mesh);
    for (const Vector3d& p : mesh.positions) {
        rounding =
            std::max(rounding, 4e-7 * diagonalOf(mesh) + 4.0 * std::numeric_limits<double>::epsilon() * p.norm());
    }
    forEachError(asset, [&](std::size_t level, std::size_t p, std::uint32_t slot, const LevelError& error) {
        const std::vector<Vector3d> positions = positionsOf(asset, level, p, slot);
        double distance = 0.0;
        for (const Vector3d& x : positions) { distance = std::max(distance, toSource.distance(x)); }
        ASSERT_LE(distance, double{error.isotropic} + rounding) << "level " << level << ", patch " << p;
        worst.add(distance / (double{error.isotropic} + rounding));
    });
}

TEST(BakeStress, EverySourceIsBakedOrRefused)
{
    unsigned baked = 0;
    Worst worst;
    const unsigned count = trials(2) * kKinds;
    for (unsigned k = 0; k < count; ++k) {
        SourceRandom random(k);
        const auto kind = static_cast<Kind>(k % kKinds);
        // Some so far away that double precision leaves little of them, or nothing.
        const double farthest = random.chance(0.1) ? 1e20 : 1e9;
        const Similarity place{random.rotation(), random.magnitude(1e-6, 1e9),
                               random.direction() * (random.chance(0.3) ? 0.0 : random.magnitude(1.0, farthest))};
        const SourceMesh mesh = place(randomSource(kind, random));
        SCOPED_TRACE(std::string(nameOf(kind)) + ", trial " + std::to_string(k));
        const std::optional<LodAsset> asset = bakeOrRefuse(mesh, randomOptions(random));
        if (!asset) { continue; }
        ++baked;
        ASSERT_NO_THROW(asset->validate());
        expectFiniteErrors(*asset, diagonalOf(mesh));
        expectNoErrorBelowTheDistance(*asset, mesh, worst);
        if (testing::Test::HasFatalFailure()) { return; }
    }
    EXPECT_GT(baked, count * 3 / 4) << "most are sound enough";
    report("baked of " + std::to_string(count), baked);
    report("largest distance of a vertex from the source over what the error allows", worst.value());
}

/// All of one height, but for the last digits of some or one peak; of a single cell or more.
bake::HeightField nearlyEqualHeights(SourceRandom& random)
{
    bake::HeightField field;
    field.name = "heights";
    field.columns = 2 + random.below(20);
    field.rows = 2 + random.below(20);
    const auto height = static_cast<float>(random.between(-1.0, 1.0) * random.magnitude(1e-6, 1e9));
    field.heights.assign(std::size_t{field.columns} * field.rows, height);
    if (random.chance(0.5)) {
        for (float& h : field.heights) { h = random.chance(0.5) ? std::nextafter(h, 0.0F) : h; }
    }
    if (random.chance(0.3)) { field.heights[random.below(field.columns * field.rows)] *= 2.0F; }
    field.spacing = {random.magnitude(1e-6, 1e9), random.magnitude(1e-6, 1e9)};
    field.corner = {field.spacing[0] * random.between(-1e9, 1e9), field.spacing[1] * random.between(-1e9, 1e9)};
    return field;
}

TEST(BakeStress, HeightFieldsOfNearlyEqualHeights)
{
    for (unsigned k = 0; k < trials(10); ++k) {
        SCOPED_TRACE(k);
        SourceRandom random(k);
        bake::Progress progress;
        const bake::TerrainMap map(nearlyEqualHeights(random), 4, random.magnitude(1e-4, 0.1), progress);
        bake::ChartSet charts = bake::makeCharts(map, 8, progress);
        bake::measureChartErrors(map.source(), map.sourceSamples(), charts, progress);
        const bake::LevelHierarchy levels =
            random.chance(0.5) ? bake::makeUniformLevels(map.topology(), charts, {1, 2, 4}, progress)
                               : bake::makeStripLevels(map.topology(), charts, {1, 2, 4}, {}, progress);
        const LodAsset asset = bake::assembleAsset(map, charts, levels, 0.0, progress);
        ASSERT_NO_THROW(asset.validate());
        expectFiniteErrors(asset, diagonalOf(bake::triangulate(map.field())));
        Worst worst;
        expectNoErrorBelowTheDistance(asset, bake::triangulate(map.field()), worst);
        if (testing::Test::HasFatalFailure()) { return; }
    }
}

/// Bit for bit, unless squares of errors are so small that single precision has no normal numbers for them: there the fit is
/// raised by as much as keeps it a bound.
void expectSameQuadratic(const ViewError& one, const ViewError& two, int exponent)
{
    double largest = 0.0;
    bool isNormal = true;
    for (std::size_t c = 0; c < 6; ++c) {
        const double scaled = std::ldexp(double{one.q[c]}, exponent);
        largest = std::max(largest, std::fabs(scaled));
        isNormal = isNormal && (scaled == 0.0 || std::fabs(scaled) >= double{std::numeric_limits<float>::min()});
    }
    for (std::size_t c = 0; c < 6; ++c) {
        const double scaled = std::ldexp(double{one.q[c]}, exponent);
        ASSERT_NEAR(scaled, double{two.q[c]}, isNormal ? 0.0 : 1e-6 * largest);
    }
}

/// All that a bake computes is relative to the source's size, which it divides by; powers of two do so exactly.
TEST(BakeStress, ScalesByPowersOfTwoChangeNoBit)
{
    const unsigned count = trials(1) * kKinds;
    for (unsigned k = 0; k < count; ++k) {
        SourceRandom random(1000 + k);
        const auto kind = static_cast<Kind>(k % kKinds);
        const SourceMesh mesh = randomSource(kind, random);
        SCOPED_TRACE(std::string(nameOf(kind)) + ", trial " + std::to_string(k));
        const BakeOptions options = randomOptions(random);
        const std::optional<LodAsset> asset = bakeOrRefuse(mesh, options);
        for (const int exponent : {-20, 29}) { // 10⁻⁶ and 5 · 10⁸
            Similarity scaled;
            scaled.scale = std::ldexp(1.0, exponent);
            const std::optional<LodAsset> other = bakeOrRefuse(scaled(mesh), options);
            ASSERT_EQ(asset.has_value(), other.has_value());
            if (!asset) { continue; }
            ASSERT_EQ(std::ldexp(asset->lattice.step, exponent), other->lattice.step);
            ASSERT_EQ(asset->patches.size(), other->patches.size());
            for (std::size_t level = 0; level < asset->levels.size(); ++level) {
                ASSERT_TRUE(asset->levels[level].vertices == other->levels[level].vertices) << level;
                ASSERT_TRUE(asset->levels[level].parameters == other->levels[level].parameters) << level;
                for (std::size_t p = 0; p < asset->levels[level].errors.size(); ++p) {
                    const LevelError& one = asset->levels[level].errors[p];
                    const LevelError& two = other->levels[level].errors[p];
                    ASSERT_EQ(std::ldexp(one.isotropic, exponent), two.isotropic);
                    ASSERT_EQ(one.coneCosine, two.coneCosine);
                    expectSameQuadratic(one.quadratic, two.quadratic, 2 * exponent);
                }
            }
        }
    }
}

} // namespace
} // namespace osgTessLOD::stress
