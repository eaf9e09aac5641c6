// SPDX-License-Identifier: MIT
#include "HeadlessStage.h"

#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgtesslodviewer/headless/HeadlessContext.h>

#include <osg/GLExtensions>
#include <osg/Material>
#include <osg/Stats>

#include <stdexcept>

namespace osgTessLOD::benchmarks {

namespace {

/// Counts by the GPU of one frame, of queries that its context has.
class FrameQueries {
public:
    void begin(osg::State& state)
    {
        _gl = state.get<osg::GLExtensions>();
        _hasTimer = _gl->isTimerQuerySupported;
        _hasCounter = _gl->isTransformFeedbackSupported;
        if (_ids[0] == 0) { _gl->glGenQueries(2, _ids); }
        if (_hasTimer) { _gl->glBeginQuery(GL_TIME_ELAPSED, _ids[0]); }
        if (_hasCounter) { _gl->glBeginQuery(GL_PRIMITIVES_GENERATED, _ids[1]); }
    }
    void end()
    {
        if (_hasCounter) { _gl->glEndQuery(GL_PRIMITIVES_GENERATED); }
        if (_hasTimer) { _gl->glEndQuery(GL_TIME_ELAPSED); }
    }
    /// After glFinish.
    void read(HeadlessStage::Frame& frame) const
    {
        GLuint64 result = 0;
        if (_hasTimer) {
            _gl->glGetQueryObjectui64v(_ids[0], GL_QUERY_RESULT_ARB, &result);
            frame.gpuMilliseconds = 1e-6 * static_cast<double>(result);
        }
        if (_hasCounter) {
            _gl->glGetQueryObjectui64v(_ids[1], GL_QUERY_RESULT_ARB, &result);
            frame.triangles = result;
        }
    }

private:
    const osg::GLExtensions* _gl = nullptr;
    bool _hasTimer = false;
    bool _hasCounter = false;
    GLuint _ids[2]{}; // they go with their context
};

} // namespace

class HeadlessStage::Begin : public osg::Camera::DrawCallback {
public:
    using osg::Camera::DrawCallback::operator();
    void operator()(osg::RenderInfo& renderInfo) const override { queries.begin(*renderInfo.getState()); }
    mutable FrameQueries queries;
};

class HeadlessStage::End : public osg::Camera::DrawCallback {
public:
    explicit End(Begin& begin)
        : _begin(begin)
    {
    }
    using osg::Camera::DrawCallback::operator();
    void operator()(osg::RenderInfo& renderInfo) const override
    {
        _begin.queries.end();
        glFinish();
        _begin.queries.read(frame);
        const std::uint64_t streamed = DrawContext::of(*renderInfo.getState()).streams().sentBytes();
        frame.streamedBytes = streamed - _streamedBefore;
        _streamedBefore = streamed;
        if (renderer.empty()) { renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER)); }
        if (atEnd) { atEnd(renderInfo); }
    }
    mutable Frame frame;
    mutable std::string renderer;
    std::function<void(osg::RenderInfo&)> atEnd;

private:
    Begin& _begin;
    mutable std::uint64_t _streamedBefore = 0;
};

HeadlessStage::HeadlessStage(int width, int height)
    : _begin(new Begin)
    , _end(new End(*_begin))
    , _width(width)
    , _height(height)
{
    std::string error;
    const osg::ref_ptr<osg::GraphicsContext> context = createHeadlessContext(width, height, error);
    if (!context) { throw std::runtime_error("no OpenGL without a window: " + error); }
    osg::StateSet* state = _shown->getOrCreateStateSet();
    state->setAttributeAndModes(new osg::Material);
    state->setMode(GL_NORMALIZE, osg::StateAttribute::ON);
    _viewer.setThreadingModel(osgViewer::ViewerBase::SingleThreaded);
    _viewer.setLightingMode(osg::View::HEADLIGHT);
    osg::Camera& camera = *_viewer.getCamera();
    camera.setGraphicsContext(context.get());
    camera.setViewport(0, 0, width, height);
    camera.setClearColor(osg::Vec4(0.0F, 0.0F, 0.0F, 0.0F));
    camera.setComputeNearFarMode(osg::CullSettings::DO_NOT_COMPUTE_NEAR_FAR);
    camera.setCullingMode(camera.getCullingMode() & ~osg::CullSettings::SMALL_FEATURE_CULLING);
    camera.setInitialDrawCallback(_begin.get());
    camera.setFinalDrawCallback(_end.get());
    camera.getStats()->collectStats("rendering", true);
    _viewer.setSceneData(_shown.get());
    _viewer.realize();
    if (!_viewer.isRealized()) { throw std::runtime_error("the OpenGL context could not be made"); }
}

HeadlessStage::~HeadlessStage() = default;

unsigned HeadlessStage::add(osg::Node* node)
{
    _shown->addChild(node);
    return _shown->getNumChildren() - 1;
}

void HeadlessStage::clear()
{
    _shown->releaseGLObjects();
    _shown->removeChildren(0, _shown->getNumChildren());
}

void HeadlessStage::look(const ScreenCamera& camera)
{
    _viewer.getCamera()->setViewMatrix(camera.localToEye);
    _viewer.getCamera()->setProjectionMatrix(camera.projection);
}

HeadlessStage::Frame HeadlessStage::draw(unsigned number, const std::function<void(osg::RenderInfo&)>& atEnd)
{
    _shown->setSingleChildOn(number);
    _end->atEnd = atEnd;
    _viewer.frame();
    _renderer = _end->renderer;
    Frame frame = _end->frame;
    const auto milliseconds = [&](const char* attribute) {
        double seconds = 0.0;
        _viewer.getCamera()->getStats()->getAttribute(_viewer.getFrameStamp()->getFrameNumber(), attribute, seconds);
        return 1e3 * seconds;
    };
    frame.cullMilliseconds = milliseconds("Cull traversal time taken");
    frame.drawMilliseconds = milliseconds("Draw traversal time taken");
    return frame;
}

osg::ref_ptr<osg::Image> HeadlessStage::picture() const
{
    osg::ref_ptr<osg::Image> image = new osg::Image;
    image->readPixels(0, 0, _width, _height, GL_RGBA, GL_UNSIGNED_BYTE);
    return image;
}

} // namespace osgTessLOD::benchmarks
