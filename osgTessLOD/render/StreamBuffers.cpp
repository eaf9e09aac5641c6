// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/StreamBuffers.h>

#include <osg/BufferObject>
#include <osg/FrameStamp>
#include <osg/GLExtensions>

#include <algorithm>
#include <cstring>
#include <iterator>

namespace osgTessLOD {

namespace {

using Block = StreamBuffers::Block;

/// Of the size and some of the content: cheap, as most contents that differ do so in many places; whether two are equal is looked at whole.
std::uint64_t keyOf(std::initializer_list<Block> blocks)
{
    constexpr std::size_t kSamples = 64;
    constexpr std::uint64_t kPrime = 0x100000001B3U; // FNV-1a's
    std::uint64_t key = 0xCBF29CE484222325U;
    const auto mix = [&](std::uint64_t word) { key = (key ^ word) * kPrime; };
    for (const Block& block : blocks) {
        mix(block.bytes);
        const std::size_t words = block.bytes / sizeof(std::uint64_t);
        const std::size_t step = std::max<std::size_t>(words / kSamples, 1);
        for (std::size_t k = 0; k < words; k += step) {
            std::uint64_t word = 0;
            std::memcpy(&word, static_cast<const std::uint8_t*>(block.data) + k * sizeof word, sizeof word);
            mix(word ^ word >> 32);
        }
    }
    return key;
}

std::size_t bytesOf(std::initializer_list<Block> blocks)
{
    std::size_t bytes = 0;
    for (const Block& block : blocks) { bytes += block.bytes; }
    return bytes;
}

bool holds(const std::vector<std::uint8_t>& content, std::initializer_list<Block> blocks)
{
    if (content.size() != bytesOf(blocks)) { return false; }
    const std::uint8_t* at = content.data();
    for (const Block& block : blocks) {
        if (block.bytes > 0 && std::memcmp(at, block.data, block.bytes) != 0) { return false; }
        at += block.bytes;
    }
    return true;
}

void fill(std::vector<std::uint8_t>& content, std::initializer_list<Block> blocks)
{
    content.clear();
    content.reserve(bytesOf(blocks));
    for (const Block& block : blocks) {
        const auto* first = static_cast<const std::uint8_t*>(block.data);
        content.insert(content.end(), first, first + block.bytes);
    }
}

} // namespace

StreamBuffers::Streams::iterator StreamBuffers::find(std::uint64_t key, std::initializer_list<Block> blocks)
{
    const auto [first, last] = _byKey.equal_range(key);
    for (auto entry = first; entry != last; ++entry) {
        if (holds(entry->second->content, blocks)) { return entry->second; }
    }
    return _streams.end();
}

/// A buffer to fill, which no key leads to: a new one, or the one used longest ago.
StreamBuffers::Streams::iterator StreamBuffers::claim(osg::State& state, unsigned frame)
{
    if (!_streams.empty()) {
        const auto oldest = std::prev(_streams.end());
        if (frame - oldest->frame >= kKeptFrames || _streams.size() >= kMost) {
            const auto [first, last] = _byKey.equal_range(oldest->key);
            _byKey.erase(std::find_if(first, last, [&](const auto& entry) { return entry.second == oldest; }));
            return oldest;
        }
    }
    _streams.emplace_front();
    state.get<osg::GLExtensions>()->glGenBuffers(1, &_streams.front().name);
    return _streams.begin();
}

void StreamBuffers::bind(osg::State& state, std::initializer_list<Block> blocks)
{
    const auto* gl = state.get<osg::GLExtensions>();
    const unsigned frame = state.getFrameStamp() != nullptr ? state.getFrameStamp()->getFrameNumber() : 0;
    const std::uint64_t key = keyOf(blocks);
    auto stream = find(key, blocks);
    const bool isNew = stream == _streams.end();
    if (isNew) {
        stream = claim(state, frame);
        stream->key = key;
        fill(stream->content, blocks);
        _byKey.emplace(key, stream);
    }
    stream->frame = frame;
    _streams.splice(_streams.begin(), _streams, stream);
    gl->glBindBuffer(GL_ARRAY_BUFFER_ARB, stream->name);
    if (!isNew) { return; }
    const auto bytes = static_cast<GLsizeiptr>(stream->content.size());
    _sentBytes += stream->content.size();
    // Fresh memory from the driver, as the last content may still be being read.
    gl->glBufferData(GL_ARRAY_BUFFER_ARB, bytes, nullptr, GL_STREAM_DRAW_ARB);
    gl->glBufferSubData(GL_ARRAY_BUFFER_ARB, 0, bytes, stream->content.data());
}

std::vector<unsigned> StreamBuffers::release()
{
    std::vector<unsigned> names;
    for (const Stream& stream : _streams) { names.push_back(stream.name); }
    _streams.clear();
    _byKey.clear();
    return names;
}

} // namespace osgTessLOD
