// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchBlocks.h>

#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <osg/Vec3f>

#include <algorithm>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

/// The middle of the displaced border: what FirstOrder sees the error from. Both sides have the same bits.
osg::Vec3f borderMiddle(const LodAsset& asset, const MorphedSurface& surface, std::uint32_t patch, std::uint32_t side)
{
    const unsigned finest = asset.edges[asset.patches[patch].edges[side]].finestLevel;
    const std::uint32_t factor = asset.ladder[finest];
    const auto level = static_cast<float>(finest);
    const auto point = [&](std::uint32_t index) {
        const auto p = surface.tessLodSurfacePoint(patch, {level, level, level}, index % (3 * factor)).position;
        return osg::Vec3f(p[0], p[1], p[2]);
    };
    const std::uint32_t first = side * factor;
    return factor > 1 ? point(first + factor / 2) : (point(first) + point(first + 1)) * 0.5F;
}

/// The power of two that makes the largest coordinate about 1.
double unitsFor(const LodAsset& asset)
{
    double largest = 0.0;
    for (const LodPatch& patch : asset.patches) {
        for (const float c : patch.boundCenter) { largest = std::max(largest, std::fabs(double{c})); }
        largest = std::max(largest, double{patch.boundRadius});
    }
    return largest > 0.0 ? std::exp2(-std::ceil(std::log2(largest))) : 1.0;
}

float roundedUp(double x)
{
    const auto rounded = static_cast<float>(x);
    return static_cast<double>(rounded) < x ? std::nextafter(rounded, std::numeric_limits<float>::max()) : rounded;
}

/// The errors of one patch, coarse levels made at least LevelNeed::kErrorRatio as large as the next finer's, in every direction:
/// never less than they are. The quadratic by as much of the unit matrix as makes what is missing positive semidefinite.
class FallingErrors {
public:
    /// From the finest level down.
    LevelError next(const LevelError& error)
    {
        constexpr double kRatio = LevelNeed::kErrorRatio;
        LevelError result;
        result.isotropic = std::max(error.isotropic, roundedUp(kRatio * double{_finer.isotropic}));
        ViewError missing;
        for (std::size_t k = 0; k < 6; ++k) {
            missing.q[k] =
                static_cast<float>(double{error.quadratic.q[k]} - kRatio * kRatio * double{_finer.quadratic.q[k]});
        }
        const double lack = std::max(0.0, -missing.leastEigenvalue());
        for (std::size_t k = 0; k < 6; ++k) {
            result.quadratic.q[k] = k < 3 ? roundedUp(double{error.quadratic.q[k]} + lack) : error.quadratic.q[k];
        }
        _finer = result;
        return result;
    }

private:
    LevelError _finer;
};

} // namespace

PatchBlocks::PatchBlocks(const LodAsset& asset, const std::vector<std::uint32_t>& order)
    : _patchCount(static_cast<std::uint32_t>(order.size()))
    , _levelCount(asset.ladder.size())
    , _unitsPerLength(unitsFor(asset))
    , _patchesByReach(asset.ladder.size(), 0)
{
    const std::size_t count = (order.size() + kLanes - 1) / kLanes;
    _spheres.resize(count);
    _middles.resize(3 * count);
    _errors.resize(_levelCount * count);
    _coneAxes.resize(count);
    _borders.resize(count);
    _hasShortBorders.assign(count, 0);
    placePatches(asset, order);
    addErrors(asset, order);
    linkSides(asset, order);
    findNeighbours();
}

unsigned PatchBlocks::lanesOf(std::uint32_t block) const
{
    const std::uint32_t after = _patchCount - block * kLanes;
    return after >= kLanes ? (1U << kLanes) - 1 : (1U << after) - 1;
}

osg::Vec4d PatchBlocks::planeInUnits(osg::Plane plane) const
{
    plane.makeUnitLength();
    osg::Vec4d p = plane.asVec4();
    p.w() *= _unitsPerLength;
    return p;
}

