// SPDX-License-Identifier: MIT
// The shaders' functions as the driver computes them against double precision: where no C++ twin promises the same bits.
#include <stress/ShaderTwinCases.h>

#include <asset/SyntheticAsset.h>
#include <render/GlTest.h>

#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/ShaderSource.h>

#include <osg/GLExtensions>
#include <osg/Program>
#include <osg/StateSet>
#include <osg/TextureBuffer>

namespace osgTessLOD::stress {
namespace {

/// Texels of input that a call has.
constexpr std::size_t kInputs = 3;

class ShaderTwinsGl : public GlTest {
protected:
    /// From here on calls are of a function of these shared texts: `call` sets `result` from `given(0 … kInputs − 1)`.
    void prepare(const std::vector<std::string>& shared, const std::string& define, const std::string& call)
    {
        _set = new osg::StateSet;
        _unit = 0;
        _inputs.texels.clear();
        const std::string text = "#version 420 compatibility\n"
                                 "#pragma import_defines(" +
                                 define +
                                 ")\n"
                                 "uniform samplerBuffer stressInputs;\n"
                                 "vec4 given(int k) { return texelFetch(stressInputs, " +
                                 std::to_string(kInputs) +
                                 " * gl_VertexID + k); }\n"
                                 "out vec4 result;\n"
                                 "void main() {\n" +
                                 call + "\n}\n";
        const osg::ref_ptr<osg::Program> program = new osg::Program;
        program->addShader(createShaderFromText(osg::Shader::VERTEX, text, shared).get());
        program->addTransformFeedBackVarying("result");
        program->setTransformFeedBackMode(GL_INTERLEAVED_ATTRIBS);
        _set->setAttributeAndModes(program.get());
        _set->setDefine(define);
    }
    osg::StateSet& set() { return *_set; }

    void texels(const char* sampler, const glsl::samplerBuffer& buffer)
    {
        const osg::ref_ptr<osg::Vec4Array> data = new osg::Vec4Array;
        for (const vec4& v : buffer.texels) {
            data->push_back({v.x.single(), v.y.single(), v.z.single(), v.w.single()});
        }
        addBuffer(sampler, data.get(), GL_RGBA32F_ARB, 1);
    }
    /// With all four numbers of a texel, or the first.
    void texels(const char* sampler, const glsl::usamplerBuffer& buffer, unsigned numbers)
    {
        const osg::ref_ptr<osg::UIntArray> data = new osg::UIntArray;
        for (const uvec4& v : buffer.texels) {
            for (std::size_t k = 0; k < numbers; ++k) { data->push_back(v[k]); }
        }
        addBuffer(sampler, data.get(), numbers == 4 ? GL_RGBA32UI : GL_R32UI, numbers);
    }

    /// What the next call is given.
    void give(const std::array<vec4, kInputs>& inputs)
    {
        _inputs.texels.insert(_inputs.texels.end(), inputs.begin(), inputs.end());
    }
    std::vector<osg::Vec4f> results()
    {
        texels("stressInputs", _inputs);
        state().pushStateSet(_set.get());
        state().apply();
        std::vector<osg::Vec4f> found(_inputs.texels.size() / kInputs);
        capture(found);
        state().popStateSet();
        state().apply();
        _inputs.texels.clear();
        --_unit; // the next ones take its place
        return found;
    }

private:
    void addBuffer(const char* sampler, osg::Array* data, GLenum format, std::size_t numbersPerTexel)
    {
        data->setBufferObject(new osg::VertexBufferObject);
        const osg::ref_ptr<osg::TextureBuffer> texture = new osg::TextureBuffer(data);
        texture->setInternalFormat(static_cast<GLint>(format));
        texture->setTextureWidth(static_cast<int>(data->getNumElements() / numbersPerTexel));
        _set->setTextureAttribute(_unit, texture.get());
        _set->addUniform(new osg::Uniform(sampler, static_cast<int>(_unit++)));
    }

