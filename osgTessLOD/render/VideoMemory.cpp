// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/VideoMemory.h>

#include <osg/FrameStamp>

#include <algorithm>

namespace osgTessLOD {

namespace {

/// Of a page that needs this much, what there is to be after `steps` levels: normals come along with the level half as fine.
PageDetail afterSteps(const PageDetail& needed, const PageDetail& least, unsigned steps)
{
    const PageDetail some{std::min(needed.levels, steps), std::min(needed.normals, steps + 1)};
    return PageDetail::both(least, some);
}

} // namespace

/// A page that is to have more.
struct VideoMemory::Growth {
    const AssetPages* pages;
    std::size_t page;
    PageDetail needed;
    PageDetail present;
    PageDetail planned;

    std::uint64_t bytes(const PageDetail& detail) const { return pages->bytes(page, detail); }
};

/// A page that can have less.
struct VideoMemory::Spare {
    const AssetPages* pages;
    std::size_t page;
    PageDetail kept;
    std::uint64_t bytes;
    std::uint64_t frame;
};

VideoMemory& VideoMemory::shared()
{
    static auto* const memory = new VideoMemory; // for good: OSG's own statics may hold assets until after all others are gone
    return *memory;
}

void VideoMemory::setLimits(const Limits& limits)
{
    const std::lock_guard<std::mutex> lock(_mutex);
    _limits = limits;
}

VideoMemory::Limits VideoMemory::limits() const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    return _limits;
}

VideoMemory::Statistics VideoMemory::statistics() const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    Statistics statistics;
    statistics.bytes = _bytes;
    for (const AssetPages* pages : _all) {
        for (std::size_t page = 0; page < pages->size(); ++page) {
            statistics.wholeBytes += pages->bytes(page, pages->whole());
            const AssetPages::Slot& slot = pages->_slots[page];
            if (!slot.page->detail.covers(slot.needed)) { ++statistics.waitingPages; }
        }
    }
    return statistics;
}

void VideoMemory::add(AssetPages& pages)
{
    std::vector<AssetPages::Slot> slots;
    for (std::size_t page = 0; page < pages.size(); ++page) {
        slots.push_back({pages.make(page, pages.least(page)), {}, 0});
    }
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const AssetPages::Slot& slot : slots) { _bytes += slot.page->bytes(); }
    pages._slots = std::move(slots);
    _all.insert(&pages);
}

void VideoMemory::remove(AssetPages& pages)
{
    const std::lock_guard<std::mutex> lock(_mutex);
    for (const AssetPages::Slot& slot : pages._slots) { _bytes -= slot.page->bytes(); }
    _all.erase(&pages);
}

AssetPages::Resident VideoMemory::residentOf(const AssetPages& pages) const
{
    AssetPages::Resident resident;
    for (const AssetPages::Slot& slot : pages._slots) { resident.push_back(slot.page); }
    return resident;
}

AssetPages::Resident VideoMemory::resident(const AssetPages& pages) const
{
    const std::lock_guard<std::mutex> lock(_mutex);
    return residentOf(pages);
}

AssetPages::Resident VideoMemory::acquire(const AssetPages& pages, const osg::State& state,
                                          const std::vector<PageDetail>& needed)
{
    const std::lock_guard<std::mutex> lock(_mutex);
    // Frames count from 1; where they have no numbers, each draw is one.
    const osg::FrameStamp* stamp = state.getFrameStamp();
    const std::uint64_t frame = stamp != nullptr ? std::uint64_t{stamp->getFrameNumber()} + 1 : _frame + 1;
    if (frame != _frame) { beginFrame(frame); }
    for (std::size_t page = 0; page < needed.size(); ++page) {
        if (needed[page].levels == 0) { continue; }
        AssetPages::Slot& slot = pages._slots[page];
        const PageDetail own = PageDetail::common(needed[page], pages.whole());
        slot.needed = slot.frame == frame ? PageDetail::both(slot.needed, own) : own;
        slot.frame = frame;
        if (!_limits.any() && !slot.page->detail.covers(slot.needed)) {
            replace(pages, page, PageDetail::both(slot.page->detail, slot.needed));
        }
    }
    if (!_limits.any()) { return residentOf(pages); }
    AssetPages::Snapshot& snapshot = pages._snapshots[state.getContextID()];
    if (snapshot.frame != frame) { snapshot = {frame, residentOf(pages)}; }
    return snapshot.pages;
}

