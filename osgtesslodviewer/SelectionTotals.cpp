// SPDX-License-Identifier: MIT
#include "SelectionTotals.h"

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/render/GpuAsset.h>

#include <mutex>
#include <utility>

namespace osgTessLOD {

struct SelectionTotals::Frames {
    std::mutex mutex;
    std::vector<FrameSelection> current;
    std::vector<FrameSelection> last;
};

/// One per drawable, which owns it: so the drawable outlives the observer's pointer to it.
class SelectionTotals::Observer : public SelectionObserver {
public:
    Observer(std::shared_ptr<Frames> frames, const TessLODDrawable* drawable)
        : _frames(std::move(frames))
        , _drawable(drawable)
    {
    }

    void selected(const osg::Camera* camera, const osg::Matrixd& localToWorld, const PatchSelection& selection) override
    {
        const std::lock_guard<std::mutex> lock(_frames->mutex);
        _frames->current.push_back({camera, _drawable, localToWorld, &selection});
    }

private:
    std::shared_ptr<Frames> _frames;
    const TessLODDrawable* _drawable;
};

SelectionTotals::SelectionTotals(const DrawableList& drawables)
    : _drawables(drawables)
    , _frames(std::make_shared<Frames>())
{
    for (const osg::ref_ptr<TessLODDrawable>& drawable : _drawables) {
        drawable->setSelectionObserver(new Observer(_frames, drawable));
    }
}

SelectionTotals::~SelectionTotals()
{
    for (const osg::ref_ptr<TessLODDrawable>& drawable : _drawables) { drawable->setSelectionObserver(nullptr); }
}

void SelectionTotals::beginFrame()
{
    std::vector<FrameSelection> dropped; // released after the lock
    const std::lock_guard<std::mutex> lock(_frames->mutex);
    dropped.swap(_frames->last);
    _frames->last.swap(_frames->current);
}

namespace {

std::vector<FrameSelection> selectionsOf(const std::vector<FrameSelection>& all, const osg::Camera* camera)
{
    std::vector<FrameSelection> selections;
    for (const FrameSelection& entry : all) {
        if (!camera || entry.camera == camera) { selections.push_back(entry); }
    }
    return selections;
}

} // namespace

std::vector<FrameSelection> SelectionTotals::lastFrame(const osg::Camera* camera) const
{
    const std::lock_guard<std::mutex> lock(_frames->mutex);
    return selectionsOf(_frames->last, camera);
}

std::vector<FrameSelection> SelectionTotals::thisFrame(const osg::Camera* camera) const
{
    const std::lock_guard<std::mutex> lock(_frames->mutex);
    return selectionsOf(_frames->current, camera);
}

SelectionSums SelectionTotals::sum(const std::vector<FrameSelection>& selections)
{
    SelectionSums sums;
    for (const FrameSelection& entry : selections) {
        const SelectionStatistics& statistics = entry.selection->statistics();
        ++sums.selections;
        sums.patches += statistics.patches;
        sums.culledPatches += statistics.culledPatches;
        sums.saturatedPatches += statistics.saturatedPatches;
        sums.triangles += statistics.triangles;
        sums.isUpperBound = sums.isUpperBound || statistics.isUpperBound;
        const std::vector<std::uint16_t>& ladder = entry.drawable->getGpuAsset()->asset().ladder;
        for (std::size_t level = 0; level < statistics.patchesByLevel.size() && level < ladder.size(); ++level) {
            if (statistics.patchesByLevel[level] > 0) {
                sums.patchesByFactor[ladder[level]] += statistics.patchesByLevel[level];
            }
        }
    }
    return sums;
}

} // namespace osgTessLOD
