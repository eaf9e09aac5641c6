// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchPrograms.h>

#include <osgTessLOD/render/ShaderSource.h>

#include <osg/PatchParameter>
#include <osg/Program>
#include <osg/observer_ptr>

namespace osgTessLOD {

namespace {

constexpr Backend kBackends[] = {Backend::Tessellation, Backend::Instanced};

/// The stages that place vertices.
osg::ref_ptr<osg::Program> makeVertexStages(Backend backend)
{
    osg::ref_ptr<osg::Program> program = new osg::Program;
    if (backend == Backend::Instanced) {
        program->addShader(createShader(osg::Shader::VERTEX, "tesslod_instanced.vert",
                                        {"tesslod_precise.glsl", "tesslod_pattern.glsl", "tesslod_surface.glsl",
                                         "tesslod_vertex.glsl"})
                               .get());
        return program;
    }
    program->addShader(createShader(osg::Shader::VERTEX, "tesslod_patch.vert", {}).get());
    program->addShader(createShader(osg::Shader::TESSCONTROL, "tesslod_patch.tctrl", {}).get());
    program->addShader(createShader(osg::Shader::TESSEVALUATION, "tesslod_patch.teval",
                                    {"tesslod_pattern.glsl", "tesslod_surface.glsl", "tesslod_vertex.glsl"})
                           .get());
    return program;
}

osg::ref_ptr<osg::StateSet> makeState(Backend backend, osg::Program* program)
{
    // Protected: a program that a shadow technique puts over the scene cannot draw patches.
    const auto on = osg::StateAttribute::ON | osg::StateAttribute::PROTECTED;
    osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
    state->setAttributeAndModes(program, on);
    if (backend == Backend::Tessellation) { state->setAttribute(new osg::PatchParameter(1), on); }
    return state;
}

} // namespace

osg::ref_ptr<PatchPrograms> PatchPrograms::shared()
{
    static std::mutex mutex;
    static osg::observer_ptr<PatchPrograms> alive;
    const std::lock_guard<std::mutex> lock(mutex);
    osg::ref_ptr<PatchPrograms> programs;
    if (!alive.lock(programs)) {
        programs = new PatchPrograms;
        alive = programs;
    }
    return programs;
}

PatchPrograms::PatchPrograms()
{
    for (const Backend backend : kBackends) {
        const osg::ref_ptr<osg::Program> program = makeVertexStages(backend);
        program->addShader(
            createShader(osg::Shader::FRAGMENT, "tesslod_patch.frag",
                         {"tesslod_normal.glsl", "tesslod_color.glsl", "tesslod_lighting.glsl"})
                .get());
        program->setName(std::string("tesslod_patch, ") + nameOf(backend));
        _draw[backend] = makeState(backend, program.get());
    }
}

osg::ref_ptr<osg::StateSet> PatchPrograms::capture(Backend backend, const std::string& varying) const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    osg::ref_ptr<osg::StateSet>& state = _captures[{backend, varying}];
    if (!state.valid()) {
        const osg::ref_ptr<osg::Program> program = makeVertexStages(backend);
        program->setName(std::string("tesslod_patch, ") + nameOf(backend) + ", captured " + varying);
        program->addTransformFeedBackVarying(varying);
        program->setTransformFeedBackMode(GL_INTERLEAVED_ATTRIBS);
        state = makeState(backend, program.get());
    }
    return state;
}

void PatchPrograms::compileGLObjects(osg::State& state, Backend backend) const
{
    _draw.at(backend)->compileGLObjects(state);
}

void PatchPrograms::releaseGLObjects(osg::State* state) const
{
    for (const auto& [backend, draw] : _draw) { draw->releaseGLObjects(state); }
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const auto& [key, capture] : _captures) { capture->releaseGLObjects(state); }
}

void PatchPrograms::resizeGLObjectBuffers(unsigned maxSize)
{
    for (const auto& [backend, draw] : _draw) { draw->resizeGLObjectBuffers(maxSize); }
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const auto& [key, capture] : _captures) { capture->resizeGLObjectBuffers(maxSize); }
}

} // namespace osgTessLOD
