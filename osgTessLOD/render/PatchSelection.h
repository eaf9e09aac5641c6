// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/AssetPages.h>
#include <osgTessLOD/render/ControlMeshDeformation.h>
#include <osgTessLOD/render/PatchRecords.h>
#include <osgTessLOD/render/Placements.h>
#include <osgTessLOD/render/SelectionOptions.h>
#include <osgTessLOD/render/SelectionStatistics.h>
#include <osgTessLOD/render/SelectionView.h>

#include <osg/Drawable>
#include <osg/Matrixd>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD {

class GpuAsset;
class PatchDraw;
class ShaderSelection;
struct DrawnRecords;
struct SelectionRequest;

/// Where records are drawn: the number of each one's placement in a set. Without a set, in the drawable's own space.
struct RecordPlacements {
    osg::ref_ptr<const Placements> set;
    std::vector<std::uint32_t> numbers;
};

/// The immutable result of one cull visit, and the leaf that draws it: the visible patches grouped by tessellation
/// factor. Brings the state that it is drawn with. Holds a reference to the shared asset; owns no GL objects.
class OSGTESSLOD_EXPORT PatchSelection : public osg::Drawable {
public:
    PatchSelection();
    /// Draws `records` in their order: consecutive ones of equal level go in one draw, so sort them by level. No side's
    /// level may be above its edge's finest. See PatchSelector. `asset` is not null; placements are as many as records, or none;
    /// the deformation is of the same LodAsset, or null.
    PatchSelection(const GpuAsset* asset, PatchRecords records, SelectionStatistics statistics,
                   const SelectionView& view, Backend backend = Backend::Auto, RecordPlacements placements = {},
                   osg::ref_ptr<const ControlMeshDeformation> deformation = nullptr);
    /// Has the control shader select when it is drawn, or PatchSelector, then, in contexts where the shader cannot. Records and
    /// statistics have all patches at the finest level that they may be drawn with.
    PatchSelection(const GpuAsset* asset, SelectionRequest request);
    PatchSelection(const PatchSelection& other, const osg::CopyOp& copyop = osg::CopyOp::SHALLOW_COPY);
    META_Object(osgTessLOD, PatchSelection)

    const PatchRecords& records() const { return _records; }
    const RecordPlacements& placements() const { return _placements; }
    /// Null: as the asset is.
    const ControlMeshDeformation* deformation() const { return _deformation.get(); }
    const SelectionStatistics& statistics() const { return _statistics; }
    /// Is the selection up to the time of the draw?
    bool isSelectedWhenDrawn() const { return _request != nullptr; }
    const SelectionView& view() const { return _view; }
    /// Its parts by the asset's materials, in their order, null where there is nothing of one; the selection itself, if the asset
    /// has one material or none.
    std::vector<osg::ref_ptr<PatchSelection>> byMaterial();
    /// What draws it in the context of `renderInfo`, which must be current: never Auto; nothing if the context cannot draw it.
    std::optional<Backend> backend(osg::RenderInfo& renderInfo) const;

    osg::BoundingBox computeBoundingBox() const override;
    void drawImplementation(osg::RenderInfo& renderInfo) const override;
    using osg::Drawable::accept;
    /// Reports how many triangles are drawn, or may be, to osgUtil's statistics; has no vertices to give.
    void accept(osg::PrimitiveFunctor& functor) const override;
    bool supports(const osg::PrimitiveFunctor&) const override { return true; }

    /// The triangles that the GPU makes of this selection, captured by transform feedback: of their corners, three per
    /// triangle, patch after patch, the vec3 that the shaders put out as `varying`; positions in the drawable's space if none is
    /// named.
    /// Needs the GL context current; leaves GL state as found. Empty if the context cannot draw the asset.
    std::vector<osg::Vec3f> capture(osg::RenderInfo& renderInfo,
                                    const std::string& varying = "tessLodObjectPosition") const;

protected:
    ~PatchSelection() override;

private:
    const ShaderSelection* shaderSelectionFor(osg::State& state) const;
    osg::ref_ptr<const PatchSelection> asDrawnIn(osg::State& state) const;
    std::vector<const osg::StateSet*> moreStates(osg::State& state) const;
    std::unique_ptr<PatchDraw> makeDraw(Backend backend, osg::State& state, const DrawnRecords& records) const;
    std::vector<PageDetail> neededDetail(const AssetPages& pages) const;
    unsigned neededNormals(const AssetPages& pages, std::size_t page) const;
    osg::ref_ptr<const PatchSelection> within(const AssetPages& pages, const AssetPages::Resident& resident) const;
    template <typename Draw>
    void forEachPage(osg::State& state, osg::StateSet& program, const AssetPages& pages,
                     const AssetPages::Resident& resident, const Draw& draw) const;
    template <typename Draw> void forEachPage(osg::State& state, osg::StateSet& program, const Draw& draw) const;
    template <typename Draw>
    void forEachDraw(const PatchRecords& records, std::uint64_t verticesPerDraw, const Draw& draw) const;

    osg::ref_ptr<const GpuAsset> _asset;
    PatchRecords _records;
    RecordPlacements _placements;
    osg::ref_ptr<const ControlMeshDeformation> _deformation;
    SelectionStatistics _statistics;
    SelectionView _view;
    Backend _backend = Backend::Auto; ///< asked for
    std::shared_ptr<const SelectionRequest> _request; ///< what is to be selected when it is drawn; null: nothing
    osg::ref_ptr<const osg::StateSet> _viewState;     ///< what the control shader selects by; null without a request
};

/// Told of each selection as it is made, during cull traversals: implementations must be thread safe and quick.
class OSGTESSLOD_EXPORT SelectionObserver : public osg::Referenced {
public:
    virtual void selected(const osg::Camera* camera, const osg::Matrixd& localToWorld,
                          const PatchSelection& selection) = 0;

protected:
    ~SelectionObserver() override = default;
};

} // namespace osgTessLOD
