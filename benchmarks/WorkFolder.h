// SPDX-License-Identifier: MIT
#pragma once

#include <support/TemporaryDirectory.h>

namespace osgTessLOD::benchmarks {

/// Where a benchmark keeps its files.
using WorkFolder = TemporaryDirectory;

} // namespace osgTessLOD::benchmarks
