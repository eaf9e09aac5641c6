// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchDraw.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/DrawContext.h>

#include <osg/GLExtensions>

namespace osgTessLOD {

namespace {

static_assert(sizeof(PatchRecord) == 16, "the shaders read records as uvec4");

constexpr GLuint kRecordAttribute = 0;
constexpr GLuint kPlacementAttribute = 1;

/// A record is a patch of one vertex; the tessellator makes the others.
class TessellationDraw : public PatchDraw {
public:
    TessellationDraw(osg::State& state, const DrawnRecords& records)
        : PatchDraw(state, records)
    {
        pointAt(0);
    }

private:
    void drawRecords(std::size_t first, std::size_t count, unsigned) override
    {
        glDrawArrays(GL_PATCHES, static_cast<GLint>(first), static_cast<GLsizei>(count));
    }
};

/// A record is an instance of the pattern's triangles.
class InstancedDraw : public PatchDraw {
public:
    InstancedDraw(osg::State& state, const DrawnRecords& records)
        : PatchDraw(state, records)
        , _gl(*state.get<osg::GLExtensions>())
    {
        setDivisor(1);
    }
    ~InstancedDraw() override { setDivisor(0); }

private:
    void setDivisor(GLuint divisor) const
    {
        _gl.glVertexAttribDivisor(kRecordAttribute, divisor);
        if (arePlaced()) { _gl.glVertexAttribDivisor(kPlacementAttribute, divisor); }
    }

    void drawRecords(std::size_t first, std::size_t count, unsigned factor) override
    {
        pointAt(first); // draws that begin with another instance than the first one need OpenGL 4.2
        DrawContext::of(state()).bindPattern(state(), factor);
        _gl.glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(3 * TessellationPattern::triangleCount(factor)),
                                    GL_UNSIGNED_SHORT, nullptr, static_cast<GLsizei>(count));
    }

    const osg::GLExtensions& _gl;
};

} // namespace

std::unique_ptr<PatchDraw> PatchDraw::make(Backend backend, osg::State& state, const DrawnRecords& records)
{
    if (backend == Backend::Tessellation) { return std::make_unique<TessellationDraw>(state, records); }
    return std::make_unique<InstancedDraw>(state, records);
}

PatchDraw::PatchDraw(osg::State& state, const DrawnRecords& records)
    : _state(state)
    , _recordBytes(records.records.size() * sizeof(PatchRecord))
    , _arePlaced(!records.placements.empty())
{
    const auto* gl = state.get<osg::GLExtensions>();
    state.lazyDisablingOfVertexAttributes();
    state.applyDisablingOfVertexAttributes();
    DrawContext::of(state).bindStream(state, {{records.records.data(), _recordBytes},
                                              {records.placements.data(), records.placements.size() * sizeof(GLuint)}});
    gl->glEnableVertexAttribArray(kRecordAttribute);
    if (_arePlaced) { gl->glEnableVertexAttribArray(kPlacementAttribute); }
}

PatchDraw::~PatchDraw()
{
    const auto* gl = _state.get<osg::GLExtensions>();
    gl->glDisableVertexAttribArray(kRecordAttribute);
    if (_arePlaced) { gl->glDisableVertexAttribArray(kPlacementAttribute); }
    DrawContext::unbind(_state);
}

void PatchDraw::draw(std::size_t first, std::size_t count, unsigned factor)
{
    drawRecords(first, count, factor);
    DrawContext::of(_state).countDrawCall();
}

void PatchDraw::pointAt(std::size_t first)
{
    const auto* gl = _state.get<osg::GLExtensions>();
    const auto* start = reinterpret_cast<const GLvoid*>(first * sizeof(PatchRecord));
    gl->glVertexAttribIPointer(kRecordAttribute, 4, GL_UNSIGNED_INT, sizeof(PatchRecord), start);
    if (!_arePlaced) { return; }
    const auto* placements = reinterpret_cast<const GLvoid*>(_recordBytes + first * sizeof(GLuint));
    gl->glVertexAttribIPointer(kPlacementAttribute, 1, GL_UNSIGNED_INT, sizeof(GLuint), placements);
}

} // namespace osgTessLOD
