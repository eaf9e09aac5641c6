// SPDX-License-Identifier: MIT
#pragma once

#include "SelectionTotals.h"
#include "StatusOverlay.h"

#include <osg/observer_ptr>
#include <osgGA/GUIEventHandler>

namespace osgTessLOD {

/// Keys that change how the scene's TessLODDrawables are drawn, and the status overlay's update in every frame.
class TessLODEventHandler : public osgGA::GUIEventHandler {
public:
    /// `drawables`: those of `scene`. `colorByLevel`: whether the scene is drawn so already.
    TessLODEventHandler(osg::Node* scene, const DrawableList& drawables, bool colorByLevel);

    StatusOverlay& overlay() { return _overlay; }

    bool handle(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& action) override;
    void getUsage(osg::ApplicationUsage& usage) const override;

protected:
    ~TessLODEventHandler() override = default;

private:
    void beginFrame(const osgGA::GUIEventAdapter& event, osgGA::GUIActionAdapter& action);
    bool handleKey(int key, osgGA::GUIActionAdapter& action);
    void toggleFrozen(osgGA::GUIActionAdapter& action);

    osg::observer_ptr<osg::Node> _scene;
    DrawableList _drawables;
    SelectionTotals _totals;
    StatusOverlay _overlay;
    bool _colorByLevel;
};

} // namespace osgTessLOD
