// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/SelectionOptions.h>

namespace osgTessLOD {

std::optional<SelectionOptions::Metric> metricNamed(const std::string& name)
{
    if (name == "view") { return SelectionOptions::Metric::View; }
    if (name == "isotropic") { return SelectionOptions::Metric::Isotropic; }
    return std::nullopt;
}

std::optional<SelectionOptions::Bound> boundNamed(const std::string& name)
{
    if (name == "conservative") { return SelectionOptions::Bound::Conservative; }
    if (name == "first-order") { return SelectionOptions::Bound::FirstOrder; }
    return std::nullopt;
}

} // namespace osgTessLOD
