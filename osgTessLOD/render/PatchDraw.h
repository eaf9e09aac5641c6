// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/PatchSelection.h>
#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/State>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace osgTessLOD {

class ShaderSelection;

/// Records to draw and, where they have any, the numbers of their placements, as many.
struct DrawnRecords {
    PatchRecords records;
    const std::vector<std::uint32_t>& placements;
};

/// Draws patches with one of the backends, for the life of the object. They are in a vertex buffer; everything that OSG's
/// last geometry left enabled is disabled first, and nothing is left behind. The backend's program is applied by the caller.
class PatchDraw {
public:
    /// `backend` is not Auto; the context of `state` can do it. Keeps a reference to the state.
    static std::unique_ptr<PatchDraw> make(Backend backend, osg::State& state, const DrawnRecords& records);
    /// Has the control shader select: patches are all of them, in the order of the selection's.
    static std::unique_ptr<PatchDraw> make(osg::State& state, const ShaderSelection& selection);
    virtual ~PatchDraw();
    PatchDraw(const PatchDraw&) = delete;
    PatchDraw& operator=(const PatchDraw&) = delete;

    /// One draw call for consecutive patches, all at a level of this factor, which the control shader sees to itself.
    void draw(std::size_t first, std::size_t count, unsigned factor);

protected:
    explicit PatchDraw(osg::State& state);
    virtual void drawRecords(std::size_t first, std::size_t count, unsigned factor) = 0;
    osg::State& state() { return _state; }

private:
    osg::State& _state;
};

} // namespace osgTessLOD
