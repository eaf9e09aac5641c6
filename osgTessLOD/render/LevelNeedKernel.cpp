// SPDX-License-Identifier: MIT
#define KERNEL_NAME kBaseline
#include <osgTessLOD/render/LevelNeedKernelBody.h>

namespace osgTessLOD::kernel {

#ifdef OSGTESSLOD_AVX2
extern const Kernel kAvx2;
#endif

const Kernel& baseline()
{
    return kBaseline;
}

const Kernel* avx2()
{
#ifdef OSGTESSLOD_AVX2
    return __builtin_cpu_supports("avx2") ? &kAvx2 : nullptr;
#else
    return nullptr;
#endif
}

const Kernel& best()
{
    static const Kernel& chosen = avx2() != nullptr ? *avx2() : baseline();
    return chosen;
}

} // namespace osgTessLOD::kernel
