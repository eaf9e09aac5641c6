// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <cstddef>
#include <cstdint>

namespace osgTessLOD {

/// CRC-32C (Castagnoli, reflected polynomial 0x82F63B78; RFC 3720) of `bytes` bytes. `previous` is the value for the data
/// before them, so that a long run may be fed in pieces; 0 to begin. Uses the processor's instruction where there is one.
OSGTESSLOD_EXPORT std::uint32_t crc32c(const void* data, std::size_t bytes, std::uint32_t previous = 0);

/// The same by tables, on any processor.
OSGTESSLOD_EXPORT std::uint32_t crc32cByTable(const void* data, std::size_t bytes, std::uint32_t previous = 0);

/// True if crc32c uses the processor's instruction on this machine.
OSGTESSLOD_EXPORT bool crc32cUsesInstruction();

} // namespace osgTessLOD
