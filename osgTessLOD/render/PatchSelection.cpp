// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchSelection.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/PatchPrograms.h>

#include <osg/Fog>
#include <osg/LightModel>
#include <osg/Notify>
#include <osg/Program>
#include <osg/State>

#include <algorithm>
#include <limits>

namespace osgTessLOD {

namespace {

static_assert(sizeof(PatchRecord) == 16, "tesslod_patch.vert reads records as uvec4");

/// Is the program that OSG applied last this one, linked? Otherwise drawing patches would be a GL error.
bool isApplied(const osg::State& state, const osg::StateSet& wanted)
{
    const osg::Program::PerContextProgram* applied = state.getLastAppliedProgramObject();
    return applied != nullptr && applied->isLinked() &&
           applied->getProgram() == wanted.getAttribute(osg::StateAttribute::PROGRAM);
}

/// The uniform of tesslod_lighting.glsl: which fixed-function features are on now.
int fixedFunctionBits(const osg::State& state)
{
    int bits = 0;
    for (int k = 0; k < 8; ++k) {
        if (state.getLastAppliedMode(static_cast<GLenum>(GL_LIGHT0 + k))) { bits |= 1 << k; }
    }
    if (state.getLastAppliedMode(GL_LIGHTING)) { bits |= 0x100; }
    const auto* model =
        dynamic_cast<const osg::LightModel*>(state.getLastAppliedAttribute(osg::StateAttribute::LIGHTMODEL));
    if (model != nullptr && model->getLocalViewer()) { bits |= 0x200; }
    const auto* fog = dynamic_cast<const osg::Fog*>(state.getLastAppliedAttribute(osg::StateAttribute::FOG));
    if (fog != nullptr && state.getLastAppliedMode(GL_FOG)) {
        bits |= (fog->getMode() == osg::Fog::LINEAR ? 1 : fog->getMode() == osg::Fog::EXP ? 2 : 3) << 10;
    }
    return bits;
}

void setUniform(osg::State& state, unsigned nameId, int value)
{
    const GLint location = state.getLastAppliedProgramObject()->getUniformLocation(nameId);
    if (location >= 0) { state.get<osg::GLExtensions>()->glUniform1i(location, value); }
}

/// The uniforms that tell shaders which fixed-function state is on now: of tesslod_lighting.glsl and tesslod_color.glsl.
void setFixedFunctionUniforms(osg::State& state)
{
    static const unsigned fixedFunction = osg::Uniform::getNameID("tessLodFixedFunction");
    static const unsigned textured = osg::Uniform::getNameID("tessLodTextured");
    setUniform(state, fixedFunction, fixedFunctionBits(state));
    setUniform(state, textured, state.getLastAppliedTextureMode(0, GL_TEXTURE_2D) ? 1 : 0);
}

/// Vertex attribute 0 from the stream buffer, for the life of the object. Everything that OSG's last geometry left
/// enabled is disabled first.
class RecordAttribute {
public:
    RecordAttribute(osg::State& state, const std::vector<PatchRecord>& records)
        : _state(state)
    {
        state.lazyDisablingOfVertexAttributes();
        state.applyDisablingOfVertexAttributes();
        DrawContext::of(state).bindStream(state, records.data(), records.size() * sizeof(PatchRecord));
        const auto* gl = state.get<osg::GLExtensions>();
        gl->glEnableVertexAttribArray(0);
        gl->glVertexAttribIPointer(0, 4, GL_UNSIGNED_INT, sizeof(PatchRecord), nullptr);
    }
    ~RecordAttribute()
    {
        _state.get<osg::GLExtensions>()->glDisableVertexAttribArray(0);
        DrawContext::unbindStream(_state);
    }
    RecordAttribute(const RecordAttribute&) = delete;
    RecordAttribute& operator=(const RecordAttribute&) = delete;

private:
    osg::State& _state;
};

/// A transform feedback buffer and a query of what went in.
class Capture {
public:
    explicit Capture(osg::State& state)
        : _gl(*state.get<osg::GLExtensions>())
    {
        _gl.glGenBuffers(1, &_buffer);
        _gl.glGenQueries(1, &_query);
        glEnable(GL_RASTERIZER_DISCARD);
    }
    ~Capture()
    {
        glDisable(GL_RASTERIZER_DISCARD);
        _gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
        _gl.glBindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, 0);
        _gl.glDeleteBuffers(1, &_buffer);
        _gl.glDeleteQueries(1, &_query);
    }
    Capture(const Capture&) = delete;
    Capture& operator=(const Capture&) = delete;

    void draw(std::size_t first, std::size_t count, std::uint64_t triangles, std::vector<osg::Vec3f>& corners)
    {
        const auto bytes = static_cast<GLsizeiptr>(triangles * 3 * sizeof(osg::Vec3f));
        _gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, _buffer);
        _gl.glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_DYNAMIC_READ);
        _gl.glBeginQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN, _query);
        _gl.glBeginTransformFeedback(GL_TRIANGLES);
        glDrawArrays(GL_PATCHES, static_cast<GLint>(first), static_cast<GLsizei>(count));
        _gl.glEndTransformFeedback();
        _gl.glEndQuery(GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN);
        GLuint written = 0;
        _gl.glGetQueryObjectuiv(_query, GL_QUERY_RESULT_ARB, &written);
        if (written != triangles) {
            OSG_WARN << "PatchSelection::capture: " << triangles << " triangles expected, " << written << " captured"
                     << std::endl;
        }
        const std::size_t at = corners.size();
        corners.resize(at + 3 * std::min<std::uint64_t>(written, triangles));
        _gl.glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0,
                               static_cast<GLsizeiptr>((corners.size() - at) * sizeof(osg::Vec3f)),
                               corners.data() + at);
    }