    void capture(std::vector<osg::Vec4f>& found)
    {
        const auto& gl = *state().get<osg::GLExtensions>();
        const auto bytes = static_cast<GLsizeiptr>(found.size() * sizeof(osg::Vec4f));
        GLuint buffer = 0;
        gl.glGenBuffers(1, &buffer);
        gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
        gl.glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_STREAM_DRAW_ARB);
        glEnable(GL_RASTERIZER_DISCARD);
        gl.glBeginTransformFeedback(GL_POINTS);
        glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(found.size()));
        gl.glEndTransformFeedback();
        glDisable(GL_RASTERIZER_DISCARD);
        gl.glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, found.data());
        gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
        gl.glDeleteBuffers(1, &buffer);
    }

    osg::ref_ptr<osg::StateSet> _set;
    unsigned _unit = 0;
    glsl::samplerBuffer _inputs;
};

osg::Vec3f toOsg(const vec3& v)
{
    return {v.x.single(), v.y.single(), v.z.single()};
}

vec4 given4(const vec3& v, const Twin& w = Twin(0.0))
{
    return vec4(v, w);
}

/// The expected numbers with the driver's in the place of the processor's.
template <std::size_t N> glsl::Vec<Twin, N> asDriven(const glsl::Vec<Twin, N>& expected, const osg::Vec4f& driven)
{
    glsl::Vec<Twin, N> v;
    for (std::size_t k = 0; k < N; ++k) { v[k] = expected[k].computedAs(driven[static_cast<unsigned>(k)]); }
    return v;
}

TEST_F(ShaderTwinsGl, normals)
{
    TwinRandom random(3);
    bindNormals(random);
    prepare({"tesslod_normal.glsl"}, "TESSLOD_NORMALS",
            "result = vec4(given(1).x < 0.0 ? tessLodOctahedralNormal(floatBitsToUint(given(0).x))"
            " : tessLodPatchNormal(int(given(1).y), given(0).xyz, given(1).x), 0.0);");
    texels("tessLodNormals", glsl::tessLodNormals, 1);
    set().addUniform(new osg::Uniform("tessLodPatchCount", glsl::tessLodPatchCount));
    set().addUniform(new osg::Uniform("tessLodNormalLevelCount", glsl::tessLodNormalLevelCount));
    std::vector<vec3> expected;
    const unsigned count = trials(5000);
    for (unsigned k = 0; k < count; ++k) {
        const bool decodes = k % 2 == 0;
        // Bits that are a normal number, which no driver flushes to 0.
        const std::uint32_t bits = (random.bits() & 0x3FFFFFFFU) | 0x00800000U;
        const vec3 weights = given(random.weights());
        const Twin footprint = Twin::given(static_cast<float>(random.magnitude(1e-8, 10.0)));
        const auto patch = static_cast<int>(random.below(kNormalPatches));
        expected.push_back(decodes ? glsl::tessLodOctahedralNormal(bits)
                                   : glsl::tessLodPatchNormal(patch, weights, footprint));
        give({given4(decodes ? vec3(glsl::uintBitsToFloat(bits)) : weights),
              vec4(decodes ? Twin(-1.0) : footprint, Twin(patch), Twin(0.0), Twin(0.0)), vec4(0.0)});
    }
    const std::vector<osg::Vec4f> found = results();
    Deviation deviation;
    for (std::size_t k = 0; k < count; ++k) { deviation.add(asDriven(expected[k], found[k])); }
    deviation.reportAs("normal, on the GPU");
}

