// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/AssetPages.h>

#include <osgTessLOD/asset/AssetError.h>
#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/GlConstants.h>
#include <osgTessLOD/render/VideoMemory.h>

#include <osg/Notify>
#include <osg/Uniform>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>

namespace osgTessLOD {

namespace {

/// A number per level; `otherwise` for those that do not exist.
template <class Number>
osg::ref_ptr<osg::Uniform> levelUniform(const char* name, const std::vector<Number>& numbers, int otherwise)
{
    constexpr auto kMaxLevels = static_cast<unsigned>(AssetPages::kMaxLevels);
    osg::ref_ptr<osg::Uniform> uniform = new osg::Uniform(osg::Uniform::INT, name, kMaxLevels);
    for (unsigned k = 0; k < kMaxLevels; ++k) {
        uniform->setElement(k, k < numbers.size() ? static_cast<int>(numbers[k]) : otherwise);
    }
    return uniform;
}

/// Resolutions of normals, from the coarsest, that one patch has room for.
std::size_t normalLevelCount(const NormalTexture& normals, std::int64_t maxTexels)
{
    std::size_t count = 0;
    std::int64_t texels = 0;
    while (count < normals.levels.size()) {
        texels += NormalTexture::texelCount(1U << count);
        if (texels > maxTexels) { break; }
        ++count;
    }
    return count;
}

GLuint floatBits(float number)
{
    GLuint bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    return bits;
}

/// Of the weights of corners 1 and 2, over the base triangle; 0 where it has no area.
std::array<osg::Vec3d, 2> weightGradients(const LodAsset& asset, const LodPatch& patch)
{
    std::array<osg::Vec3d, 3> corners;
    for (std::size_t c = 0; c < 3; ++c) {
        const auto& at = asset.baseVertices[patch.baseVertices[c]];
        corners[c] = osg::Vec3d(at[0], at[1], at[2]) * double{asset.lattice.step};
    }
    const osg::Vec3d a = corners[1] - corners[0];
    const osg::Vec3d b = corners[2] - corners[0];
    const osg::Vec3d normal = a ^ b;
    const double squared = normal.length2();
    if (!(squared > 0.0)) { return {}; }
    return {(b ^ normal) / squared, (normal ^ a) / squared};
}

} // namespace

/// Where what is in an asset's pages.
class AssetPages::Layout {
public:
    Layout(const LodAsset& asset, std::int64_t maxTexels)
        : _asset(asset)
        , _maxTexels(maxTexels)
        , _normalLevels(normalLevelCount(asset.normals, maxTexels))
    {
        for (const std::uint16_t factor : asset.ladder) {
            _vertexCounts.push_back(TessellationPattern::vertexCount(factor));
        }
        for (std::size_t level = 0; level < asset.levels.size(); ++level) {
            std::vector<std::size_t>& before = _slotsBefore.emplace_back(1, 0);
            for (const LodPatch& patch : asset.patches) {
                before.push_back(before.back() + (patch.finestLevel >= level ? 1 : 0));
            }
        }
    }

    /// The first patch that has no place on a page that begins with `first`.
    std::uint32_t endOfPage(std::uint32_t first) const
    {
        std::int64_t vertices = 0;
        std::int64_t rows = 0;
        std::int64_t normals = 0;
        std::uint32_t end = first;
        for (; end < _asset.patches.size(); ++end) {
            for (std::size_t level = 0; level <= _asset.patches[end].finestLevel; ++level) {
                vertices += static_cast<std::int64_t>(_vertexCounts[level]);
            }
            rows += static_cast<std::int64_t>(rowSize(_asset.levels.size()));
            normals += static_cast<std::int64_t>(normalTexels(_normalLevels));
            if (end > first && std::max({vertices, rows, normals}) > _maxTexels) { break; }
        }
        return end;
    }

    PageDetail whole() const
    {
        return {static_cast<unsigned>(_asset.levels.size()), static_cast<unsigned>(_normalLevels)};
    }

