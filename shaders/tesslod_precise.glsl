// SPDX-License-Identifier: MIT
// `precise` for stages of a version before 4.00, where the driver knows it; elsewhere it asks for nothing. Then, too, what
// neighbours share is computed by the same instructions from the same numbers.
//
// Shared text: pasted first behind the #version line, as #extension must come before all else.
#if __VERSION__ < 400
#if defined(GL_ARB_gpu_shader5)
#extension GL_ARB_gpu_shader5 : enable
#else
#define precise
#endif
#endif
