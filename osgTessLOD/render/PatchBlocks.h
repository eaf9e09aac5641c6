// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/LevelNeedKernel.h>

#include <osg/Plane>
#include <osg/Vec4d>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD {

class ControlMeshDeformation;
class DeformableAsset;
class DeformedPatch;
struct BoundSphere;

/// What selection asks of an asset's patches, eight patches to a block, in an order that has neighbours near each other. A
/// patch's number in that order is its position. The last block may have room for patches that do not exist: they need nothing.
///
/// Lengths are in units of a power of two of the asset's, so that no square of one is out of single precision's range.
class PatchBlocks {
public:
    static constexpr std::uint32_t kLanes = kernel::kLanes;

    /// `order`: the number of the patch at each position.
    PatchBlocks(const LodAsset& asset, const std::vector<std::uint32_t>& order);
    /// The same patches, in the same order, where a deformation has them. `spheres`: around them, by the patches' numbers.
    PatchBlocks(const PatchBlocks& undeformed, const ControlMeshDeformation& deformation,
                const std::vector<BoundSphere>& spheres);

    std::uint32_t patchCount() const { return _patchCount; }
    std::uint32_t blockCount() const { return static_cast<std::uint32_t>(_spheres.size()); }
    /// Positions, those without a patch included.
    std::uint32_t positionCount() const { return blockCount() * kLanes; }
    /// Bit k: there is a k-th patch in the block.
    unsigned lanesOf(std::uint32_t block) const;
    /// Of ours, in one of the asset's.
    double unitsPerLength() const { return _unitsPerLength; }

    std::size_t levelCount() const { return _levelCount; }
    /// n, d of n · p + d ≥ 0 with n of unit length.
    osg::Vec4d planeInUnits(osg::Plane plane) const;

    const kernel::Spheres& spheres(std::uint32_t block) const { return _spheres[block]; }
    /// The middles of the borders, side 0, 1, 2.
    const kernel::Spheres* middles(std::uint32_t block) const { return &_middles[std::size_t{3} * block]; }
    /// One per level.
    const kernel::Errors* errors(std::uint32_t block) const { return &_errors[_levelCount * block]; }
    const kernel::ConeAxes& coneAxes(std::uint32_t block) const { return _coneAxes[block]; }
    const kernel::Borders& borders(std::uint32_t block) const { return _links->borders[block]; }
    /// Does a border of one of its patches end before the patch?
    bool hasShortBorders(std::uint32_t block) const { return _links->hasShortBorders[block] != 0; }
    /// Is there a border that is not drawn as coarse as may be?
    bool hasSeams() const { return _links->hasSeams; }
    /// Other blocks with a patch across a border of one of these: from, to.
    const std::uint32_t* neighboursBegin(std::uint32_t block) const { return &_links->neighbours[_links->firstNeighbour[block]]; }
    const std::uint32_t* neighboursEnd(std::uint32_t block) const { return &_links->neighbours[_links->firstNeighbour[block + 1]]; }
    /// One side of an edge of the asset: 3 · position + side; kNoPatch if no patch has it.
    std::uint32_t sideOfEdge(std::uint32_t edge) const { return _links->edgeSides[edge]; }
    /// How many patches have each level as the largest of their borders'.
    const std::vector<std::uint32_t>& patchesByReach() const { return _links->patchesByReach; }

private:
    /// What no deformation changes.
    struct Links {
        std::vector<kernel::Borders> borders;
        std::vector<std::uint8_t> hasShortBorders;
        std::vector<std::uint32_t> firstNeighbour;
        std::vector<std::uint32_t> neighbours;
        std::vector<std::uint32_t> edgeSides;
        std::vector<std::uint32_t> patchesByReach;
        bool hasSeams = false;
    };

    void resize(std::size_t blocks);
    void placePatches(const LodAsset& asset, const std::vector<std::uint32_t>& order);
    void addErrors(const LodAsset& asset, const std::vector<std::uint32_t>& order);
    static std::shared_ptr<const Links> link(const LodAsset& asset, const std::vector<std::uint32_t>& order);
    static void addBorders(const LodAsset& asset, const std::vector<std::uint32_t>& order, Links& links);
    static void linkSides(const LodAsset& asset, const std::vector<std::uint32_t>& order, Links& links);
    static void findNeighbours(Links& links);
    void placeSphere(std::size_t position, const BoundSphere& sphere);
    void deformMiddles(const PatchBlocks& undeformed, const DeformedPatch& patch, std::size_t position);
    void deformErrors(const PatchBlocks& undeformed, const DeformedPatch& patch, std::size_t position,
                      const DeformableAsset& chords, std::size_t levels);

    std::uint32_t _patchCount;
    std::size_t _levelCount;
    double _unitsPerLength;
    std::vector<kernel::Spheres> _spheres;
    std::vector<kernel::Spheres> _middles;
    std::vector<kernel::Errors> _errors;
    std::vector<kernel::ConeAxes> _coneAxes;
    std::shared_ptr<const Links> _links;
};

} // namespace osgTessLOD
