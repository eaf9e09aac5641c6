// SPDX-License-Identifier: MIT
// The functions of shaders/*.glsl, from the very text that GPUs get, as C++ functions of Twins. For one source file of an
// executable: what the shaders have as uniforms are its variables.
#pragma once

#include <stress/Glsl.h>

namespace osgTessLOD::stress::glsl {

struct gl_MaterialParameters {
    vec4 emission, ambient, diffuse, specular;
    Twin shininess;
};
struct gl_LightSourceParameters {
    vec4 ambient, diffuse, specular, position;
    vec3 spotDirection;
    Twin spotExponent, spotCutoff, spotCosCutoff, constantAttenuation, linearAttenuation, quadraticAttenuation;
};
static gl_MaterialParameters gl_FrontMaterial, gl_BackMaterial;
static std::array<gl_LightSourceParameters, 8> gl_LightSource;
static struct {
    vec4 ambient;
} gl_LightModel;
static struct {
    vec4 color;
    Twin density, start, end, scale;
} gl_Fog;
static std::array<vec4, 8> gl_EyePlaneS, gl_EyePlaneT, gl_EyePlaneR, gl_EyePlaneQ;

/// Without shadows none is read.
struct sampler2DShadow {};
inline Twin textureProj(sampler2DShadow, const vec4&)
{
    return Twin(1.0);
}

#define float Twin
#define precise
#define uniform static
#define in
#define out
#define xy swizzle<0, 1>()
#define yx swizzle<1, 0>()
#define yz swizzle<1, 2>()
#define rg swizzle<0, 1>()
#define xyz swizzle<0, 1, 2>()
#define rgb swizzle<0, 1, 2>()

#define TESSLOD_NORMALS
#define TESSLOD_PARAMETERS
#define TESSLOD_UVS
#define TESSLOD_COLORS
#define TESSLOD_PLACEMENTS
#define TESSLOD_DEFORMATION
#define TESSLOD_SELECTION

// In the order in which the stages paste them.
// clang-format off
#include <tesslod_pattern.glsl>
#include <tesslod_surface.glsl>
#include <tesslod_deformation.glsl>
#include <tesslod_placement.glsl>
#include <tesslod_normal.glsl>
#include <tesslod_shadow.glsl>
#include <tesslod_lighting.glsl>
// clang-format on

// Another stage's, which has a uniform of its own by the name of one above.
namespace selection {
#include <tesslod_need.glsl>
}

#undef float
#undef precise
#undef uniform
#undef in
#undef out
#undef xy
#undef yx
#undef yz
#undef rg
#undef xyz
#undef rgb

} // namespace osgTessLOD::stress::glsl
