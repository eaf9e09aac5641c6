// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/bake/LevelHierarchy.h>
#include <osgTessLOD/bake/PatchTopology.h>
#include <osgTessLOD/bake/Progress.h>

#include <cstdint>
#include <functional>
#include <vector>

namespace osgTessLOD::bake {

/// Error of a patch at finest.patch, its borders at finest.borders ≤ finest.patch, in the unit of the tolerance. Called
/// from several threads.
using ErrorAtFinest = std::function<double(std::uint32_t patch, const FinestLevels& finest)>;

/// Which levels are worth storing: for each patch a finest level at which its error is at most `tolerance`, its borders
/// staying behind where neighbours end before it. Only where the ladder's last level, `last`, is not that good by itself
/// is the error larger, and then no larger than it is there without such neighbours. Tolerance 0 keeps all levels.
/// Seams are at their level, and patches no coarser than their seams.
///
/// At first each patch ends where it and all finer levels are within the tolerance, as if its neighbours followed. A
/// border is drawn no finer than the coarser of its patches, and a patch no finer than the finest of its borders. So,
/// round by round, patches that this leaves with too large an error make neighbours finer by one level, until none is
/// left: levels only rise, and all at `last` would do. The result does not depend on the number of threads.
OSGTESSLOD_EXPORT std::vector<FinestLevels> chooseFinestLevels(const PatchTopology& topology, std::uint8_t last,
                                                               double tolerance, const ErrorAtFinest& errorAtFinest,
                                                               Progress& progress);

} // namespace osgTessLOD::bake
