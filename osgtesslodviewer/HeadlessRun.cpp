// SPDX-License-Identifier: MIT
#include "HeadlessRun.h"

#include "CapturedMesh.h"
#include "FrameStatistics.h"
#include "SceneDrawables.h"
#include "SelectionTotals.h"
#include "SelectionTrace.h"
#include "ViewerOptions.h"

#include <osgTessLOD/asset/AtomicFile.h>
#include <osgTessLOD/asset/SurfaceMesh.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>

#include <osg/AnimationPath>
#include <osg/Image>
#include <osg/Timer>
#include <osgDB/FileNameUtils>
#include <osgDB/Registry>
#include <osgDB/fstream>
#include <osgGA/TrackballManipulator>
#include <osgViewer/Viewer>

#include <algorithm>
#include <iostream>
#include <optional>
#include <stdexcept>

namespace osgTessLOD {

namespace {

/// Compiling, uploading and the first selection happen in these.
constexpr unsigned kWarmUpFrames = 2;

/// At the end of each frame waits for the GPU; at the end of the one asked for, reads what was drawn.
class FrameReader : public osg::Camera::DrawCallback {
public:
    FrameReader(const SelectionTotals& totals, bool wantsImage, bool wantsCapture)
        : _totals(totals)
        , _wantsImage(wantsImage)
        , _wantsCapture(wantsCapture)
    {
    }

    using osg::Camera::DrawCallback::operator();
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        glFinish();
        if (_isReading) { const_cast<FrameReader*>(this)->read(renderInfo); }
    }

    void startReading() { _isReading = true; }
    const osg::Image* image() const { return _image; }
    const CapturedMesh& capture() const { return _capture; }
    const FrameStatistics& statistics() const { return _statistics; }
    /// Name of a drawable that was selected and that this context cannot draw; empty: there is none.
    const std::string& undrawn() const { return _undrawn; }

protected:
    ~FrameReader() override = default;

private:
    void read(osg::RenderInfo& renderInfo);

