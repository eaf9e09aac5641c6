// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/PatternCheck.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/ShaderSource.h>
#include <osgTessLOD/render/TransformFeedback.h>

#include <osg/PatchParameter>
#include <osg/Program>
#include <osg/StateSet>
#include <osg/Uniform>

#include <algorithm>
#include <vector>

namespace osgTessLOD {

namespace {

using Triangles = std::vector<TessellationPattern::Triangle>;

/// Each from its least vertex on, in the order of numbers: whoever made them, in whatever order.
Triangles sorted(Triangles triangles)
{
    for (TessellationPattern::Triangle& t : triangles) {
        std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    }
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

osg::ref_ptr<osg::StateSet> makeState(unsigned factor)
{
    const osg::ref_ptr<osg::Program> program = new osg::Program;
    program->addShader(createShader(osg::Shader::VERTEX, "tesslod_check.vert", {}).get());
    program->addShader(createShader(osg::Shader::TESSCONTROL, "tesslod_check.tctrl", {}).get());
    program->addShader(
        createShader(osg::Shader::TESSEVALUATION, "tesslod_check.teval", {"tesslod_pattern.glsl"}).get());
    program->addTransformFeedBackVarying("tessLodIndex");
    program->setTransformFeedBackMode(GL_INTERLEAVED_ATTRIBS);
    const auto on = osg::StateAttribute::ON | osg::StateAttribute::PROTECTED;
    osg::ref_ptr<osg::StateSet> set = new osg::StateSet;
    set->setAttributeAndModes(program.get(), on);
    set->setAttribute(new osg::PatchParameter(1), on);
    set->addUniform(new osg::Uniform("tessLodFactor", static_cast<int>(factor)));
    return set;
}

} // namespace

bool driverMakesPattern(osg::State& state, unsigned factor)
{
    const TessellationPattern pattern(factor);
    const osg::ref_ptr<osg::StateSet> set = makeState(factor);
    state.pushStateSet(set.get());
    state.apply();
    Triangles made(pattern.triangles().size() + 1); // room to notice too many
    const osg::Program::PerContextProgram* applied = state.getLastAppliedProgramObject();
    const bool isApplied = applied != nullptr && applied->isLinked() &&
                           applied->getProgram() == set->getAttribute(osg::StateAttribute::PROGRAM);
    if (isApplied) {
        state.lazyDisablingOfVertexAttributes();
        state.applyDisablingOfVertexAttributes();
        TransformFeedback feedback(state);
        made.resize(feedback.capture(made.data(), made.size(), [] { glDrawArrays(GL_PATCHES, 0, 1); }));
    }
    state.popStateSet();
    state.apply();
    set->releaseGLObjects(&state);
    return isApplied && sorted(std::move(made)) == sorted(pattern.triangles());
}

} // namespace osgTessLOD
