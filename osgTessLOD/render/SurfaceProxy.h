// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/Geometry>
#include <osg/KdTree>
#include <osg/Referenced>
#include <osg/ref_ptr>

#include <cstdint>
#include <limits>
#include <mutex>

namespace osgTessLOD {

class ControlMeshDeformation;
class GpuAsset;
class MorphedSurface;
class Placements;
class PatchSelector;
struct LodAsset;

/// Which level stands for a surface wherever OSG asks for triangles on the CPU: intersections, functors, statistics. It is
/// the finest one that both limits allow, and level 0 where they allow none.
struct PickingOptions {
    unsigned finestLevel = std::numeric_limits<unsigned>::max(); ///< index into the ladder
    std::uint64_t maxTriangles = 100'000;                        ///< some 100 bytes of memory each, tree included

    bool operator==(const PickingOptions& o) const
    {
        return finestLevel == o.finestLevel && maxTriangles == o.maxTriangles;
    }
};

/// The KdTree of a SurfaceProxy, under a name of its own: it is made again when needed, and so need not be in files.
class OSGTESSLOD_EXPORT SurfaceTree : public osg::KdTree {
public:
    SurfaceTree() = default;
    SurfaceTree(const SurfaceTree& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
    osg::Object* cloneType() const override { return new SurfaceTree; }
    osg::Object* clone(const osg::CopyOp& copyop) const override { return new SurfaceTree(*this, copyop); }
    bool isSameKindAs(const osg::Object* o) const override { return dynamic_cast<const SurfaceTree*>(o) != nullptr; }
    const char* libraryName() const override { return "osgTessLOD"; }
    const char* className() const override { return "SurfaceTree"; }

protected:
    ~SurfaceTree() override = default;
};

/// One level of an asset as triangles, and a tree to find them by. Immutable; shared by all drawables that ask for the level.
class OSGTESSLOD_EXPORT SurfaceProxy : public osg::Referenced {
public:
    SurfaceProxy(const LodAsset& asset, const PatchSelector& selector, const MorphedSurface& surface, unsigned level);

    /// `undeformed`, of this asset, where a deformation of it has its vertices.
    SurfaceProxy(const SurfaceProxy& undeformed, const GpuAsset& asset, const ControlMeshDeformation& deformation);

    /// `one` at each of the placements.
    SurfaceProxy(const SurfaceProxy& one, const Placements& placements);

    /// The level that the options mean.
    static unsigned levelFor(const PatchSelector& selector, std::size_t levelCount, const PickingOptions& options);

    unsigned level() const { return _level; }
    /// Asset frame, or that of the placements; patch after patch, each with vertices of its own.
    const osg::Vec3Array& vertices() const { return *_vertices; }
    /// Three per triangle, counter-clockwise.
    const osg::DrawElementsUInt& triangles() const { return *_triangles; }
    /// Built when first asked for; any thread. Null without triangles.
    SurfaceTree* tree() const;

protected:
    ~SurfaceProxy() override;

private:
    unsigned _level;
    osg::ref_ptr<osg::Vec3Array> _vertices = new osg::Vec3Array;
    osg::ref_ptr<osg::DrawElementsUInt> _triangles = new osg::DrawElementsUInt(GL_TRIANGLES);
    mutable std::once_flag _treeOnce;
    mutable osg::ref_ptr<SurfaceTree> _tree;
};

} // namespace osgTessLOD
