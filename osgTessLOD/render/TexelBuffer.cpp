// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/TexelBuffer.h>

#include <osg/BufferObject>
#include <osg/Uniform>

namespace osgTessLOD {

TexelBuffer TexelBuffer::make(osg::StateSet& state, osg::Array* data, GLenum format, std::size_t numbersPerTexel,
                              unsigned unit, const char* sampler)
{
    osg::ref_ptr<osg::VertexBufferObject> object = new osg::VertexBufferObject;
    object->setUsage(GL_STATIC_DRAW_ARB);
    data->setBufferObject(object.get());
    osg::ref_ptr<osg::TextureBuffer> texture = new osg::TextureBuffer(data);
    texture->setInternalFormat(static_cast<GLint>(format));
    texture->setTextureWidth(static_cast<int>(data->getNumElements() / numbersPerTexel));
    // Protected: a texture that a shadow technique puts over the scene has no business here.
    state.setTextureAttribute(unit, texture.get(), osg::StateAttribute::ON | osg::StateAttribute::PROTECTED);
    state.addUniform(new osg::Uniform(sampler, static_cast<int>(unit)));
    return {unit, data, texture};
}

} // namespace osgTessLOD
