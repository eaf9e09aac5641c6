// SPDX-License-Identifier: MIT
#include "Orbit.h"

#include <osg/Math>

#include <cmath>

namespace osgTessLOD::benchmarks {

std::vector<ScreenCamera> orbitOf(const LodAsset& asset, double diagonals, unsigned views)
{
    const osg::Vec3d low(asset.boundsMin[0], asset.boundsMin[1], asset.boundsMin[2]);
    const osg::Vec3d high(asset.boundsMax[0], asset.boundsMax[1], asset.boundsMax[2]);
    const osg::Vec3d center = (low + high) * 0.5;
    const double radius = (high - low).length() * diagonals;
    const osg::Vec3d side(0.6, -0.8, 0.0);
    const osg::Vec3d top(0.4, 0.3, std::sqrt(0.75)); // 60° above
    std::vector<ScreenCamera> cameras;
    for (unsigned k = 0; k < views; ++k) {
        const double turn = 2.0 * osg::PI * k / views;
        ScreenCamera camera;
        camera.width = 1280.0;
        camera.height = 800.0;
        camera.localToEye =
            osg::Matrixd::lookAt(center + (side * std::cos(turn) + top * std::sin(turn)) * radius, center, side ^ top);
        camera.projection.makePerspective(30.0, camera.width / camera.height, 0.01 * radius, 10.0 * radius);
        cameras.push_back(camera);
    }
    return cameras;
}

} // namespace osgTessLOD::benchmarks
