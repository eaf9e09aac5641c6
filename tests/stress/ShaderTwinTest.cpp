// SPDX-License-Identifier: MIT
// Every function of the shaders in single against double precision, and against the C++ twins that promise the same bits.
#include <stress/ShaderTwinCases.h>

#include <asset/SyntheticAsset.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/Placements.h>

#include <memory>

namespace osgTessLOD::stress {
namespace {

TEST(ShaderTwins, PatternsAreExactAtEveryFactor)
{
    for (unsigned factor = 1; factor <= 64; factor += factor == 1 ? 1 : 2) {
        const int f = static_cast<int>(factor);
        const std::uint32_t count = TessellationPattern::vertexCount(factor);
        ASSERT_EQ(static_cast<std::uint32_t>(glsl::tessLodPatternVertexCount(f)), count);
        for (std::uint32_t v = 0; v < count; ++v) {
            const auto expected = TessellationPattern::barycentric(factor, v);
            const glsl::ivec3 b = glsl::tessLodPatternBarycentric(f, static_cast<int>(v));
            // As tessellators may give it: off by up to 2⁻¹⁶, as much as fixed point of 16 bits is.
            for (const double off : {0.0, std::ldexp(1.0, -16), -std::ldexp(1.0, -16)}) {
                std::array<float, 3> at{};
                for (std::size_t k = 0; k < 3; ++k) {
                    ASSERT_EQ(static_cast<std::uint32_t>(b[k]), expected[k]);
                    at[k] = static_cast<float>(expected[k] / (3.0 * factor) + (k == 0 ? off : k == 1 ? -off : 0.0));
                }
                ASSERT_EQ(glsl::tessLodPatternIndex(given(at), f), static_cast<int>(v)) << factor;
            }
        }
    }
}

/// The uniforms of an asset, as AssetPages has them.
void bind(const LodAsset& asset, const MorphedSurface& surface)
{
    glsl::tessLodVertices.texels.clear();
    glsl::tessLodUvs.texels.clear();
    glsl::tessLodColors.texels.clear();
    glsl::tessLodParameters.texels.clear();
    glsl::tessLodPatchTable.texels.clear();
    int without = 0;
    for (std::size_t l = 0; l < asset.levels.size(); ++l) {
        const LodLevel& level = asset.levels[l];
        for (const LodVertex& v : level.vertices) {
            glsl::tessLodVertices.texels.emplace_back(static_cast<std::uint32_t>(v.bits),
                                                      static_cast<std::uint32_t>(v.bits >> 32), 0U, 0U);
        }
        const auto put = [](const std::vector<std::uint32_t>& words, glsl::usamplerBuffer& buffer) {
            for (const std::uint32_t word : words) { buffer.texels.emplace_back(word, 0U, 0U, 0U); }
        };
        put(level.uvs, glsl::tessLodUvs);
        put(level.colors, glsl::tessLodColors);
        put(level.parameters, glsl::tessLodParameters);
        glsl::tessLodParameterShifts[l] = level.parameters.empty() ? -1 : without;
        if (level.parameters.empty()) { without += static_cast<int>(level.vertices.size()); }
        glsl::tessLodFactors[l] = asset.ladder[l];
    }
    for (const std::int32_t number : surface.patchTable()) {
        glsl::tessLodPatchTable.texels.emplace_back(number, 0, 0, 0);
    }
    glsl::tessLodLevelCount = static_cast<int>(asset.levels.size());
    glsl::tessLodStep = Twin::given(asset.lattice.step);
    for (std::size_t k = 0; k < 2; ++k) {
        glsl::tessLodUvOrigin[k] = Twin::given(asset.uvLattice.origin[k]);
        glsl::tessLodUvStep[k] = Twin::given(asset.uvLattice.step[k]);
    }
}

/// At any scale, and as far from the origin as a lattice of 32 bits goes.
LodAsset placedAnywhere(LodAsset asset, TwinRandom& random)
{
    asset.lattice.step = static_cast<float>(random.magnitude(1e-15, 1e7));
    for (std::size_t k = 0; k < 3; ++k) {
        const auto shift = static_cast<std::int32_t>(random.between(-1.0, 1.0) * random.magnitude(1.0, 1 << 29));
        for (LodPatch& patch : asset.patches) { patch.latticeOrigin[k] += shift; }
    }
    return asset;
}

TEST(ShaderTwins, SurfacesHaveTheTwinsBits)
{
    Deviation positions;
    Deviation weights;
    Deviation texCoords;
    Deviation colors;
    const std::array<LodAsset, 2> assets{withAttributes(makeSyntheticDisplacedAsset(16, false)),
                                         withAttributes(makeSyntheticMixedAsset(16))};
    for (unsigned k = 0; k < trials(40); ++k) {
        TwinRandom random(k);
        const LodAsset asset = placedAnywhere(assets[k % assets.size()], random);
        const MorphedSurface surface(asset);
        bind(asset, surface);
        const std::uint32_t patch = random.below(static_cast<std::uint32_t>(asset.patches.size()));
        std::array<float, 3> levels{};
        for (std::size_t side = 0; side < 3; ++side) {
            const double finest = asset.edges[asset.patches[patch].edges[side]].finestLevel;
            const double level = random.between(0.0, finest);
            levels[side] = static_cast<float>(random.chance(0.3) ? std::round(level) : level);
        }
        const std::uint32_t count = TessellationPattern::vertexCount(asset.ladder[MorphedSurface::drawnLevel(levels)]);
        for (std::uint32_t v = 0; v < count; ++v) {
            const auto expected = surface.tessLodSurfacePoint(patch, levels, v);
            const glsl::TessLodPoint point =
                glsl::tessLodSurfacePoint(static_cast<int>(patch), given(levels), static_cast<int>(v));
            ASSERT_TRUE(haveSameBits(point.position, expected.position)) << k << ", vertex " << v;
            ASSERT_TRUE(haveSameBits(point.weights, expected.weights)) << k << ", vertex " << v;
            ASSERT_TRUE(haveSameBits(point.texCoord, expected.texCoord)) << k << ", vertex " << v;
            ASSERT_TRUE(haveSameBits(point.color, expected.color)) << k << ", vertex " << v;
            positions.add(point.position);
            weights.add(point.weights);
            texCoords.add(point.texCoord);
            colors.add(point.color);
        }
    }
    positions.reportAs("position");
    weights.reportAs("weights");
    texCoords.reportAs("texture coordinates");
    colors.reportAs("colour");
}

TEST(ShaderTwins, DeformationsHaveTheTwinsBits)
{
    Deviation positions;
    Deviation normals;
    const osg::ref_ptr<GpuAsset> asset = new GpuAsset(std::make_shared<const LodAsset>(makeSyntheticAsset(2, false)));
    const LodAsset& content = asset->asset();
    for (unsigned k = 0; k < trials(200); ++k) {
        TwinRandom random(k);
        const std::vector<osg::Matrixd> transforms = bindDeformation(content, random);
        const osg::ref_ptr<ControlMeshDeformation> pose = new ControlMeshDeformation(asset.get(), transforms);
        for (std::uint32_t patch = 0; patch < content.patches.size(); ++patch) {
            const auto id = static_cast<int>(patch);
            const std::array<float, 3> weights = random.weights();
            const vec3 at = random.point(1.0);
            const osg::Vec3f expected =
                pose->tessLodDeformed({at.x.single(), at.y.single(), at.z.single()}, weights, patch);
            const vec3 deformed = glsl::tessLodDeformed(at, given(weights), id);
            ASSERT_TRUE(haveSameBits(deformed, {expected.x(), expected.y(), expected.z()})) << k;
            positions.add(deformed);
            const glsl::mat3 turned = glsl::tessLodDeformationRows(at, given(weights), id);
            bool mirrors = false;
            normals.add(glsl::tessLodDeformedNormal(random.unit(), turned, mirrors));
        }
    }
    positions.reportAs("deformed position");
    normals.reportAs("deformed normal");
}

TEST(ShaderTwins, PlacementsHaveTheTwinsBits)
{
    Deviation deviation;
    osg::BoundingBox box(-1.0F, -1.0F, -1.0F, 1.0F, 1.0F, 1.0F);
    for (unsigned k = 0; k < trials(500); ++k) {
        TwinRandom random(k);
        const osg::Matrixd matrix = randomAffine(random, 1.0);
        const osg::ref_ptr<Placements> placements = new Placements({matrix}, box);
        glsl::tessLodPlacements.texels.clear();
        for (int row = 0; row < 3; ++row) { glsl::tessLodPlacements.texels.push_back(rowOf(matrix, row, 0.0)); }
        for (unsigned i = 0; i < 20; ++i) {
            const vec3 at = random.point(1.0);
            const osg::Vec3f expected = placements->tessLodPlaced({at.x.single(), at.y.single(), at.z.single()}, 0);
            const vec3 placed = glsl::tessLodPlaced(at, 0);
            ASSERT_TRUE(haveSameBits(placed, {expected.x(), expected.y(), expected.z()})) << k;
            deviation.add(placed);
        }
    }
    deviation.reportAs("placed position");
}

TEST(ShaderTwins, NormalsDecodeFromAnyBits)
{
    Deviation decoded;
    Deviation interpolated;
    TwinRandom random(1);
    for (unsigned k = 0; k < trials(20000); ++k) {
        const vec3 n = glsl::tessLodOctahedralNormal(random.bits());
        ASSERT_NEAR(glsl::dot(n, n).exact(), 1.0, 1e-6);
        decoded.add(n);
    }
    bindNormals(random);
    for (int level = 0; level < kNormalLevels; ++level) {
        const int texels = glsl::tessLodNormalTexelsBelow(level + 1) - glsl::tessLodNormalTexelsBelow(level);
        ASSERT_EQ(static_cast<std::uint32_t>(texels), NormalTexture::texelCount(1U << level));
    }
    for (unsigned k = 0; k < trials(5000); ++k) {
        const vec3 weights = given(random.weights());
        interpolated.add(glsl::tessLodPatchNormal(static_cast<int>(random.below(kNormalPatches)), weights,
                                                  Twin::given(static_cast<float>(random.magnitude(1e-8, 10.0)))));
    }
    decoded.reportAs("normal");
    interpolated.reportAs("interpolated normal");
}

TEST(ShaderTwins, NeedsAreThoseOfDoublePrecision)
{
    using namespace glsl::selection;
    Deviation tolerances;
    Deviation errors;
    Worst levels;
    unsigned between = 0;
    for (unsigned k = 0; k < trials(5000); ++k) {
        TwinRandom random(k);
        bindNeeds(random, 7);
        const vec4 sphere = bindView(random);
        const TessLodSight sight = tessLodSee(sphere);
        tolerances.add(sight.tolerance);
        for (int level = 0; level < 7; ++level) { errors.add(tessLodErrorOf(0, level, sight)); }
        const Twin need = tessLodNeed(0, sphere);
        ASSERT_GE(need.single(), 0.0F);
        ASSERT_LE(need.single(), 7.0F);
        ASSERT_LE(need.error(), need.bound()) << k;
        levels.add(need.error());
        between += need.single() != std::floor(need.single()) ? 1 : 0;
    }
    EXPECT_GT(between, 500U);
    tolerances.reportAs("tolerance");
    errors.reportAs("error as seen");
    report("level needed, levels", levels.value());
}

TEST(ShaderTwins, LightsAndFogOfAnyKind)
{
    using namespace glsl;
    Deviation lit;
    Deviation fogged;
    for (unsigned k = 0; k < trials(2000); ++k) {
        TwinRandom random(k);
        const gl_MaterialParameters material = bindLights(random);
        const vec3 position = random.point(10.0);
        lit.add(tessLodLitColor(position, random.unit(), material));
        fogged.add(tessLodFoggedColor(random.color(), position));
    }
    lit.reportAs("lit colour");
    fogged.reportAs("colour in fog");
}

} // namespace
} // namespace osgTessLOD::stress
