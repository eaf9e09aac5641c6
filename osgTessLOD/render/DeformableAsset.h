// SPDX-License-Identifier: MIT
#pragma once

#include <osg/BoundingBox>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace osgTessLOD {

struct LodAsset;

/// What all deformations of an asset have in common. Immutable.
class DeformableAsset {
public:
    explicit DeformableAsset(const LodAsset& asset);

    /// Per base vertex a box around what its transform has a part in, asset frame; not valid where there is nothing.
    const std::vector<osg::BoundingBox>& boxes() const { return _boxes; }

    /// How far triangles may be from what they stand for because they are flat, while no border is below `level`: a deformation
    /// whose matrices are within δ (largest singular value) of one another's mean bends the triangles between their corners by
    /// δ times this at most. Object units; falls by LevelNeed::kErrorRatio at least from level to level; 0 above the patch's
    /// finest level.
    float chordError(std::uint32_t patch, std::size_t level) const { return _chordErrors[patch * _levelCount + level]; }

private:
    std::size_t _levelCount;
    std::vector<osg::BoundingBox> _boxes;
    std::vector<float> _chordErrors;
};

} // namespace osgTessLOD