    const SelectionTotals& _totals;
    bool _wantsImage;
    bool _wantsCapture;
    bool _isReading = false;
    osg::ref_ptr<osg::Image> _image;
    CapturedMesh _capture;
    FrameStatistics _statistics;
    std::string _undrawn;
};

std::string glText(GLenum name)
{
    const GLubyte* text = glGetString(name);
    return text ? reinterpret_cast<const char*>(text) : "";
}

void FrameReader::read(osg::RenderInfo& renderInfo)
{
    const osg::Camera* camera = renderInfo.getCurrentCamera();
    const osg::Viewport* viewport = camera->getViewport();
    _statistics.glVendor = glText(GL_VENDOR);
    _statistics.glRenderer = glText(GL_RENDERER);
    _statistics.glVersion = glText(GL_VERSION);
    _statistics.width = static_cast<int>(viewport->width());
    _statistics.height = static_cast<int>(viewport->height());
    _statistics.view = camera->getViewMatrix();
    _statistics.projection = renderInfo.getState()->getProjectionMatrix();

    const std::vector<FrameSelection> selections = _totals.thisFrame(camera);
    _statistics.selected = SelectionTotals::sum(selections);
    for (const FrameSelection& entry : selections) {
        const double asked = entry.drawable->getOptions().errorPixels;
        _statistics.errorPixels = std::max(asked, _statistics.errorPixels.value_or(asked));
        const std::optional<Backend> backend = entry.selection->backend(renderInfo);
        if (backend) {
            _statistics.backends.insert(nameOf(*backend));
        } else {
            _undrawn = entry.drawable->getName();
        }
    }
    if (_wantsImage) {
        _image = new osg::Image;
        _image->readPixels(static_cast<int>(viewport->x()), static_cast<int>(viewport->y()), _statistics.width,
                           _statistics.height, GL_RGB, GL_UNSIGNED_BYTE); // no alpha: opaque
    }
    if (_wantsCapture) {
        for (const FrameSelection& entry : selections) {
            _capture.add(entry.selection->capture(renderInfo), entry.localToWorld);
        }
        _statistics.captured = _capture.counts();
    }
}

void setUpCamera(osgViewer::Viewer& viewer, osg::GraphicsContext& context, const ViewerOptions& options)
{
    osg::Camera& camera = *viewer.getCamera();
    camera.setGraphicsContext(&context);
    camera.setViewport(0, 0, options.width, options.height);
    const GLenum buffer = context.getTraits() && context.getTraits()->doubleBuffer ? GL_BACK : GL_FRONT;
    camera.setDrawBuffer(buffer);
    camera.setReadBuffer(buffer);

    double fovDegrees = 0.0;
    double aspect = 0.0;
    double near = 0.0;
    double far = 0.0;
    camera.getProjectionMatrixAsPerspective(fovDegrees, aspect, near, far);
    camera.setProjectionMatrixAsPerspective(options.fovDegrees.value_or(fovDegrees),
                                            static_cast<double>(options.width) / options.height, near, far);
    if (!options.pathFile.empty()) { return; } // the path says where it is
    if (options.camera) {
        camera.setViewMatrixAsLookAt(options.camera->eye, options.camera->center, options.camera->up);
    } else {
        viewer.setCameraManipulator(new osgGA::TrackballManipulator); // goes to its home position
    }
}

/// Rows of eight numbers: time, place, rotation. Throws std::runtime_error if the file has anything else:
/// osg::AnimationPath::read() would not come back from it.
osg::ref_ptr<osg::AnimationPath> readPath(const std::string& fileName)
{
    osgDB::ifstream file(fileName.c_str());
    osg::ref_ptr<osg::AnimationPath> path = new osg::AnimationPath;
    path->setLoopMode(osg::AnimationPath::NO_LOOPING); // or the end would be the beginning
    double time = 0.0;
    osg::Vec3d place;
    osg::Quat rotation;
    while (file >> time >> place.x() >> place.y() >> place.z() >> rotation.x() >> rotation.y() >> rotation.z() >> rotation.w()) {
        path->insert(time, osg::AnimationPath::ControlPoint(place, rotation));
    }
    if (path->empty() || !file.eof()) { throw std::runtime_error("-p " + fileName + ": no animation path can be read from it"); }
    return path;
}

/// Puts the camera where it is at frame `frame` of `frames`, the first and the last at the path's ends.
void followPath(osg::Camera& camera, const osg::AnimationPath& path, unsigned frame, unsigned frames)
{
    const double part = frames > 1 ? static_cast<double>(frame) / (frames - 1) : 0.0;
    osg::Matrixd eyeToWorld;
    path.getMatrix(path.getFirstTime() + part * path.getPeriod(), eyeToWorld);
    camera.setViewMatrix(osg::Matrixd::inverse(eyeToWorld));
}

/// Renders one frame and returns its times.
FrameTime renderFrame(osgViewer::Viewer& viewer, SelectionTotals& totals)
{
    totals.beginFrame();
    FrameTime time;
    const osg::Timer_t start = osg::Timer::instance()->tick();
    viewer.frame();
    time.frame = osg::Timer::instance()->delta_m(start, osg::Timer::instance()->tick());

    const unsigned number = viewer.getFrameStamp()->getFrameNumber();
    const auto milliseconds = [&](const char* attribute) {
        double seconds = 0.0;
        viewer.getCamera()->getStats()->getAttribute(number, attribute, seconds);
        return seconds * 1000.0;
    };
    time.cull = milliseconds("Cull traversal time taken");
    time.draw = milliseconds("Draw traversal time taken");
    return time;
}

/// The frames to warm up, and those to take times of and to trace.
std::vector<FrameTime> renderFrames(osgViewer::Viewer& viewer, SelectionTotals& totals, const ViewerOptions& options)
{
    osg::Camera& camera = *viewer.getCamera();
    osg::ref_ptr<osg::AnimationPath> path;
    if (!options.pathFile.empty()) {
        path = readPath(options.pathFile);
        followPath(camera, *path, 0, options.frames);
    }
    std::optional<SelectionTrace> trace;
    if (!options.traceFile.empty()) { trace.emplace(options.traceFile); }
    for (unsigned frame = 0; frame < kWarmUpFrames; ++frame) { renderFrame(viewer, totals); }
    std::vector<FrameTime> times;
    for (unsigned frame = 0; frame < options.frames; ++frame) {
        if (path) { followPath(camera, *path, frame, options.frames); }
        times.push_back(renderFrame(viewer, totals));
        if (trace) { trace->addFrame(frame, camera.getViewMatrix(), totals.thisFrame(&camera)); }
    }
    if (trace) { trace->commit(); }
    return times;
}

void writeScreenshot(const std::string& path, const osg::Image& image)
{
    const std::string extension = osgDB::getLowerCaseFileExtension(path);
    osgDB::ReaderWriter* writer = osgDB::Registry::instance()->getReaderWriterForExtension(extension);
    if (!writer) { throw std::runtime_error(path + ": no plugin writes pictures of this kind"); }
    AtomicFile file(path);
    const osgDB::ReaderWriter::WriteResult result = writer->writeImage(image, file.stream());
    if (!result.success()) {
        throw std::runtime_error(path + ": " + (result.message().empty() ? "cannot be written" : result.message()));
    }
    file.commit();
}

void writeStatistics(const std::string& path, const FrameStatistics& statistics)
{
    AtomicFile file(path);
    writeJson(file.stream(), statistics);
    file.commit();
}

} // namespace

void runHeadless(osgViewer::Viewer& viewer, osg::Node& scene, const ViewerOptions& options)
{
    std::string error;
    const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(options.width, options.height, error);
    if (!context) { throw std::runtime_error("no OpenGL without a window: " + error); }

    SelectionTotals totals(findDrawables(scene));
    const osg::ref_ptr<FrameReader> reader =
        new FrameReader(totals, !options.screenshotFile.empty(), !options.captureFile.empty());
    viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
    viewer.setSceneData(&scene);
    setUpCamera(viewer, *context, options);
    viewer.getCamera()->setFinalDrawCallback(reader);
    viewer.getCamera()->getStats()->collectStats("rendering", true);
    viewer.realize();
    if (!viewer.isRealized()) { throw std::runtime_error("the OpenGL context could not be made"); }

    const std::vector<FrameTime> times = renderFrames(viewer, totals, options);
    reader->startReading();
    renderFrame(viewer, totals);
    viewer.getCamera()->setFinalDrawCallback(nullptr);

    FrameStatistics statistics = reader->statistics();
    if (!reader->undrawn().empty()) {
        throw std::runtime_error(reader->undrawn() + ": cannot be drawn by OpenGL " + statistics.glVersion);
    }
    statistics.times = times;
    statistics.videoMemory = VideoMemory::shared().statistics();
    if (!options.screenshotFile.empty()) { writeScreenshot(options.screenshotFile, *reader->image()); }
    if (!options.captureFile.empty()) { writePly(options.captureFile, reader->capture().surface()); }
    if (!options.statsFile.empty()) { writeStatistics(options.statsFile, statistics); }
    writeSummary(std::cout, statistics);
    if (!std::cout.flush()) { throw std::runtime_error("the standard output cannot be written"); }
}

} // namespace osgTessLOD
