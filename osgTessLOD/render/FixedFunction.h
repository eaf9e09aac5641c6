// SPDX-License-Identifier: MIT
#pragma once

namespace osg {
class State;
}

namespace osgTessLOD {

/// Texture unit that the shadow samplers read from while there is no shadow technique: one that nothing else uses, as samplers
/// of different kinds must not share a unit. Applications leave it alone.
constexpr int kNoShadowUnit = 9;

/// Tells the program that `state` applied last, one with tesslod_lighting.glsl, what is on in `state`: lighting, lights, fog, and
/// the shadow maps of osgShadow. Call it when all of the state is applied, before each draw.
///
/// Shadow maps are found by what osgShadow's techniques leave in the state: the uniform that names a map's texture unit, a depth
/// texture with comparison on that unit, and texture coordinates that are generated for it (eye planes). ShadowMap:
/// osgShadow_shadowTexture; ViewDependentShadowMap: shadowTexture0 and shadowTexture1.
void applyFixedFunctionUniforms(osg::State& state);

} // namespace osgTessLOD
