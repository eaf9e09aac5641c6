// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/SurfaceProxy.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/Placements.h>

#include <algorithm>

namespace osgTessLOD {

SurfaceTree::SurfaceTree(const SurfaceTree& other, const osg::CopyOp& copyop)
    : osg::KdTree(other, copyop)
{
}

SurfaceProxy::SurfaceProxy(const LodAsset& asset, const PatchSelector& selector, const MorphedSurface& surface,
                           unsigned level)
    : _level(level)
{
    const PatchRecords records = selector.uniformRecords(level);
    _triangles->reserve(3 * selector.statisticsOf(records).triangles);
    for (const PatchRecord& record : records) {
        const unsigned factor = asset.ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
        const auto first = static_cast<unsigned>(_vertices->size());
        for (std::uint32_t v = 0; v < TessellationPattern::vertexCount(factor); ++v) {
            const MorphedSurface::Vec3 p = surface.tessLodSurfacePoint(record.patch, record.edgeLevels, v).position;
            _vertices->push_back(osg::Vec3(p[0], p[1], p[2]));
        }
        const TessellationPattern pattern(factor);
        for (const TessellationPattern::Triangle& triangle : pattern.triangles()) {
            for (std::uint32_t v : triangle) { _triangles->push_back(first + v); }
        }
    }
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
