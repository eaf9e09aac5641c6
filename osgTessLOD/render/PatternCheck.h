// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/State>

namespace osgTessLOD {

/// Does the driver's tessellator make the triangles of TessellationPattern(factor), each once and the same way round, and do
/// the shaders number its vertices so? By transform feedback in the context of `state`, which must be current, can tessellate
/// and has a complete framebuffer; GL state is left as found.
OSGTESSLOD_EXPORT bool driverMakesPattern(osg::State& state, unsigned factor);

} // namespace osgTessLOD
