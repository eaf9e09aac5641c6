// SPDX-License-Identifier: MIT
#pragma once

namespace osg {
class StateSet;
}

namespace osgUtil {
class CullVisitor;
}

namespace osgTessLOD {

/// Triangles that GL leaves out, by the way their corners turn on screen.
enum class CulledFace { None, Clockwise, CounterClockwise };

/// What is culled of a drawable that `visitor` visits, with a state set of its own or null, by all state sets from the camera's
/// down, overrides and protections included. None where that cannot be told.
CulledFace culledFaceOf(osgUtil::CullVisitor& visitor, const osg::StateSet* own);

} // namespace osgTessLOD
