// SPDX-License-Identifier: MIT
#include "GpuBytes.h"
#include "LodScene.h"

#include <osgTessLOD/asset/TessellationPattern.h>
#include <osgTessLOD/render/GpuAsset.h>
#include <osgTessLOD/render/MorphedSurface.h>
#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/PatchSelector.h>
#include <osgTessLOD/render/TessLODInstances.h>
#include <osgtesslodviewer/SelectionTotals.h>
#include <support/ScreenDeviation.h>

#include <osg/MatrixTransform>

#include <stdexcept>
#include <utility>

namespace osgTessLOD::benchmarks {

namespace {

class TessLodScene : public LodScene {
public:
    TessLodScene(std::shared_ptr<const LodAsset> asset, const SelectionOptions& options, const Eigen::Vector3d& center)
        : _drawable(new TessLODDrawable(asset))
        , _instances(new TessLODInstances)
        , _options(options)
        , _totals({_drawable, _instances})
        , _gpuBytes(osgTessLOD::benchmarks::gpuBytes(*asset).all())
    {
        _instances->shareAsset(*_drawable);
        const auto& origin = asset->lattice.origin;
        _assetToModel = osg::Matrixd::translate(origin[0] - center.x(), origin[1] - center.y(), origin[2] - center.z());
    }

    void place(const std::vector<osg::Matrixd>& placements) override
    {
        _placements = placements;
        _root->removeChildren(0, _root->getNumChildren());
        std::vector<osg::Matrixd> ofAsset;
        for (const osg::Matrixd& placement : placements) { ofAsset.push_back(_assetToModel * placement); }
        if (placements.size() == 1) {
            const osg::ref_ptr<osg::MatrixTransform> transform = new osg::MatrixTransform(ofAsset.front());
            transform->addChild(_drawable.get());
            _root->addChild(transform.get());
        } else {
            _instances->setPlacements(ofAsset);
            _root->addChild(_instances.get());
        }
    }
    void ask(double errorPixels, double) override
    {
        _options.errorPixels = errorPixels;
        _drawable->setOptions(_options);
        _instances->setOptions(_options);
    }
    void beginFrame() override { _totals.beginFrame(); }
    std::uint64_t submitted() const override { return SelectionTotals::sum(_totals.thisFrame(nullptr)).patches; }
    std::uint64_t saturated() const override
    {
        return SelectionTotals::sum(_totals.thisFrame(nullptr)).saturatedPatches;
    }
    std::vector<DrawnModel> drawn(osg::RenderInfo& renderInfo, const ScreenCamera& camera,
                                  const std::vector<std::size_t>& placements) const override
    {
        std::vector<DrawnModel> models(placements.size());
        for (const FrameSelection& selection : _totals.thisFrame(nullptr)) {
            const std::vector<osg::Vec3f> corners = selection.selection->capture(renderInfo);
            for (std::size_t k = 0; k < placements.size(); ++k) {
                append(*selection.selection, corners, placements[k], camera, models[k]);
            }
        }
        return models;
    }
    std::uint64_t gpuBytes() const override { return _gpuBytes; }

private:
    const LodAsset& asset() const { return _drawable->getGpuAsset()->asset(); }

    /// Of triangles as captured, patch after patch, those of this placement.
    void append(const PatchSelection& selection, const std::vector<osg::Vec3f>& corners, std::size_t placement,
                const ScreenCamera& camera, DrawnModel& model) const
    {
        const std::vector<std::uint32_t>& numbers = selection.placements().numbers;
        const osg::Matrixd toModel =
            _placements.size() == 1 ? _assetToModel : osg::Matrixd::inverse(_placements[placement]);
        ScreenCamera fromAsset = camera;
        fromAsset.localToEye = _assetToModel * _placements[placement] * camera.localToEye;
        const SelectionView view = fromAsset.view();
        const PatchSelector& selector = _drawable->getGpuAsset()->selector();
        std::size_t first = 0;
        for (std::size_t r = 0; r < selection.records().size(); ++r) {
            const PatchRecord& record = selection.records()[r];
            const unsigned factor = asset().ladder[MorphedSurface::drawnLevel(record.edgeLevels)];
            const std::size_t count = 3 * TessellationPattern::triangleCount(factor);
            if (numbers.empty() || numbers[r] == placement) {
                const bool isPromised = !hasSaturatedBorder(asset(), selector, record.patch, view, _options);
                append(corners, first, count, toModel, isPromised, model);
            }
            first += count;
        }
        if (first != corners.size()) { throw std::runtime_error("what was captured is not what was selected"); }
    }
    /// All but triangles that morphing has left without area.
    static void append(const std::vector<osg::Vec3f>& corners, std::size_t first, std::size_t count,
                       const osg::Matrixd& toModel, bool isPromised, DrawnModel& model)
    {
        for (std::size_t k = first; k < first + count; k += 3) {
            const osg::Vec3f* t = &corners[k];
            if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) { continue; }
            for (std::size_t c = 0; c < 3; ++c) {
                const osg::Vec3d p = osg::Vec3d(t[c]) * toModel;
                model.corners.emplace_back(p.x(), p.y(), p.z());
            }
            model.isPromised.push_back(isPromised);
        }
    }

    osg::ref_ptr<TessLODDrawable> _drawable;
    osg::ref_ptr<TessLODInstances> _instances;
    SelectionOptions _options;
    SelectionTotals _totals;
    osg::Matrixd _assetToModel;
    std::vector<osg::Matrixd> _placements;
    std::uint64_t _gpuBytes;
};

} // namespace

std::unique_ptr<LodScene> makeTessLodScene(std::shared_ptr<const LodAsset> asset, const SelectionOptions& options,
                                           const Eigen::Vector3d& center)
{
    return std::make_unique<TessLodScene>(std::move(asset), options, center);
}

} // namespace osgTessLOD::benchmarks
