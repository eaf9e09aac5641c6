// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Vec3d>

#include <random>

namespace osgTessLOD {

/// A unit vector, all directions alike.
template <class Generator> osg::Vec3d randomDirection(Generator& random)
{
    std::normal_distribution<double> normal;
    osg::Vec3d direction;
    for (const int axis : {2, 1, 0}) { direction[axis] = normal(random); }
    direction.normalize();
    return direction;
}

} // namespace osgTessLOD
