// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace osgTessLOD::benchmarks {

/// A table of texts: the first column is aligned to the left, the others to the right.
struct ResultTable {
    std::vector<std::string> headers;
    std::vector<std::vector<std::string>> rows; ///< as many cells each as there are headers

    /// As aligned columns, or as a table of Markdown.
    std::string toText(bool markdown) const;
};

/// 1234567 as "1,234,567".
std::string grouped(unsigned long long number);

} // namespace osgTessLOD::benchmarks
