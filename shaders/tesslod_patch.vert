#version 420 compatibility
// SPDX-License-Identifier: MIT
// One vertex is one patch. In: tessLodRecord, a PatchRecord (x: patch; y, z, w: levels of sides 0, 1, 2, float bits).
// Out: the same.

layout(location = 0) in uvec4 tessLodRecord;

out uvec4 tessLodPatchRecord;

void main()
{
    tessLodPatchRecord = tessLodRecord;
}