    std::size_t vertexCount(std::size_t level) const { return _vertexCounts[level]; }
    /// Patches that come before and reach the level.
    std::size_t slotsBefore(std::size_t level, std::uint32_t patch) const { return _slotsBefore[level][patch]; }
    /// Of the level, of the patches from `first` on and before `end`.
    std::size_t verticesOf(std::size_t level, std::uint32_t first, std::uint32_t end) const
    {
        return (slotsBefore(level, end) - slotsBefore(level, first)) * _vertexCounts[level];
    }
    /// Numbers per patch in the patch table.
    static std::size_t rowSize(std::size_t levels) { return 3 + levels; }
    /// Of one patch at so many resolutions.
    static std::uint64_t normalTexels(std::size_t resolutions)
    {
        std::uint64_t texels = 0;
        for (std::size_t k = 0; k < resolutions; ++k) { texels += NormalTexture::texelCount(1U << k); }
        return texels;
    }

private:
    const LodAsset& _asset;
    std::int64_t _maxTexels;
    std::size_t _normalLevels;
    std::vector<std::size_t> _vertexCounts;             ///< of one patch, per level
    std::vector<std::vector<std::size_t>> _slotsBefore; ///< per level and patch
};

/// Makes pages.
class AssetPages::Maker {
public:
    Maker(const StreamedAsset& source, const Layout& layout)
        : _source(source)
        , _asset(source.frame())
        , _layout(layout)
    {
    }

    AssetPage page(std::uint32_t first, std::uint32_t end, const PageDetail& detail)
    {
        _page = AssetPage{first, end - first, detail, {}, new osg::StateSet};
        addUniforms();
        addPatchTable();
        const osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
        for (std::size_t level = 0; level < detail.levels; ++level) {
            forVertices(level, [&](std::size_t v) {
                const std::uint64_t bits = _asset.levels[level].vertices[v].bits;
                words->push_back(static_cast<GLuint>(bits & 0xFFFFFFFFU));
                words->push_back(static_cast<GLuint>(bits >> 32));
            });
        }
        addBuffer(words.get(), GL_RG32UI, 2, AssetPages::kVerticesUnit, "tessLodVertices");
        if (detail.normals > 0) {
            addNormals();
            addParameters();
        }
        addVertexWords(_asset.hasUvs(), &LodLevel::uvs, AssetPages::kUvsUnit, "TESSLOD_UVS", "tessLodUvs");
        addVertexWords(_asset.hasColors(), &LodLevel::colors, AssetPages::kColorsUnit, "TESSLOD_COLORS", "tessLodColors");
        return std::move(_page);
    }

    AssetPage deformedPage(std::uint32_t first, std::uint32_t end, const PageDetail& detail)
    {
        _page = AssetPage{first, end - first, detail, {}, new osg::StateSet};
        addDeformedPatches();
        if (_page.detail.normals == 0) { addParameters(); }
        return std::move(_page);
    }

private:
    std::uint32_t end() const { return _page.firstPatch + _page.patchCount; }

    /// Calls visit(index in the level's vertices) for all of the page.
    template <class Visit> void forVertices(std::size_t level, const Visit& visit) const
    {
        const std::size_t count = _layout.vertexCount(level);
        const std::size_t last = _layout.slotsBefore(level, end()) * count;
        for (std::size_t v = _layout.slotsBefore(level, _page.firstPatch) * count; v < last; ++v) { visit(v); }
    }

    std::size_t verticesOf(std::size_t level) const { return _layout.verticesOf(level, _page.firstPatch, end()); }

    void addBuffer(osg::Array* array, GLenum format, std::size_t numbersPerTexel, unsigned unit, const char* sampler)
    {
        _page.buffers.push_back(TexelBuffer::make(*_page.state, array, format, numbersPerTexel, unit, sampler));
    }

