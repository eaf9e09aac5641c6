// SPDX-License-Identifier: MIT
#pragma once

namespace osg {
class ApplicationUsage;
class Node;
} // namespace osg
namespace osgViewer {
class Viewer;
}

namespace osgTessLOD {

struct ViewerOptions;

/// Gives the viewer osgviewer's event handlers and camera manipulators and this program's own keys; `usage` describes
/// them for the help screen. Throws std::runtime_error where an animation path asked for cannot be read.
void addHandlers(osgViewer::Viewer& viewer, osg::Node& scene, const ViewerOptions& options,
                 osg::ApplicationUsage* usage);

/// Shows the scene in a window until that is closed. Throws std::runtime_error if none can be opened.
void runWindow(osgViewer::Viewer& viewer, osg::Node& scene, const ViewerOptions& options, osg::ApplicationUsage* usage);

} // namespace osgTessLOD
