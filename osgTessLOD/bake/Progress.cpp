// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/Progress.h>

namespace osgTessLOD::bake {

void Progress::begin(const std::string& /*stage*/, std::uint64_t /*total*/, const std::string& /*unit*/) {}
void Progress::advance(std::uint64_t /*amount*/) {}
void Progress::end() {}
bool Progress::stopRequested() const { return false; }

void Progress::step(std::uint64_t amount)
{
    advance(amount);
    if (stopRequested()) { throw Interrupted(); }
}

} // namespace osgTessLOD::bake
