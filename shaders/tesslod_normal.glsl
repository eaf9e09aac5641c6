// SPDX-License-Identifier: MIT
// Normals from the per-patch triangular grids (NormalTexture in asset/LodAsset.h), or from an image over the surface's texture
// coordinates (LodTexture::Role::ObjectNormal).
//
// Shared text: pasted behind the #version line of the stages that need it.
//
// In: tessLodNormals           R32UI, octahedral 2 × 16 bit signed normalized; resolutions 1, 2, 4 … one after the
//                              other, in each all patches' grids in order
//     tessLodPatchCount        patches in the buffer
//     tessLodNormalLevelCount  resolutions stored (≥ 1)
//     tessLodNormalMap         (n + 1) / 2                                    (with TESSLOD_NORMAL_MAP)

#if defined(TESSLOD_NORMALS)
uniform usamplerBuffer tessLodNormals;
uniform int tessLodPatchCount;
uniform int tessLodNormalLevelCount;

// unpackSnorm2x16(), which versions before 4.20 lack.
vec2 tessLodUnpackSnorm(uint bits)
{
    return clamp(vec2(int(bits << 16) >> 16, int(bits) >> 16) / 32767.0, -1.0, 1.0);
}

vec3 tessLodOctahedralNormal(uint bits)
{
    vec2 folded = tessLodUnpackSnorm(bits);
    vec3 n = vec3(folded, 1.0 - abs(folded.x) - abs(folded.y));
    vec2 signs = vec2(folded.x < 0.0 ? -1.0 : 1.0, folded.y < 0.0 ? -1.0 : 1.0);
    if (n.z < 0.0) { n.xy = (1.0 - abs(folded.yx)) * signs; }
    return normalize(n);
}

// Texels of one patch at all resolutions below 2^level: Σ (2^m + 1)(2^m + 2)/2.
int tessLodNormalTexelsBelow(int level)
{
    int r = 1 << level;
    return ((r * r - 1) / 3 + 3 * (r - 1) + 2 * level) / 2;
}

// Linear interpolation in the grid of resolution 2^level. The cell (i, j) is an upright triangle and, beyond its
// diagonal, an inverted one:
//
//     (i, j+1) ──── (i+1, j+1)
//        │  ╲          │
//        │     ╲       │
//     (i, j) ────── (i+1, j)
vec3 tessLodGridNormal(int patchId, vec3 weights, int level)
{
    int r = 1 << level;
    int first = tessLodPatchCount * tessLodNormalTexelsBelow(level) + patchId * ((r + 1) * (r + 2) / 2);
    vec2 at = weights.yz * float(r);
    int j = clamp(int(at.y), 0, r - 1);
    int i = clamp(int(at.x), 0, r - 1 - j);
    vec2 f = clamp(at - vec2(i, j), 0.0, 1.0);
    int row = first + j * (2 * r + 3 - j) / 2 + i;
    int above = row + r + 1 - j; // (i, j + 1)
    bool inverted = f.x + f.y > 1.0 && i + j < r - 1;
    vec3 a = tessLodOctahedralNormal(texelFetch(tessLodNormals, row + 1).r);
    vec3 b = tessLodOctahedralNormal(texelFetch(tessLodNormals, above).r);
    vec3 c = tessLodOctahedralNormal(texelFetch(tessLodNormals, inverted ? above + 1 : row).r);
    return inverted ? a * (1.0 - f.y) + b * (1.0 - f.x) + c * (f.x + f.y - 1.0)
                    : a * f.x + b * f.y + c * max(0.0, 1.0 - f.x - f.y);
}

// Normal in object space, unit. `footprint`: how far, as a part of a patch's edge, neighbouring pixels are apart.
vec3 tessLodPatchNormal(int patchId, vec3 weights, float footprint)
{
    vec3 inside = max(weights, vec3(0.0)); // multisampling may evaluate outside the triangle
    inside /= inside.x + inside.y + inside.z;
    float finest = float(tessLodNormalLevelCount - 1);
    float wanted = clamp(-log2(max(footprint, 1e-6)), 0.0, finest);
    int level = min(int(wanted), tessLodNormalLevelCount - 1);
    vec3 n = tessLodGridNormal(patchId, inside, level);
    float t = wanted - float(level);
    if (t > 0.0) { n = mix(n, tessLodGridNormal(patchId, inside, level + 1), t); }
    return dot(n, n) > 0.0 ? normalize(n) : vec3(0.0, 0.0, 1.0);
}
#endif

#if defined(TESSLOD_NORMAL_MAP)
uniform sampler2D tessLodNormalMap;

// Normal in object space, unit; 0 where normals that look in all directions leave none.
vec3 tessLodMappedNormal(vec2 texCoord)
{
    vec3 n = 2.0 * texture(tessLodNormalMap, texCoord).xyz - 1.0;
    return dot(n, n) > 0.001 ? normalize(n) : vec3(0.0);
}
#endif
