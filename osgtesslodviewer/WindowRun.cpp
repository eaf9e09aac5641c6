// SPDX-License-Identifier: MIT
#include "WindowRun.h"

#include "SceneDrawables.h"
#include "SelectionStatsLines.h"
#include "TessLODEventHandler.h"
#include "ViewerOptions.h"

#include <osg/Group>
#include <osgGA/AnimationPathManipulator>
#include <osgGA/DriveManipulator>
#include <osgGA/FlightManipulator>
#include <osgGA/KeySwitchMatrixManipulator>
#include <osgGA/SphericalManipulator>
#include <osgGA/StateSetManipulator>
#include <osgGA/TerrainManipulator>
#include <osgGA/TrackballManipulator>
#include <osgGA/UFOManipulator>
#include <osgViewer/Viewer>
#include <osgViewer/ViewerEventHandlers>

#include <stdexcept>

namespace osgTessLOD {

namespace {

/// Those of osgviewer on its keys; an animation path is the key after them and the one to start with.
osg::ref_ptr<osgGA::KeySwitchMatrixManipulator> makeManipulators(const std::string& pathFile)
{
    osg::ref_ptr<osgGA::KeySwitchMatrixManipulator> manipulators = new osgGA::KeySwitchMatrixManipulator;
    manipulators->addMatrixManipulator('1', "Trackball", new osgGA::TrackballManipulator);
    manipulators->addMatrixManipulator('2', "Flight", new osgGA::FlightManipulator);
    manipulators->addMatrixManipulator('3', "Drive", new osgGA::DriveManipulator);
    manipulators->addMatrixManipulator('4', "Terrain", new osgGA::TerrainManipulator);
    manipulators->addMatrixManipulator('5', "Orbit", new osgGA::OrbitManipulator);
    manipulators->addMatrixManipulator('6', "FirstPerson", new osgGA::FirstPersonManipulator);
    manipulators->addMatrixManipulator('7', "Spherical", new osgGA::SphericalManipulator);
    if (!pathFile.empty()) {
        const osg::ref_ptr<osgGA::AnimationPathManipulator> path = new osgGA::AnimationPathManipulator(pathFile);
        if (!path->valid()) { throw std::runtime_error(pathFile + ": no animation path can be read from it"); }
        const unsigned index = manipulators->getNumMatrixManipulators();
        manipulators->addMatrixManipulator('8', "Path", path);
        manipulators->selectMatrixManipulator(index);
    }
    return manipulators;
}

} // namespace

void addHandlers(osgViewer::Viewer& viewer, osg::Node& scene, const ViewerOptions& options,
                 osg::ApplicationUsage* usage)
{
    const osg::ref_ptr<TessLODEventHandler> ownKeys =
        new TessLODEventHandler(&scene, findDrawables(scene), options.colorByLevel);
    const osg::ref_ptr<osg::Group> root = new osg::Group;
    root->addChild(&scene);
    root->addChild(ownKeys->overlay().camera());
    viewer.setSceneData(root);

    viewer.setCameraManipulator(makeManipulators(options.pathFile));
    const osg::ref_ptr<osgGA::StateSetManipulator> stateKeys =
        new osgGA::StateSetManipulator(viewer.getCamera()->getOrCreateStateSet());
    if (options.wireframe) { stateKeys->setPolygonMode(osg::PolygonMode::LINE); }
    viewer.addEventHandler(stateKeys);
    viewer.addEventHandler(ownKeys);
    viewer.addEventHandler(new osgViewer::ThreadingHandler);
    viewer.addEventHandler(new osgViewer::WindowSizeHandler);
    const osg::ref_ptr<osgViewer::StatsHandler> statistics = new osgViewer::StatsHandler;
    addSelectionLines(*statistics);
    viewer.addEventHandler(statistics);
    viewer.addEventHandler(new osgViewer::HelpHandler(usage));
    viewer.addEventHandler(new osgViewer::RecordCameraPathHandler);
    viewer.addEventHandler(new osgViewer::LODScaleHandler);
    viewer.addEventHandler(new osgViewer::ScreenCaptureHandler);
}

void runWindow(osgViewer::Viewer& viewer, osg::Node& scene, const ViewerOptions& options, osg::ApplicationUsage* usage)
{
    // Keys change it between frames, while the last frame may still be drawn unless it is DYNAMIC.
    scene.getOrCreateStateSet()->setDataVariance(osg::Object::DYNAMIC);
    addHandlers(viewer, scene, options, usage);
    viewer.realize();
    if (!viewer.isRealized()) { throw std::runtime_error("no window can be opened; --headless renders without one"); }
    viewer.run();
}

} // namespace osgTessLOD
