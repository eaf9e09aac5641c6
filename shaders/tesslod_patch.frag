#version 330 compatibility
// SPDX-License-Identifier: MIT
// Gathers what is known of the surface at a fragment and has tessLodShade colour it.
// Needs tesslod_precise.glsl, tesslod_deformation.glsl, tesslod_normal.glsl, tesslod_color.glsl, tesslod_shadow.glsl, tesslod_lighting.glsl, tesslod_fragment.glsl
// and tesslod_shade.glsl.
// In: tessLodEyePosition    eye space
//     tessLodWeights        corner weights in the patch, tessLodFragmentPatch   (with TESSLOD_NORMALS)
//     tessLodUndeformedPosition  the asset's space, see tesslod_deformation.glsl (with TESSLOD_DEFORMATION and normals of either kind)
//     tessLodLevel          continuous level                                    (with TESSLOD_COLOR_BY_LEVEL)
//     tessLodFragmentPlacement, tessLodPlacements  see tesslod_placement.glsl       (with TESSLOD_PLACEMENTS)
// Out: gl_FragColor
#pragma import_defines(TESSLOD_NORMALS, TESSLOD_NORMAL_MAP, TESSLOD_UVS, TESSLOD_COLORS, TESSLOD_COLOR_BY_LEVEL, TESSLOD_UNFILLED, TESSLOD_PLACEMENTS, TESSLOD_DEFORMATION)

in vec3 tessLodEyePosition;
#if defined(TESSLOD_NORMALS) || (defined(TESSLOD_NORMAL_MAP) && defined(TESSLOD_DEFORMATION))
in vec3 tessLodWeights;
flat in int tessLodFragmentPatch;
#if defined(TESSLOD_DEFORMATION)
in vec3 tessLodUndeformedPosition;
#endif
#endif
#if defined(TESSLOD_COLOR_BY_LEVEL)
in float tessLodLevel;

// Colours of levels 0, 1, 2 … : dark blue, blue, cyan, green, yellow, orange, red, magenta, and round again.
vec3 tessLodLevelColor(int level)
{
    const vec3 kColors[8] = vec3[8](vec3(0.15, 0.15, 0.55), vec3(0.20, 0.45, 0.95), vec3(0.25, 0.85, 0.90),
                                    vec3(0.25, 0.80, 0.30), vec3(0.95, 0.90, 0.25), vec3(0.98, 0.60, 0.15),
                                    vec3(0.90, 0.20, 0.15), vec3(0.85, 0.30, 0.80));
    return kColors[level % 8];
}
#endif

#if defined(TESSLOD_PLACEMENTS)
flat in int tessLodFragmentPlacement;
uniform samplerBuffer tessLodPlacements;
#endif

// Of any length, in the drawable's space: a normal of the asset.
vec3 tessLodPlacedNormal(vec3 normal)
{
#if defined(TESSLOD_PLACEMENTS)
    int first = 6 * tessLodFragmentPlacement + 3;
    return vec3(dot(texelFetch(tessLodPlacements, first).xyz, normal), dot(texelFetch(tessLodPlacements, first + 1).xyz, normal),
                dot(texelFetch(tessLodPlacements, first + 2).xyz, normal));
#else
    return normal;
#endif
}

// True where the way from the asset's space to the eye's turns the winding, not the normals. `deformed`: the deformation does.
bool tessLodMirrored(bool deformed)
{
    bool mirrored = deformed != (determinant(mat3(gl_ModelViewMatrix)) < 0.0);
#if defined(TESSLOD_PLACEMENTS)
    return mirrored != (texelFetch(tessLodPlacements, 6 * tessLodFragmentPlacement + 3).w < 0.0);
#else
    return mirrored;
#endif
}

// True where the back of the surface is seen, given its eye-space normal. `mirrors`: does a deformation mirror there?
bool tessLodIsBack(vec3 normal, bool mirrors)
{
    // A coarse triangle may be turned over where the surface is not: the surface's own normal then still looks at the viewer.
    vec3 sight = gl_ProjectionMatrix[2][3] == 0.0 ? vec3(0.0, 0.0, -1.0) : tessLodEyePosition; // orthographic: all alike
    bool looksAway = dot(normal, sight) > 0.0;
#if defined(TESSLOD_UNFILLED)
    return looksAway; // Mesa 22.3 draws outlines of tessellated triangles wrong where a shader asks for gl_FrontFacing
#else
    return gl_FrontFacing == tessLodMirrored(mirrors) && looksAway;
#endif
}

// By what is drawn: steps from a pixel to the next ones, in eye space.
void tessLodOrientFlat(inout TessLodFragment fragment, vec3 across, vec3 up)
{
    vec3 normal = cross(across, up); // on the viewer's side, as pixels are ordered there
    fragment.normal = dot(normal, normal) > 0.0 ? normalize(normal) : vec3(0.0, 0.0, 1.0);
#if defined(TESSLOD_UNFILLED)
    fragment.isBack = false; // lines and points have no side
#else
    fragment.isBack = tessLodIsBack(-fragment.normal, false);
#endif
}

// Normal in eye space and on which side we are. The back of an open surface is lit as its front: the normal is turned.
void tessLodOrient(inout TessLodFragment fragment)
{
    // Derivatives first: they are undefined in control flow that neighbouring fragments do not share.
    vec3 across = dFdx(tessLodEyePosition);
    vec3 up = dFdy(tessLodEyePosition);
#if defined(TESSLOD_NORMALS)
    // A step along an edge by a part d of it changes two weights by d each: length √2 · d.
    float footprint = 0.70710678 * max(length(dFdx(tessLodWeights)), length(dFdy(tessLodWeights)));
    vec3 normal = tessLodPatchNormal(tessLodFragmentPatch, tessLodWeights, footprint);
#elif defined(TESSLOD_NORMAL_MAP)
    vec3 normal = tessLodMappedNormal(tessLodTexCoord.xy);
    if (normal == vec3(0.0)) {
        tessLodOrientFlat(fragment, across, up);
        return;
    }
#endif
#if defined(TESSLOD_NORMALS) || defined(TESSLOD_NORMAL_MAP)
    bool mirrors = false;
#if defined(TESSLOD_DEFORMATION)
    normal = tessLodDeformedNormal(
        normal, tessLodDeformationRows(tessLodUndeformedPosition, tessLodWeights, tessLodFragmentPatch), mirrors);
#endif
    normal = normalize(gl_NormalMatrix * tessLodPlacedNormal(normal));
    fragment.isBack = tessLodIsBack(normal, mirrors);
    fragment.normal = fragment.isBack ? -normal : normal;
#else
    tessLodOrientFlat(fragment, across, up);
#endif
}

void main()
{
    TessLodFragment fragment;
    fragment.position = tessLodEyePosition;
    tessLodOrient(fragment);
    fragment.material = tessLodMaterial(fragment.isBack);
    fragment.material.ambient = tessLodBaseColor(fragment.material.ambient);
    fragment.material.diffuse = tessLodBaseColor(fragment.material.diffuse);
#if defined(TESSLOD_COLOR_BY_LEVEL)
    int below = int(tessLodLevel);
    vec3 levelColor = mix(tessLodLevelColor(below), tessLodLevelColor(below + 1), tessLodLevel - float(below));
    fragment.material.ambient.rgb = levelColor;
    fragment.material.diffuse.rgb = levelColor;
#endif
    gl_FragColor = tessLodShade(fragment);
}
