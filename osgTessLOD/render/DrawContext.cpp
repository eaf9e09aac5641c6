// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/DrawContext.h>

#include <osgTessLOD/render/GlConstants.h>

#include <osg/BufferObject>
#include <osg/ContextData>
#include <osg/GLExtensions>
#include <osg/GLObjects>
#include <osg/VertexArrayState>

#include <string>

namespace osgTessLOD {

namespace {

/// Deletes buffer names when OSG next flushes with the context current.
class StreamBufferManager : public osg::GLObjectManager {
public:
    explicit StreamBufferManager(unsigned contextId)
        : osg::GLObjectManager("osgTessLOD::StreamBufferManager", contextId)
    {
    }
    void deleteGLObject(GLuint buffer) override
    {
        osg::GLExtensions::Get(_contextID, true)->glDeleteBuffers(1, &buffer);
    }
};

} // namespace

DrawContext& DrawContext::of(osg::State& state)
{
    auto* context = state.get<DrawContext>();
    if (!context->_queried) { context->query(state); }
    return *context;
}

void DrawContext::release(osg::State& state)
{
    if (state._extensionMap.count(&typeid(DrawContext)) == 0) { return; }
    auto* context = state.get<DrawContext>();
    if (context->_buffer != 0) {
        osg::get<StreamBufferManager>(context->_contextId)->scheduleGLObjectForDeletion(context->_buffer);
    }
    context->_buffer = 0;
}

void DrawContext::query(osg::State& state)
{
    const auto* gl = state.get<osg::GLExtensions>();
    _queried = true;
    _supported = gl->areTessellationShadersSupported && gl->glVersion >= 4.2F && gl->glslLanguageVersion >= 4.2F;
    GLint texels = 0;
    if (_supported) { glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels); }
    _maxTextureBufferTexels = texels;
    const auto* bytes = glGetString(GL_RENDERER);
    const std::string renderer = bytes != nullptr ? reinterpret_cast<const char*>(bytes) : "";
    const bool software =
        renderer.find("llvmpipe") != std::string::npos || renderer.find("softpipe") != std::string::npos;
    _verticesPerDraw = software ? kSoftwareVerticesPerDraw : 4'000'000;
}

void DrawContext::bindStream(osg::State& state, const void* data, std::size_t bytes)
{
    const auto* gl = state.get<osg::GLExtensions>();
    if (_buffer == 0) { gl->glGenBuffers(1, &_buffer); }
    gl->glBindBuffer(GL_ARRAY_BUFFER_ARB, _buffer);
    gl->glBufferData(GL_ARRAY_BUFFER_ARB, static_cast<GLsizeiptr>(bytes), data, GL_STREAM_DRAW_ARB);
}

void DrawContext::unbindStream(osg::State& state)
{
    // unbindVertexBufferObject() does nothing where OSG believes that nothing is bound.
    state.get<osg::GLExtensions>()->glBindBuffer(GL_ARRAY_BUFFER_ARB, 0);
    if (state.getCurrentVertexArrayState() != nullptr) {
        state.getCurrentVertexArrayState()->setCurrentVertexBufferObject(nullptr);
    }
}

} // namespace osgTessLOD
