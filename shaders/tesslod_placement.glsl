// SPDX-License-Identifier: MIT
// Where a placement of the asset has its points.
//
// Shared text: pasted behind the #version line of the stage that places vertices, before tesslod_vertex.glsl.
//
// In: tessLodPlacements  RGBA32F, six texels per placement, see render/Placements.h    (with TESSLOD_PLACEMENTS)

#if defined(TESSLOD_PLACEMENTS)
uniform samplerBuffer tessLodPlacements;

// From the asset's space to the drawable's. What patches share stays the same bits; the C++ twin, Placements::tessLodPlaced,
// gives them, too.
vec3 tessLodPlaced(vec3 position, int placement)
{
    vec4 x = texelFetch(tessLodPlacements, 6 * placement);
    vec4 y = texelFetch(tessLodPlacements, 6 * placement + 1);
    vec4 z = texelFetch(tessLodPlacements, 6 * placement + 2);
    precise vec3 placed = ((vec3(x.x, y.x, z.x) * position.x + vec3(x.y, y.y, z.y) * position.y)
                           + vec3(x.z, y.z, z.z) * position.z) + vec3(x.w, y.w, z.w);
    return placed;
}
#endif
