// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchBlocks.h>

#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/DeformableAsset.h>
#include <osgTessLOD/render/DeformedPatch.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/LevelNeed.h>
#include <osgTessLOD/render/MorphedSurface.h>

#include <osg/Vec3f>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

/// The middle of the displaced border, as the finest level has it that is always there: what FirstOrder sees the error from. Both
/// sides have the same bits.
osg::Vec3f borderMiddle(const LodAsset& asset, const MorphedSurface& surface, std::uint32_t patch, std::uint32_t side)
{
    const unsigned finest = asset.edges[asset.patches[patch].edges[side]].finestLevel;
    const unsigned drawn = std::min(finest, asset.levelsUpTo(StreamedAsset::kLeastFactor) - 1);
    const std::uint32_t factor = asset.ladder[drawn];
    const auto level = static_cast<float>(drawn);
    const auto point = [&](std::uint32_t index) {
        const auto p = surface.tessLodSurfacePoint(patch, {level, level, level}, index % (3 * factor)).position;
        return osg::Vec3f(p[0], p[1], p[2]);
    };
    const std::uint32_t first = side * factor;
    return factor > 1 ? point(first + factor / 2) : (point(first) + point(first + 1)) * 0.5F;
}

std::vector<BoundSphere> spheresOf(const LodAsset& asset)
{
    std::vector<BoundSphere> spheres;
    for (const LodPatch& patch : asset.patches) {
        spheres.push_back({{patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]}, patch.boundRadius});
    }
    return spheres;
}

