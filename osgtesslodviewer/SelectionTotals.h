// SPDX-License-Identifier: MIT
#pragma once

#include "SceneDrawables.h"

#include <osgTessLOD/render/PatchSelection.h>

#include <osg/Camera>
#include <osg/Matrixd>
#include <osg/ref_ptr>

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

namespace osgTessLOD {

/// One selection of the frame and whose it is.
struct FrameSelection {
    const osg::Camera* camera = nullptr; ///< to compare only
    const TessLODDrawable* drawable = nullptr;
    osg::Matrixd localToWorld;
    osg::ref_ptr<const PatchSelection> selection;
};

/// Sums over selections.
struct SelectionSums {
    std::uint64_t selections = 0;
    std::uint64_t patches = 0;
    std::uint64_t culledPatches = 0;
    std::uint64_t saturatedPatches = 0;
    std::uint64_t triangles = 0;
    std::map<unsigned, std::uint64_t> patchesByFactor; ///< drawn patches per tessellation factor; no empty entries
    bool isUpperBound = false;                         ///< as in SelectionStatistics, of any of them
};

/// Observes the selections of a list of drawables, frame by frame. Selections may come from any thread.
class SelectionTotals {
public:
    explicit SelectionTotals(const DrawableList& drawables);
    ~SelectionTotals();
    SelectionTotals(const SelectionTotals&) = delete;
    SelectionTotals& operator=(const SelectionTotals&) = delete;

    /// Starts a new frame: what was selected since the last call becomes the last frame's.
    void beginFrame();

    /// The last whole frame's selections made for `camera`, or for all cameras if it is null.
    std::vector<FrameSelection> lastFrame(const osg::Camera* camera) const;
    /// The same for the frame that began last.
    std::vector<FrameSelection> thisFrame(const osg::Camera* camera) const;

    static SelectionSums sum(const std::vector<FrameSelection>& selections);

private:
    struct Frames;
    class Observer;

    DrawableList _drawables;
    std::shared_ptr<Frames> _frames;
};

} // namespace osgTessLOD
