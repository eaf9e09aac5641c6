// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/SurfaceProxy.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/Placements.h>

#include <algorithm>

namespace osgTessLOD {

SurfaceTree::SurfaceTree(const SurfaceTree& other, const osg::CopyOp& copyop)
    : osg::KdTree(other, copyop)
{
}

namespace {

/// Calls visit(patch, its vertex) for the vertices of all patches at one level, in the order of the proxy's.
template <class Visit>
void forEachVertex(const LodAsset& asset, const PatchRecords& records, const MorphedSurface& surface,
                   const Visit& visit)
{
    for (const PatchRecord& record : records) {
        const unsigned factor = asset.ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            visit(record.patch, surface.tessLodSurfacePoint(record.patch, record.edgeLevels, v));
        }
    }
}

osg::Vec3f toVec3(const MorphedSurface::Vec3& p)
{
    return {p[0], p[1], p[2]};
}

} // namespace

SurfaceProxy::SurfaceProxy(const LodAsset& asset, const PatchSelector& selector, const MorphedSurface& surface,
                           unsigned level)
    : _level(level)
{
    const PatchRecords records = selector.uniformRecords(level);
    _triangles->reserve(3 * selector.statisticsOf(records).triangles);
    unsigned first = 0;
    for (const PatchRecord& record : records) {
        const TessellationPattern pattern(asset.ladder[MorphedSurface::drawnLevel(record.edgeLevels)]);
        for (const TessellationPattern::Triangle& triangle : pattern.triangles()) {
            for (const std::uint32_t v : triangle) { _triangles->push_back(first + v); }
        }
        first += pattern.vertexCount();
    }
    forEachVertex(asset, records, surface, [&](std::uint32_t, const MorphedSurface::TessLodPoint& p) {
        _vertices->push_back(toVec3(p.position));
    });
}

SurfaceProxy::SurfaceProxy(const SurfaceProxy& undeformed, const GpuAsset& asset,
                           const ControlMeshDeformation& deformation)
    : _level(undeformed._level)
    , _triangles(undeformed._triangles)
{
    forEachVertex(asset.asset(), asset.selector().uniformRecords(_level), asset.surface(),
                  [&](std::uint32_t patch, const MorphedSurface::TessLodPoint& p) {
                      _vertices->push_back(deformation.tessLodDeformed(toVec3(p.position), p.weights, patch));
                  });
}

SurfaceProxy::SurfaceProxy(const SurfaceProxy& one, const Placements& placements)
    : _level(one._level)
{
    const auto everywhere = [](const osg::BoundingSphere&) { return true; };
    placements.forEach(everywhere, [&](std::uint32_t number) {
        const auto first = static_cast<unsigned>(_vertices->size());
        for (const osg::Vec3& p : *one._vertices) { _vertices->push_back(placements.tessLodPlaced(p, number)); }
        const std::size_t second = placements.mirrors(number) ? 2 : 1; // so that they stay counter-clockwise
        for (std::size_t k = 0; k + 2 < one._triangles->size(); k += 3) {
            const osg::DrawElementsUInt& t = *one._triangles;
            for (const std::size_t corner : {k, k + second, k + 3 - second}) {
                _triangles->push_back(first + t[corner]);
            }
        }
    });
}

SurfaceProxy::~SurfaceProxy() = default;

unsigned SurfaceProxy::levelFor(const PatchSelector& selector, std::size_t levelCount, const PickingOptions& options)
{
    unsigned best = 0;
    for (unsigned level = 1; level < levelCount && level <= options.finestLevel; ++level) {
        if (selector.statisticsOf(selector.uniformRecords(level)).triangles <= options.maxTriangles) { best = level; }
    }
    return best;
}

SurfaceTree* SurfaceProxy::tree() const
{
    std::call_once(_treeOnce, [this] {
        const osg::ref_ptr<osg::Geometry> geometry = new osg::Geometry;
        geometry->setVertexArray(_vertices.get());
        geometry->addPrimitiveSet(_triangles.get());
        osg::KdTree::BuildOptions options;
        const osg::ref_ptr<SurfaceTree> tree = new SurfaceTree;
        if (tree->build(options, geometry.get())) { _tree = tree; }
    });
    return _tree.get();
}

} // namespace osgTessLOD
