// SPDX-License-Identifier: MIT
// Compiled with -mavx2.
#define KERNEL_NAME kAvx2
#include <osgTessLOD/render/LevelNeedKernelBody.h>