    /// A word of each vertex of those levels that have any, one level after the other. Shifts: what to take off a vertex's
    /// index for that of its word; −1 for levels without; null where all levels have words or none. Nothing is added unless some
    /// level of the asset `hasWords`; where none of the page's has, the shaders are told of words all the same: they are the same ones.
    void addVertexWords(bool hasWords, std::vector<std::uint32_t> LodLevel::*wordsOfLevel, unsigned unit,
                        const char* define, const char* sampler, const char* shiftUniform = nullptr)
    {
        const osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
        std::vector<std::int32_t> shifts;
        std::size_t without = 0; // vertices before the level that have no words
        if (!hasWords) { return; }
        for (std::size_t level = 0; level < _page.detail.levels; ++level) {
            const std::vector<std::uint32_t>& all = _asset.levels[level].*wordsOfLevel;
            shifts.push_back(all.empty() ? -1 : static_cast<std::int32_t>(without));
            if (all.empty()) {
                without += verticesOf(level);
            } else {
                forVertices(level, [&](std::size_t v) { words->push_back(all[v]); });
            }
        }
        if (words->empty()) { words->push_back(0); }
        addBuffer(words.get(), GL_R32UI, 1, unit, sampler);
        _page.state->setDefine(define);
        if (shiftUniform != nullptr) { _page.state->addUniform(levelUniform(shiftUniform, shifts, -1).get()); }
    }

    void addParameters()
    {
        bool hasParameters = false;
        for (std::size_t level = 0; level < _asset.levels.size(); ++level) {
            hasParameters = hasParameters || _source.hasParameters(level);
        }
        addVertexWords(hasParameters, &LodLevel::parameters, AssetPages::kParametersUnit, "TESSLOD_PARAMETERS",
                       "tessLodParameters", "tessLodParameterShifts");
    }

    /// Per patch its base vertices in rising order and the corners that they are; then the gradients of the weights of corners 1 and 2.
    void addDeformedPatches()
    {
        const osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
        for (std::uint32_t p = _page.firstPatch; p < end(); ++p) {
            const auto& baseVertices = _asset.patches[p].baseVertices;
            std::array<std::uint32_t, 3> corners{0, 1, 2};
            std::sort(corners.begin(), corners.end(),
                      [&](std::uint32_t a, std::uint32_t b) { return baseVertices[a] < baseVertices[b]; });
            for (const std::uint32_t corner : corners) { words->push_back(baseVertices[corner]); }
            words->push_back(corners[0] | corners[1] << 2 | corners[2] << 4);
            for (const osg::Vec3d& gradient : weightGradients(_asset, _asset.patches[p])) {
                for (int axis = 0; axis < 3; ++axis) {
                    words->push_back(floatBits(static_cast<float>(gradient[axis])));
                }
                words->push_back(0);
            }
        }
        addBuffer(words.get(), GL_RGBA32UI, 4, AssetPages::kDeformedPatchesUnit, "tessLodDeformedPatches");
    }

    void addUniforms()
    {
        osg::StateSet& state = *_page.state;
        state.addUniform(new osg::Uniform("tessLodFirstPatch", static_cast<int>(_page.firstPatch)));
        state.addUniform(new osg::Uniform("tessLodStep", _asset.lattice.step));
        state.addUniform(new osg::Uniform("tessLodLevelCount", static_cast<int>(_page.detail.levels)));
        state.addUniform(levelUniform("tessLodFactors", _asset.ladder, 1).get());
        if (!_asset.hasUvs()) { return; }
        const auto& [origin, step] = _asset.uvLattice;
        state.addUniform(new osg::Uniform("tessLodUvOrigin", osg::Vec2f(origin[0], origin[1])));
        state.addUniform(new osg::Uniform("tessLodUvStep", osg::Vec2f(step[0], step[1])));
        state.addUniform(new osg::Uniform("tessLodColorTexture", 0)); // the scene's, of unit 0
    }

    /// Per patch its lattice origin, then per level the page's index of its first vertex.
    void addPatchTable()
    {
        const osg::ref_ptr<osg::IntArray> table = new osg::IntArray;
        for (std::uint32_t p = _page.firstPatch; p < end(); ++p) {
            std::size_t ofLevel = 0;
            const LodPatch& patch = _asset.patches[p];
            table->insert(table->end(), patch.latticeOrigin.begin(), patch.latticeOrigin.end());
            for (std::size_t level = 0; level < _page.detail.levels; ++level) {
                const std::size_t slot = _layout.slotsBefore(level, p) - _layout.slotsBefore(level, _page.firstPatch);
                const bool reaches = patch.finestLevel >= level;
                table->push_back(reaches ? static_cast<GLint>(ofLevel + slot * _layout.vertexCount(level)) : -1);
                ofLevel += verticesOf(level);
            }
        }
        addBuffer(table.get(), GL_R32I, 1, AssetPages::kPatchTableUnit, "tessLodPatchTable");
    }

