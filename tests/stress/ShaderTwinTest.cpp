// SPDX-License-Identifier: MIT
// Every function of the shaders in single against double precision, and against the C++ twins that promise the same bits.
#include <stress/ShaderTwins.h>

#include <asset/SyntheticAsset.h>
#include <stress/Stress.h>
#include <support/RandomDirection.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/Placements.h>

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace osgTessLOD::stress {
namespace {

using glsl::ivec4;
using glsl::uvec4;
using glsl::vec3;
using glsl::vec4;

class Random {
public:
    explicit Random(std::uint64_t seed)
        : _generator(seed)
    {
    }
    double between(double from, double to) { return std::uniform_real_distribution<double>(from, to)(_generator); }
    double magnitude(double from, double to) { return std::exp(between(std::log(from), std::log(to))); }
    bool chance(double probability) { return between(0.0, 1.0) < probability; }
    std::uint32_t bits() { return static_cast<std::uint32_t>(_generator()); }
    std::uint32_t below(std::uint32_t count) { return bits() % count; }
    osg::Vec3d direction() { return randomDirection(_generator); }
    Twin number(double from, double to) { return Twin::given(static_cast<float>(between(from, to))); }
    vec3 point(double size) { return vec3(number(-size, size), number(-size, size), number(-size, size)); }
    vec3 unit()
    {
        const osg::Vec3d d = direction();
        const auto given = [](double x) { return Twin::given(static_cast<float>(x)); };
        return vec3(given(d.x()), given(d.y()), given(d.z()));
    }
    /// Corner weights, some of them 0.
    std::array<float, 3> weights()
    {
        std::array<float, 3> w{};
        float sum = 0.0F;
        while (!(sum > 0.0F)) {
            for (float& each : w) { each = chance(0.2) ? 0.0F : static_cast<float>(between(0.0, 1.0)); }
            sum = w[0] + w[1] + w[2];
        }
        for (float& each : w) { each /= sum; }
        return w;
    }
    vec4 color() { return vec4(number(0.0, 1.0), number(0.0, 1.0), number(0.0, 1.0), number(0.0, 1.0)); }

private:
    std::mt19937_64 _generator;
};

/// How far single precision is off, in units in the last place of a result's largest component, and as a part of what the
/// running error analysis allows.
class Deviation {
public:
    template <std::size_t N> void add(const glsl::Vec<Twin, N>& v)
    {
        double largest = 0.0;
        for (std::size_t k = 0; k < N; ++k) { largest = std::max(largest, std::fabs(v[k].exact())); }
        for (std::size_t k = 0; k < N; ++k) { add(v[k], largest); }
    }
    void add(const Twin& x) { add(x, std::fabs(x.exact())); }

    void reportAs(const std::string& name) const
    {
        EXPECT_LE(_ofBound.value(), 1.0) << name;
        EXPECT_GT(_count, 0U) << name;
        report(name + ", worst ulp", _ulps.value());
        report(name + ", of the bound", _ofBound.value());
    }

private:
    void add(const Twin& x, double largest)
    {
        ASSERT_TRUE(std::isfinite(x.single()));
        ++_count;
        const double unit = std::ldexp(1.0, std::ilogb(std::max(largest, 1e-37)) - 23);
        _ulps.add(x.error() / unit);
        if (x.error() > 0.0) { _ofBound.add(x.error() / x.bound()); }
    }

    Worst _ulps;
    Worst _ofBound;
    std::size_t _count = 0;
};

vec3 given(const std::array<float, 3>& v)
{
    return vec3(Twin::given(v[0]), Twin::given(v[1]), Twin::given(v[2]));
}

template <std::size_t N> bool haveSameBits(const glsl::Vec<Twin, N>& v, const std::array<float, N>& other)
{
    for (std::size_t k = 0; k < N; ++k) {
        if (v[k].single() != other[k]) { return false; }
    }
    return true;
}

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
LodAsset placedAnywhere(LodAsset asset, Random& random)
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
        Random random(k);
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

osg::Matrixd randomAffine(Random& random, double size)
{
    const osg::Vec3d turn = random.direction() * random.magnitude(1e-6, 10.0);
    const osg::Matrixd scale = osg::Matrixd::scale(random.magnitude(1e-3, 1e3), random.magnitude(1e-3, 1e3),
                                                   random.between(-1.0, 1.0) * random.magnitude(1e-3, 1e3));
    return scale * osg::Matrixd::rotate(turn.length(), turn) *
           osg::Matrixd::translate(random.direction() * size * random.magnitude(1e-6, 1e3));
}

/// A row of the matrix, less `identity` times the unit matrix's, as the GPU has it.
vec4 rowOf(const osg::Matrixd& matrix, int row, double identity)
{
    const auto number = [&](int column) {
        return Twin::given(static_cast<float>(matrix(column, row) - (column == row ? identity : 0.0)));
    };
    return vec4(number(0), number(1), number(2), number(3));
}

TEST(ShaderTwins, DeformationsHaveTheTwinsBits)
{
    Deviation positions;
    Deviation normals;
    const osg::ref_ptr<GpuAsset> asset = new GpuAsset(std::make_shared<const LodAsset>(makeSyntheticAsset(2, false)));
    const LodAsset& content = asset->asset();
    for (unsigned k = 0; k < trials(200); ++k) {
        Random random(k);
        std::vector<osg::Matrixd> transforms;
        for (std::size_t v = 0; v < content.baseVertices.size(); ++v) {
            transforms.push_back(randomAffine(random, 1.0));
        }
        const osg::ref_ptr<ControlMeshDeformation> pose = new ControlMeshDeformation(asset.get(), transforms);
        glsl::tessLodDeformation.texels.clear();
        for (const osg::Matrixd& matrix : transforms) {
            for (int row = 0; row < 3; ++row) { glsl::tessLodDeformation.texels.push_back(rowOf(matrix, row, 1.0)); }
        }
        glsl::tessLodDeformedPatches.texels.clear();
        for (const LodPatch& patch : content.patches) {
            std::array<std::uint32_t, 3> corners{0, 1, 2};
            std::sort(corners.begin(), corners.end(),
                      [&](auto a, auto b) { return patch.baseVertices[a] < patch.baseVertices[b]; });
            const auto vertex = [&](std::size_t i) { return patch.baseVertices[corners[i]]; };
            glsl::tessLodDeformedPatches.texels.emplace_back(vertex(0), vertex(1), vertex(2),
                                                             corners[0] | corners[1] << 2 | corners[2] << 4);
            for (int gradient = 0; gradient < 2; ++gradient) {
                const vec3 g = random.point(2.0);
                uvec4 bits(0U);
                for (std::size_t c = 0; c < 3; ++c) {
                    const float value = g[c].single();
                    std::memcpy(&bits[c], &value, sizeof value);
                }
                glsl::tessLodDeformedPatches.texels.push_back(bits);
            }
        }
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
        Random random(k);
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
    Random random(1);
    for (unsigned k = 0; k < trials(20000); ++k) {
        const vec3 n = glsl::tessLodOctahedralNormal(random.bits());
        ASSERT_NEAR(glsl::dot(n, n).exact(), 1.0, 1e-6);
        decoded.add(n);
    }
    constexpr int kPatches = 3;
    constexpr int kLevels = 6;
    glsl::tessLodPatchCount = kPatches;
    glsl::tessLodNormalLevelCount = kLevels;
    glsl::tessLodNormals.texels.clear();
    for (int level = 0; level < kLevels; ++level) {
        ASSERT_EQ(static_cast<std::size_t>(kPatches * glsl::tessLodNormalTexelsBelow(level)),
                  glsl::tessLodNormals.texels.size());
        for (std::uint32_t t = 0; t < kPatches * NormalTexture::texelCount(1U << level); ++t) {
            // About one direction, so that no mean of them vanishes.
            const std::uint32_t x = random.below(0x4000) & 0xFFFFU;
            glsl::tessLodNormals.texels.emplace_back(x | random.below(0x4000) << 16, 0U, 0U, 0U);
        }
    }
    for (unsigned k = 0; k < trials(5000); ++k) {
        const vec3 weights = given(random.weights());
        interpolated.add(glsl::tessLodPatchNormal(static_cast<int>(random.below(kPatches)), weights,
                                                  Twin::given(static_cast<float>(random.magnitude(1e-8, 10.0)))));
    }
    decoded.reportAs("normal");
    interpolated.reportAs("interpolated normal");
}

/// A row of tessLodNeeds with errors that fall as PatchBlocks has them.
void bindNeeds(Random& random, int levelCount)
{
    auto& texels = glsl::selection::tessLodNeeds.texels;
    texels.clear();
    const auto put = [&](std::array<double, 4> numbers) {
        uvec4 bits(0U);
        for (std::size_t k = 0; k < 4; ++k) {
            const auto value = static_cast<float>(numbers[k]);
            std::memcpy(&bits[k], &value, sizeof value);
        }
        texels.push_back(bits);
    };
    for (unsigned k = 0; k < 5; ++k) {
        put({random.between(-1, 1), random.between(-1, 1), random.between(-1, 1), 0.1});
    }
    double size = random.magnitude(1e-3, 0.1);
    const osg::Vec3d v = random.direction();
    for (int level = 0; level < levelCount; ++level) {
        const double square = size * size * 1.01;
        put({square - size * size * v.x() * v.x(), square - size * size * v.y() * v.y(),
             square - size * size * v.z() * v.z(), -size * size * v.x() * v.y()});
        put({-size * size * v.x() * v.z(), -size * size * v.y() * v.z(), std::sqrt(square), 0.0});
        size /= random.between(LevelNeed::kErrorRatio * 1.001, 6.0);
    }
    glsl::selection::tessLodLevelCount = levelCount;
    glsl::selection::tessLodTopLevel = levelCount - 1;
}

TEST(ShaderTwins, NeedsAreThoseOfDoublePrecision)
{
    using namespace glsl::selection;
    Deviation tolerances;
    Deviation errors;
    Worst levels;
    unsigned between = 0;
    for (unsigned k = 0; k < trials(5000); ++k) {
        Random random(k);
        bindNeeds(random, 7);
        tessLodOrthographic = random.chance(0.2);
        tessLodConservative = random.chance(0.6);
        tessLodIsotropic = random.chance(0.3);
        const osg::Vec3d eye = random.direction() * random.magnitude(1e-3, 1e4);
        for (std::size_t c = 0; c < 3; ++c) {
            const double each = eye[static_cast<int>(c)];
            const auto high = static_cast<float>(each);
            tessLodEyeHigh[c] = Twin::given(high);
            tessLodEyeLow[c] = Twin::given(static_cast<float>(each - double{high}));
        }
        const vec4 sphere(random.point(1.0), random.number(1e-3, 0.3));
        const osg::Vec3d toSphere(sphere.x.exact() - eye.x(), sphere.y.exact() - eye.y(), sphere.z.exact() - eye.z());
        osg::Vec3d axis = toSphere / toSphere.length() + random.direction() * 0.3;
        axis.normalize();
        for (std::size_t c = 0; c < 3; ++c) {
            tessLodAxis[c] = Twin::given(static_cast<float>(axis[static_cast<int>(c)]));
        }
        tessLodLeastCosine = random.number(0.01, 0.99);
        tessLodSlope = Twin::given(static_cast<float>(random.magnitude(1e-3, 0.1) / toSphere.length()));
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
    tessLodShadow = ivec3(0);
    for (unsigned k = 0; k < trials(2000); ++k) {
        Random random(k);
        tessLodFixedFunction = static_cast<int>(random.below(0x1000)) | 0x100;
        gl_LightModel.ambient = random.color();
        gl_MaterialParameters material{random.color(), random.color(), random.color(), random.color(),
                                       random.chance(0.2) ? Twin(0.0) : random.number(0.0, 128.0)};
        for (gl_LightSourceParameters& light : gl_LightSource) {
            light.ambient = random.color();
            light.diffuse = random.color();
            light.specular = random.color();
            light.position = vec4(random.point(100.0), random.chance(0.5) ? Twin(0.0) : Twin(1.0));
            light.spotDirection = random.unit();
            light.spotCutoff = Twin(random.chance(0.5) ? 180.0 : 90.0);
            light.spotCosCutoff = Twin(0.0);
            light.spotExponent = random.number(0.0, 128.0);
            light.constantAttenuation = Twin(1.0);
            light.linearAttenuation = random.number(0.0, 0.1);
            light.quadraticAttenuation = random.number(0.0, 0.1);
        }
        const vec3 position = random.point(10.0);
        lit.add(tessLodLitColor(position, random.unit(), material));
        gl_Fog.color = random.color();
        gl_Fog.density = random.number(0.0, 0.2);
        gl_Fog.start = random.number(0.0, 5.0);
        gl_Fog.end = random.number(6.0, 20.0);
        gl_Fog.scale = Twin(1.0) / (gl_Fog.end - gl_Fog.start);
        fogged.add(tessLodFoggedColor(random.color(), position));
    }
    lit.reportAs("lit colour");
    fogged.reportAs("colour in fog");
}

} // namespace
} // namespace osgTessLOD::stress
