// SPDX-License-Identifier: MIT
// osgtesslodviewer: shows scenes with TessLODDrawables in a window as osgviewer does, or renders them without one.
#include "HeadlessRun.h"
#include "SceneDrawables.h"
#include "SceneLoading.h"
#include "ViewerOptions.h"
#include "WindowRun.h"

#include <osgTessLOD/render/VideoMemory.h>

#include <osg/ArgumentParser>
#include <osg/Group>
#include <osg/PolygonMode>
#include <osgDB/Registry>
#include <osgViewer/Viewer>

#include <cstdint>
#include <exception>
#include <iostream>
#include <optional>

namespace {

using osgTessLOD::ViewerOptions;

void describeProgram(osg::ArgumentParser& arguments)
{
    osg::ApplicationUsage& usage = *arguments.getApplicationUsage();
    usage.setApplicationName(arguments.getApplicationName());
    usage.setDescription(arguments.getApplicationName() +
                         " shows scenes with level-of-detail surfaces (.tlod) and whatever else OSG reads.");
    usage.setCommandLineUsage(arguments.getApplicationName() + " [options] file ...");
    osgTessLOD::describeViewerOptions(usage);
}

/// True where help was asked for and has been given.
bool helped(osg::ArgumentParser& arguments, osgViewer::Viewer& viewer)
{
    const unsigned kind = static_cast<unsigned>(arguments.readHelpType());
    if (kind == 0) { return false; }
    osg::ApplicationUsage& usage = *arguments.getApplicationUsage();
    const osg::ref_ptr<osg::Group> nothing = new osg::Group;
    osgTessLOD::addHandlers(viewer, *nothing, ViewerOptions(), &usage);
    viewer.getUsage(usage);
    usage.write(std::cout, kind);
    return true;
}

void limitVideoMemory(const ViewerOptions& options)
{
    const auto bytes = [](const std::optional<double>& mebibytes) {
        return mebibytes ? static_cast<std::uint64_t>(*mebibytes * 1024.0 * 1024.0) : osgTessLOD::VideoMemory::Limits::kNone;
    };
    osgTessLOD::VideoMemory::shared().setLimits({bytes(options.uploadMebibytes), bytes(options.videoMemoryMebibytes)});
}

void applyOptions(osg::Node& scene, const ViewerOptions& options)
{
    osgTessLOD::changeOptions(osgTessLOD::findDrawables(scene), [&](osgTessLOD::SelectionOptions& selection) {
        selection.errorPixels = options.errorPixels.value_or(selection.errorPixels);
        selection.maxFactor = options.maxFactor.value_or(selection.maxFactor);
        selection.metric = options.metric.value_or(selection.metric);
        selection.bound = options.bound.value_or(selection.bound);
        selection.selector = options.selector.value_or(selection.selector);
        selection.backend = options.backend.value_or(selection.backend);
        selection.cullPatches = options.cullPatches;
    });
    osgTessLOD::setColorByLevel(scene, options.colorByLevel);
}

int run(osg::ArgumentParser& arguments)
{
    describeProgram(arguments);
    osgViewer::Viewer viewer(arguments);
    osgDB::readCommandLine(arguments);
    if (helped(arguments, viewer)) { return 0; }

    const ViewerOptions options = osgTessLOD::readViewerOptions(arguments);
    arguments.reportRemainingOptionsAsUnrecognized();
    if (arguments.errors()) {
        arguments.writeErrorMessages(std::cerr);
        return 1;
    }

    osgTessLOD::addPluginFolders();
    std::string error;
    const osg::ref_ptr<osg::Node> scene = osgTessLOD::loadScene(arguments, error);
    if (!scene) {
        std::cerr << arguments.getApplicationName() << ": " << error << '\n';
        return 1;
    }
    applyOptions(*scene, options);
    limitVideoMemory(options);
    if (!options.headless) {
        osgTessLOD::runWindow(viewer, *scene, options, arguments.getApplicationUsage());
        return 0;
    }
    if (options.wireframe) {
        viewer.getCamera()->getOrCreateStateSet()->setAttribute(
            new osg::PolygonMode(osg::PolygonMode::FRONT_AND_BACK, osg::PolygonMode::LINE));
    }
    osgTessLOD::runHeadless(viewer, *scene, options);
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    osg::ArgumentParser arguments(&argc, argv);
    try {
        return run(arguments);
    } catch (const std::exception& error) {
        std::cerr << arguments.getApplicationName() << ": " << error.what() << '\n';
        return 1;
    }
}
