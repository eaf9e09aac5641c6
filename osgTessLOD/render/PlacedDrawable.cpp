// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PlacedDrawable.h>

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

std::vector<PlacedDrawable> findTessLODDrawables(osg::Node& scene)
{
    DrawableFinder finder;
    scene.accept(finder);
    return std::move(finder._drawables);
}

} // namespace osgTessLOD
