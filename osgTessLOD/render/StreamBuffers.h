// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <osg/State>

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <list>
#include <unordered_map>
#include <vector>

namespace osgTessLOD {

/// Vertex buffers of one context that draws fill anew, kept by what is in them: what a frame ago was drawn with the same content
/// (the camera stood still) is not sent again. A buffer that was not used for kKeptFrames serves for another content. Used by the
/// context's graphics thread only.
class OSGTESSLOD_EXPORT StreamBuffers {
public:
    static constexpr unsigned kKeptFrames = 2;
    /// Of buffers; beyond it the one used longest ago is filled anew at once. Where frames have no numbers nothing else does that.
    static constexpr std::size_t kMost = 1024;

    struct Block {
        const void* data;
        std::size_t bytes;
    };
    /// Binds a buffer that holds these one after the other to GL_ARRAY_BUFFER. The context of `state` must be current.
    void bind(osg::State& state, std::initializer_list<Block> blocks);
    /// Bytes sent by all calls of bind.
    std::uint64_t sentBytes() const { return _sentBytes; }
    /// The names of all buffers, which are forgotten and the caller's to delete.
    std::vector<unsigned> release();

private:
    struct Stream {
        unsigned name = 0;
        std::uint64_t key = 0;
        unsigned frame = 0; ///< when it was used last
        std::vector<std::uint8_t> content;
    };
    using Streams = std::list<Stream>;

    Streams::iterator find(std::uint64_t key, std::initializer_list<Block> blocks);
    Streams::iterator claim(osg::State& state, unsigned frame);

    std::uint64_t _sentBytes = 0;
    Streams _streams; ///< those used last first
    std::unordered_multimap<std::uint64_t, Streams::iterator> _byKey;
};

} // namespace osgTessLOD
