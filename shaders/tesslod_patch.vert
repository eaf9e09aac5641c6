#version 420 compatibility
// SPDX-License-Identifier: MIT
// One vertex is one patch.
// In: tessLodRecord           a PatchRecord (x: patch; y, z, w: levels of sides 0, 1, 2, float bits)
//     tessLodRecordPlacement  the number of its placement                                 (with TESSLOD_PLACEMENTS)
// Out: the same.
#pragma import_defines(TESSLOD_PLACEMENTS)

layout(location = 0) in uvec4 tessLodRecord;
#if defined(TESSLOD_PLACEMENTS)
layout(location = 1) in uint tessLodRecordPlacement;
#endif

out uvec4 tessLodPatchRecord;
#if defined(TESSLOD_PLACEMENTS)
out uint tessLodPatchPlacement;
#endif

void main()
{
    tessLodPatchRecord = tessLodRecord;
#if defined(TESSLOD_PLACEMENTS)
    tessLodPatchPlacement = tessLodRecordPlacement;
#endif
}
