// SPDX-License-Identifier: MIT
#pragma once

#include "ReferenceSurface.h"

#include <cstddef>
#include <vector>

namespace osgTessLOD::benchmarks {

/// Levels of detail that another library made, each of the former one and with half its triangles.
struct LevelChain {
    std::vector<std::size_t> triangles; ///< of each level, the source first
    double seconds = 0.0;               ///< from buffers as the library takes them to the last level
};

/// By meshopt_simplify, whatever the error, down to 64 triangles or as far as topology lets it go.
LevelChain meshoptimizerChain(const Triangles& source);

/// By osgUtil::Simplifier, likewise, making neither strips nor normals.
LevelChain osgSimplifierChain(const Triangles& source);

} // namespace osgTessLOD::benchmarks
