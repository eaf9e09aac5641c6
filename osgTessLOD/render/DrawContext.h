// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/Referenced>
#include <osg/State>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <vector>

namespace osgTessLOD {

/// What drawing needs per osg::State, that is, per graphics context: what the context can do, asked for once; a vertex buffer
/// that every draw fills anew (so that the driver gives it fresh memory while the last content is still being read); and the
/// index buffers of patterns. Lives in the State and is used by its graphics thread only.
class OSGTESSLOD_EXPORT DrawContext : public osg::Referenced {
public:
    /// Made by osg::State::get.
    explicit DrawContext(unsigned contextId)
        : _contextId(contextId)
    {
    }

    /// That of `state`, whose context must be current.
    static DrawContext& of(osg::State& state);
    /// Forgets the buffers of `state`, if there are any, and has them deleted when the context is next current. Any thread.
    static void release(osg::State& state);

    /// Can the context draw at all? Backend::Instanced needs OpenGL and GLSL 3.3.
    bool supported() const { return _supported; }
    /// Backend::Tessellation needs OpenGL and GLSL 4.2, and the pattern that the driver's tessellator makes of each of these
    /// factors to be TessellationPattern's. Each factor is checked once; if it is another, says so and never tessellates.
    bool canTessellate(osg::State& state, const std::vector<std::uint16_t>& factors);
    using PatternCheck = std::function<bool(osg::State&, unsigned factor)>;
    /// The check to make instead of driverMakesPattern().
    void setPatternCheck(PatternCheck check);
    /// The backend that was found to be the faster one, once that has been tried; what to remember of it.
    std::optional<Backend> fastestBackend() const { return _fastestBackend; }
    void setFastestBackend(Backend backend) { _fastestBackend = backend; }

    std::int64_t maxTextureBufferTexels() const { return std::min(_maxTextureBufferTexels, _texelLimit); }
    /// Has the context be treated as one that allows no more than this either. Between draws.
    void limitTextureBufferTexels(std::int64_t most) { _texelLimit = most; }
    /// Most vertices that one draw should make. Elsewhere than on Mesa's software rasterizer the limit only bounds a single draw's
    /// duration.
    std::uint64_t verticesPerDraw(Backend backend) const
    {
        if (!_isSoftware) { return 4'000'000; }
        return backend == Backend::Tessellation ? kSoftwareTessellatedVertices : kSoftwareVerticesPerDraw;
    }
    static constexpr std::uint64_t kSoftwareVerticesPerDraw = 60'000;
    /// Above it the time of one draw grows with the square of what is tessellated: 6,638 patches at factors up to 16 take 0.55 s in
    /// draws of 16, 1.1 s in draws of 64 and 4.9 s in draws of 60,000 vertices.
    static constexpr std::uint64_t kSoftwareTessellatedVertices = 4'000;

    struct Block {
        const void* data;
        std::size_t bytes;
    };
    /// Binds the buffer, filled with these one after the other, to GL_ARRAY_BUFFER.
    void bindStream(osg::State& state, std::initializer_list<Block> blocks);
    /// Binds the triangles of the factor's pattern, 16-bit indices, to GL_ELEMENT_ARRAY_BUFFER.
    void bindPattern(osg::State& state, unsigned factor);
    /// Draw calls made for patches since the context is known.
    std::uint64_t drawCalls() const { return _drawCalls; }
    void countDrawCall() { ++_drawCalls; }
    /// Bytes sent by bindStream since then.
    std::uint64_t streamedBytes() const { return _streamedBytes; }
    /// Leaves no buffers bound and OSG's bookkeeping saying so.
    static void unbind(osg::State& state);

protected:
    ~DrawContext() override = default; // the buffer goes with its context

private:
    void query(osg::State& state);

    unsigned _contextId;
    bool _queried = false;
    bool _supported = false;
    bool _tessellates = false;
    PatternCheck _patternCheck;
    std::set<unsigned> _checkedFactors;
    std::optional<Backend> _fastestBackend;
    std::int64_t _maxTextureBufferTexels = 0;
    std::int64_t _texelLimit = std::numeric_limits<std::int64_t>::max();
    bool _isSoftware = true;
    std::uint64_t _drawCalls = 0;
    std::uint64_t _streamedBytes = 0;
    unsigned _stream = 0;
    std::map<unsigned, unsigned> _patterns; ///< buffers by factor
};

} // namespace osgTessLOD
