// SPDX-License-Identifier: MIT
// How fine a patch has to be for a view, and the levels of its borders: selection in the control shader (Lambert §2.4, ch. 3). What
// is computed and why: render/LevelNeed.cpp; operations are those of render/LevelNeedKernelBody.h, in the same order. Whatever has
// to do with a border is the same function of the same numbers from both of its patches.
//
// Shared text: pasted behind the #version line of the control shader.
//
// In: tessLodNeeds         RGBA32UI, per patch 5 + 2 · tessLodLevelCount texels, see render/ShaderSelection.h (with TESSLOD_SELECTION)
//     tessLodEyeHigh, tessLodEyeLow, tessLodAxis, tessLodSlope, tessLodLeastCosine, tessLodTopLevel, tessLodOrthographic,
//     tessLodConservative, tessLodIsotropic  as kernel::View has them, render/LevelNeedKernel.h
//     tessLodPlanes        n, d of half spaces n · p + d ≥ 0 out of which patches are not drawn, tessLodPlaneCount of them
// Lengths are in the units of PatchBlocks.

#if defined(TESSLOD_SELECTION)
uniform usamplerBuffer tessLodNeeds;
uniform int tessLodLevelCount;
uniform vec3 tessLodEyeHigh;
uniform vec3 tessLodEyeLow;
uniform vec3 tessLodAxis;
uniform float tessLodSlope;
uniform float tessLodLeastCosine;
uniform int tessLodTopLevel;
uniform bool tessLodOrthographic;
uniform bool tessLodConservative;
uniform bool tessLodIsotropic;
uniform int tessLodPlaneCount;
uniform vec4 tessLodPlanes[8];

const float kTessLodRounding = 2e-6;

// How a sphere is seen.
struct TessLodSight {
    vec3 direction; // of the centre
    float sine;     // of half the angle that the sphere takes up
    float cosine;
    float tolerance; // error that is allowed
    float loss;      // part of the isotropic error that comes on top of the error as seen
};

// Of NaN and b it is b, as in the kernel.
float tessLodLeast(float a, float b)
{
    return a < b ? a : b;
}

float tessLodLargest(float a, float b)
{
    return a > b ? a : b;
}

int tessLodRow(int patchId)
{
    return patchId * (5 + 2 * tessLodLevelCount);
}

TessLodSight tessLodSee(vec4 sphere)
{
    TessLodSight sight;
    if (tessLodOrthographic) {
        sight.direction = tessLodAxis;
        sight.sine = 0.0;
        sight.cosine = 1.0;
        sight.tolerance = tessLodSlope;
        sight.loss = 0.0;
        return sight;
    }
    precise vec3 toCenter = (sphere.xyz - tessLodEyeHigh) - tessLodEyeLow;
    precise float distanceSquared = toCenter.x * toCenter.x + toCenter.y * toCenter.y + toCenter.z * toCenter.z;
    precise float distance = sqrt(distanceSquared);
    precise float radius = sphere.w;
    bool inside = distance <= radius;
    precise float inverse = 1.0 / tessLodLargest(distance, 1e-30);
    precise vec3 direction = toCenter * inverse;
    precise float sine = radius * inverse;
    if (inside) { sine = 1.0; }
    precise float cosineSquared = 1.0 - sine * sine;
    precise float cosine = sqrt(tessLodLargest(cosineSquared, 0.0));
    sight.direction = direction;
    sight.sine = sine;
    sight.cosine = cosine;
    if (!tessLodConservative) {
        precise float tolerance = tessLodSlope * distance;
        sight.tolerance = tolerance;
        sight.loss = 0.0;
        return sight;
    }
    precise float axial = direction.x * tessLodAxis.x + direction.y * tessLodAxis.y + direction.z * tessLodAxis.z;
    axial = tessLodLeast(tessLodLargest(axial, -1.0), 1.0);
    precise float acrossSquared = 1.0 - axial * axial;
    precise float across = sqrt(acrossSquared);
    precise float leastCosine = axial * cosine - across * sine;
    leastCosine = tessLodLargest(leastCosine, tessLodLeastCosine);
    precise float byDepth = distance * axial - radius;
    precise float byDistance = (distance - radius) * leastCosine;
    precise float leastDepth = tessLodLargest(byDepth, byDistance) - kTessLodRounding * (distance + radius);
    if (leastDepth < 0.0) { leastDepth = 0.0; }
    precise float loss = tessLodSlope * leastCosine;
    precise float tolerance = loss * leastDepth * (1.0 - kTessLodRounding);
    sight.loss = loss;
    sight.tolerance = inside ? 0.0 : tolerance;
    return sight;
}

float tessLodErrorOf(int row, int level, TessLodSight sight)
{
    vec4 a = uintBitsToFloat(texelFetch(tessLodNeeds, row + 5 + 2 * level));
    vec4 b = uintBitsToFloat(texelFetch(tessLodNeeds, row + 6 + 2 * level));
    precise float most = b.z;
    precise float onTop = most * sight.loss;
    if (tessLodIsotropic) {
        precise float error = most + onTop;
        return error;
    }
    precise float x = sight.direction.x;
    precise float y = sight.direction.y;
    precise float z = sight.direction.z;
    precise float form = (a.x * x * x + a.y * y * y + a.z * z * z) + 2.0 * (a.w * x * y + b.x * x * z + b.y * y * z);
    precise float square = most * most;
    precise float seenFromSomewhere = square * (sight.cosine * sight.cosine);
    precise float squared = tessLodLargest(form, 0.0);
    if (tessLodConservative) { squared = squared + kTessLodRounding * square; }
    squared = tessLodLeast(squared, seenFromSomewhere);
    precise float rest = square - squared;
    rest = tessLodLargest(rest, 0.0);
    precise float widened = sqrt(squared) * sight.cosine + sqrt(rest) * sight.sine;
    precise float error = tessLodLeast(widened, most) + onTop;
    return error;
}

