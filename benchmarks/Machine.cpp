// SPDX-License-Identifier: MIT
#include "Machine.h"

#include <nlohmann/json.hpp>

#include <sched.h>

#include <fstream>
#include <string>

namespace osgTessLOD::benchmarks {

namespace {

/// Cores that this process may run on.
int coreCount()
{
    cpu_set_t cores;
    return sched_getaffinity(0, sizeof cores, &cores) == 0 ? CPU_COUNT(&cores) : 0;
}

std::string cpuModel()
{
    std::ifstream file("/proc/cpuinfo");
    for (std::string line; std::getline(file, line);) {
        const std::size_t colon = line.find(": ");
        if (line.rfind("model name", 0) == 0 && colon != std::string::npos) { return line.substr(colon + 2); }
    }
    return "unknown";
}

std::string compiler()
{
#if defined(__clang__)
    return "clang " __clang_version__;
#elif defined(__GNUC__)
    return "g++ " __VERSION__;
#else
    return "unknown";
#endif
}

} // namespace

nlohmann::ordered_json describeMachine()
{
    return {{"cores", coreCount()}, {"cpu", cpuModel()}, {"compiler", compiler()}};
}

} // namespace osgTessLOD::benchmarks
