// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatchPrograms.h>

#include <osgTessLOD/render/ShaderSource.h>
#include <osgTessLOD/render/SurfaceShading.h>

#include <osg/PatchParameter>
#include <osg/PolygonMode>
#include <osg/Program>
#include <osg/State>
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
                                         "tesslod_deformation.glsl", "tesslod_placement.glsl", "tesslod_vertex.glsl"})
                               .get());
        return program;
    }
    program->addShader(createShader(osg::Shader::VERTEX, "tesslod_patch.vert", {}).get());
    program->addShader(createShader(osg::Shader::TESSCONTROL, "tesslod_patch.tctrl", {"tesslod_need.glsl"}).get());
    program->addShader(
        createShader(osg::Shader::TESSEVALUATION, "tesslod_patch.teval",
                     {"tesslod_pattern.glsl", "tesslod_surface.glsl", "tesslod_deformation.glsl",
                      "tesslod_placement.glsl", "tesslod_vertex.glsl"})
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

/// Shades by tessLodShade as `shading` defines it, or as tesslod_shade.glsl does where that is empty.
osg::ref_ptr<osg::Shader> makeFragmentShader(const std::string& shading)
{
    std::vector<std::string> shared{"tesslod_precise.glsl",  "tesslod_deformation.glsl", "tesslod_normal.glsl",
                                    "tesslod_color.glsl",    "tesslod_shadow.glsl",      "tesslod_lighting.glsl",
                                    "tesslod_fragment.glsl"};
    if (shading.empty()) {
        shared.emplace_back("tesslod_shade.glsl");
        return createShader(osg::Shader::FRAGMENT, "tesslod_patch.frag", shared);
    }
    // Before the stage's own text, behind its #version line; the compiler's messages call it file 100.
    std::string text = shaderText("tesslod_patch.frag");
    text.insert(text.find('\n') + 1, "#line 1 100\n" + shading + "\n#line 2 0\n");
    return createShaderFromText(osg::Shader::FRAGMENT, text, shared);
}

bool isUnfilled(const osg::State& state)
{
    const auto* mode =
        dynamic_cast<const osg::PolygonMode*>(state.getLastAppliedAttribute(osg::StateAttribute::POLYGONMODE));
    return mode != nullptr && (mode->getMode(osg::PolygonMode::FRONT) != osg::PolygonMode::FILL ||
                               mode->getMode(osg::PolygonMode::BACK) != osg::PolygonMode::FILL);
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
    for (const Backend backend : kBackends) { _draws[{backend, std::string()}] = makeDraw(backend, std::string()); }
}

PatchPrograms::Draw PatchPrograms::makeDraw(Backend backend, const std::string& shading)
{
    const osg::ref_ptr<osg::Program> program = makeVertexStages(backend);
    program->addShader(makeFragmentShader(shading).get());
    program->setName(std::string("tesslod_patch, ") + nameOf(backend));
    const Draw draw{makeState(backend, program.get()), makeState(backend, program.get())};
    draw.unfilled->setDefine("TESSLOD_UNFILLED");
    return draw;
}

osg::ref_ptr<osg::StateSet> PatchPrograms::draw(Backend backend, const osg::State& state) const
{
    const auto* shading = dynamic_cast<const SurfaceShading*>(state.getLastAppliedAttribute(SurfaceShading::kType));
    const std::pair<Backend, std::string> key{backend, shading != nullptr ? shading->getSource() : std::string()};
    const std::lock_guard<std::mutex> lock(_mutex);
    const auto known = _draws.find(key);
    const Draw& draw =
        known != _draws.end() ? known->second : _draws.emplace(key, makeDraw(backend, key.second)).first->second;
    return isUnfilled(state) ? draw.unfilled : draw.filled;
}

template <typename What> void PatchPrograms::forEach(const What& what) const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const auto& [key, draw] : _draws) {
        what(*draw.filled);
        what(*draw.unfilled);
    }
    for (const auto& [key, capture] : _captures) { what(*capture); }
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
    osg::ref_ptr<osg::StateSet> usual;
    {
        const std::lock_guard<std::mutex> lock(_mutex);
        usual = _draws.at({backend, std::string()}).filled;
    }
    usual->compileGLObjects(state);
}

void PatchPrograms::releaseGLObjects(osg::State* state) const
{
    forEach([state](osg::StateSet& set) { set.releaseGLObjects(state); });
}

void PatchPrograms::resizeGLObjectBuffers(unsigned maxSize)
{
    forEach([maxSize](osg::StateSet& set) { set.resizeGLObjectBuffers(maxSize); });
}

} // namespace osgTessLOD
