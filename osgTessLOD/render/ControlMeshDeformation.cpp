// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/ControlMeshDeformation.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/AffineMap.h>
#include <osgTessLOD/render/DeformableAsset.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchSelector.h>

#include <osg/Notify>
#include <osg/State>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace osgTessLOD {

namespace {

using Rows = std::array<osg::Vec4f, 3>;

constexpr double kRounding = 1e-6; ///< relative to the sizes of numbers: some units in the last place

/// The rows of the transform less the identity's, as the GPU has them; zeros for what cannot be drawn.
Rows rowsOf(const osg::Matrixd& m, const osg::Vec3d& reach)
{
    constexpr double kMost = 1e-3 * std::numeric_limits<float>::max();
    if (m(0, 3) != 0.0 || m(1, 3) != 0.0 || m(2, 3) != 0.0 || m(3, 3) != 1.0) { return {}; }
    Rows rows;
    for (int k = 0; k < 3; ++k) {
        double largest = std::fabs(m(3, k));
        for (int c = 0; c < 3; ++c) { largest += (std::fabs(m(c, k)) + 1.0) * (reach[c] + 1.0); }
        if (!(largest <= kMost)) { return {}; } // NaN, too
        rows[static_cast<std::size_t>(k)] = osg::Vec4d(m(0, k) - (k == 0 ? 1.0 : 0.0), m(1, k) - (k == 1 ? 1.0 : 0.0),
                                                       m(2, k) - (k == 2 ? 1.0 : 0.0), m(3, k));
    }
    return rows;
}

AffineMap mapOf(const Rows& rows)
{
    AffineMap map;
    for (int k = 0; k < 3; ++k) {
        const osg::Vec4f& row = rows[static_cast<std::size_t>(k)];
        map.linear.rows[static_cast<std::size_t>(k)] = osg::Vec3d(row.x(), row.y(), row.z());
        map.linear.rows[static_cast<std::size_t>(k)][k] += 1.0;
        map.move[k] = row.w();
    }
    map.stretch = map.linear.largestSingularValues()[0];
    return map;
}

/// Around what the map makes of the box, rounding included.
osg::BoundingBox mapped(const AffineMap& map, const osg::BoundingBox& box)
{
    const osg::Vec3d center = map(box.center());
    const osg::Vec3d half = osg::Vec3d(box._max - box._min) * 0.5;
    osg::BoundingBox result;
    osg::Vec3d reach;
    for (int k = 0; k < 3; ++k) {
        const osg::Vec3d& row = map.linear.rows[static_cast<std::size_t>(k)];
        reach[k] = std::fabs(row.x()) * half.x() + std::fabs(row.y()) * half.y() + std::fabs(row.z()) * half.z();
        reach[k] += kRounding * (reach[k] + std::fabs(center[k]) + std::fabs(map.move[k]));
    }
    result.expandBy(center - reach);
    result.expandBy(center + reach);
    return result;
}

osg::Vec3d reachOf(const osg::BoundingBox& box)
{
    osg::Vec3d reach;
    for (int k = 0; k < 3; ++k) { reach[k] = std::max(std::fabs(box._min[k]), std::fabs(box._max[k])); }
    return reach;
}

} // namespace

std::vector<osg::Vec3d> ControlMeshDeformation::baseVertices(const LodAsset& asset)
{
    std::vector<osg::Vec3d> places;
    for (const std::array<std::int32_t, 3>& at : asset.baseVertices) {
        const auto place = [&](std::size_t k) { return double{asset.lattice.step * static_cast<float>(at[k])}; };
        places.emplace_back(place(0), place(1), place(2));
    }
    return places;
}

ControlMeshDeformation::ControlMeshDeformation(const GpuAsset* asset, const std::vector<osg::Matrixd>& transforms)
    : _asset(asset)
    , _state(new osg::StateSet)
{
    const std::vector<osg::BoundingBox>& boxes = asset->deformable().boxes();
    const osg::Vec3d reach = reachOf(asset->bounds());
    const osg::ref_ptr<osg::Vec4Array> texels = new osg::Vec4Array;
    texels->reserve(std::max<std::size_t>(1, kTexels * boxes.size()));
    _maps.reserve(boxes.size());
    for (std::size_t k = 0; k < boxes.size(); ++k) {
        const Rows rows = k < transforms.size() ? rowsOf(transforms[k], reach) : Rows();
        texels->insert(texels->end(), rows.begin(), rows.end());
        _maps.push_back(mapOf(rows));
        if (boxes[k].valid()) { _bounds.expandBy(mapped(_maps.back(), boxes[k])); }
    }
    if (texels->empty()) { texels->push_back(osg::Vec4()); }
    _buffer = TexelBuffer::make(*_state, texels.get(), GL_RGBA32F_ARB, 1, kUnit, "tessLodDeformation");
    _state->setDefine("TESSLOD_DEFORMATION");
}

ControlMeshDeformation::~ControlMeshDeformation() = default;

const PatchSelector& ControlMeshDeformation::selector() const
{
    std::call_once(_selectorOnce, [this] { _selector = std::make_unique<PatchSelector>(_asset->selector(), *this); });
    return *_selector;
}

osg::Vec3f ControlMeshDeformation::tessLodDeformed(const osg::Vec3f& position, const MorphedSurface::Vec3& weights,
                                                   std::uint32_t patch) const
{
    const auto& baseVertices = _asset->asset().patches[patch].baseVertices;
    std::array<std::size_t, 3> corners{0, 1, 2};
    std::sort(corners.begin(), corners.end(),
              [&](std::size_t a, std::size_t b) { return baseVertices[a] < baseVertices[b]; });
    osg::Vec3f deformed = position;
    for (const std::size_t corner : corners) {
        const float weight = weights[corner];
        if (weight == 0.0F) { continue; }
        for (unsigned k = 0; k < 3; ++k) {
            const osg::Vec4f& row = texels()[kTexels * baseVertices[corner] + k];
            const float move = ((row.x() * position.x() + row.y() * position.y()) + row.z() * position.z()) + row.w();
            deformed[static_cast<int>(k)] += move * weight;
        }
    }
    return deformed;
}

bool ControlMeshDeformation::fits(osg::State& state) const
{
    const std::int64_t most = DrawContext::of(state).maxTextureBufferTexels();
    const bool fits = static_cast<std::int64_t>(kTexels * _maps.size()) <= most;
    if (!fits && !_warned.exchange(true)) {
        OSG_WARN << "osgTessLOD: cannot draw \"" << _asset->asset().source << "\" deformed: it has " << _maps.size()
                 << " base vertices, and this context room for " << most / static_cast<std::int64_t>(kTexels)
                 << std::endl;
    }
    return fits;
}

void ControlMeshDeformation::releaseGLObjects(osg::State* state) const
{
    _state->releaseGLObjects(state);
    _buffer.releaseGLObjects(state);
}

void ControlMeshDeformation::resizeGLObjectBuffers(unsigned maxSize) const
{
    _state->resizeGLObjectBuffers(maxSize);
    _buffer.resizeGLObjectBuffers(maxSize);
}

} // namespace osgTessLOD
