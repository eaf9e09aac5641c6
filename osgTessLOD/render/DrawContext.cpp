// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/DrawContext.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/PatternCheck.h>

#include <osg/BufferObject>
#include <osg/ContextData>
#include <osg/GLExtensions>
#include <osg/GLObjects>
#include <osg/Notify>
#include <osg/VertexArrayState>

#include <string>
#include <utility>

namespace osgTessLOD {

namespace {

/// Deletes buffer names when OSG next flushes with the context current.
class DrawBufferManager : public osg::GLObjectManager {
public:
    explicit DrawBufferManager(unsigned contextId)
        : osg::GLObjectManager("osgTessLOD::DrawBufferManager", contextId)
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
    auto* manager = osg::get<DrawBufferManager>(context->_contextId);
    if (context->_stream != 0) { manager->scheduleGLObjectForDeletion(context->_stream); }
    for (const auto& [factor, buffer] : context->_patterns) { manager->scheduleGLObjectForDeletion(buffer); }
    context->_stream = 0;
    context->_patterns.clear();
}

void DrawContext::query(osg::State& state)
{
    const auto* gl = state.get<osg::GLExtensions>();
    const auto has = [&](float version) { return gl->glVersion >= version && gl->glslLanguageVersion >= version; };
    _queried = true;
    _supported = has(3.3F);
    _tessellates = gl->areTessellationShadersSupported && has(4.2F);
    _patternCheck = driverMakesPattern;
    GLint texels = 0;
    if (_supported) { glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &texels); }
    _maxTextureBufferTexels = texels;
    const auto* bytes = glGetString(GL_RENDERER);
    const std::string renderer = bytes != nullptr ? reinterpret_cast<const char*>(bytes) : "";
    _isSoftware = renderer.find("llvmpipe") != std::string::npos || renderer.find("softpipe") != std::string::npos;
}

void DrawContext::setPatternCheck(PatternCheck check)
{
    _patternCheck = std::move(check);
    _checkedFactors.clear();
}

bool DrawContext::canTessellate(osg::State& state, const std::vector<std::uint16_t>& factors)
{
    for (const std::uint16_t factor : factors) {
        if (!_tessellates || factor > PatchSelector::kMaxDrawnFactor) { break; }
        if (!_checkedFactors.insert(factor).second || _patternCheck(state, factor)) { continue; }
        _tessellates = false;
        OSG_WARN << "osgTessLOD: the tessellator of " << reinterpret_cast<const char*>(glGetString(GL_RENDERER))
                 << " has another pattern of factor " << factor << " than expected: drawing instances instead"
                 << std::endl;
    }
    return _tessellates;
}

void DrawContext::bindStream(osg::State& state, std::initializer_list<Block> blocks)
{
    const auto* gl = state.get<osg::GLExtensions>();
    if (_stream == 0) { gl->glGenBuffers(1, &_stream); }
    gl->glBindBuffer(GL_ARRAY_BUFFER_ARB, _stream);
    std::size_t bytes = 0;
    for (const Block& block : blocks) { bytes += block.bytes; }
    _streamedBytes += bytes;
    gl->glBufferData(GL_ARRAY_BUFFER_ARB, static_cast<GLsizeiptr>(bytes), nullptr, GL_STREAM_DRAW_ARB);
    std::size_t first = 0;
    for (const Block& block : blocks) {
        if (block.bytes == 0) { continue; }
        gl->glBufferSubData(GL_ARRAY_BUFFER_ARB, static_cast<GLintptr>(first), static_cast<GLsizeiptr>(block.bytes),
                            block.data);
        first += block.bytes;
    }
}

void DrawContext::bindPattern(osg::State& state, unsigned factor)
{
    const auto* gl = state.get<osg::GLExtensions>();
    unsigned& buffer = _patterns[factor];
    const bool isNew = buffer == 0;
    if (isNew) { gl->glGenBuffers(1, &buffer); }
    gl->glBindBuffer(GL_ELEMENT_ARRAY_BUFFER_ARB, buffer);
    if (!isNew) { return; }
    std::vector<std::uint16_t> indices;
    const TessellationPattern pattern(factor);
    for (const TessellationPattern::Triangle& triangle : pattern.triangles()) {
        for (const std::uint32_t vertex : triangle) { indices.push_back(static_cast<std::uint16_t>(vertex)); }
    }
    gl->glBufferData(GL_ELEMENT_ARRAY_BUFFER_ARB, static_cast<GLsizeiptr>(indices.size() * sizeof(std::uint16_t)),
                     indices.data(), GL_STATIC_DRAW_ARB);
}

void DrawContext::unbind(osg::State& state)
{
    // unbindVertexBufferObject() does nothing where OSG believes that nothing is bound.
    const auto* gl = state.get<osg::GLExtensions>();
    gl->glBindBuffer(GL_ARRAY_BUFFER_ARB, 0);
    gl->glBindBuffer(GL_ELEMENT_ARRAY_BUFFER_ARB, 0);
    osg::VertexArrayState* arrays = state.getCurrentVertexArrayState();
    if (arrays != nullptr) {
        arrays->setCurrentVertexBufferObject(nullptr);
        arrays->setCurrentElementBufferObject(nullptr);
    }
}

} // namespace osgTessLOD
