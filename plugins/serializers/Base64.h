// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace osgTessLOD {

/// `bytes` in the 64 characters of RFC 4648 §4, padded with '=' to a multiple of four.
std::string toBase64(const std::string& bytes);

/// The bytes again. Throws std::runtime_error for anything that toBase64 does not write.
std::string fromBase64(const std::string& text);

} // namespace osgTessLOD
