// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Vec3d>

#include <optional>
#include <string>

namespace osg {
class ArgumentParser;
class ApplicationUsage;
} // namespace osg

namespace osgTessLOD {

/// A viewpoint in world space.
struct LookAt {
    osg::Vec3d eye;
    osg::Vec3d center;
    osg::Vec3d up;
};

/// What osgtesslodviewer's own command line options ask for; OSG's own are left to osgViewer.
struct ViewerOptions {
    std::optional<double> errorPixels; ///< for every TessLODDrawable; not given: as each was read
    std::optional<unsigned> maxFactor; ///< the same
    std::optional<SelectionOptions::Metric> metric; ///< the same
    std::optional<SelectionOptions::Bound> bound;   ///< the same
    std::optional<SelectionOptions::Selector> selector; ///< the same
    std::optional<Backend> backend;                     ///< the same
    std::optional<double> videoMemoryMebibytes;         ///< VideoMemory's limits; not given: none
    std::optional<double> uploadMebibytes;              ///< of a frame
    bool cullPatches = true;
    bool colorByLevel = false;
    bool wireframe = false;
    std::string pathFile; ///< animation path to follow; headless: all of it, evenly, by the frames timed; empty: none

    bool headless = false; ///< what follows is for headless runs alone
    int width = 1280;      ///< pixels
    int height = 800;
    std::optional<LookAt> camera;     ///< not given: the home position of OSG's trackball
    std::optional<double> fovDegrees; ///< vertical; not given: OSG's default
    unsigned frames = 5;              ///< frames to take times of
    std::string screenshotFile;       ///< empty: none
    std::string captureFile;
    std::string statsFile;
    std::string traceFile; ///< what was selected in every frame timed
};

/// Describes the options for --help.
void describeViewerOptions(osg::ApplicationUsage& usage);

/// Takes the options out of `arguments`; what is malformed is reported there as an error.
ViewerOptions readViewerOptions(osg::ArgumentParser& arguments);

} // namespace osgTessLOD