private:
    const osg::GLExtensions& _gl;
    GLuint _buffer = 0;
    GLuint _query = 0;
};

} // namespace

void SelectionStatistics::add(const SelectionStatistics& other)
{
    patches += other.patches;
    culledPatches += other.culledPatches;
    saturatedPatches += other.saturatedPatches;
    triangles += other.triangles;
    patchesByLevel.resize(std::max(patchesByLevel.size(), other.patchesByLevel.size()), 0);
    for (std::size_t k = 0; k < other.patchesByLevel.size(); ++k) { patchesByLevel[k] += other.patchesByLevel[k]; }
}

PatchSelection::PatchSelection()
{
    setUseDisplayList(false);
    setDataVariance(osg::Object::STATIC); // DYNAMIC would make the next frame wait for this one's draw
    setCullingActive(false);              // it exists because it was found visible
}

PatchSelection::PatchSelection(GpuAsset* asset, std::vector<PatchRecord> records, SelectionStatistics statistics,
                               const SelectionView& view)
    : PatchSelection()
{
    _asset = asset;
    _records = std::move(records);
    _statistics = std::move(statistics);
    _view = view;
}

PatchSelection::PatchSelection(const PatchSelection& other, const osg::CopyOp& copyop)
    : osg::Drawable(other, copyop)
    , _asset(other._asset)
    , _records(other._records)
    , _statistics(other._statistics)
    , _view(other._view)
{
}

PatchSelection::~PatchSelection() = default;

osg::BoundingBox PatchSelection::computeBoundingBox() const
{
    return _asset.valid() ? _asset->bounds() : osg::BoundingBox();
}

/// Calls draw(records) for the records of each page, with the page's state and the program's applied.
template <typename Draw>
void PatchSelection::forEachPage(osg::State& state, const AssetPages& pages, osg::StateSet& program,
                                 const Draw& draw) const
{
    std::vector<std::vector<PatchRecord>> byPage;
    if (pages.pages().size() > 1) {
        byPage.resize(pages.pages().size());
        for (const PatchRecord& record : _records) { byPage[pages.pageOf(record.patch)].push_back(record); }
    }
    state.pushStateSet(&program);
    for (std::size_t page = 0; page < pages.pages().size(); ++page) {
        const std::vector<PatchRecord>& records = byPage.empty() ? _records : byPage[page];
        if (records.empty()) { continue; }
        state.pushStateSet(pages.pages()[page].state.get());
        state.apply();
        if (isApplied(state, program)) {
            state.applyModelViewAndProjectionUniformsIfRequired();
            setFixedFunctionUniforms(state);
            draw(records);
        }
        state.popStateSet();
    }
    state.popStateSet();
    state.apply();
}

/// Calls draw(first record, count, factor) for pieces of one level and of at most `verticesPerDraw` tessellated vertices.
template <typename Draw>
void PatchSelection::forEachDraw(const std::vector<PatchRecord>& records, std::uint64_t verticesPerDraw,
                                 const Draw& draw) const
{
    const auto levelOf = [&](std::size_t k) { return MorphedSurface::drawnLevel(records[k].edgeLevels); };
    for (std::size_t first = 0; first < records.size();) {
        const unsigned level = levelOf(first);
        const unsigned factor = _asset->asset().ladder[level];
        const std::size_t most = std::max<std::uint64_t>(1, verticesPerDraw / TessellationPattern::vertexCount(factor));
        std::size_t end = first + 1;
        while (end < records.size() && end - first < most && levelOf(end) == level) { ++end; }
        draw(first, end - first, factor);
        first = end;
    }
}

void PatchSelection::drawImplementation(osg::RenderInfo& renderInfo) const
{
    if (_records.empty()) { return; }
    osg::State& state = *renderInfo.getState();
    const AssetPages* pages = _asset->pagesFor(state);
    if (pages == nullptr) { return; }
    forEachPage(state, *pages, *_asset->programs().draw(), [&](const std::vector<PatchRecord>& records) {
        const RecordAttribute attribute(state, records);
        const std::uint64_t verticesPerDraw = DrawContext::of(state).verticesPerDraw();
        forEachDraw(records, verticesPerDraw, [](std::size_t first, std::size_t count, unsigned) {
            glDrawArrays(GL_PATCHES, static_cast<GLint>(first), static_cast<GLsizei>(count));
        });
    });
}

std::vector<osg::Vec3f> PatchSelection::capture(osg::RenderInfo& renderInfo, const std::string& varying) const
{
    std::vector<osg::Vec3f> corners;
    if (_records.empty()) { return corners; }
    osg::State& state = *renderInfo.getState();
    const AssetPages* pages = _asset->pagesFor(state);
    if (pages == nullptr) { return corners; }
    const osg::ref_ptr<osg::StateSet> program = _asset->programs().capture(varying);
    forEachPage(state, *pages, *program, [&](const std::vector<PatchRecord>& records) {
        const RecordAttribute attribute(state, records);
        Capture capture(state);
        forEachDraw(records, DrawContext::kSoftwareVerticesPerDraw,
                    [&](std::size_t first, std::size_t count, unsigned factor) {
                        capture.draw(first, count, count * TessellationPattern::triangleCount(factor), corners);
                    });
    });
    return corners;
}

void PatchSelection::accept(osg::PrimitiveFunctor& functor) const
{
    constexpr std::uint64_t kMost = std::numeric_limits<GLsizei>::max() / 3;
    functor.setVertexArray(0, static_cast<const osg::Vec3*>(nullptr));
    functor.drawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(3 * std::min(_statistics.triangles, kMost)));
}

} // namespace osgTessLOD
