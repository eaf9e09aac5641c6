// SPDX-License-Identifier: MIT
// libFuzzer's entry to one of the targets: OSGTESSLOD_FUZZ_TARGET.
#include <fuzz/Targets.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    osgTessLOD::fuzz::OSGTESSLOD_FUZZ_TARGET(data, size);
    return 0;
}
