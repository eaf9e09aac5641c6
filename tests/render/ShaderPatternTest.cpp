// SPDX-License-Identifier: MIT
// What the driver's tessellator emits, and what the shaders make of it, against TessellationPattern.
#include <render/GlTest.h>

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/ShaderSource.h>

#include <osg/PatchParameter>
#include <osg/Program>
#include <osg/StateSet>

#include <algorithm>
#include <array>
#include <cstdint>
#include <set>
#include <vector>

namespace osgTessLOD {
namespace {

constexpr const char* kVertex = "#version 420 compatibility\nvoid main() {}\n";
constexpr const char* kControl = "#version 420 compatibility\n"
                                 "layout(vertices = 1) out;\n"
                                 "uniform int factor;\n"
                                 "void main() {\n"
                                 "    for (int k = 0; k < 3; ++k) { gl_TessLevelOuter[k] = float(factor); }\n"
                                 "    gl_TessLevelInner[0] = float(factor);\n"
                                 "}\n";
constexpr const char* kEvaluation = "#version 420 compatibility\n"
                                    "layout(triangles, equal_spacing, ccw) in;\n"
                                    "uniform int factor;\n"
                                    "out vec3 coordinate;\n"
                                    "flat out int index;\n"
                                    "flat out ivec3 barycentric;\n"
                                    "flat out int count;\n"
                                    "void main() {\n"
                                    "    coordinate = gl_TessCoord;\n"
                                    "    index = tessLodPatternIndex(gl_TessCoord, factor);\n"
                                    "    barycentric = tessLodPatternBarycentric(factor, index);\n"
                                    "    count = tessLodPatternVertexCount(factor);\n"
                                    "}\n";

/// One captured vertex, as the varyings lie in the buffer.
struct Corner {
    std::array<float, 3> coordinate;
    std::int32_t index;
    std::array<std::int32_t, 3> barycentric;
    std::int32_t count;
};

using Triangle = TessellationPattern::Triangle;

Triangle rotated(Triangle t)
{
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
    return t;
}

class ShaderPattern : public GlTest {
protected:
    std::vector<Corner> tessellate(unsigned factor)
    {
        if (!program.valid()) {
            program = new osg::Program;
            program->addShader(new osg::Shader(osg::Shader::VERTEX, kVertex));
            program->addShader(new osg::Shader(osg::Shader::TESSCONTROL, kControl));
            program->addShader(
                createShaderFromText(osg::Shader::TESSEVALUATION, kEvaluation, {"tesslod_pattern.glsl"}).get());
            for (const char* name : {"coordinate", "index", "barycentric", "count"}) {
                program->addTransformFeedBackVarying(name);
            }
            program->setTransformFeedBackMode(GL_INTERLEAVED_ATTRIBS);
        }
        const osg::ref_ptr<osg::StateSet> set = new osg::StateSet;
        set->setAttributeAndModes(program.get());
        set->setAttribute(new osg::PatchParameter(1));
        set->addUniform(new osg::Uniform("factor", static_cast<int>(factor)));
        state().pushStateSet(set.get());
        state().apply();
        std::vector<Corner> corners(3 * TessellationPattern::triangleCount(factor) + 3); // room to notice too many
        const std::size_t captured = draw(corners);
        corners.resize(captured);
        state().popStateSet();
        state().apply();
        return corners;
    }

private:
    std::size_t draw(std::vector<Corner>& corners)
    {
        const auto& gl = *state().get<osg::GLExtensions>();
        GLuint buffer = 0;
        GLuint query = 0;
        gl.glGenBuffers(1, &buffer);
        gl.glGenQueries(1, &query);
        gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffer);
        const auto bytes = static_cast<GLsizeiptr>(corners.size() * sizeof(Corner));
        gl.glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_STREAM_DRAW_ARB);
        glEnable(GL_RASTERIZER_DISCARD);
        gl.glBeginQuery(0x8C88 /* GL_TRANSFORM_FEEDBACK_PRIMITIVES_WRITTEN */, query);
        gl.glBeginTransformFeedback(GL_TRIANGLES);
        glDrawArrays(GL_PATCHES, 0, 1);
        gl.glEndTransformFeedback();
        gl.glEndQuery(0x8C88);
        glDisable(GL_RASTERIZER_DISCARD);
        GLuint triangles = 0;
        gl.glGetQueryObjectuiv(query, GL_QUERY_RESULT_ARB, &triangles);
        gl.glGetBufferSubData(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, corners.data());
        gl.glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
        gl.glDeleteBuffers(1, &buffer);
        gl.glDeleteQueries(1, &query);
        return 3 * triangles;
    }

    osg::ref_ptr<osg::Program> program;
};

std::vector<unsigned> drawnFactors()
{
    std::vector<unsigned> factors{1};
    for (unsigned f = 2; f <= PatchSelector::kMaxDrawnFactor; f += 2) { factors.push_back(f); }
    return factors;
}

TEST_F(ShaderPattern, driverEmitsThePatternsOrientedTriangles)
{
    for (unsigned f : drawnFactors()) {
        const std::vector<Corner> corners = tessellate(f);
        ASSERT_EQ(corners.size(), 3 * TessellationPattern::triangleCount(f)) << f;
        std::set<Triangle> emitted;
        for (std::size_t k = 0; k < corners.size(); k += 3) {
            Triangle t{};
            for (std::size_t c = 0; c < 3; ++c) { t[c] = TessellationPattern::index(f, corners[k + c].coordinate); }
            EXPECT_TRUE(emitted.insert(rotated(t)).second) << "twice the same triangle, factor " << f;
        }
        std::set<Triangle> expected;
        const TessellationPattern pattern(f);
        for (const Triangle& t : pattern.triangles()) { expected.insert(rotated(t)); }
        EXPECT_EQ(emitted, expected) << f;
    }
}

TEST_F(ShaderPattern, shaderFunctionsEqualTheirTwins)
{
    for (unsigned f : drawnFactors()) {
        std::set<std::int32_t> seen;
        for (const Corner& corner : tessellate(f)) {
            const std::uint32_t index = TessellationPattern::index(f, corner.coordinate);
            ASSERT_EQ(corner.index, static_cast<std::int32_t>(index)) << f;
            ASSERT_EQ(corner.count, static_cast<std::int32_t>(TessellationPattern::vertexCount(f))) << f;
            const TessellationPattern::Barycentric b = TessellationPattern::barycentric(f, index);
            for (std::size_t k = 0; k < 3; ++k) {
                ASSERT_EQ(corner.barycentric[k], static_cast<std::int32_t>(b[k])) << f << " " << index;
                // The tessellator works in 16-bit fixed point; rings add up a few of its roundings.
                ASSERT_NEAR(corner.coordinate[k], static_cast<double>(b[k]) / (3.0 * f), 5e-4) << f << " " << index;
            }
            seen.insert(corner.index);
        }
        EXPECT_EQ(seen.size(), TessellationPattern::vertexCount(f)) << f;
    }
}

} // namespace
} // namespace osgTessLOD
