// SPDX-License-Identifier: MIT
#include "BakeProgress.h"

#include <osg/Notify>

#include <algorithm>
#include <utility>

namespace osgTessLOD {

namespace {

constexpr std::chrono::seconds kBetweenNotices{5};

} // namespace

BakeProgress::BakeProgress(std::string name)
    : _name(std::move(name))
{
}

void BakeProgress::begin(const std::string& stage, std::uint64_t total, const std::string& /*unit*/)
{
    _stage = stage;
    _total = total;
    _done = 0;
    _start = Clock::now();
}

void BakeProgress::advance(std::uint64_t amount)
{
    const std::uint64_t done = _done += amount;
    const std::unique_lock<std::mutex> lock(_mutex, std::try_to_lock);
    if (!lock.owns_lock() || Clock::now() - _lastTold < kBetweenNotices) { return; }
    _lastTold = Clock::now();
    OSG_NOTICE << "osgTessLOD: baking " << _name << ": " << _stage;
    if (_total > 0) { OSG_NOTICE << " " << std::min<std::uint64_t>(100, done * 100 / _total) << " %"; }
    OSG_NOTICE << std::endl;
}

void BakeProgress::end()
{
    const std::chrono::duration<double> elapsed = Clock::now() - _start;
    OSG_INFO << "osgTessLOD: baking " << _name << ": " << _stage << " took " << elapsed.count() << " s" << std::endl;
}

} // namespace osgTessLOD
