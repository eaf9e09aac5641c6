#version 330 compatibility
// SPDX-License-Identifier: MIT
// Places vertices without a tessellator: one instance is one patch, drawn with the index buffer of its pattern, so that
// gl_VertexID is the vertex's index there. Needs tesslod_precise.glsl, tesslod_pattern.glsl, tesslod_surface.glsl,
// tesslod_deformation.glsl, tesslod_placement.glsl and tesslod_vertex.glsl.
// In, per instance: tessLodRecord, a PatchRecord, and tessLodRecordPlacement, see tesslod_patch.vert; tessLodFirstPatch, of the
// buffers' page.
// Out: see tesslod_vertex.glsl

layout(location = 0) in uvec4 tessLodRecord;
#if defined(TESSLOD_PLACEMENTS)
layout(location = 1) in uint tessLodRecordPlacement;
#endif

uniform int tessLodFirstPatch;

void main()
{
#if defined(TESSLOD_PLACEMENTS)
    tessLodFragmentPlacement = int(tessLodRecordPlacement);
#endif
    tessLodPutVertex(int(tessLodRecord.x) - tessLodFirstPatch, uintBitsToFloat(tessLodRecord.yzw), gl_VertexID);
}
