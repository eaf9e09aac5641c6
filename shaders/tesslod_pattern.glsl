// SPDX-License-Identifier: MIT
// The tessellator's pattern of a triangle patch with equal integer factors (1, or even): twins of
// TessellationPattern::vertexCount, ::index and ::barycentric, which say how the rings are numbered.
//
// Shared text: pasted behind the #version line of the stages that need it.

int tessLodPatternVertexCount(int factor)
{
    int rings = factor / 2;
    return factor == 1 ? 3 : 1 + 3 * rings * (rings + 1);
}

// Vertices of all rings outside ring `ring` of `rings`: the index of its corner 0.
int tessLodRingOffset(int rings, int ring)
{
    return 3 * (rings * (rings + 1) - ring * (ring + 1));
}

// Index of the vertex nearest to the tessellation coordinates.
int tessLodPatternIndex(vec3 c, int factor)
{
    if (factor == 1) { return c.x > 0.5 ? 0 : c.y > 0.5 ? 1 : 2; }
    int opposite = c.x <= c.y ? (c.x <= c.z ? 0 : 2) : (c.y <= c.z ? 1 : 2);
    int side = (opposite + 1) % 3;
    float smallest = c[opposite];
    float f = float(factor);
    int ring = int(floor((1.0 - 3.0 * smallest) * 0.5 * f + 0.5));
    int rings = factor / 2;
    if (ring == 0) { return tessLodPatternVertexCount(factor) - 1; }
    int along = int(floor((c[(side + 1) % 3] - smallest) * f + 0.5));
    return tessLodRingOffset(rings, ring) + (side * 2 * ring + along) % (6 * ring);
}

// Largest m with 3·m(m + 1) ≤ value: the square root may be off by one either way, the corrections are exact.
int tessLodRingContaining(int value)
{
    int m = int((sqrt(1.0 + 4.0 * (float(value) / 3.0)) - 1.0) * 0.5);
    if (3 * m * (m + 1) > value) { --m; }
    if (3 * (m + 1) * (m + 2) <= value) { ++m; }
    return m;
}

// Corner weights of a vertex as integers over 3·factor.
ivec3 tessLodPatternBarycentric(int factor, int index)
{
    ivec3 result = ivec3(0);
    if (factor == 1) {
        result[index] = 3;
        return result;
    }
    int rings = factor / 2;
    if (index + 1 == tessLodPatternVertexCount(factor)) { return ivec3(factor); }
    int ring = tessLodRingContaining(3 * rings * (rings + 1) - 1 - index) + 1;
    int onRing = index - tessLodRingOffset(rings, ring);
    int side = onRing / (2 * ring);
    int along = onRing % (2 * ring);
    int smallest = factor - 2 * ring;
    result[side] = smallest + 3 * (2 * ring - along);
    result[(side + 1) % 3] = smallest + 3 * along;
    result[(side + 2) % 3] = smallest;
    return result;
}
