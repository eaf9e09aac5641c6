// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/SelectionOptions.h>
#include <osgTessLOD/render/SelectionView.h>

#include <osg/Vec3f>

#include <cstddef>

namespace osgTessLOD {

/// A sphere in local space.
struct BoundSphere {
    osg::Vec3f center;
    float radius = 0.0F;
};

/// How fine patches have to be for one view: a continuous level. What needs more than level k has needs above k; k + 1 at
/// least where level k does not do at all.
///
/// The need is a continuous function of the view and grows with the errors. For that the errors must fall strictly from level
/// to level: where a finer level is no better than a coarser one, the level would jump from k to k + 1 in the moment the coarse
/// one no longer suffices. So the coarser error is taken to be at least kErrorRatio times the finer: never less than the true
/// one, so the bound is kept.
class LevelNeed {
public:
    static constexpr double kErrorRatio = 1.1;
    /// Rows of a patch's errors, each a number per level, 0 above its finest: ViewError::q, then the isotropic error.
    static constexpr std::size_t kErrorRows = 7;
    /// Rows of what holds for all of several patches.
    enum BoundRow { kLeastSeen, kLeastIsotropic, kLargestIsotropic, kBoundRows };

    /// Needs are at most finestAllowed + 1.
    LevelNeed(const SelectionView& view, const SelectionOptions& options, std::size_t levelCount,
              unsigned finestAllowed);

    /// Is the patch's bounding sphere to be asked for (Conservative), or the middle of each border?
    bool isPerPatch() const { return _conservative; }

    /// Conservative: of a patch of which all that is ever drawn lies in the sphere.
    float ofPatch(const BoundSphere& sphere, const float* errors) const;
    /// FirstOrder: of a patch at a border with its middle there.
    float atBorder(const osg::Vec3f& middle, const float* errors) const;

    struct Range {
        float least;
        float largest;
    };
    /// Contains the needs of all patches whose spheres lie in this one.
    Range ofPatches(const BoundSphere& sphere, const float* bounds) const;

    /// Is level `finest` not good enough where this is needed?
    bool isSaturated(float need, unsigned finest) const;

private:
    struct Sight;
    Sight sightOf(const osg::Vec3f& center, double radius) const;
    void errorsAlong(const Sight& sight, const float* errors, double* seen) const;
    float needFor(const double* errors, double tolerance) const;

    SelectionView _view;
    bool _conservative;
    bool _isotropic;
    std::size_t _levelCount;
    float _most;
    double _slope; ///< of the tolerance: object units per object unit of distance; orthographic: the tolerance
};

} // namespace osgTessLOD
