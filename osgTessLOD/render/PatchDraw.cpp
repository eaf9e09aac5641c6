// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchDraw.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/ShaderSelection.h>

#include <osg/BufferObject>
#include <osg/GLExtensions>

namespace osgTessLOD {

namespace {

static_assert(sizeof(PatchRecord) == 16, "the shaders read records as uvec4");

constexpr GLuint kRecordAttribute = 0;
constexpr GLuint kPlacementAttribute = 1;

/// A vertex is a patch; the tessellator makes the others.
void drawVertices(std::size_t first, std::size_t count)
{
    glDrawArrays(GL_PATCHES, static_cast<GLint>(first), static_cast<GLsizei>(count));
}

/// The records are in a buffer that holds them already, or that this draw fills.
class RecordsDraw : public PatchDraw {
public:
    RecordsDraw(osg::State& state, const DrawnRecords& records)
        : PatchDraw(state)
        , _recordBytes(records.records.size() * sizeof(PatchRecord))
        , _arePlaced(!records.placements.empty())
    {
        DrawContext::of(state).streams().bind(
            state, {{records.records.data(), _recordBytes},
                    {records.placements.data(), records.placements.size() * sizeof(GLuint)}});
        if (_arePlaced) { state.get<osg::GLExtensions>()->glEnableVertexAttribArray(kPlacementAttribute); }
    }
    ~RecordsDraw() override
    {
        if (_arePlaced) { state().get<osg::GLExtensions>()->glDisableVertexAttribArray(kPlacementAttribute); }
    }

protected:
    /// Has the records from `first` on be vertex attribute 0, and their placements attribute 1.
    void pointAt(std::size_t first)
    {
        const auto* gl = state().get<osg::GLExtensions>();
        const auto* start = reinterpret_cast<const GLvoid*>(first * sizeof(PatchRecord));
        gl->glVertexAttribIPointer(kRecordAttribute, 4, GL_UNSIGNED_INT, sizeof(PatchRecord), start);
        if (!_arePlaced) { return; }
        const auto* placements = reinterpret_cast<const GLvoid*>(_recordBytes + first * sizeof(GLuint));
        gl->glVertexAttribIPointer(kPlacementAttribute, 1, GL_UNSIGNED_INT, sizeof(GLuint), placements);
    }
    bool arePlaced() const { return _arePlaced; }

private:
    std::size_t _recordBytes;
    bool _arePlaced;
};

class TessellationDraw : public RecordsDraw {
public:
    TessellationDraw(osg::State& state, const DrawnRecords& records)
        : RecordsDraw(state, records)
    {
        pointAt(0);
    }

private:
    void drawRecords(std::size_t first, std::size_t count, unsigned) override { drawVertices(first, count); }
};

/// The records are numbers of patches in a buffer of the asset's: the control shader finds the levels.
class SelectingDraw : public PatchDraw {
public:
    SelectingDraw(osg::State& state, const ShaderSelection& selection)
        : PatchDraw(state)
    {
        const osg::BufferObject& buffer = *selection.patches().getBufferObject();
        osg::GLBufferObject* object = buffer.getOrCreateGLBufferObject(state.getContextID());
        if (object->isDirty()) { object->compileBuffer(); }
        object->bindBuffer();
        state.get<osg::GLExtensions>()->glVertexAttribIPointer(kRecordAttribute, 1, GL_UNSIGNED_INT, sizeof(GLuint),
                                                               nullptr);
    }

private:
    void drawRecords(std::size_t first, std::size_t count, unsigned) override { drawVertices(first, count); }
};

/// A record is an instance of the pattern's triangles.
class InstancedDraw : public RecordsDraw {
public:
    InstancedDraw(osg::State& state, const DrawnRecords& records)
        : RecordsDraw(state, records)
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

std::unique_ptr<PatchDraw> PatchDraw::make(osg::State& state, const ShaderSelection& selection)
{
    return std::make_unique<SelectingDraw>(state, selection);
}

PatchDraw::PatchDraw(osg::State& state)
    : _state(state)
{
    state.lazyDisablingOfVertexAttributes();
    state.applyDisablingOfVertexAttributes();
    state.get<osg::GLExtensions>()->glEnableVertexAttribArray(kRecordAttribute);
}

PatchDraw::~PatchDraw()
{
    _state.get<osg::GLExtensions>()->glDisableVertexAttribArray(kRecordAttribute);
    DrawContext::unbind(_state);
}

void PatchDraw::draw(std::size_t first, std::size_t count, unsigned factor)
{
    drawRecords(first, count, factor);
    DrawContext::of(_state).countDrawCall();
}

} // namespace osgTessLOD