/// The power of two that makes the largest coordinate about 1.
double unitsFor(const std::vector<BoundSphere>& patches)
{
    double largest = 0.0;
    for (const BoundSphere& patch : patches) {
        for (int k = 0; k < 3; ++k) { largest = std::max(largest, std::fabs(double{patch.center[k]})); }
        largest = std::max(largest, double{patch.radius});
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
    , _unitsPerLength(unitsFor(spheresOf(asset)))
    , _links(link(asset, order))
{
    resize(_links->borders.size());
    placePatches(asset, order);
    addErrors(asset, order);
}

PatchBlocks::PatchBlocks(const PatchBlocks& undeformed, const ControlMeshDeformation& deformation,
                         const std::vector<BoundSphere>& spheres)
    : _patchCount(undeformed._patchCount)
    , _levelCount(undeformed._levelCount)
    , _unitsPerLength(unitsFor(spheres))
    , _links(undeformed._links)
{
    resize(undeformed._spheres.size());
    const LodAsset& asset = deformation.asset().asset();
    const DeformableAsset& chords = deformation.asset().deformable();
    for (std::size_t position = 0; position < _patchCount; ++position) {
        const std::uint32_t number = _links->borders[position / kLanes].numbers[position % kLanes];
        const LodPatch& patch = asset.patches[number];
        const DeformedPatch deformed(patch, deformation.maps());
        placeSphere(position, spheres[number]);
        deformMiddles(undeformed, deformed, position);
        deformErrors(undeformed, deformed, position, chords, std::size_t{patch.finestLevel} + 1);
    }
}

void PatchBlocks::resize(std::size_t blocks)
{
    _spheres.resize(blocks);
    _middles.resize(3 * blocks);
    _errors.resize(_levelCount * blocks);
    _coneAxes.resize(blocks);
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

void PatchBlocks::placeSphere(std::size_t position, const BoundSphere& sphere)
{
    const auto units = static_cast<float>(_unitsPerLength);
    kernel::Spheres& at = _spheres[position / kLanes];
    at.x[position % kLanes] = sphere.center.x() * units;
    at.y[position % kLanes] = sphere.center.y() * units;
    at.z[position % kLanes] = sphere.center.z() * units;
    at.radius[position % kLanes] = sphere.radius * units;
}

void PatchBlocks::placePatches(const LodAsset& asset, const std::vector<std::uint32_t>& order)
{
    const MorphedSurface surface(asset);
    const std::vector<BoundSphere> spheres = spheresOf(asset);
    const auto units = static_cast<float>(_unitsPerLength);
    for (std::size_t position = 0; position < order.size(); ++position) {
        const std::size_t block = position / kLanes;
        const std::size_t lane = position % kLanes;
        const LodPatch& patch = asset.patches[order[position]];
        placeSphere(position, spheres[order[position]]);
        kernel::ConeAxes& axis = _coneAxes[block];
        axis.x[lane] = patch.coneAxis[0];
        axis.y[lane] = patch.coneAxis[1];
        axis.z[lane] = patch.coneAxis[2];
        for (std::uint32_t side = 0; side < 3; ++side) {
            const osg::Vec3f middle = borderMiddle(asset, surface, order[position], side) * units;
            kernel::Spheres& at = _middles[3 * block + side];
            at.x[lane] = middle.x();
            at.y[lane] = middle.y();
            at.z[lane] = middle.z();
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

// ----------------------------------------------------------------------------------------------- deformations ---

void PatchBlocks::deformMiddles(const PatchBlocks& undeformed, const DeformedPatch& patch, std::size_t position)
{
    const std::size_t lane = position % kLanes;
    for (std::size_t side = 0; side < 3; ++side) {
        const kernel::Spheres& from = undeformed._middles[3 * (position / kLanes) + side];
        kernel::Spheres& to = _middles[3 * (position / kLanes) + side];
        const osg::Vec3d middle =
            patch.middle(osg::Vec3d(from.x[lane], from.y[lane], from.z[lane]) / undeformed._unitsPerLength, side) *
            _unitsPerLength;
        to.x[lane] = static_cast<float>(middle.x());
        to.y[lane] = static_cast<float>(middle.y());
        to.z[lane] = static_cast<float>(middle.z());
    }
}

void PatchBlocks::deformErrors(const PatchBlocks& undeformed, const DeformedPatch& patch, std::size_t position,
                               const DeformableAsset& chords, std::size_t levels)
{
    const std::size_t lane = position % kLanes;
    const std::size_t first = _levelCount * (position / kLanes);
    const std::uint32_t number = _links->borders[position / kLanes].numbers[lane];
    const auto units = static_cast<float>(_unitsPerLength / undeformed._unitsPerLength);
    std::array<LevelError, LodAsset::kMaxLevels> errors;
    std::array<double, LodAsset::kMaxLevels> chordErrors{};
    for (std::size_t level = 0; level < levels; ++level) {
        const kernel::Errors& from = undeformed._errors[first + level];
        for (std::size_t k = 0; k < 6; ++k) { errors[level].quadratic.q[k] = from.q[k][lane] * units * units; }
        errors[level].isotropic = from.isotropic[lane] * units;
        chordErrors[level] = double{chords.chordError(number, level)} * _unitsPerLength;
    }
    patch.deform(errors.data(), chordErrors.data(), levels);
    for (std::size_t level = 0; level < levels; ++level) {
        kernel::Errors& to = _errors[first + level];
        for (std::size_t k = 0; k < 6; ++k) { to.q[k][lane] = errors[level].quadratic.q[k]; }
        to.isotropic[lane] = errors[level].isotropic;
        to.coneCosine[lane] = errors[level].coneCosine;
    }
}

// ------------------------------------------------------------------------------------------------- what meets what ---

std::shared_ptr<const PatchBlocks::Links> PatchBlocks::link(const LodAsset& asset,
                                                            const std::vector<std::uint32_t>& order)
{
    const auto links = std::make_shared<Links>();
    addBorders(asset, order, *links);
    linkSides(asset, order, *links);
    findNeighbours(*links);
    return links;
}

void PatchBlocks::addBorders(const LodAsset& asset, const std::vector<std::uint32_t>& order, Links& links)
{
    const std::size_t count = (order.size() + kLanes - 1) / kLanes;
    links.borders.resize(count);
    links.hasShortBorders.assign(count, 0);
    links.patchesByReach.assign(asset.ladder.size(), 0);
    for (std::size_t position = 0; position < order.size(); ++position) {
        const std::size_t block = position / kLanes;
        const std::size_t lane = position % kLanes;
        kernel::Borders& borders = links.borders[block];
        borders.numbers[lane] = order[position];
        for (std::uint32_t side = 0; side < 3; ++side) {
            const LodEdge& edge = asset.edges[asset.patches[order[position]].edges[side]];
            borders.finest[side][lane] = static_cast<float>(edge.finestLevel);
            borders.coarsest[side][lane] = static_cast<float>(edge.coarsestLevel);
            borders.reach[lane] = std::max(borders.reach[lane], borders.finest[side][lane]);
            links.hasSeams = links.hasSeams || edge.coarsestLevel > 0;
        }
        ++links.patchesByReach[static_cast<std::size_t>(borders.reach[lane])];
        for (std::uint32_t side = 0; side < 3; ++side) {
            if (borders.finest[side][lane] < borders.reach[lane]) { links.hasShortBorders[block] = 1; }
        }
    }
}

void PatchBlocks::linkSides(const LodAsset& asset, const std::vector<std::uint32_t>& order, Links& links)
{
    links.edgeSides.assign(asset.edges.size(), kNoPatch);
    const auto link = [&](std::uint32_t from, std::uint32_t to) {
        kernel::Borders& borders = links.borders[from / 3 / kLanes];
        borders.twins[from % 3][from / 3 % kLanes] = to / 3;
        borders.twinSides[from % 3][from / 3 % kLanes] = to % 3;
    };
    for (std::uint32_t position = 0; position < order.size(); ++position) {
        for (std::uint32_t side = 0; side < 3; ++side) {
            const std::uint32_t own = 3 * position + side;
            std::uint32_t& first = links.edgeSides[asset.patches[order[position]].edges[side]];
            if (first == kNoPatch) { first = own; }
            link(own, first);
            link(first, own);
        }
    }
}

void PatchBlocks::findNeighbours(Links& links)
{
    links.firstNeighbour.push_back(0);
    std::vector<std::uint32_t> blocks;
    for (std::uint32_t block = 0; block < links.borders.size(); ++block) {
        blocks.clear();
        for (const auto& side : links.borders[block].twins) {
            for (const std::uint32_t twin : side) { blocks.push_back(twin / kLanes); }
        }
        std::sort(blocks.begin(), blocks.end());
        blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
        blocks.erase(std::remove(blocks.begin(), blocks.end(), block), blocks.end());
        links.neighbours.insert(links.neighbours.end(), blocks.begin(), blocks.end());
        links.firstNeighbour.push_back(static_cast<std::uint32_t>(links.neighbours.size()));
    }
    links.neighbours.push_back(0); // so that the address behind the last one is an element's
}

} // namespace osgTessLOD