void PatchBlocks::placePatches(const LodAsset& asset, const std::vector<std::uint32_t>& order)
{
    const MorphedSurface surface(asset);
    const auto units = static_cast<float>(_unitsPerLength);
    for (std::size_t position = 0; position < order.size(); ++position) {
        const std::size_t block = position / kLanes;
        const std::size_t lane = position % kLanes;
        const LodPatch& patch = asset.patches[order[position]];
        kernel::Spheres& sphere = _spheres[block];
        sphere.x[lane] = patch.boundCenter[0] * units;
        sphere.y[lane] = patch.boundCenter[1] * units;
        sphere.z[lane] = patch.boundCenter[2] * units;
        sphere.radius[lane] = patch.boundRadius * units;
        kernel::ConeAxes& axis = _coneAxes[block];
        axis.x[lane] = patch.coneAxis[0];
        axis.y[lane] = patch.coneAxis[1];
        axis.z[lane] = patch.coneAxis[2];
        kernel::Borders& borders = _borders[block];
        borders.numbers[lane] = order[position];
        for (std::uint32_t side = 0; side < 3; ++side) {
            const osg::Vec3f middle = borderMiddle(asset, surface, order[position], side) * units;
            kernel::Spheres& at = _middles[3 * block + side];
            at.x[lane] = middle.x();
            at.y[lane] = middle.y();
            at.z[lane] = middle.z();
            const unsigned finest = asset.edges[patch.edges[side]].finestLevel;
            borders.finest[side][lane] = static_cast<float>(finest);
            borders.reach[lane] = std::max(borders.reach[lane], static_cast<float>(finest));
        }
        ++_patchesByReach[static_cast<std::size_t>(borders.reach[lane])];
        for (std::uint32_t side = 0; side < 3; ++side) {
            if (borders.finest[side][lane] < borders.reach[lane]) { _hasShortBorders[block] = 1; }
        }
    }
}

void PatchBlocks::addErrors(const LodAsset& asset, const std::vector<std::uint32_t>& order)
{
    std::vector<std::vector<std::uint32_t>> slots;
    for (std::size_t level = 0; level < _levelCount; ++level) { slots.push_back(asset.levelSlots(level)); }
    const auto units = static_cast<float>(_unitsPerLength);
    for (std::size_t position = 0; position < order.size(); ++position) {
        FallingErrors falling;
        for (std::size_t level = _levelCount; level-- > 0;) {
            const std::uint32_t slot = slots[level][order[position]];
            if (slot == kNoPatch) { continue; }
            LevelError scaled = asset.levels[level].errors[slot];
            scaled.isotropic *= units;
            for (float& q : scaled.quadratic.q) {
                q = static_cast<float>(double{q} * _unitsPerLength * _unitsPerLength);
            }
            const LevelError error = falling.next(scaled);
            kernel::Errors& at = _errors[_levelCount * (position / kLanes) + level];
            for (std::size_t k = 0; k < 6; ++k) { at.q[k][position % kLanes] = error.quadratic.q[k]; }
            at.isotropic[position % kLanes] = error.isotropic;
            at.coneCosine[position % kLanes] = scaled.coneCosine;
        }
    }
}

void PatchBlocks::linkSides(const LodAsset& asset, const std::vector<std::uint32_t>& order)
{
    _edgeSides.assign(asset.edges.size(), kNoPatch);
    const auto link = [&](std::uint32_t from, std::uint32_t to) {
        kernel::Borders& borders = _borders[from / 3 / kLanes];
        borders.twins[from % 3][from / 3 % kLanes] = to / 3;
        borders.twinSides[from % 3][from / 3 % kLanes] = to % 3;
    };
    for (std::uint32_t position = 0; position < order.size(); ++position) {
        for (std::uint32_t side = 0; side < 3; ++side) {
            const std::uint32_t own = 3 * position + side;
            std::uint32_t& first = _edgeSides[asset.patches[order[position]].edges[side]];
            if (first == kNoPatch) { first = own; }
            link(own, first);
            link(first, own);
        }
    }
}

void PatchBlocks::findNeighbours()
{
    _firstNeighbour.push_back(0);
    std::vector<std::uint32_t> blocks;
    for (std::uint32_t block = 0; block < blockCount(); ++block) {
        blocks.clear();
        for (const auto& side : _borders[block].twins) {
            for (const std::uint32_t twin : side) { blocks.push_back(twin / kLanes); }
        }
        std::sort(blocks.begin(), blocks.end());
        blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
        blocks.erase(std::remove(blocks.begin(), blocks.end(), block), blocks.end());
        _neighbours.insert(_neighbours.end(), blocks.begin(), blocks.end());
        _firstNeighbour.push_back(static_cast<std::uint32_t>(_neighbours.size()));
    }
    _neighbours.push_back(0); // so that the address behind the last one is an element's
}

} // namespace osgTessLOD
