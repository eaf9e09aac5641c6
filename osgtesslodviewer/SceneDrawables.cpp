// SPDX-License-Identifier: MIT
#include "SceneDrawables.h"

#include <osg/NodeVisitor>

#include <algorithm>

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
        auto* found = dynamic_cast<TessLODDrawable*>(&drawable);
        if (found && std::find(_drawables.begin(), _drawables.end(), found) == _drawables.end()) {
            _drawables.emplace_back(found);
        }
    }

    DrawableList _drawables;
};

} // namespace

DrawableList findDrawables(osg::Node& scene)
{
    DrawableFinder finder;
    scene.accept(finder);
    return finder._drawables;
}

void changeOptions(const DrawableList& drawables, const std::function<void(SelectionOptions&)>& change)
{
    for (const osg::ref_ptr<TessLODDrawable>& drawable : drawables) {
        SelectionOptions options = drawable->getOptions();
        change(options);
        drawable->setOptions(options);
    }
}

void setColorByLevel(osg::Node& node, bool on)
{
    osg::StateSet* stateSet = node.getOrCreateStateSet();
    if (on) {
        stateSet->setDefine("TESSLOD_COLOR_BY_LEVEL");
    } else {
        stateSet->removeDefine("TESSLOD_COLOR_BY_LEVEL");
    }
}

} // namespace osgTessLOD
