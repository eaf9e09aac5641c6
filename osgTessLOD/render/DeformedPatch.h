// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/AffineMap.h>
#include <osgTessLOD/render/LevelNeed.h>

#include <array>
#include <vector>

namespace osgTessLOD {

/// What becomes of a patch's bounds where a deformation has it: see DeformedPatch.cpp.
class DeformedPatch {
public:
    /// `maps`: per base vertex of the asset; kept.
    DeformedPatch(const LodPatch& patch, const std::vector<AffineMap>& maps);

    /// Holds all of the deformed patch where `undeformed` holds the undeformed one, rounding included.
    static BoundSphere sphere(const LodPatch& patch, const std::vector<AffineMap>& maps, const BoundSphere& undeformed);
    /// Half way between corner `side` and the next one; `undeformed` is there before. The same bits from both sides of a border.
    osg::Vec3d middle(const osg::Vec3d& undeformed, std::size_t side) const;

    /// Errors, from the coarsest level on, to what they are of the deformed patch; in proportion they fall as they did. `chords`:
    /// DeformableAsset::chordError of these levels, same units.
    void deform(LevelError* errors, const double* chords, std::size_t count) const;

private:
    using Quadratic = std::array<double, 6>; ///< ViewError::q

    void setQuadraticMap(const Matrix3& mean);
    Quadratic mapped(const Quadratic& q) const;

    std::array<const AffineMap*, 3> _corners;
    double _stretch;      ///< of any corner's matrix
    double _bend = 0.0;   ///< how far any of these is from their mean
    bool _isFlat = false; ///< the mean is nearly singular: then the quadratic says nothing
    std::array<std::array<double, 6>, 6> _quadraticMap{};
};

} // namespace osgTessLOD
