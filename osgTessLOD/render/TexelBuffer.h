// SPDX-License-Identifier: MIT
#pragma once

#include <osg/Array>
#include <osg/StateSet>
#include <osg/TextureBuffer>
#include <osg/ref_ptr>

#include <cstddef>

namespace osgTessLOD {

/// Numbers that shaders read as a buffer texture. They have a buffer object of their own: osg::TextureBuffer knows no offsets.
struct TexelBuffer {
    unsigned unit; ///< texture unit
    osg::ref_ptr<osg::Array> data;
    osg::ref_ptr<osg::TextureBuffer> texture;

    /// Has `state` bind the texture, which is not empty, and name its unit to the sampler.
    static TexelBuffer make(osg::StateSet& state, osg::Array* data, GLenum format, std::size_t numbersPerTexel,
                            unsigned unit, const char* sampler);
    /// Releases the buffer. The texture goes with the StateSet's objects: release both.
    void releaseGLObjects(osg::State* state) const { data->getBufferObject()->releaseGLObjects(state); }
    void resizeGLObjectBuffers(unsigned maxSize) const { data->getBufferObject()->resizeGLObjectBuffers(maxSize); }
};

} // namespace osgTessLOD
