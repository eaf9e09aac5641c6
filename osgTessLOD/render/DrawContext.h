// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/Referenced>
#include <osg/State>

#include <algorithm>
#include <cstdint>
#include <limits>

namespace osgTessLOD {

/// What drawing needs per osg::State, that is, per graphics context: its limits, asked for once, and one vertex buffer
/// that every draw fills anew (so that the driver gives it fresh memory while the last content is still being read).
/// Lives in the State and is used by its graphics thread only.
class OSGTESSLOD_EXPORT DrawContext : public osg::Referenced {
public:
    /// Made by osg::State::get.
    explicit DrawContext(unsigned contextId)
        : _contextId(contextId)
    {
    }

    /// That of `state`, whose context must be current.
    static DrawContext& of(osg::State& state);
    /// Forgets the buffer of `state`, if there is one, and has it deleted when the context is next current. Any thread.
    static void release(osg::State& state);

    /// Tessellation shaders, texture buffers and GLSL 4.20.
    bool supported() const { return _supported; }
    std::int64_t maxTextureBufferTexels() const { return std::min(_maxTextureBufferTexels, _texelLimit); }
    /// Has the context be treated as one that allows no more than this either. Between draws.
    void limitTextureBufferTexels(std::int64_t most) { _texelLimit = most; }
    /// Most vertices that one draw should make the tessellator emit. Mesa's software rasterizer takes time quadratic in
    /// that above 64k; elsewhere the limit only bounds a single draw's duration.
    std::uint64_t verticesPerDraw() const { return _verticesPerDraw; }
    static constexpr std::uint64_t kSoftwareVerticesPerDraw = 60'000;

    /// Binds the buffer, filled with `bytes` bytes of `data`, to GL_ARRAY_BUFFER.
    void bindStream(osg::State& state, const void* data, std::size_t bytes);
    /// Leaves no buffer bound and OSG's bookkeeping saying so.
    static void unbindStream(osg::State& state);

protected:
    ~DrawContext() override = default; // the buffer goes with its context

private:
    void query(osg::State& state);

    unsigned _contextId;
    bool _queried = false;
    bool _supported = false;
    std::int64_t _maxTextureBufferTexels = 0;
    std::int64_t _texelLimit = std::numeric_limits<std::int64_t>::max();
    std::uint64_t _verticesPerDraw = kSoftwareVerticesPerDraw;
    unsigned _buffer = 0;
};

} // namespace osgTessLOD
