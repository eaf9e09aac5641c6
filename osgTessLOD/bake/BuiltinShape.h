// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

#include <memory>

namespace osgTessLOD::bake {

/// A surface as a function of a point of a simple domain, private to the bake room: the unit sphere (points are unit
/// vectors), or the sheet 0 ≤ x, y ≤ 4 of the plane z = 0 (defined a little beyond it too). Continuous; outward is where
/// the domain's outward normal, or +z, goes. Thread safe.
class BuiltinShape {
public:
    virtual ~BuiltinShape() = default;
    virtual Eigen::Vector3d position(const Eigen::Vector3d& point) const = 0;
};

// `extraOctaves` halvings of the smallest features, for references that are sampled so much finer.

/// Cratered rock of radius about 1, over the sphere.
std::unique_ptr<BuiltinShape> makeAsteroidShape(unsigned extraOctaves);
/// A brick wall with overhanging bricks and deep joints, over the sheet.
std::unique_ptr<BuiltinShape> makeBricksShape(unsigned extraOctaves);
/// A coiled, spiny shell, over the sphere: z = 1 goes to the tip, the parallel at 9/11 of the way down to the sharp lip,
/// and from there the surface runs back inside, to z = −1 deep in the last whorl.
std::unique_ptr<BuiltinShape> makeSeashellShape(unsigned extraOctaves);
/// Mountains around a glacier, over the sheet: a height field, x and y stay as they are.
std::unique_ptr<BuiltinShape> makeGlacierShape(unsigned extraOctaves);

} // namespace osgTessLOD::bake
