// SPDX-License-Identifier: MIT
// Shades the surface as OpenGL's fixed function would, per fragment. What SurfaceShading, or a file of this name on
// OSG_FILE_PATH, replaces: docs/shading.md.
//
// Shared text: pasted behind the #version line of the stages that need it, after tesslod_lighting.glsl and tesslod_fragment.glsl.

vec4 tessLodShade(TessLodFragment fragment)
{
    vec4 color = tessLodLitColor(fragment.position, fragment.normal, fragment.material) * tessLodTextureColor();
    return tessLodFoggedColor(color, fragment.position);
}
