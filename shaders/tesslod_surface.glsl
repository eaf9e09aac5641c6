// SPDX-License-Identifier: MIT
// Where a vertex of a patch lies at continuous levels (Lambert §3.2, §3.3). The C++ twins of the same names are in
// render/MorphedSurface.cpp; positions are the same bits, and with TESSLOD_DEFORMATION weights, too.
//
// Shared text: pasted behind the #version line of the stages that need it, after tesslod_pattern.glsl.
//
// Levels are indices into the ladder of factors. A level l = k − 1 + α, 0 < α ≤ 1, is drawn with the pattern of level k,
// each vertex α of the way from its parent on level k − 1 to its own place. What lies on a border follows the border's
// level instead, and so depends on the border alone: both its patches give the same bits.
//
// Patches and vertices are numbered within the buffers (AssetPages.h).
//
// In: tessLodVertices    RG32UI, LodVertex low and high word, object lattice offsets and parent index
//     tessLodPatchTable  R32I, per patch: lattice origin x y z, then per level the index of its first vertex or −1
//     tessLodStep        object units per lattice unit
//     tessLodFactors     the ladder, tessLodLevelCount entries
//     tessLodUvs         R32UI, LodLevel::uvs of all vertices; tessLodUvOrigin, tessLodUvStep: their grid   (with TESSLOD_UVS)
//     tessLodColors      R32UI, LodLevel::colors of all vertices                                      (with TESSLOD_COLORS)
//     tessLodParameters       R32UI, ChartPoint::bits of the vertices of levels that have them    (with TESSLOD_PARAMETERS)
//     tessLodParameterShifts  per level what to take off a vertex's index in tessLodVertices for its index there; −1 where
//                             vertices lie where the pattern has them                             (with TESSLOD_PARAMETERS)

uniform usamplerBuffer tessLodVertices;
uniform isamplerBuffer tessLodPatchTable;
uniform float tessLodStep;
uniform int tessLodLevelCount;
uniform int tessLodFactors[33];
#if defined(TESSLOD_PARAMETERS)
uniform usamplerBuffer tessLodParameters;
uniform int tessLodParameterShifts[33];
#endif

#if defined(TESSLOD_UVS)
uniform usamplerBuffer tessLodUvs;
uniform vec2 tessLodUvOrigin;
uniform vec2 tessLodUvStep;
#endif
#if defined(TESSLOD_COLORS)
uniform usamplerBuffer tessLodColors;
#endif

// A point of the surface: object space, corner weights in its patch, and what it has beside these.
struct TessLodPoint {
    vec3 position;
    vec3 weights;
#if defined(TESSLOD_UVS)
    vec3 texCoord; // u, v, and how much of it has texture coordinates
#endif
#if defined(TESSLOD_COLORS)
    vec4 color;
#endif
};

// Index of the vertex in tessLodVertices.
int tessLodVertexNumber(int patchId, int level, int index)
{
    int row = patchId * (3 + tessLodLevelCount);
    return texelFetch(tessLodPatchTable, row + 3 + level).r + index;
}

uvec2 tessLodVertexBits(int patchId, int level, int index)
{
    return texelFetch(tessLodVertices, tessLodVertexNumber(patchId, level, index)).rg;
}

// Index of the vertex's parent in the pattern of level − 1.
int tessLodVertexParent(int patchId, int level, int index)
{
    return int(tessLodVertexBits(patchId, level, index).y >> 19);
}

// Lattice offsets are 17 bits each: x in bits 0–16, y 17–33, z 34–50.
ivec3 tessLodVertexOffset(uvec2 bits)
{
    return ivec3(int(bits.x & 0x1FFFFu), int((bits.x >> 17) | ((bits.y & 3u) << 15)), int((bits.y >> 2) & 0x1FFFFu));
}

#if defined(TESSLOD_DEFORMATION)
// `weights` times scale / (divisor · 2²³), to the nearest multiple of 2⁻²³. In integers, as division of floats need not be exact: what
// is all of it is 1, and neighbours have the same bits.
vec3 tessLodExactWeights(ivec3 weights, int scale, int divisor)
{
    return vec3((weights * scale + divisor / 2) / divisor) / 8388608.0;
}
#endif

// Corner weights of the vertex's own place in its patch.
vec3 tessLodVertexWeights(int patchId, int level, int index)
{
#if defined(TESSLOD_PARAMETERS)
    int shift = tessLodParameterShifts[level];
    if (shift >= 0) {
        uint bits = texelFetch(tessLodParameters, tessLodVertexNumber(patchId, level, index) - shift).r;
        ivec2 at = ivec2(int(bits & 0xFFFFu), int(bits >> 16));
        ivec3 weights = ivec3(49152 - at.x - at.y, at);
#if defined(TESSLOD_DEFORMATION)
        return tessLodExactWeights(weights, 512, 3);
#else
        return vec3(weights) / 49152.0;
#endif
    }
#endif
    int factor = tessLodFactors[level];
    ivec3 weights = tessLodPatternBarycentric(factor, index);
#if defined(TESSLOD_DEFORMATION)
    return tessLodExactWeights(weights, 8388608, 3 * factor);
#else
    return vec3(weights) / float(3 * factor);
#endif
}

