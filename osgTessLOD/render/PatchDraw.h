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

/// Records to draw and, where they have any, the numbers of their placements, as many.
struct DrawnRecords {
    PatchRecords records;
    const std::vector<std::uint32_t>& placements;
};

/// Draws records with one of the backends, for the life of the object. They are in a vertex buffer; everything that OSG's
/// last geometry left enabled is disabled first, and nothing is left behind. The backend's program is applied by the caller.
class PatchDraw {
public:
    /// `backend` is not Auto; the context of `state` can do it. Keeps a reference to the state.
    static std::unique_ptr<PatchDraw> make(Backend backend, osg::State& state, const DrawnRecords& records);
    virtual ~PatchDraw();
    PatchDraw(const PatchDraw&) = delete;
    PatchDraw& operator=(const PatchDraw&) = delete;

    /// One draw call for consecutive records, all at a level of this factor.
    void draw(std::size_t first, std::size_t count, unsigned factor);

protected:
    PatchDraw(osg::State& state, const DrawnRecords& records);
    virtual void drawRecords(std::size_t first, std::size_t count, unsigned factor) = 0;
    /// Has the records from `first` on be vertex attribute 0, and their placements attribute 1.
    void pointAt(std::size_t first);
    bool arePlaced() const { return _arePlaced; }
    osg::State& state() { return _state; }

private:
    osg::State& _state;
    std::size_t _recordBytes;
    bool _arePlaced;
};

} // namespace osgTessLOD