void VideoMemory::replace(const AssetPages& pages, std::size_t page, const PageDetail& detail)
{
    AssetPages::Slot& slot = pages._slots[page];
    _bytes -= slot.page->bytes();
    slot.page = pages.make(page, detail);
    _bytes += slot.page->bytes();
}

/// Gives pages what the last frame found wanting, as far as the limits allow.
void VideoMemory::beginFrame(std::uint64_t frame)
{
    const std::uint64_t last = _frame;
    _frame = frame;
    for (const AssetPages* pages : _all) {
        auto& snapshots = pages->_snapshots;
        for (auto at = snapshots.begin(); at != snapshots.end();) {
            at = at->second.frame < last ? snapshots.erase(at) : std::next(at);
        }
    }
    if (!_limits.any()) { return; }
    const std::vector<Spare> spares = this->spares(last);
    std::uint64_t spared = 0;
    for (const Spare& spare : spares) { spared += spare.bytes; }
    std::vector<Growth> growths = waiting(last);
    const std::uint64_t kept = _bytes - spared;
    plan(growths, _limits.bytes > kept ? _limits.bytes - kept : 0);
    std::uint64_t wanted = _bytes;
    for (const Growth& growth : growths) { wanted += growth.bytes(growth.planned) - growth.bytes(growth.present); }
    for (const Spare& spare : spares) {
        if (wanted <= _limits.bytes) { break; }
        replace(*spare.pages, spare.page, spare.kept);
        wanted -= spare.bytes;
    }
    for (const Growth& growth : growths) {
        if (!(growth.planned == growth.present)) { replace(*growth.pages, growth.page, growth.planned); }
    }
}

/// Pages that were drawn in `frame` with less than they needed.
std::vector<VideoMemory::Growth> VideoMemory::waiting(std::uint64_t frame) const
{
    std::vector<Growth> growths;
    for (const AssetPages* pages : _all) {
        for (std::size_t page = 0; page < pages->size(); ++page) {
            const AssetPages::Slot& slot = pages->_slots[page];
            const PageDetail& present = slot.page->detail;
            if (slot.frame != frame || present.covers(slot.needed)) { continue; }
            growths.push_back({pages, page, pages->readAhead(slot.needed), present, present});
        }
    }
    return growths;
}

/// Coarse first: all of them get a level before one of them gets the next. `room`: bytes for all of it.
void VideoMemory::plan(std::vector<Growth>& growths, std::uint64_t room) const
{
    std::uint64_t sent = 0;
    std::uint64_t taken = 0;
    unsigned most = 0;
    for (const Growth& growth : growths) { most = std::max({most, growth.needed.levels, growth.needed.normals}); }
    for (unsigned steps = 1; steps <= most; ++steps) {
        for (Growth& growth : growths) {
            const PageDetail next =
                PageDetail::both(growth.present, afterSteps(growth.needed, growth.pages->least(growth.page), steps));
            if (growth.planned.covers(next)) { continue; }
            const std::uint64_t bytes = growth.bytes(next);
            const std::uint64_t before = growth.bytes(growth.planned);
            const std::uint64_t sentBefore = growth.planned == growth.present ? 0 : before; // the whole page is sent anew
            const bool isFirst = sent == 0;
            if (taken + bytes - before > room) { return; }
            if (!isFirst && sent + bytes - sentBefore > _limits.bytesPerFrame) { return; }
            sent += bytes - sentBefore;
            taken += bytes - before;
            growth.planned = next;
        }
    }
}

/// What can be spared of pages: all that is finer than the least of those not drawn in `frame`, drawn longest ago first, then what those
/// drawn have more than they need.
std::vector<VideoMemory::Spare> VideoMemory::spares(std::uint64_t frame) const
{
    std::vector<Spare> spares;
    for (const AssetPages* pages : _all) {
        for (std::size_t page = 0; page < pages->size(); ++page) {
            const AssetPages::Slot& slot = pages->_slots[page];
            const PageDetail& present = slot.page->detail;
            PageDetail kept = pages->least(page);
            if (slot.frame == frame) {
                kept = PageDetail::both(kept, {std::min(present.levels, slot.needed.levels),
                                               std::min(present.normals, slot.needed.normals)});
            }
            if (!(kept == present)) {
                spares.push_back({pages, page, kept, pages->bytes(page, present) - pages->bytes(page, kept), slot.frame});
            }
        }
    }
    std::stable_sort(spares.begin(), spares.end(), [](const Spare& a, const Spare& b) { return a.frame < b.frame; });
    return spares;
}

} // namespace osgTessLOD
