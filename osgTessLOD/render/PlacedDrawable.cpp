// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PlacedDrawable.h>

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/GpuAsset.h>

#include <osg/MatrixTransform>
#include <osg/NodeVisitor>
#include <osg/Transform>

namespace osgTessLOD {

namespace {

class DrawableFinder : public osg::NodeVisitor {
public:
    DrawableFinder()
        : osg::NodeVisitor(TRAVERSE_ALL_CHILDREN)
    {
    }
    META_NodeVisitor(osgTessLOD, DrawableFinder)

    using osg::NodeVisitor::apply;
    void apply(osg::Drawable& drawable) override
    {
        if (auto* found = dynamic_cast<TessLODDrawable*>(&drawable)) {
            _drawables.push_back({found, osg::computeLocalToWorld(getNodePath())});
        }
    }

    std::vector<PlacedDrawable> _drawables;
};

} // namespace

osg::ref_ptr<osg::Node> placeAtOrigin(TessLODDrawable& drawable)
{
    drawable.getBound(); // now, so that no cull thread has to
    osg::Vec3d origin;
    if (drawable.getGpuAsset() != nullptr) {
        const std::array<double, 3>& of = drawable.getGpuAsset()->asset().lattice.origin;
        origin.set(of[0], of[1], of[2]);
    }
    if (origin == osg::Vec3d()) { return &drawable; }

    osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(osg::Matrixd::translate(origin));
    transform->setName(drawable.getName());
    // The Optimizer would try to apply a STATIC transform to vertices, which it cannot reach here.
    transform->setDataVariance(osg::Object::DYNAMIC);
    transform->addChild(&drawable);
    transform->getBound();
    return transform;
}

std::vector<PlacedDrawable> findTessLODDrawables(osg::Node& scene)
{
    DrawableFinder finder;
    scene.accept(finder);
    return std::move(finder._drawables);
}

} // namespace osgTessLOD