// How much of the way from a level to the next finer one is to be gone: 0, where the level does, to 1.
float tessLodProgressAt(int row, int level, TessLodSight sight)
{
    precise float error = tessLodErrorOf(row, level, sight);
    precise float enough = error;
    precise float width = error;
    if (tessLodConservative) {
        enough = error * 1.1;
        width = error * 0.1;
    } else if (level + 1 < tessLodLevelCount) {
        width = error - tessLodErrorOf(row, level + 1, sight);
    }
    precise float part = (enough - sight.tolerance) / width;
    return enough > sight.tolerance ? tessLodLeast(part, 1.0) : 0.0; // NaN gives 0
}

// What the patch needs as seen in this sphere. What a level asks for, all coarser ones ask for.
float tessLodNeed(int patchId, vec4 sphere)
{
    int row = tessLodRow(patchId);
    TessLodSight sight = tessLodSee(sphere);
    precise float need = 0.0;
    int from = 0;
    int to = tessLodTopLevel + 1;
    while (from < to) {
        int level = (from + to) / 2;
        float part = tessLodProgressAt(row, level, sight);
        if (part > 0.0) {
            need = part + float(level);
            from = level + 1;
        } else {
            to = level;
        }
    }
    return need;
}

vec4 tessLodSphere(int patchId)
{
    return uintBitsToFloat(texelFetch(tessLodNeeds, tessLodRow(patchId)));
}

// x, y, z: 3 · patch + side of what lies on the other side of each border; w: the finest and the coarsest
// levels of the borders, and the largest finest one, four bits each.
uvec4 tessLodBorders(int patchId)
{
    return texelFetch(tessLodNeeds, tessLodRow(patchId) + 1);
}

float tessLodFinest(uint levels, int side)
{
    return float(levels >> (8 * side) & 0xFu);
}

float tessLodCoarsest(uint levels, int side)
{
    return float(levels >> (8 * side + 4) & 0xFu);
}

// What the patch needs at the middle of a side; at the first that goes on farthest also what it needs at those that end before.
float tessLodNeedAt(int patchId, int side)
{
    uint levels = tessLodBorders(patchId).w;
    float reach = tessLodFinest(levels, 3);
    int carrier = 0;
    while (tessLodFinest(levels, carrier) < reach) { ++carrier; }
    float need = 0.0;
    for (int k = 0; k < 3; ++k) {
        bool isCarried = side == carrier && tessLodFinest(levels, k) < reach;
        if (k != side && !isCarried) { continue; }
        vec4 middle = uintBitsToFloat(texelFetch(tessLodNeeds, tessLodRow(patchId) + 2 + k));
        need = tessLodLargest(need, tessLodNeed(patchId, middle));
    }
    return need;
}

// What the patch itself and those on the other side of its borders need there, the larger.
vec3 tessLodLargerNeeds(int patchId, uvec4 borders)
{
    vec3 needs = vec3(0.0);
    if (tessLodConservative) { // all sides of a patch need the same
        for (int k = 0; k < 4; ++k) {
            int other = k < 3 ? int(borders[k]) / 3 : patchId;
            float need = tessLodNeed(other, tessLodSphere(other));
            for (int side = 0; side < 3; ++side) {
                if (side == k || k == 3) { needs[side] = tessLodLargest(needs[side], need); }
            }
        }
        return needs;
    }
    for (int side = 0; side < 3; ++side) {
        int other = int(borders[side]);
        needs[side] = tessLodLargest(tessLodNeedAt(patchId, side), tessLodNeedAt(other / 3, other % 3));
    }
    return needs;
}

// Continuous levels of sides 0, 1, 2.
vec3 tessLodSelectedLevels(int patchId)
{
    uvec4 borders = tessLodBorders(patchId);
    vec3 levels = tessLodLargerNeeds(patchId, borders);
    for (int side = 0; side < 3; ++side) {
        float level = tessLodLeast(levels[side], tessLodFinest(borders.w, side));
        level = tessLodLeast(level, float(tessLodTopLevel));
        levels[side] = tessLodLargest(level, tessLodCoarsest(borders.w, side));
    }
    return levels;
}

// Does the patch's sphere lie outside of a plane?
bool tessLodIsOutOfView(int patchId)
{
    vec4 sphere = tessLodSphere(patchId);
    precise float size = abs(sphere.x) + abs(sphere.y) + abs(sphere.z);
    for (int k = 0; k < tessLodPlaneCount; ++k) {
        vec4 plane = tessLodPlanes[k];
        precise float distance = sphere.x * plane.x + sphere.y * plane.y + sphere.z * plane.z + plane.w;
        if (distance + sphere.w + kTessLodRounding * size < -kTessLodRounding * abs(plane.w)) { return true; }
    }
    return false;
}
#endif