    void addNormals()
    {
        const osg::ref_ptr<osg::UIntArray> words = new osg::UIntArray;
        for (std::size_t level = 0; level < _page.detail.normals; ++level) {
            const auto& texels = _asset.normals.levels[level];
            const auto count = static_cast<std::ptrdiff_t>(NormalTexture::texelCount(1U << level));
            words->insert(words->end(), texels.begin() + _page.firstPatch * count, texels.begin() + end() * count);
        }
        addBuffer(words.get(), GL_R32UI, 1, AssetPages::kNormalsUnit, "tessLodNormals");
        osg::StateSet& state = *_page.state;
        state.setDefine("TESSLOD_NORMALS");
        state.addUniform(new osg::Uniform("tessLodPatchCount", static_cast<int>(_page.patchCount)));
        state.addUniform(new osg::Uniform("tessLodNormalLevelCount", static_cast<int>(_page.detail.normals)));
    }

    const StreamedAsset& _source;
    const LodAsset& _asset; ///< its frame
    const Layout& _layout;
    AssetPage _page; ///< being made
};

std::uint64_t AssetPage::bytes() const
{
    std::uint64_t sum = 0;
    for (const TexelBuffer& buffer : buffers) { sum += buffer.data->getTotalDataSize(); }
    return sum;
}

void AssetPage::releaseGLObjects(osg::State* of) const
{
    state->releaseGLObjects(of);
    for (const TexelBuffer& buffer : buffers) { buffer.releaseGLObjects(of); }
}

void AssetPage::resizeGLObjectBuffers(unsigned maxSize) const
{
    state->resizeGLObjectBuffers(maxSize);
    for (const TexelBuffer& buffer : buffers) { buffer.resizeGLObjectBuffers(maxSize); }
}

AssetPages::AssetPages(const StreamedAsset& asset, std::int64_t maxTexels)
    : _source(asset)
    , _asset(asset.frame())
    , _layout(std::make_unique<const Layout>(_asset, maxTexels))
{
    PageDetail least;
    for (std::uint32_t first = 0; first < _asset.patches.size();) {
        const std::uint32_t end = _layout->endOfPage(first);
        _ranges.push_back(range(first, end));
        least = PageDetail::both(least, _ranges.back().least);
        first = end;
    }
    _source.read(least.levels, least.normals);
    if (!whole().covers(least)) { throw AssetError(_source.takeFault()); }
    VideoMemory::shared().add(*this);
}

AssetPages::~AssetPages()
{
    VideoMemory::shared().remove(*this);
}

PageDetail AssetPages::whole() const
{
    return PageDetail::common(_layout->whole(), {_source.levelCount(), _source.normalCount()});
}

void AssetPages::warnOfFault() const
{
    const std::string fault = _source.takeFault();
    if (!fault.empty()) { OSG_WARN << "osgTessLOD: what is finer is not shown: " << fault << std::endl; }
}

/// Reads, and returns what of it there is.
PageDetail AssetPages::read(const PageDetail& detail) const
{
    const PageDetail wanted = PageDetail::common(detail, whole());
    _source.read(wanted.levels, wanted.normals);
    warnOfFault();
    return PageDetail::common(wanted, whole());
}

PageDetail AssetPages::readAhead(const PageDetail& detail) const
{
    const PageDetail wanted = PageDetail::common(detail, whole());
    _source.readAhead(wanted.levels, wanted.normals);
    warnOfFault();
    return PageDetail::common(wanted, {_source.levelsRead(), _source.normalsRead()});
}

/// Of the patches from `first` on, before `end`.
AssetPages::Range AssetPages::range(std::uint32_t first, std::uint32_t end) const
{
    Range range{first, end - first, {}, {}};
    const PageDetail whole = _layout->whole();
    unsigned levels = _asset.levelsUpTo(kLeastFactor);
    for (std::uint32_t p = first; p < end; ++p) {
        const LodPatch& patch = _asset.patches[p];
        const osg::Vec3f center(patch.boundCenter[0], patch.boundCenter[1], patch.boundCenter[2]);
        range.extent.sphere.expandBy(osg::BoundingSphere(center, patch.boundRadius));
        range.extent.patchRadius = std::max(range.extent.patchRadius, double{patch.boundRadius});
        for (const std::uint32_t edge : patch.edges) {
            levels = std::max<unsigned>(levels, _asset.edges[edge].coarsestLevel + 1U);
        }
    }
    constexpr unsigned kLeastNormals = 5; // resolutions 1, 2, 4 … 2 · kLeastFactor
    range.least = {levels, std::min(whole.normals, kLeastNormals)};
    return range;
}

std::shared_ptr<const AssetPage> AssetPages::make(std::size_t page, const PageDetail& detail) const
{
    const auto& [first, count, extent, least] = _ranges[page];
    return std::make_shared<const AssetPage>(Maker(_source, *_layout).page(first, first + count, read(detail)));
}

std::uint64_t AssetPages::bytes(std::size_t page, const PageDetail& detail) const
{
    const auto& [first, count, extent, least] = _ranges[page];
    constexpr std::uint64_t kWord = 4;
    std::uint64_t bytes = kWord * count * (Layout::rowSize(detail.levels) + Layout::normalTexels(detail.normals));
    const std::uint64_t attributes = (_asset.hasUvs() ? 1 : 0) + (_asset.hasColors() ? 1 : 0);
    for (std::size_t level = 0; level < detail.levels; ++level) {
        const std::uint64_t words = attributes + (detail.normals > 0 && _source.hasParameters(level) ? 1 : 0);
        bytes += (sizeof(LodVertex) + words * kWord) * _layout->verticesOf(level, first, first + count);
    }
    return bytes;
}

std::size_t AssetPages::pageOf(std::uint32_t patch) const
{
    const auto after = std::upper_bound(_ranges.begin(), _ranges.end(), patch,
                                        [](std::uint32_t p, const Range& range) { return p < range.firstPatch; });
    return static_cast<std::size_t>(after - _ranges.begin()) - 1;
}

AssetPages::Resident AssetPages::acquire(const osg::State& state, const std::vector<PageDetail>& needed) const
{
    if (!VideoMemory::shared().limits().any()) { // now, while nobody has to wait for it
        PageDetail most;
        for (const PageDetail& detail : needed) { most = PageDetail::both(most, detail); }
        read(most);
    }
    return VideoMemory::shared().acquire(*this, state, needed);
}

AssetPages::Resident AssetPages::resident() const
{
    return VideoMemory::shared().resident(*this);
}

const std::vector<AssetPage>& AssetPages::deformedPages() const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    if (_deformedPages.empty()) {
        Maker maker(_source, *_layout);
        const PageDetail detail = read(whole());
        for (const Range& range : _ranges) {
            _deformedPages.push_back(maker.deformedPage(range.firstPatch, range.firstPatch + range.patchCount, detail));
        }
    }
    return _deformedPages;
}

/// Calls visit(page) for all that there are.
template <typename Visit> void AssetPages::forEachMade(const Visit& visit) const
{
    for (const auto& page : resident()) { visit(*page); }
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const AssetPage& page : _deformedPages) { visit(page); }
}

void AssetPages::compileGLObjects(osg::State& state) const
{
    for (const auto& page : resident()) { page->state->compileGLObjects(state); }
}

void AssetPages::releaseGLObjects(osg::State* state) const
{
    forEachMade([state](const AssetPage& page) { page.releaseGLObjects(state); });
}

void AssetPages::resizeGLObjectBuffers(unsigned maxSize)
{
    forEachMade([maxSize](const AssetPage& page) { page.resizeGLObjectBuffers(maxSize); });
}

} // namespace osgTessLOD
