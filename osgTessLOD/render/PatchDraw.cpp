// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchDraw.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/DrawContext.h>

#include <osg/GLExtensions>

namespace osgTessLOD {

namespace {

static_assert(sizeof(PatchRecord) == 16, "the shaders read records as uvec4");

constexpr GLuint kRecordAttribute = 0;

/// A record is a patch of one vertex; the tessellator makes the others.
class TessellationDraw : public PatchDraw {
public:
    TessellationDraw(osg::State& state, const PatchRecords& records)
        : PatchDraw(state, records)
    {
        pointAt(0);
    }

    void draw(std::size_t first, std::size_t count, unsigned) override
    {
        glDrawArrays(GL_PATCHES, static_cast<GLint>(first), static_cast<GLsizei>(count));
    }
};

/// A record is an instance of the pattern's triangles.
class InstancedDraw : public PatchDraw {
public:
    InstancedDraw(osg::State& state, const PatchRecords& records)
        : PatchDraw(state, records)
        , _gl(*state.get<osg::GLExtensions>())
    {
        _gl.glVertexAttribDivisor(kRecordAttribute, 1);
    }
    ~InstancedDraw() override { _gl.glVertexAttribDivisor(kRecordAttribute, 0); }

    void draw(std::size_t first, std::size_t count, unsigned factor) override
    {
        pointAt(first); // draws that begin with another instance than the first one need OpenGL 4.2
        DrawContext::of(state()).bindPattern(state(), factor);
        _gl.glDrawElementsInstanced(GL_TRIANGLES, static_cast<GLsizei>(3 * TessellationPattern::triangleCount(factor)),
                                    GL_UNSIGNED_SHORT, nullptr, static_cast<GLsizei>(count));
    }

private:
    const osg::GLExtensions& _gl;
};

} // namespace

std::unique_ptr<PatchDraw> PatchDraw::make(Backend backend, osg::State& state, const PatchRecords& records)
{
    if (backend == Backend::Tessellation) { return std::make_unique<TessellationDraw>(state, records); }
    return std::make_unique<InstancedDraw>(state, records);
}

PatchDraw::PatchDraw(osg::State& state, const PatchRecords& records)
    : _state(state)
{
    state.lazyDisablingOfVertexAttributes();
    state.applyDisablingOfVertexAttributes();
    DrawContext::of(state).bindStream(state, records.data(), records.size() * sizeof(PatchRecord));
    state.get<osg::GLExtensions>()->glEnableVertexAttribArray(kRecordAttribute);
}

PatchDraw::~PatchDraw()
{
    _state.get<osg::GLExtensions>()->glDisableVertexAttribArray(kRecordAttribute);
    DrawContext::unbind(_state);
}

void PatchDraw::pointAt(std::size_t first)
{
    const auto* start = reinterpret_cast<const GLvoid*>(first * sizeof(PatchRecord));
    _state.get<osg::GLExtensions>()->glVertexAttribIPointer(kRecordAttribute, 4, GL_UNSIGNED_INT, sizeof(PatchRecord),
                                                            start);
}

} // namespace osgTessLOD
