// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/AssetPages.h>

#include <osg/State>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <set>
#include <vector>

namespace osgTessLOD {

/// How much of the pages of all assets is there to draw with: levels and normals come when they are first needed, coarse ones
/// first, and go where room is wanted, those drawn longest ago first (after the video memory manager of Livny et al. 2011). One for the
/// process; any thread.
///
/// Without limits, what a draw needs is there at once and stays. With them a frame is drawn with what there was as it began, the
/// same for all of an asset's parts in one context, so that borders stay closed: patches and borders that are to be finer wait for the next frames.
/// What was not yet read from its file is read in another thread meanwhile; without limits, by the draw that needs it.
/// Whatever is drawn then keeps no error; what there always is of a page (AssetPages::least) is not subject to limits.
class OSGTESSLOD_EXPORT VideoMemory {
public:
    struct Limits {
        static constexpr std::uint64_t kNone = std::numeric_limits<std::uint64_t>::max();

        std::uint64_t bytesPerFrame = kNone; ///< to send; one level of one page is sent even so
        std::uint64_t bytes = kNone;         ///< of all pages together

        bool any() const { return bytesPerFrame != kNone || bytes != kNone; }
    };
    struct Statistics {
        std::uint64_t bytes = 0;      ///< of all pages
        std::uint64_t wholeBytes = 0; ///< that they would have in full
        std::size_t waitingPages = 0; ///< drawn last with less than they need
    };

    static VideoMemory& shared();

    void setLimits(const Limits& limits);
    Limits limits() const;
    Statistics statistics() const;

private:
    friend class AssetPages;
    struct Growth;
    struct Spare;

    void add(AssetPages& pages);
    void remove(AssetPages& pages);
    AssetPages::Resident resident(const AssetPages& pages) const;
    AssetPages::Resident acquire(const AssetPages& pages, const osg::State& state,
                                 const std::vector<PageDetail>& needed);

    AssetPages::Resident residentOf(const AssetPages& pages) const;
    void beginFrame(std::uint64_t frame);
    std::vector<Growth> waiting(std::uint64_t frame) const;
    std::vector<Spare> spares(std::uint64_t frame) const;
    void plan(std::vector<Growth>& growths, std::uint64_t room) const;
    void replace(const AssetPages& pages, std::size_t page, const PageDetail& detail);

    mutable std::mutex _mutex; ///< of what follows and of all pages' slots and snapshots
    std::set<const AssetPages*> _all;
    Limits _limits;
    std::uint64_t _bytes = 0;
    std::uint64_t _frame = 0;
};

} // namespace osgTessLOD
