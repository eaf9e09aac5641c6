// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/FixedFunction.h>

#include <osg/Fog>
#include <osg/GLExtensions>
#include <osg/LightModel>
#include <osg/Program>
#include <osg/State>
#include <osg/TexGen>
#include <osg/Texture>
#include <osg/Uniform>

#include <array>
#include <optional>

namespace osgTessLOD {

namespace {

/// tessLodFixedFunction of tesslod_lighting.glsl.
int fixedFunctionBits(const osg::State& state)
{
    int bits = 0;
    for (int k = 0; k < 8; ++k) {
        if (state.getLastAppliedMode(static_cast<GLenum>(GL_LIGHT0 + k))) { bits |= 1 << k; }
    }
    if (state.getLastAppliedMode(GL_LIGHTING)) { bits |= 0x100; }
    const auto* model =
        dynamic_cast<const osg::LightModel*>(state.getLastAppliedAttribute(osg::StateAttribute::LIGHTMODEL));
    if (model != nullptr && model->getLocalViewer()) { bits |= 0x200; }
    if (model != nullptr && model->getTwoSided()) { bits |= 0x1000; }
    const auto* fog = dynamic_cast<const osg::Fog*>(state.getLastAppliedAttribute(osg::StateAttribute::FOG));
    if (fog != nullptr && state.getLastAppliedMode(GL_FOG)) {
        bits |= (fog->getMode() == osg::Fog::LINEAR ? 1 : fog->getMode() == osg::Fog::EXP ? 2 : 3) << 10;
    }
    return bits;
}

constexpr int kTexCoordUnits = 8; ///< that OpenGL has eye planes for

/// The texture unit that the uniform names, if a shadow map can be read there.
std::optional<int> shadowMapUnit(const osg::State& state, const char* uniformName)
{
    const osg::State::UniformMap& uniforms = state.getUniformMap();
    const auto found = uniforms.find(uniformName);
    if (found == uniforms.end() || found->second.uniformVec.empty()) { return std::nullopt; }
    int unit = -1;
    if (!found->second.uniformVec.back().first->get(unit) || unit < 0 || unit >= kTexCoordUnits) { return std::nullopt; }
    const auto number = static_cast<unsigned>(unit);
    const auto* map =
        dynamic_cast<const osg::Texture*>(state.getLastAppliedTextureAttribute(number, osg::StateAttribute::TEXTURE));
    const bool isMap = map != nullptr && map->getShadowComparison() && state.getLastAppliedTextureMode(number, GL_TEXTURE_GEN_S);
    return isMap ? std::optional<int>(unit) : std::nullopt;
}

/// tessLodShadow of tesslod_shadow.glsl.
struct ShadowMaps {
    int technique = 0;
    std::array<int, 2> units{-1, -1};
};

ShadowMaps shadowMaps(const osg::State& state)
{
    if (const auto unit = shadowMapUnit(state, "osgShadow_shadowTexture")) { return {1, {*unit, -1}}; }
    const auto first = shadowMapUnit(state, "shadowTexture0");
    const auto second = shadowMapUnit(state, "shadowTexture1");
    return first ? ShadowMaps{2, {*first, second.value_or(-1)}} : ShadowMaps();
}

} // namespace

void applyFixedFunctionUniforms(osg::State& state)
{
    static const unsigned bits = osg::Uniform::getNameID("tessLodFixedFunction");
    static const unsigned textured = osg::Uniform::getNameID("tessLodTextured"); // of tesslod_color.glsl
    static const unsigned shadow = osg::Uniform::getNameID("tessLodShadow");
    static const std::array<unsigned, 2> maps{osg::Uniform::getNameID("tessLodShadowMap0"),
                                              osg::Uniform::getNameID("tessLodShadowMap1")};
    const osg::Program::PerContextProgram& program = *state.getLastAppliedProgramObject();
    const auto* gl = state.get<osg::GLExtensions>();
    const GLint texturedAt = program.getUniformLocation(textured);
    if (texturedAt >= 0) { gl->glUniform1i(texturedAt, state.getLastAppliedTextureMode(0, GL_TEXTURE_2D) ? 1 : 0); }
    const GLint bitsAt = program.getUniformLocation(bits);
    if (bitsAt >= 0) { gl->glUniform1i(bitsAt, fixedFunctionBits(state)); }
    const GLint shadowAt = program.getUniformLocation(shadow);
    if (shadowAt < 0) { return; }
    const ShadowMaps found = shadowMaps(state);
    gl->glUniform3i(shadowAt, found.technique, found.units[0], found.units[1]);
    for (std::size_t k = 0; k < maps.size(); ++k) {
        const GLint at = program.getUniformLocation(maps[k]);
        if (at >= 0) { gl->glUniform1i(at, found.units[k] >= 0 ? found.units[k] : kNoShadowUnit); }
    }
}

} // namespace osgTessLOD
