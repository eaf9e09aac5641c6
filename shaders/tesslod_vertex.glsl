// SPDX-License-Identifier: MIT
// What the stage that places vertices hands on, be it the evaluation or the vertex shader.
//
// Shared text: pasted behind the #version line of the stages that need it, after tesslod_pattern.glsl,
// tesslod_surface.glsl, tesslod_deformation.glsl and tesslod_placement.glsl.
//
// Out: tessLodObjectPosition  the drawable's space (captured by PatchSelection::capture)
//      tessLodEyePosition     eye space
//      tessLodWeights         corner weights of the point in its patch, morphed as the position is
//      tessLodUndeformedPosition  the asset's space                             (with TESSLOD_DEFORMATION and either of TESSLOD_NORMALS and TESSLOD_NORMAL_MAP)
//      tessLodLevel           continuous level at the vertex
//      tessLodFragmentPatch   the patch, within the buffers
//      tessLodFragmentPlacement  set by the stage, before it puts a vertex      (with TESSLOD_PLACEMENTS)
//      tessLodTexCoord        texture coordinates u, v, and how much of the point has any (0 … 1), morphed likewise
//      tessLodColor           the source's colour, morphed likewise
#pragma import_defines(TESSLOD_NORMALS, TESSLOD_NORMAL_MAP, TESSLOD_PARAMETERS, TESSLOD_UVS, TESSLOD_COLORS, TESSLOD_COLOR_BY_LEVEL, TESSLOD_PLACEMENTS, TESSLOD_DEFORMATION)

out vec3 tessLodObjectPosition;
out vec3 tessLodEyePosition;
#if defined(TESSLOD_PLACEMENTS)
flat out int tessLodFragmentPlacement;
#endif
#if defined(TESSLOD_NORMALS) || (defined(TESSLOD_NORMAL_MAP) && defined(TESSLOD_DEFORMATION))
out vec3 tessLodWeights;
flat out int tessLodFragmentPatch;
#if defined(TESSLOD_DEFORMATION)
out vec3 tessLodUndeformedPosition;
#endif
#endif
#if defined(TESSLOD_UVS)
out vec3 tessLodTexCoord;
#endif
#if defined(TESSLOD_COLORS)
out vec4 tessLodColor;
#endif
#if defined(TESSLOD_COLOR_BY_LEVEL)
out float tessLodLevel;
#endif

// Vertex `index` of the pattern that the patch is drawn with when its sides are at these continuous levels.
void tessLodPutVertex(int patchId, vec3 edgeLevels, int index)
{
    TessLodPoint point = tessLodSurfacePoint(patchId, edgeLevels, index);
#if defined(TESSLOD_DEFORMATION)
    vec3 undeformed = point.position;
    point.position = tessLodDeformed(undeformed, point.weights, patchId);
#endif
#if defined(TESSLOD_PLACEMENTS)
    point.position = tessLodPlaced(point.position, tessLodFragmentPlacement);
#endif
    vec4 eyePosition = gl_ModelViewMatrix * vec4(point.position, 1.0);
    tessLodObjectPosition = point.position;
    tessLodEyePosition = eyePosition.xyz;
    gl_Position = gl_ModelViewProjectionMatrix * vec4(point.position, 1.0);
    gl_ClipVertex = eyePosition;
#if defined(TESSLOD_NORMALS) || (defined(TESSLOD_NORMAL_MAP) && defined(TESSLOD_DEFORMATION))
    tessLodWeights = point.weights;
    tessLodFragmentPatch = patchId;
#if defined(TESSLOD_DEFORMATION)
    tessLodUndeformedPosition = undeformed;
#endif
#endif
#if defined(TESSLOD_UVS)
    tessLodTexCoord = point.texCoord;
#endif
#if defined(TESSLOD_COLORS)
    tessLodColor = point.color;
#endif
#if defined(TESSLOD_COLOR_BY_LEVEL)
    float patchLevel = max(edgeLevels.x, max(edgeLevels.y, edgeLevels.z));
    int factor = tessLodFactors[int(ceil(patchLevel))];
    tessLodLevel = index < 3 * factor ? tessLodBorderLevel(factor, index, edgeLevels) : patchLevel;
#endif
}
