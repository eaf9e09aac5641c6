// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/GlConstants.h>

#include <osg/GLExtensions>
#include <osg/State>

#include <algorithm>
#include <cstddef>

namespace osgTessLOD {

/// A transform feedback buffer and a query of what went in. Nothing is rasterized while it lives.
class TransformFeedback {
public:
    explicit TransformFeedback(osg::State& state)
        : _gl(*state.get<osg::GLExtensions>())
    {
        _gl.glGenBuffers(1, &_buffer);
        _gl.glGenQueries(1, &_query);
        glEnable(GL_RASTERIZER_DISCARD);
    }
    ~TransformFeedback()
    {
        glDisable(GL_RASTERIZER_DISCARD);
        _gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
        _gl.glBindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, 0);
        _gl.glDeleteBuffers(1, &_buffer);
        _gl.glDeleteQueries(1, &_query);
    }
    TransformFeedback(const TransformFeedback&) = delete;
    TransformFeedback& operator=(const TransformFeedback&) = delete;

    /// Writes the triangles that draw() makes, as far as `triangles` has room for `count` of them; returns how many.
    template <class Triangle, class Draw> std::size_t capture(Triangle* triangles, std::size_t count, const Draw& draw)
    {
        const auto bytes = static_cast<GLsizeiptr>(count * sizeof(Triangle));
        _gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, _buffer);
        _gl.glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_DYNAMIC_READ);
        _gl.glBeginQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, _query);
        _gl.glBeginTransformFeedback(GL_TRIANGLES);
        draw();
        _gl.glEndTransformFeedback();
        _gl.glEndQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN);
        GLuint written = 0;
        _gl.glGetQueryObjectuiv(_query, GL_QUERY_RESULT_ARB, &written);
        const std::size_t captured = std::min<std::size_t>(written, count);
        _gl.glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, static_cast<GLsizeiptr>(captured * sizeof(Triangle)),
                               triangles);
        return captured;
    }

private:
    const osg::GLExtensions& _gl;
    GLuint _buffer = 0;
    GLuint _query = 0;
};

} // namespace osgTessLOD
