// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchPrograms.h>

#include <osgTessLOD/render/ShaderSource.h>

#include <osg/PatchParameter>
#include <osg/Program>
#include <osg/observer_ptr>

namespace osgTessLOD {

namespace {

/// The stages that place vertices.
osg::ref_ptr<osg::Program> makeVertexStages()
{
    osg::ref_ptr<osg::Program> program = new osg::Program;
    program->addShader(createShader(osg::Shader::VERTEX, "tesslod_patch.vert", {}).get());
    program->addShader(createShader(osg::Shader::TESSCONTROL, "tesslod_patch.tctrl", {}).get());
    program->addShader(createShader(osg::Shader::TESSEVALUATION, "tesslod_patch.teval",
                                    {"tesslod_pattern.glsl", "tesslod_surface.glsl"})
                           .get());
    return program;
}

osg::ref_ptr<osg::StateSet> makeState(osg::Program* program)
{
    // Protected: a program that a shadow technique puts over the scene cannot draw patches.
    const auto on = osg::StateAttribute::ON | osg::StateAttribute::PROTECTED;
    osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
    state->setAttributeAndModes(program, on);
    state->setAttribute(new osg::PatchParameter(1), on);
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
    const osg::ref_ptr<osg::Program> program = makeVertexStages();
    program->addShader(
        createShader(osg::Shader::FRAGMENT, "tesslod_patch.frag", {"tesslod_normal.glsl", "tesslod_color.glsl", "tesslod_lighting.glsl"})
            .get());
    program->setName("tesslod_patch");
    _draw = makeState(program.get());
}

osg::ref_ptr<osg::StateSet> PatchPrograms::capture(const std::string& varying) const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    osg::ref_ptr<osg::StateSet>& state = _captures[varying];
    if (!state.valid()) {
        const osg::ref_ptr<osg::Program> program = makeVertexStages();
        program->setName("tesslod_patch, captured " + varying);
        program->addTransformFeedBackVarying(varying);
        program->setTransformFeedBackMode(GL_INTERLEAVED_ATTRIBS);
        state = makeState(program.get());
    }
    return state;
}

void PatchPrograms::compileGLObjects(osg::State& state) const
{
    _draw->compileGLObjects(state);
}

void PatchPrograms::releaseGLObjects(osg::State* state) const
{
    _draw->releaseGLObjects(state);
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const auto& [varying, capture] : _captures) { capture->releaseGLObjects(state); }
}

void PatchPrograms::resizeGLObjectBuffers(unsigned maxSize)
{
    _draw->resizeGLObjectBuffers(maxSize);
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const auto& [varying, capture] : _captures) { capture->resizeGLObjectBuffers(maxSize); }
}

} // namespace osgTessLOD
