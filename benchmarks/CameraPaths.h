// SPDX-License-Identifier: MIT
#pragma once

#include "ReferenceSurface.h"

#include <support/ScreenCamera.h>

#include <osg/Matrixd>

#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// What a model is drawn for: where it is and where it is seen from.
struct CameraPath {
    std::string name;
    std::vector<osg::Matrixd> placements; ///< of the model; no two at the same place
    std::vector<ScreenCamera> cameras;    ///< of each frame; near and far planes cut off nothing of the model
};

/// Picture size and length of paths.
struct PathOptions {
    int width = 960;     ///< pixels
    int height = 600;    ///< pixels
    unsigned frames = 6; ///< of each path
    unsigned side = 20;  ///< of the square of placements, in models
};

/// "orbit": round the model two diagonals of its box away, over its top and below. "fly-in": from a thousand diagonals away to a fiftieth
/// of one, each frame as many times nearer, and last grazing it five thousandths away. "walk": over the model a hundredth of
/// its diagonal above it, looking ahead; a model that is flatter than wide is walked across, upright, any other one round.
/// "field": over a square of models, turned at random.
const std::vector<std::string>& pathNames();

/// One of these about a surface whose box has the origin in its middle. Throws std::invalid_argument for other names.
CameraPath makePath(const std::string& name, const Triangles& surface, const PathOptions& options);

} // namespace osgTessLOD::benchmarks
