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

std::optional<Backend> backendNamed(const std::string& name)
{
    for (const Backend backend : {Backend::Auto, Backend::Tessellation, Backend::Instanced}) {
        if (name == nameOf(backend)) { return backend; }
    }
    return std::nullopt;
}

const char* nameOf(Backend backend)
{
    switch (backend) {
    case Backend::Tessellation: return "tessellation";
    case Backend::Instanced: return "instanced";
    default: return "auto";
    }
}

} // namespace osgTessLOD
