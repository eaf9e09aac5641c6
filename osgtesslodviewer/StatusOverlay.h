// SPDX-License-Identifier: MIT
#pragma once

#include "SelectionTotals.h"

#include <osg/Camera>
#include <osg/Timer>
#include <osg/ref_ptr>
#include <osgText/Text>

namespace osgTessLOD {

/// A line of text in the lower left corner of the window: frame time, what was drawn, and the error asked.
class StatusOverlay {
public:
    StatusOverlay();

    /// To be added to the scene.
    osg::Camera* camera() const { return _camera.get(); }
    /// Once per frame, between frames: `width` and `height` of the window in pixels.
    void update(const SelectionSums& sums, const SelectionOptions& options, double width, double height);

private:
    osg::ref_ptr<osg::Camera> _camera;
    osg::ref_ptr<osgText::Text> _text;
    osg::Timer_t _intervalStart;
    unsigned _intervalFrames = 0;
    double _frameMilliseconds = 0.0; ///< mean of the last interval
};

} // namespace osgTessLOD
