// SPDX-License-Identifier: MIT
// Random input of the shaders' functions, and how far off their results are. For one source file of an executable, as
// ShaderTwins.h.
#pragma once

#include <stress/Random.h>
#include <stress/ShaderTwins.h>
#include <stress/Stress.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/LevelNeed.h>
#include <support/RandomDirection.h>

#include <osg/Matrixd>
#include <osg/Vec3d>

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <random>
#include <string>
#include <vector>

namespace osgTessLOD::stress {

using glsl::uvec4;
using glsl::vec3;
using glsl::vec4;

/// Random input of shaders.
class TwinRandom : public Random {
public:
    using Random::Random;
    std::uint32_t bits() { return static_cast<std::uint32_t>(generator()()); }
    osg::Vec3d viewDirection() { return randomDirection(generator()); }
    Twin number(double from, double to) { return Twin::given(static_cast<float>(between(from, to))); }
    vec3 point(double size) { return vec3(number(-size, size), number(-size, size), number(-size, size)); }
    vec3 unit()
    {
        const osg::Vec3d d = viewDirection();
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
};

/// How far single precision is off: in units in the last place of the largest number that a result, or another component of it, is
/// the sum of; and as a part of what the running error analysis allows.
class Deviation {
public:
    template <std::size_t N> void add(const glsl::Vec<Twin, N>& v)
    {
        double largest = 0.0;
        for (std::size_t k = 0; k < N; ++k) { largest = std::max(largest, v[k].summand()); }
        for (std::size_t k = 0; k < N; ++k) { add(v[k], largest); }
    }
    void add(const Twin& x) { add(x, x.summand()); }

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

inline vec3 given(const std::array<float, 3>& v)
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

/// As texture buffers of integers hold it.
inline uvec4 bitsOf(const vec4& v)
{
    uvec4 bits(0U);
    for (std::size_t k = 0; k < 4; ++k) {
        const float value = v[k].single();
        std::memcpy(&bits[k], &value, sizeof value);
    }
    return bits;
}

inline osg::Matrixd randomAffine(TwinRandom& random, double size)
{
    const osg::Vec3d turn = random.viewDirection() * random.magnitude(1e-6, 10.0);
    const osg::Matrixd scale = osg::Matrixd::scale(random.magnitude(1e-3, 1e3), random.magnitude(1e-3, 1e3),
                                                   random.between(-1.0, 1.0) * random.magnitude(1e-3, 1e3));
    return scale * osg::Matrixd::rotate(turn.length(), turn) *
           osg::Matrixd::translate(random.viewDirection() * size * random.magnitude(1e-6, 1e3));
}

/// A row of the matrix, less `identity` times the unit matrix's, as the GPU has it.
inline vec4 rowOf(const osg::Matrixd& matrix, int row, double identity)
{
    const auto number = [&](int column) {
        return Twin::given(static_cast<float>(matrix(column, row) - (column == row ? identity : 0.0)));
    };
    return vec4(number(0), number(1), number(2), number(3));
}

/// A transform per base vertex, which are returned, and what the shaders know of the asset's patches.
inline std::vector<osg::Matrixd> bindDeformation(const LodAsset& asset, TwinRandom& random)
{
    std::vector<osg::Matrixd> transforms;
    glsl::tessLodDeformation.texels.clear();
    for (std::size_t v = 0; v < asset.baseVertices.size(); ++v) {
        transforms.push_back(randomAffine(random, 1.0));
        for (int row = 0; row < 3; ++row) {
            glsl::tessLodDeformation.texels.push_back(rowOf(transforms.back(), row, 1.0));
        }
    }
    glsl::tessLodDeformedPatches.texels.clear();
    for (const LodPatch& patch : asset.patches) {
        std::array<std::uint32_t, 3> corners{0, 1, 2};
        std::sort(corners.begin(), corners.end(),
                  [&](auto a, auto b) { return patch.baseVertices[a] < patch.baseVertices[b]; });
        const auto vertex = [&](std::size_t i) { return patch.baseVertices[corners[i]]; };
        glsl::tessLodDeformedPatches.texels.emplace_back(vertex(0), vertex(1), vertex(2),
                                                         corners[0] | corners[1] << 2 | corners[2] << 4);
        for (int gradient = 0; gradient < 2; ++gradient) {
            glsl::tessLodDeformedPatches.texels.push_back(bitsOf(vec4(random.point(2.0), Twin(0.0))));
        }
    }
    return transforms;
}

/// Grids of normals about one direction, so that no mean of them vanishes.
constexpr int kNormalPatches = 3;
constexpr int kNormalLevels = 6;
inline void bindNormals(TwinRandom& random)
{
    glsl::tessLodPatchCount = kNormalPatches;
    glsl::tessLodNormalLevelCount = kNormalLevels;
    glsl::tessLodNormals.texels.clear();
    for (int level = 0; level < kNormalLevels; ++level) {
        for (std::uint32_t t = 0; t < kNormalPatches * NormalTexture::texelCount(1U << level); ++t) {
            const std::uint32_t x = random.below(0x4000);
            glsl::tessLodNormals.texels.emplace_back(x | random.below(0x4000) << 16, 0U, 0U, 0U);
        }
    }
}

/// A row of tessLodNeeds with errors that fall as PatchBlocks has them.
inline void bindNeeds(TwinRandom& random, int levelCount)
{
    auto& texels = glsl::selection::tessLodNeeds.texels;
    texels.clear();
    const auto put = [&](const std::array<double, 4>& numbers) {
        vec4 rounded;
        for (std::size_t k = 0; k < 4; ++k) { rounded[k] = Twin::given(static_cast<float>(numbers[k])); }
        texels.push_back(bitsOf(rounded));
    };
    for (unsigned k = 0; k < 5; ++k) {
        put({random.between(-1, 1), random.between(-1, 1), random.between(-1, 1), 0.1});
    }
    double size = random.magnitude(1e-3, 0.1);
    const osg::Vec3d v = random.viewDirection();
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

/// A view in which a sphere, which is returned, needs one level or another.
inline vec4 bindView(TwinRandom& random)
{
    using namespace glsl::selection;
    tessLodOrthographic = random.chance(0.2);
    tessLodConservative = random.chance(0.6);
    tessLodIsotropic = random.chance(0.3);
    const osg::Vec3d eye = random.viewDirection() * random.magnitude(1e-3, 1e4);
    for (std::size_t c = 0; c < 3; ++c) {
        const double each = eye[static_cast<int>(c)];
        const auto high = static_cast<float>(each);
        tessLodEyeHigh[c] = Twin::given(high);
        tessLodEyeLow[c] = Twin::given(static_cast<float>(each - double{high}));
    }
    const vec4 sphere(random.point(1.0), random.number(1e-3, 0.3));
    const osg::Vec3d toSphere(sphere.x.exact() - eye.x(), sphere.y.exact() - eye.y(), sphere.z.exact() - eye.z());
    osg::Vec3d axis = toSphere / toSphere.length() + random.viewDirection() * 0.3;
    axis.normalize();
    for (std::size_t c = 0; c < 3; ++c) { tessLodAxis[c] = Twin::given(static_cast<float>(axis[static_cast<int>(c)])); }
    tessLodLeastCosine = random.number(0.01, 0.99);
    tessLodSlope = Twin::given(static_cast<float>(random.magnitude(1e-3, 0.1) / toSphere.length()));
    return sphere;
}

/// Eight lights of any kind, a material, which is returned, and fog.
inline glsl::gl_MaterialParameters bindLights(TwinRandom& random)
{
    using namespace glsl;
    tessLodShadow = ivec3(0);
    tessLodFixedFunction = static_cast<int>(random.below(0x1000)) | 0x100;
    gl_LightModel.ambient = random.color();
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
    gl_Fog.color = random.color();
    gl_Fog.density = random.number(0.0, 0.2);
    gl_Fog.start = random.number(0.0, 5.0);
    gl_Fog.end = random.number(6.0, 20.0);
    gl_Fog.scale = Twin(1.0) / (gl_Fog.end - gl_Fog.start);
    return {random.color(), random.color(), random.color(), random.color(),
            random.chance(0.2) ? Twin(0.0) : random.number(0.0, 128.0)};
}

} // namespace osgTessLOD::stress
