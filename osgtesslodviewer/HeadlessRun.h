// SPDX-License-Identifier: MIT
#pragma once

namespace osg {
class Node;
}
namespace osgViewer {
class Viewer;
}

namespace osgTessLOD {

struct ViewerOptions;

/// Renders `scene` without a window or display and writes the files that `options` ask for: each under a temporary name
/// first, so that a file is there whole or not at all. Prints a summary of what was drawn. Throws std::runtime_error
/// saying what failed, with the name of the file where there is one.
void runHeadless(osgViewer::Viewer& viewer, osg::Node& scene, const ViewerOptions& options);

} // namespace osgTessLOD
