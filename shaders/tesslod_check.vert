#version 420 compatibility
// SPDX-License-Identifier: MIT
// Of the check that the tessellator makes TessellationPattern (render/PatternCheck.h): a patch of nothing.

void main() {}