TEST_F(ShaderTwinsGl, deformedPositionsAndNormals)
{
    const LodAsset asset = makeSyntheticAsset(2, false);
    Deviation positions;
    Deviation normals;
    for (unsigned k = 0; k < trials(10); ++k) {
        TwinRandom random(k);
        bindDeformation(asset, random);
        prepare({"tesslod_deformation.glsl"}, "TESSLOD_DEFORMATION",
                "bool mirrors; int patchId = int(given(0).w);"
                "result = vec4(gl_VertexID % 2 == 0 ? tessLodDeformed(given(0).xyz, given(1).xyz, patchId)"
                " : tessLodDeformedNormal(given(2).xyz, tessLodDeformationRows(given(0).xyz, given(1).xyz, patchId), "
                "mirrors), 0.0);");
        texels("tessLodDeformation", glsl::tessLodDeformation);
        texels("tessLodDeformedPatches", glsl::tessLodDeformedPatches, 4);
        std::vector<vec3> expected;
        for (unsigned i = 0; i < 200; ++i) {
            const vec3 at = random.point(1.0);
            const vec3 weights = given(random.weights());
            const vec3 normal = random.unit();
            const auto patch = static_cast<int>(random.below(static_cast<std::uint32_t>(asset.patches.size())));
            bool mirrors = false;
            expected.push_back(i % 2 == 0 ? glsl::tessLodDeformed(at, weights, patch)
                                          : glsl::tessLodDeformedNormal(
                                                normal, glsl::tessLodDeformationRows(at, weights, patch), mirrors));
            give({given4(at, Twin(patch)), given4(weights), given4(normal)});
        }
        const std::vector<osg::Vec4f> found = results();
        for (std::size_t i = 0; i < found.size(); ++i) {
            (i % 2 == 0 ? positions : normals).add(asDriven(expected[i], found[i]));
        }
    }
    positions.reportAs("deformed position, on the GPU");
    normals.reportAs("deformed normal, on the GPU");
}

TEST_F(ShaderTwinsGl, needs)
{
    using namespace glsl::selection;
    Deviation tolerances;
    Deviation errors;
    Worst levels;
    for (unsigned k = 0; k < trials(40); ++k) {
        TwinRandom random(k);
        bindNeeds(random, 7);
        bindView(random);
        prepare({"tesslod_need.glsl"}, "TESSLOD_SELECTION",
                "TessLodSight sight = tessLodSee(given(0));"
                "result = vec4(sight.tolerance, tessLodErrorOf(0, int(given(1).x), sight), tessLodNeed(0, given(0)), "
                "0.0);");
        texels("tessLodNeeds", tessLodNeeds, 4);
        set().addUniform(new osg::Uniform("tessLodLevelCount", tessLodLevelCount));
        set().addUniform(new osg::Uniform("tessLodTopLevel", tessLodTopLevel));
        set().addUniform(new osg::Uniform("tessLodEyeHigh", toOsg(tessLodEyeHigh)));
        set().addUniform(new osg::Uniform("tessLodEyeLow", toOsg(tessLodEyeLow)));
        set().addUniform(new osg::Uniform("tessLodAxis", toOsg(tessLodAxis)));
        set().addUniform(new osg::Uniform("tessLodSlope", tessLodSlope.single()));
        set().addUniform(new osg::Uniform("tessLodLeastCosine", tessLodLeastCosine.single()));
        set().addUniform(new osg::Uniform("tessLodOrthographic", tessLodOrthographic));
        set().addUniform(new osg::Uniform("tessLodConservative", tessLodConservative));
        set().addUniform(new osg::Uniform("tessLodIsotropic", tessLodIsotropic));
        std::vector<vec3> expected;
        for (unsigned i = 0; i < 100; ++i) {
            const vec4 sphere(random.point(1.0), random.number(1e-3, 0.3));
            const auto level = static_cast<int>(random.below(7));
            const TessLodSight sight = tessLodSee(sphere);
            expected.push_back(vec3(sight.tolerance, tessLodErrorOf(0, level, sight), tessLodNeed(0, sphere)));
            give({sphere, vec4(Twin(level), Twin(0.0), Twin(0.0), Twin(0.0)), vec4(0.0)});
        }
        const std::vector<osg::Vec4f> found = results();
        for (std::size_t i = 0; i < found.size(); ++i) {
            const vec3 driven = asDriven(expected[i], found[i]);
            tolerances.add(driven.x);
            errors.add(driven.y);
            // Where a decision is close the driver may decide otherwise; the need is continuous.
            ASSERT_LE(driven.z.error(), 2.0 * driven.z.bound() + 1e-5) << k;
            levels.add(driven.z.error());
        }
    }
    tolerances.reportAs("tolerance, on the GPU");
    errors.reportAs("error as seen, on the GPU");
    report("level needed, on the GPU, levels", levels.value());
}

void setLight(GLenum light, GLenum parameter, const vec4& value)
{
    const std::array<float, 4> numbers{value.x.single(), value.y.single(), value.z.single(), value.w.single()};
    glLightfv(light, parameter, numbers.data());
}

