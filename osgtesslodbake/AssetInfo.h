// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace osgTessLOD {

/// Counts, levels, bytes, bounds and errors of a .tlod file, as JSON. Throws AssetError if it is not sound.
std::string describeTlod(const std::string& path);

} // namespace osgTessLOD