#if defined(TESSLOD_UVS)
// u, v and 1; 0 without.
vec3 tessLodVertexTexCoord(int patchId, int level, int index)
{
    uint bits = texelFetch(tessLodUvs, tessLodVertexNumber(patchId, level, index)).r;
    if (bits == 0xFFFFFFFFu) { return vec3(0.0); }
    precise vec2 uv = tessLodUvOrigin + vec2(float(bits & 0xFFFFu), float(bits >> 16)) * tessLodUvStep;
    return vec3(uv, 1.0);
}
#endif

#if defined(TESSLOD_COLORS)
vec4 tessLodVertexColor(int patchId, int level, int index)
{
    uint bits = texelFetch(tessLodColors, tessLodVertexNumber(patchId, level, index)).r;
    precise vec4 color = vec4(bits & 0xFFu, bits >> 8 & 0xFFu, bits >> 16 & 0xFFu, bits >> 24) * 0.003921569;
    return color;
}
#endif

// The vertex in its own place.
TessLodPoint tessLodVertexPoint(int patchId, int level, int index)
{
    int row = patchId * (3 + tessLodLevelCount);
    ivec3 origin = ivec3(texelFetch(tessLodPatchTable, row).r, texelFetch(tessLodPatchTable, row + 1).r,
                         texelFetch(tessLodPatchTable, row + 2).r);
    TessLodPoint point;
    precise vec3 position = vec3(origin + tessLodVertexOffset(tessLodVertexBits(patchId, level, index))) * tessLodStep;
    point.position = position;
#if defined(TESSLOD_NORMALS) || defined(TESSLOD_DEFORMATION)
    point.weights = tessLodVertexWeights(patchId, level, index);
#else
    point.weights = vec3(0.0);
#endif
#if defined(TESSLOD_UVS)
    point.texCoord = tessLodVertexTexCoord(patchId, level, index);
#endif
#if defined(TESSLOD_COLORS)
    point.color = tessLodVertexColor(patchId, level, index);
#endif
    return point;
}

// t of the way from `from` to `to`; exactly `to` at t = 1, which the sum alone would not give.
TessLodPoint tessLodMix(TessLodPoint from, TessLodPoint to, float t)
{
    if (t >= 1.0) { return to; }
    TessLodPoint point;
    precise vec3 position = from.position + (to.position - from.position) * t;
    point.position = position;
#if defined(TESSLOD_DEFORMATION)
    precise vec3 weights = from.weights + (to.weights - from.weights) * t;
    point.weights = weights;
#else
    point.weights = from.weights + (to.weights - from.weights) * t;
#endif
#if defined(TESSLOD_UVS)
    precise vec3 texCoord = from.texCoord + (to.texCoord - from.texCoord) * t;
    point.texCoord = texCoord;
#endif
#if defined(TESSLOD_COLORS)
    precise vec4 color = from.color + (to.color - from.color) * t;
    point.color = color;
#endif
    return point;
}

// Border vertex `index` of the pattern of `level`, whose border is at continuous level `edgeLevel` ≤ level.
TessLodPoint tessLodBorderPoint(int patchId, int level, int index, float edgeLevel)
{
    int reached = int(ceil(edgeLevel));
    for (; level > reached; --level) { index = tessLodVertexParent(patchId, level, index); }
    TessLodPoint own = tessLodVertexPoint(patchId, level, index);
    float t = edgeLevel - float(level - 1);
    if (level == 0 || t >= 1.0) { return own; }
    int parent = tessLodVertexParent(patchId, level, index);
    return tessLodMix(tessLodVertexPoint(patchId, level - 1, parent), own, t);
}

// The level of border vertex `index` of a pattern: its side's; corners stay where they are at every level.
float tessLodBorderLevel(int factor, int index, vec3 edgeLevels)
{
    return edgeLevels[index / factor];
}

// Vertex `index` of the pattern that the patch is drawn with, that of level ⌈largest of edgeLevels⌉.
TessLodPoint tessLodSurfacePoint(int patchId, vec3 edgeLevels, int index)
{
    float patchLevel = max(edgeLevels.x, max(edgeLevels.y, edgeLevels.z));
    int level = int(ceil(patchLevel));
    int factor = tessLodFactors[level];
    if (index < 3 * factor) {
        return tessLodBorderPoint(patchId, level, index, tessLodBorderLevel(factor, index, edgeLevels));
    }
    TessLodPoint own = tessLodVertexPoint(patchId, level, index);
    float t = patchLevel - float(level - 1);
    if (level == 0 || t >= 1.0) { return own; }
    int parent = tessLodVertexParent(patchId, level, index);
    int parentFactor = tessLodFactors[level - 1];
    TessLodPoint target;
    if (parent < 3 * parentFactor) {
        float borderLevel = min(tessLodBorderLevel(parentFactor, parent, edgeLevels), float(level - 1));
        target = tessLodBorderPoint(patchId, level - 1, parent, borderLevel);
    } else {
        target = tessLodVertexPoint(patchId, level - 1, parent);
    }
    return tessLodMix(target, own, t);
}
