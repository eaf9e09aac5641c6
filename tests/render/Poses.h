// SPDX-License-Identifier: MIT
// Deformations of a control mesh, as functions of time.
#pragma once

#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/GpuAsset.h>

#include <osg/Matrixd>
#include <osg/Vec3d>

#include <cmath>
#include <cstddef>
#include <functional>
#include <random>
#include <vector>

namespace osgTessLOD {

/// What becomes of the space around a point: where it goes, and how it changes there.
using Motion = std::function<osg::Matrixd(const osg::Vec3d& at, double time)>;

/// Goes along with the point `at` by `linear` about it (row vectors) and to `to`.
inline osg::Matrixd about(const osg::Vec3d& at, osg::Matrixd linear, const osg::Vec3d& to)
{
    linear.preMultTranslate(-at);
    linear.postMultTranslate(to);
    return linear;
}

/// Waves of height 0.15 along x, which move points along y and turn what is around them.
inline osg::Matrixd waves(const osg::Vec3d& at, double time)
{
    const double phase = 3.0 * at.x() + time;
    osg::Matrixd linear;
    linear(0, 1) = 0.15 * 3.0 * std::cos(phase);
    return about(at, linear, at + osg::Vec3d(0.0, 0.15 * std::sin(phase), 0.0));
}

/// Bends the x axis into an arc of up to 1.2 radians per unit, and twists it.
inline osg::Matrixd bending(const osg::Vec3d& at, double time)
{
    const double curvature = 1.2 * std::sin(time) + 1e-3;
    const double angle = curvature * at.x();
    osg::Matrixd turn = osg::Matrixd::rotate(0.8 * at.x() * std::cos(time), 1.0, 0.0, 0.0) *
                        osg::Matrixd::rotate(angle, 0.0, 0.0, 1.0);
    const osg::Vec3d axisPoint(std::sin(angle) / curvature, (1.0 - std::cos(angle)) / curvature, 0.0);
    return about(osg::Vec3d(at.x(), 0.0, 0.0), turn, axisPoint);
}

/// Turns and moves everything alike.
inline osg::Matrixd turning(const osg::Vec3d&, double time)
{
    return osg::Matrixd::rotate(time, 0.3, 1.0, -0.5) * osg::Matrixd::translate(2.0 * time, -1.0, 0.3);
}

inline std::vector<osg::Matrixd> poseOf(const LodAsset& asset, const Motion& motion, double time)
{
    std::vector<osg::Matrixd> transforms;
    for (const osg::Vec3d& at : ControlMeshDeformation::baseVertices(asset)) { transforms.push_back(motion(at, time)); }
    return transforms;
}

inline osg::ref_ptr<ControlMeshDeformation> deformed(const GpuAsset& asset, const Motion& motion, double time)
{
    return new ControlMeshDeformation(&asset, poseOf(asset.asset(), motion, time));
}

/// Every base vertex goes somewhere of its own: stretched, sheared, turned over.
inline osg::ref_ptr<ControlMeshDeformation> wildlyDeformed(const GpuAsset& asset, unsigned seed)
{
    std::mt19937 random(seed);
    std::vector<osg::Matrixd> transforms;
    for (std::size_t k = 0; k < asset.asset().baseVertices.size(); ++k) {
        osg::Matrixd m;
        for (int column = 0; column < 3; ++column) {
            for (int row = 0; row < 4; ++row) {
                m(row, column) = std::uniform_real_distribution<double>(-2.0, 2.0)(random);
            }
        }
        transforms.push_back(m);
    }
    return new ControlMeshDeformation(&asset, transforms);
}

} // namespace osgTessLOD
