// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/asset/StreamedAsset.h>
#include <osgTessLOD/render/TexelBuffer.h>

#include <osg/BoundingSphere>
#include <osg/Referenced>
#include <osg/State>
#include <osg/StateSet>
#include <osg/ref_ptr>

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

namespace osgTessLOD {

/// How much there is of a page: its levels and its resolutions of normals, each counted from the coarsest.
struct PageDetail {
    unsigned levels = 0;
    unsigned normals = 0;

    bool covers(const PageDetail& o) const { return levels >= o.levels && normals >= o.normals; }
    bool operator==(const PageDetail& o) const { return levels == o.levels && normals == o.normals; }
    /// What both cover.
    static PageDetail common(const PageDetail& a, const PageDetail& b)
    {
        return {std::min(a.levels, b.levels), std::min(a.normals, b.normals)};
    }
    /// What covers both and no more.
    static PageDetail both(const PageDetail& a, const PageDetail& b)
    {
        return {std::max(a.levels, b.levels), std::max(a.normals, b.normals)};
    }
};

/// Consecutive patches of an asset and the texture buffers with all that the shaders read of them. Numbers within a page
/// count from its first patch and its first vertex: the shaders subtract tessLodFirstPatch and know nothing of pages. Levels
/// come one after the other, so that a page of fewer levels has the same numbers.
struct OSGTESSLOD_EXPORT AssetPage {
    std::uint32_t firstPatch;
    std::uint32_t patchCount;
    PageDetail detail;
    std::vector<TexelBuffer> buffers;
    osg::ref_ptr<osg::StateSet> state; ///< the buffers, and the uniforms and defines that go with them

    std::uint64_t bytes() const; ///< of the buffers
    void releaseGLObjects(osg::State* of) const;
    void resizeGLObjectBuffers(unsigned maxSize) const;
};

/// An asset in pages none of whose buffers has more texels than a context allows. What neighbours on two pages share, both
/// have, with the same bits: borders stay closed. Of each page there is as much as VideoMemory lets it have; all of it is made
/// of the asset when it is first needed.
class OSGTESSLOD_EXPORT AssetPages : public osg::Referenced {
public:
    /// Texture units of the buffers: out of the way of units that applications use. Each is used by assets that have what it
    /// is for; parameters only where there are normals or a deformation.
    static constexpr unsigned kColorsUnit = 10;
    static constexpr unsigned kUvsUnit = 11;
    static constexpr unsigned kParametersUnit = 12;
    static constexpr unsigned kVerticesUnit = 13;
    static constexpr unsigned kPatchTableUnit = 14;
    static constexpr unsigned kNormalsUnit = 15;
    static constexpr unsigned kDeformedPatchesUnit = 16; ///< with a deformation
    /// Most levels that the shaders know: factors 1, 2, 4, 6 … 64.
    static constexpr std::size_t kMaxLevels = 33;
    /// Of a page that nobody needs there are the levels up to this factor, and normals of twice it.
    static constexpr unsigned kLeastFactor = StreamedAsset::kLeastFactor;

    /// One per page. What is drawn with them keeps them.
    using Resident = std::vector<std::shared_ptr<const AssetPage>>;

    /// The asset must outlive the pages. Throws AssetError if the least of them cannot be read. A page has one patch at least: without normals, any fits the 65,536 texels that every context
    /// allows. Where one patch's normals would need more than `maxTexels`, their finest resolutions are left out.
    AssetPages(const StreamedAsset& asset, std::int64_t maxTexels);

    std::size_t size() const { return _ranges.size(); }
    /// Index of the page that has the patch.
    std::size_t pageOf(std::uint32_t patch) const;
    /// Around the patches of a page, asset frame, and the largest radius of one of its patches' spheres.
    struct Extent {
        osg::BoundingSphere sphere;
        double patchRadius = 0.0;
    };
    const Extent& extent(std::size_t page) const { return _ranges[page].extent; }

    /// All that the asset has and that can be read.
    PageDetail whole() const;
    /// What is read of `detail`, of which reading the next goes on in another thread.
    PageDetail readAhead(const PageDetail& detail) const;
    /// What there always is of a page: nothing is drawn coarser, and no seam without its own level.
    PageDetail least(std::size_t page) const { return _ranges[page].least; }
    /// Makes a page anew, of what can be read of `detail`.
    std::shared_ptr<const AssetPage> make(std::size_t page, const PageDetail& detail) const;
    /// Bytes that it would have.
    std::uint64_t bytes(std::size_t page, const PageDetail& detail) const;

    /// The pages to draw with in the context of `state`, which must be current, in its present frame, where this much of them is
    /// needed (of pages that are not drawn, nothing). They may be coarser: see VideoMemory.
    Resident acquire(const osg::State& state, const std::vector<PageDetail>& needed) const;
    /// As they are now.
    Resident resident() const;

    /// For each page what the shaders read of it beside, where there is a deformation (tesslod_deformation.glsl): base vertices, and
    /// parameters where there are no normals. Made when first asked for; any thread.
    const std::vector<AssetPage>& deformedPages() const;

    void compileGLObjects(osg::State& state) const;
    void releaseGLObjects(osg::State* state) const;
    void resizeGLObjectBuffers(unsigned maxSize);

protected:
    ~AssetPages() override;

private:
    friend class VideoMemory;
    class Layout;
    class Maker;

    struct Range {
        std::uint32_t firstPatch;
        std::uint32_t patchCount;
        Extent extent;
        PageDetail least;
    };
    /// What there is of a page, and who needs it.
    struct Slot {
        std::shared_ptr<const AssetPage> page;
        PageDetail needed;    ///< in `frame`
        std::uint64_t frame;  ///< when it was drawn last
    };
    struct Snapshot {
        std::uint64_t frame;
        Resident pages;
    };

    template <typename Visit> void forEachMade(const Visit& visit) const;
    Range range(std::uint32_t first, std::uint32_t end) const;

    PageDetail read(const PageDetail& detail) const;
    void warnOfFault() const;

    const StreamedAsset& _source;
    const LodAsset& _asset; ///< its frame
    std::unique_ptr<const Layout> _layout;
    std::vector<Range> _ranges;
    mutable std::vector<Slot> _slots;               ///< VideoMemory's, under its lock
    mutable std::map<unsigned, Snapshot> _snapshots; ///< likewise; by context
    mutable std::mutex _mutex;                      ///< of what follows
    mutable std::vector<AssetPage> _deformedPages;
};

} // namespace osgTessLOD
