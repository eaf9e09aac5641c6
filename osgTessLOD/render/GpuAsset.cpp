// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/GpuAsset.h>

#include <osgTessLOD/render/DrawContext.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/ShaderSource.h>

#include <osg/BufferObject>
#include <osg/Notify>
#include <osg/PatchParameter>
#include <osg/Program>
#include <osg/Uniform>
#include <osg/observer_ptr>

#include <algorithm>
#include <cassert>
#include <limits>

namespace osgTessLOD {

namespace {

constexpr unsigned kMaxLevels = 33; // size of tessLodFactors: 1 and the even factors up to 64

/// The programs that draw and capture. They do not depend on the asset.
struct Programs : osg::Referenced {
    osg::ref_ptr<osg::Program> draw = new osg::Program;
    osg::ref_ptr<osg::Program> capture = new osg::Program;

    Programs()
    {
        const auto add = [this](const osg::ref_ptr<osg::Shader>& shader, bool both) {
            draw->addShader(shader.get());
            if (both) { capture->addShader(shader.get()); }
        };
        add(createShader(osg::Shader::VERTEX, "tesslod_patch.vert", {}), true);
        add(createShader(osg::Shader::TESSCONTROL, "tesslod_patch.tctrl", {}), true);
        add(createShader(osg::Shader::TESSEVALUATION, "tesslod_patch.teval",
                         {"tesslod_pattern.glsl", "tesslod_surface.glsl"}),
            true);
        add(createShader(osg::Shader::FRAGMENT, "tesslod_patch.frag", {"tesslod_normal.glsl", "tesslod_lighting.glsl"}),
            false);
        draw->setName("tesslod_patch");
        capture->setName("tesslod_patch, captured");
        capture->addTransformFeedBackVarying("tessLodObjectPosition");
        capture->setTransformFeedBackMode(GL_INTERLEAVED_ATTRIBS);
    }

protected:
    ~Programs() override = default;
};

/// The programs that are alive, or new ones: so that scenes of many assets compile and switch shaders once.
osg::ref_ptr<Programs> sharedPrograms()
{
    static std::mutex mutex;
    static osg::observer_ptr<Programs> alive;
    const std::lock_guard<std::mutex> lock(mutex);
    osg::ref_ptr<Programs> programs;
    if (!alive.lock(programs)) {
        programs = new Programs;
        alive = programs;
    }
    return programs;
}

osg::ref_ptr<osg::UIntArray> vertexWords(const LodAsset& asset, std::uint64_t count)
{
    osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
    words->reserve(2 * count);
    for (const LodLevel& level : asset.levels) {
        for (const LodVertex& vertex : level.vertices) {
            words->push_back(static_cast<GLuint>(vertex.bits & 0xFFFFFFFFU));
            words->push_back(static_cast<GLuint>(vertex.bits >> 32));
        }
    }
    return words;
}

osg::ref_ptr<osg::UIntArray> normalWords(const NormalTexture& normals)
{
    osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
    for (const std::vector<std::uint32_t>& level : normals.levels) {
        words->insert(words->end(), level.begin(), level.end());
    }
    return words;
}

/// A number per level; `otherwise` for those that do not exist.
template <class Number>
osg::ref_ptr<osg::Uniform> levelUniform(const char* name, const std::vector<Number>& numbers, int otherwise)
{
    osg::ref_ptr<osg::Uniform> uniform = new osg::Uniform(osg::Uniform::INT, name, kMaxLevels);
    for (unsigned k = 0; k < kMaxLevels; ++k) {
        uniform->setElement(k, k < numbers.size() ? static_cast<int>(numbers[k]) : otherwise);
    }
    return uniform;
}

} // namespace

GpuAsset::GpuAsset(std::shared_ptr<const LodAsset> asset)
    : _asset(std::move(asset))
    , _selector(*_asset)
    , _surface(*_asset)
    , _programs(sharedPrograms())
{
    const LodAsset& a = *_asset;
    _bounds.set(a.boundsMin[0], a.boundsMin[1], a.boundsMin[2], a.boundsMax[0], a.boundsMax[1], a.boundsMax[2]);
    _largestBufferTexels = static_cast<std::int64_t>(_surface.vertexCount());
    if (_surface.vertexCount() <= static_cast<std::uint64_t>(std::numeric_limits<std::int32_t>::max())) {
        const std::vector<std::int32_t>& table = _surface.patchTable();
        addBuffer(vertexWords(a, _surface.vertexCount()).get(), GL_RG32UI, kVerticesUnit,
                  static_cast<std::int64_t>(_surface.vertexCount()));
        addBuffer(new osg::IntArray(table.begin(), table.end()), GL_R32I, kPatchTableUnit,
                  static_cast<std::int64_t>(table.size()));
        if (a.normals.resolution > 0) {
            const osg::ref_ptr<osg::UIntArray> words = normalWords(a.normals);
            const auto texels = static_cast<std::int64_t>(words->size());
            addBuffer(words.get(), GL_R32UI, kNormalsUnit, texels);
            addParameters();
        }
    }
    const auto* programs = static_cast<Programs*>(_programs.get());
    _drawState = makeState(programs->draw.get());
    _captureState = makeState(programs->capture.get());
}

GpuAsset::~GpuAsset() = default;

void GpuAsset::addBuffer(osg::Array* array, GLenum format, unsigned unit, std::int64_t texels)
{
    osg::ref_ptr<osg::VertexBufferObject> object = new osg::VertexBufferObject;
    object->setUsage(GL_STATIC_DRAW_ARB);
    array->setBufferObject(object.get());
    osg::ref_ptr<osg::TextureBuffer> buffer = new osg::TextureBuffer(array);
    buffer->setInternalFormat(static_cast<GLint>(format));
    buffer->setTextureWidth(static_cast<int>(texels));
    _buffers.push_back({unit, array, buffer});
    _largestBufferTexels = std::max(_largestBufferTexels, texels);
}

/// Of all levels that have them, one after the other. Only normals are looked up by them.
void GpuAsset::addParameters()
{
    const osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
    std::vector<std::int32_t> shifts;
    std::size_t without = 0; // vertices before the level that have no parameters
    for (const LodLevel& level : _asset->levels) {
        words->insert(words->end(), level.parameters.begin(), level.parameters.end());
        shifts.push_back(level.parameters.empty() ? -1 : static_cast<std::int32_t>(without));
        if (level.parameters.empty()) { without += level.vertices.size(); }
    }
    if (words->empty()) { return; }
    addBuffer(words.get(), GL_R32UI, kParametersUnit, static_cast<std::int64_t>(words->size()));
    _parameterShifts = std::move(shifts);
}

osg::ref_ptr<osg::StateSet> GpuAsset::makeState(osg::StateAttribute* program) const
{
    // Protected: a program or texture that a shadow technique puts over the scene cannot draw patches.
    const auto on = osg::StateAttribute::ON | osg::StateAttribute::PROTECTED;
    osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
    state->setDataVariance(osg::Object::DYNAMIC); // keeps optimizers from merging it with another asset's
    state->setAttributeAndModes(program, on);
    state->setAttribute(new osg::PatchParameter(1), on);
    for (const Buffer& buffer : _buffers) { state->setTextureAttribute(buffer.unit, buffer.texture.get(), on); }
    state->addUniform(new osg::Uniform("tessLodVertices", static_cast<int>(kVerticesUnit)));
    state->addUniform(new osg::Uniform("tessLodPatchTable", static_cast<int>(kPatchTableUnit)));
    state->addUniform(new osg::Uniform("tessLodStep", _asset->lattice.step));
    state->addUniform(new osg::Uniform("tessLodLevelCount", static_cast<int>(_asset->levels.size())));
    state->addUniform(levelUniform("tessLodFactors", _asset->ladder, 1).get());
    if (_asset->normals.resolution > 0) {
        state->setDefine("TESSLOD_NORMALS");
        state->addUniform(new osg::Uniform("tessLodNormals", static_cast<int>(kNormalsUnit)));
        state->addUniform(new osg::Uniform("tessLodPatchCount", static_cast<int>(_asset->patches.size())));
        state->addUniform(new osg::Uniform("tessLodNormalLevelCount", static_cast<int>(_asset->normals.levels.size())));
    }
    if (!_parameterShifts.empty()) {
        state->setDefine("TESSLOD_PARAMETERS");
        state->addUniform(new osg::Uniform("tessLodParameters", static_cast<int>(kParametersUnit)));
        state->addUniform(levelUniform("tessLodParameterShifts", _parameterShifts, -1).get());
    }
    return state;
}

void GpuAsset::warnOnce(const std::string& why) const
{
    if (!_warned.exchange(true)) {
        OSG_WARN << "osgTessLOD: cannot draw \"" << _asset->source << "\": " << why << std::endl;
    }
}

bool GpuAsset::canDraw(osg::State& state) const
{
    const DrawContext& context = DrawContext::of(state);
    if (!context.supported()) {
        warnOnce("OpenGL 4.2 with tessellation shaders is needed");
        return false;
    }
    if (_asset->levels.size() > kMaxLevels) {
        warnOnce("its ladder has more than " + std::to_string(kMaxLevels) + " levels");
        return false;
    }
    if (_buffers.empty() || _largestBufferTexels > context.maxTextureBufferTexels()) {
        warnOnce("it needs a texture buffer of " + std::to_string(_largestBufferTexels) +
                 " texels, the context allows " + std::to_string(context.maxTextureBufferTexels()));
        return false;
    }
    return true;
}

osg::ref_ptr<SurfaceProxy> GpuAsset::proxy(const PickingOptions& options) const
{
    const unsigned level = SurfaceProxy::levelFor(_selector, _asset->levels.size(), options);
    const std::lock_guard<std::mutex> lock(_proxyMutex);
    osg::ref_ptr<SurfaceProxy> proxy;
    if (!_proxies[level].lock(proxy)) {
        proxy = new SurfaceProxy(*_asset, _selector, _surface, level);
        _proxies[level] = proxy;
    }
    return proxy;
}

void GpuAsset::compileGLObjects(osg::State& state) const
{
    if (canDraw(state)) { _drawState->compileGLObjects(state); }
}

void GpuAsset::releaseGLObjects(osg::State* state) const
{
    _drawState->releaseGLObjects(state);
    _captureState->releaseGLObjects(state);
    // The state sets release the textures, but not the buffers behind them.
    for (const Buffer& buffer : _buffers) { buffer.data->getBufferObject()->releaseGLObjects(state); }
    if (state != nullptr) { DrawContext::release(*state); }
}

void GpuAsset::resizeGLObjectBuffers(unsigned maxSize)
{
    _drawState->resizeGLObjectBuffers(maxSize);
    _captureState->resizeGLObjectBuffers(maxSize);
    for (const Buffer& buffer : _buffers) { buffer.data->getBufferObject()->resizeGLObjectBuffers(maxSize); }
}

} // namespace osgTessLOD
