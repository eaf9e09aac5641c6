// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>

#include <stdexcept>

namespace osgTessLOD {

/// An asset or file that cannot be used; what() says why, naming the file where there is one.
class OSGTESSLOD_EXPORT AssetError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

} // namespace osgTessLOD