void setMaterial(GLenum parameter, const vec4& value)
{
    const std::array<float, 4> numbers{value.x.single(), value.y.single(), value.z.single(), value.w.single()};
    glMaterialfv(GL_FRONT_AND_BACK, parameter, numbers.data());
}

void setFixedFunction(const glsl::gl_MaterialParameters& material)
{
    glMatrixMode(GL_MODELVIEW);
    glLoadIdentity();
    setMaterial(GL_EMISSION, material.emission);
    setMaterial(GL_AMBIENT, material.ambient);
    setMaterial(GL_DIFFUSE, material.diffuse);
    setMaterial(GL_SPECULAR, material.specular);
    glMaterialf(GL_FRONT_AND_BACK, GL_SHININESS, material.shininess.single());
    for (unsigned k = 0; k < 8; ++k) {
        const glsl::gl_LightSourceParameters& from = glsl::gl_LightSource[k];
        const GLenum light = GL_LIGHT0 + k;
        setLight(light, GL_AMBIENT, from.ambient);
        setLight(light, GL_DIFFUSE, from.diffuse);
        setLight(light, GL_SPECULAR, from.specular);
        setLight(light, GL_POSITION, from.position);
        setLight(light, GL_SPOT_DIRECTION, given4(from.spotDirection));
        glLightf(light, GL_SPOT_CUTOFF, from.spotCutoff.single());
        glLightf(light, GL_SPOT_EXPONENT, from.spotExponent.single());
        glLightf(light, GL_CONSTANT_ATTENUATION, from.constantAttenuation.single());
        glLightf(light, GL_LINEAR_ATTENUATION, from.linearAttenuation.single());
        glLightf(light, GL_QUADRATIC_ATTENUATION, from.quadraticAttenuation.single());
    }
    const vec4& a = glsl::gl_LightModel.ambient;
    const std::array<float, 4> ambient{a.x.single(), a.y.single(), a.z.single(), a.w.single()};
    glLightModelfv(GL_LIGHT_MODEL_AMBIENT, ambient.data());
    const vec4& c = glsl::gl_Fog.color;
    const std::array<float, 4> color{c.x.single(), c.y.single(), c.z.single(), c.w.single()};
    glFogfv(GL_FOG_COLOR, color.data());
    glFogf(GL_FOG_DENSITY, glsl::gl_Fog.density.single());
    glFogf(GL_FOG_START, glsl::gl_Fog.start.single());
    glFogf(GL_FOG_END, glsl::gl_Fog.end.single());
}

TEST_F(ShaderTwinsGl, lightsAndFog)
{
    Deviation lit;
    Deviation fogged;
    for (unsigned k = 0; k < trials(20); ++k) {
        TwinRandom random(k);
        const glsl::gl_MaterialParameters material = bindLights(random);
        prepare({"tesslod_shadow.glsl", "tesslod_lighting.glsl"}, "TESSLOD_NOTHING",
                "result = gl_VertexID % 2 == 0 ? tessLodLitColor(given(0).xyz, given(1).xyz, gl_FrontMaterial)"
                " : tessLodFoggedColor(given(2), given(0).xyz);");
        set().addUniform(new osg::Uniform("tessLodFixedFunction", glsl::tessLodFixedFunction));
        // Not read, but no unit may have textures of two kinds.
        set().addUniform(new osg::Uniform("tessLodShadowMap0", 6));
        set().addUniform(new osg::Uniform("tessLodShadowMap1", 7));
        std::vector<vec4> expected;
        for (unsigned i = 0; i < 50; ++i) {
            const vec3 position = random.point(10.0);
            const vec3 normal = random.unit();
            const vec4 color = random.color();
            expected.push_back(i % 2 == 0 ? glsl::tessLodLitColor(position, normal, material)
                                          : glsl::tessLodFoggedColor(color, position));
            give({given4(position), given4(normal), color});
        }
        setFixedFunction(material);
        const std::vector<osg::Vec4f> found = results();
        for (std::size_t i = 0; i < found.size(); ++i) {
            (i % 2 == 0 ? lit : fogged).add(asDriven(expected[i], found[i]));
        }
    }
    lit.reportAs("lit colour, on the GPU");
    fogged.reportAs("colour in fog, on the GPU");
}

} // namespace
} // namespace osgTessLOD::stress
