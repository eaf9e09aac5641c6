// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/LevelNeedKernel.h>
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
/// one no longer suffices. So PatchBlocks takes the coarser error to be at least kErrorRatio times the finer: never less than
/// the true one, so the bound is kept.
class OSGTESSLOD_EXPORT LevelNeed {
public:
    static constexpr double kErrorRatio = 1.1;
    /// Rows of what holds for all of several patches, a number per level.
    enum BoundRow { kLeastSeen, kLeastIsotropic, kLargestIsotropic, kBoundRows };

    /// Needs are at most finestAllowed + 1. Spheres and errors are in units of which there are `unitsPerLength` in one of the
    /// view's space.
    LevelNeed(const SelectionView& view, const SelectionOptions& options, std::size_t levelCount,
              unsigned finestAllowed, double unitsPerLength);

    /// Is the patch's bounding sphere to be asked for (Conservative), or the middle of each border?
    bool isPerPatch() const { return _kernelView.conservative; }

    /// What needs of single patches are computed from.
    const kernel::View& kernelView() const { return _kernelView; }

    struct Range {
        float least;
        float largest;
    };
    /// Contains the needs of all patches whose spheres lie in this one.
    Range ofPatches(const BoundSphere& sphere, const float* bounds) const;

private:
    struct Sight;
    Sight sightOf(const BoundSphere& sphere) const;
    float needFor(const double* errors, double tolerance) const;

    SelectionView _view; ///< in these units
    std::size_t _levelCount;
    double _slope; ///< of the tolerance: per distance; orthographic: the tolerance
    kernel::View _kernelView;
};

} // namespace osgTessLOD
