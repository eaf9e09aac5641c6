// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace osgTessLOD::bake {

/// Thrown out of a bake whose Progress asked it to stop.
class OSGTESSLOD_EXPORT Interrupted : public std::runtime_error {
public:
    Interrupted() : std::runtime_error("interrupted") {}
};

/// Told how far a long work is. The default does nothing and never stops it.
class OSGTESSLOD_EXPORT Progress {
public:
    virtual ~Progress() = default;

    /// A stage begins that will advance by `total` in all; `unit` names what is counted ("collapses", "patches").
    /// Called from one thread.
    virtual void begin(const std::string& stage, std::uint64_t total, const std::string& unit);
    /// `amount` more is done. Called from any thread, seldom enough that its cost does not matter.
    virtual void advance(std::uint64_t amount);
    /// The stage is done.
    virtual void end();
    /// True once the work should stop; asked from any thread.
    virtual bool stopRequested() const;

    /// advance(), then throws Interrupted if stopRequested().
    void step(std::uint64_t amount);
};

} // namespace osgTessLOD::bake
