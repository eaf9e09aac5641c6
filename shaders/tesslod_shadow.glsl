// SPDX-License-Identifier: MIT
// What the shadow maps of osgShadow leave of the light, as the techniques' own fragment shaders have it.
//
// Shared text: pasted behind the #version line of the stages that need it.
//
// In: tessLodShadow           technique (0 none, 1 ShadowMap, 2 ViewDependentShadowMap); texture units of its maps, −1: no second
//     tessLodShadowMap0, 1    the maps; not read without a technique
//     gl_EyePlane*            from eye space to the maps' coordinates, by unit
//     osgShadow_ambientBias   ShadowMap's own: light where it is dark, and what is added where it is not

uniform ivec3 tessLodShadow;
uniform sampler2DShadow tessLodShadowMap0;
uniform sampler2DShadow tessLodShadowMap1;
uniform vec2 osgShadow_ambientBias;

// Of eye-space `position` in the map of a unit, homogeneous.
vec4 tessLodShadowCoord(int unit, vec3 position)
{
    vec4 p = vec4(position, 1.0);
    return vec4(dot(gl_EyePlaneS[unit], p), dot(gl_EyePlaneT[unit], p), dot(gl_EyePlaneR[unit], p),
                dot(gl_EyePlaneQ[unit], p));
}

// How much of the light arrives at eye-space `position`: 0 in the shadow, 1 out of it or without shadows.
float tessLodLightReceived(vec3 position)
{
    if (tessLodShadow.x == 0) { return 1.0; }
    float received = textureProj(tessLodShadowMap0, tessLodShadowCoord(tessLodShadow.y, position));
    if (tessLodShadow.z >= 0) {
        received *= textureProj(tessLodShadowMap1, tessLodShadowCoord(tessLodShadow.z, position));
    }
    return received;
}

// `lit`, the colour in the light, as it is at eye-space `position`; `unlit` is what is left without any light.
vec4 tessLodShadowedColor(vec4 lit, vec3 unlit, vec3 position)
{
    if (tessLodShadow.x == 0) { return lit; }
    float received = tessLodLightReceived(position);
    vec3 color = tessLodShadow.x == 1 ? lit.rgb * (osgShadow_ambientBias.x + received * osgShadow_ambientBias.y)
                                      : mix(unlit, lit.rgb, received);
    return vec4(color, lit.a);
}
