// SPDX-License-Identifier: MIT
#include <render/GlTest.h>

namespace osgTessLOD {
namespace {

using HeadlessContext = GlTest;

TEST_F(HeadlessContext, givesACompatibilityContext)
{
    ASSERT_NE(glGetString(GL_VERSION), nullptr);
    glMatrixMode(GL_MODELVIEW); // an error in a core context
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    const auto* gl = state().get<osg::GLExtensions>();
    EXPECT_GE(gl->glVersion, 4.2F);
    EXPECT_TRUE(gl->areTessellationShadersSupported);
}

TEST_F(HeadlessContext, severalLiveSideBySideAndEndAlone)
{
    std::string error;
    for (int k = 0; k < 3; ++k) {
        const osg::ref_ptr<osg::GraphicsContext> other = createHeadlessContext(16 + k, 8, error);
        ASSERT_TRUE(other.valid()) << error;
        EXPECT_NE(other->getState()->getContextID(), context->getState()->getContextID());
        ASSERT_TRUE(other->realize());
        ASSERT_TRUE(other->makeCurrent());
        EXPECT_EQ(other->getTraits()->width, 16 + k);
        other->releaseContext();
    }
    ASSERT_TRUE(context->makeCurrent()); // the others' end took nothing along
    glClear(GL_COLOR_BUFFER_BIT);
}

TEST_F(HeadlessContext, sharesObjects)
{
    std::string error;
    const osg::ref_ptr<osg::GraphicsContext> other = createHeadlessContext(16, 16, error, context.get());
    ASSERT_TRUE(other.valid()) << error;
    EXPECT_EQ(other->getState()->getContextID(), context->getState()->getContextID());
    GLuint texture = 0;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    context->releaseContext();
    ASSERT_TRUE(other->realize());
    ASSERT_TRUE(other->makeCurrent());
    EXPECT_TRUE(glIsTexture(texture));
    other->releaseContext();
    ASSERT_TRUE(context->makeCurrent());
}

TEST(HeadlessContextErrors, sizeMustBePositive)
{
    std::string error;
    EXPECT_FALSE(createHeadlessContext(0, 10, error).valid());
    EXPECT_NE(error, "");
}

} // namespace
} // namespace osgTessLOD
