// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/ShaderSelection.h>

#include <osgTessLOD/render/GlConstants.h>

#include <osg/BufferObject>
#include <osg/Uniform>

#include <algorithm>
#include <array>
#include <cstring>

namespace osgTessLOD {

namespace {

constexpr std::size_t kTexelsBeforeErrors = 5;
constexpr std::size_t kTexelsPerLevel = 2;
constexpr std::size_t kWordsPerTexel = 4;

std::size_t texelsPerPatch(const PatchBlocks& blocks)
{
    return kTexelsBeforeErrors + kTexelsPerLevel * blocks.levelCount();
}

GLuint bitsOf(float x)
{
    GLuint bits = 0;
    std::memcpy(&bits, &x, sizeof(bits));
    return bits;
}

/// The words of one patch after another.
class RowWriter {
public:
    RowWriter(const PatchBlocks& blocks, std::uint32_t position, GLuint* at)
        : _blocks(blocks)
        , _block(position / PatchBlocks::kLanes)
        , _lane(position % PatchBlocks::kLanes)
        , _at(at)
    {
    }

    void write()
    {
        put(_blocks.spheres(_block));
        putBorders();
        for (std::size_t side = 0; side < 3; ++side) { put(_blocks.middles(_block)[side]); }
        for (std::size_t level = 0; level < _blocks.levelCount(); ++level) {
            const kernel::Errors& errors = _blocks.errors(_block)[level];
            for (const auto& q : errors.q) { put(q[_lane]); }
            put(errors.isotropic[_lane]);
            put(0.0F);
        }
    }

private:
    void put(float x) { *_at++ = bitsOf(x); }
    void put(const kernel::Spheres& spheres)
    {
        for (const float* row : {spheres.x, spheres.y, spheres.z, spheres.radius}) { put(row[_lane]); }
    }
    void putBorders()
    {
        const kernel::Borders& borders = _blocks.borders(_block);
        auto levels = static_cast<GLuint>(borders.reach[_lane]) << 24;
        for (std::size_t side = 0; side < 3; ++side) {
            const std::uint32_t twin = borders.twins[side][_lane];
            const kernel::Borders& ofTwin = _blocks.borders(twin / PatchBlocks::kLanes);
            *_at++ = 3 * ofTwin.numbers[twin % PatchBlocks::kLanes] + borders.twinSides[side][_lane];
            levels |= static_cast<GLuint>(borders.finest[side][_lane]) << (8 * side);
            levels |= static_cast<GLuint>(borders.coarsest[side][_lane]) << (8 * side + 4);
        }
        *_at++ = levels;
    }

    const PatchBlocks& _blocks;
    std::uint32_t _block;
    std::uint32_t _lane;
    GLuint* _at;
};

osg::ref_ptr<osg::UIntArray> wordsOf(const PatchBlocks& blocks)
{
    const std::size_t rowWords = kWordsPerTexel * texelsPerPatch(blocks);
    osg::ref_ptr<osg::UIntArray> words =
        new osg::UIntArray(static_cast<unsigned>(rowWords * std::max<std::size_t>(1, blocks.patchCount())));
    for (std::uint32_t position = 0; position < blocks.patchCount(); ++position) {
        const kernel::Borders& borders = blocks.borders(position / PatchBlocks::kLanes);
        RowWriter(blocks, position, &(*words)[rowWords * borders.numbers[position % PatchBlocks::kLanes]]).write();
    }
    return words;
}

osg::ref_ptr<osg::UIntArray> numbersByReach(const PatchBlocks& blocks)
{
    osg::ref_ptr<osg::UIntArray> numbers = new osg::UIntArray;
    for (std::size_t reach = 0; reach < blocks.levelCount(); ++reach) {
        for (std::uint32_t position = 0; position < blocks.patchCount(); ++position) {
            const kernel::Borders& borders = blocks.borders(position / PatchBlocks::kLanes);
            const std::uint32_t lane = position % PatchBlocks::kLanes;
            if (static_cast<std::size_t>(borders.reach[lane]) == reach) { numbers->push_back(borders.numbers[lane]); }
        }
    }
    return numbers;
}

osg::Vec3f vec3(const float* v)
{
    return {v[0], v[1], v[2]};
}

} // namespace

ShaderSelection::ShaderSelection(const PatchBlocks& blocks, const AssetPages& pages)
    : _pages(pages)
    , _page(pages.make(0, pages.whole()))
    , _state(new osg::StateSet)
    , _patches(numbersByReach(blocks))
{
    _needs = TexelBuffer::make(*_state, wordsOf(blocks).get(), GL_RGBA32UI, kWordsPerTexel, kUnit, "tessLodNeeds");
    _state->setDefine("TESSLOD_SELECTION");
    const osg::ref_ptr<osg::VertexBufferObject> object = new osg::VertexBufferObject;
    object->setUsage(GL_STATIC_DRAW_ARB);
    _patches->setBufferObject(object.get());
}

ShaderSelection::~ShaderSelection() = default;

std::int64_t ShaderSelection::texelCount(const PatchBlocks& blocks)
{
    return static_cast<std::int64_t>(texelsPerPatch(blocks) * blocks.patchCount());
}

osg::ref_ptr<osg::StateSet> ShaderSelection::viewState(const PatchSelector& selector, const SelectionRequest& request)
{
    const kernel::View view = selector.kernelView(request.view, request.options);
    osg::ref_ptr<osg::StateSet> state = new osg::StateSet;
    state->addUniform(new osg::Uniform("tessLodEyeHigh", vec3(view.eyeHigh)));
    state->addUniform(new osg::Uniform("tessLodEyeLow", vec3(view.eyeLow)));
    state->addUniform(new osg::Uniform("tessLodAxis", vec3(view.axis)));
    state->addUniform(new osg::Uniform("tessLodSlope", view.slope));
    state->addUniform(new osg::Uniform("tessLodLeastCosine", view.leastCosine));
    state->addUniform(new osg::Uniform("tessLodTopLevel", view.top));
    state->addUniform(new osg::Uniform("tessLodOrthographic", view.orthographic));
    state->addUniform(new osg::Uniform("tessLodConservative", view.conservative));
    state->addUniform(new osg::Uniform("tessLodIsotropic", view.isotropic));
    const std::size_t planeCount =
        request.options.cullPatches ? std::min(request.frustum.size(), kMostPlanes) : std::size_t{0};
    const osg::ref_ptr<osg::Uniform> planes =
        new osg::Uniform(osg::Uniform::FLOAT_VEC4, "tessLodPlanes", static_cast<int>(kMostPlanes));
    for (std::size_t k = 0; k < planeCount; ++k) {
        planes->setElement(static_cast<unsigned>(k), osg::Vec4f(selector.blocks().planeInUnits(request.frustum[k])));
    }
    state->addUniform(new osg::Uniform("tessLodPlaneCount", static_cast<int>(planeCount)));
    state->addUniform(planes.get());
    return state;
}

void ShaderSelection::releaseGLObjects(osg::State* state) const
{
    _page->releaseGLObjects(state);
    _state->releaseGLObjects(state);
    _needs.releaseGLObjects(state);
    _patches->getBufferObject()->releaseGLObjects(state);
}

void ShaderSelection::resizeGLObjectBuffers(unsigned maxSize) const
{
    _page->resizeGLObjectBuffers(maxSize);
    _state->resizeGLObjectBuffers(maxSize);
    _needs.resizeGLObjectBuffers(maxSize);
    _patches->getBufferObject()->resizeGLObjectBuffers(maxSize);
}

} // namespace osgTessLOD
