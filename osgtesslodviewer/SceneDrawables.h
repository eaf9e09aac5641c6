// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/TessLODDrawable.h>

#include <osg/Node>
#include <osg/ref_ptr>

#include <functional>
#include <vector>

namespace osgTessLOD {

using DrawableList = std::vector<osg::ref_ptr<TessLODDrawable>>;

/// The TessLODDrawables of a scene, each once.
DrawableList findDrawables(osg::Node& scene);

/// Changes the options of all drawables; between frames only.
void changeOptions(const DrawableList& drawables, const std::function<void(SelectionOptions&)>& change);

/// Draws everything below the node in a colour per level, or as usual.
void setColorByLevel(osg::Node& node, bool on);

} // namespace osgTessLOD
