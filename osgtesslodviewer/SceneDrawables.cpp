// SPDX-License-Identifier: MIT
#include "SceneDrawables.h"

#include <osgTessLOD/render/PlacedDrawable.h>

#include <algorithm>

namespace osgTessLOD {

DrawableList findDrawables(osg::Node& scene)
{
    DrawableList drawables;
    for (const PlacedDrawable& placed : findTessLODDrawables(scene)) {
        if (std::find(drawables.begin(), drawables.end(), placed.drawable) == drawables.end()) {
            drawables.push_back(placed.drawable);
        }
    }
    return drawables;
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
