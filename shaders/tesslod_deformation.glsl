// SPDX-License-Identifier: MIT
// Where a deformation of the control mesh has the surface: linear blend skinning by the corner weights of a patch.
//
// Shared text: pasted behind the #version line of the stage that places vertices, after tesslod_surface.glsl, and of the fragment
// stage; after tesslod_precise.glsl in versions before 4.00.
//
// In: tessLodDeformation       RGBA32F, three texels per base vertex: the rows of its transform less the identity's, of which the
//                              fourth numbers translate                                        (with TESSLOD_DEFORMATION)
//     tessLodDeformedPatches   RGBA32UI, three texels per patch: its base vertices in rising order, and which corner each is, two
//                              bits each; then the gradients of the weights of corners 1 and 2 over the base triangle, float
//                              bits                                                            (with TESSLOD_DEFORMATION)

#if defined(TESSLOD_DEFORMATION)
uniform samplerBuffer tessLodDeformation;
uniform usamplerBuffer tessLodDeformedPatches;

// How far the transform of a base vertex takes an undeformed point.
vec3 tessLodMove(vec3 position, int baseVertex)
{
    vec4 x = texelFetch(tessLodDeformation, 3 * baseVertex);
    vec4 y = texelFetch(tessLodDeformation, 3 * baseVertex + 1);
    vec4 z = texelFetch(tessLodDeformation, 3 * baseVertex + 2);
    precise vec3 move = ((vec3(x.x, y.x, z.x) * position.x + vec3(x.y, y.y, z.y) * position.y)
                         + vec3(x.z, y.z, z.z) * position.z) + vec3(x.w, y.w, z.w);
    return move;
}

// From the undeformed asset to the deformed one. On a border one weight is 0, and both its patches add the same two moves in the same
// order: the same bits. The C++ twin, ControlMeshDeformation::tessLodDeformed, gives them, too.
vec3 tessLodDeformed(vec3 position, vec3 weights, int patchId)
{
    uvec4 corners = texelFetch(tessLodDeformedPatches, 3 * patchId);
    precise vec3 deformed = position;
    for (int k = 0; k < 3; ++k) {
        float weight = weights[int(corners.w >> (2 * k) & 3u)];
        if (weight != 0.0) {
            precise vec3 part = tessLodMove(position, int(corners[k])) * weight;
            deformed = deformed + part;
        }
    }
    return deformed;
}

// How the deformed point changes with the undeformed one, by rows: Σ wᵢ Aᵢ + Σ (Aᵢ p + tᵢ) ∇wᵢᵀ, where weights change as they do over the
// base triangle.
mat3 tessLodDeformationRows(vec3 position, vec3 weights, int patchId)
{
    uvec4 corners = texelFetch(tessLodDeformedPatches, 3 * patchId);
    vec3 gradients[3];
    gradients[1] = uintBitsToFloat(texelFetch(tessLodDeformedPatches, 3 * patchId + 1).xyz);
    gradients[2] = uintBitsToFloat(texelFetch(tessLodDeformedPatches, 3 * patchId + 2).xyz);
    gradients[0] = -(gradients[1] + gradients[2]);
    mat3 rows = mat3(1.0);
    for (int k = 0; k < 3; ++k) {
        int corner = int(corners.w >> (2 * k) & 3u);
        for (int row = 0; row < 3; ++row) {
            vec4 r = texelFetch(tessLodDeformation, 3 * int(corners[k]) + row);
            rows[row] += weights[corner] * r.xyz + (dot(r.xyz, position) + r.w) * gradients[corner];
        }
    }
    return rows;
}

// Of any length: a normal of the undeformed asset as the surface around it is turned. `mirrors`: does the deformation mirror there?
vec3 tessLodDeformedNormal(vec3 normal, mat3 rows, out bool mirrors)
{
    mat3 cofactors = mat3(cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1]));
    mirrors = dot(rows[0], cofactors[0]) < 0.0;
    vec3 turned = normal * cofactors; // a dot product per row
    return mirrors ? -turned : turned;
}
#endif
