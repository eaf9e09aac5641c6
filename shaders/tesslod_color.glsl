// SPDX-License-Identifier: MIT
// The colour that the surface itself has, as OpenGL's fixed function takes it from vertex colours and texture unit 0.
//
// Shared text: pasted behind the #version line of the fragment stage, before tesslod_lighting.glsl.
//
// In: tessLodColor         the source's colour                                                        (with TESSLOD_COLORS)
//     tessLodTexCoord      texture coordinates u, v, and how much of the point has any                (with TESSLOD_UVS)
//     tessLodColorTexture  the scene's texture of unit 0; tessLodTextured: whether it is on           (with TESSLOD_UVS)

#if defined(TESSLOD_COLORS)
in vec4 tessLodColor;
#endif
#if defined(TESSLOD_UVS)
in vec3 tessLodTexCoord;
uniform sampler2D tessLodColorTexture;
uniform bool tessLodTextured;
#endif

// Ambient or diffuse colour of the material `material`: the source's own colour where it has one, as under
// glColorMaterial(…, GL_AMBIENT_AND_DIFFUSE).
vec4 tessLodBaseColor(vec4 material)
{
#if defined(TESSLOD_COLORS)
    return tessLodColor;
#else
    return material;
#endif
}

// What the lit colour is to be multiplied with (GL_MODULATE): the texture, white where there is none.
vec4 tessLodTextureColor()
{
#if defined(TESSLOD_UVS)
    if (tessLodTextured) {
        vec4 at = gl_TextureMatrix[0] * vec4(tessLodTexCoord.xy, 0.0, 1.0);
        return mix(vec4(1.0), texture(tessLodColorTexture, at.xy / at.w), tessLodTexCoord.z);
    }
#endif
    return vec4(1.0);
}
