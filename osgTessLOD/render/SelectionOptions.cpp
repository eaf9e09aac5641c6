// SPDX-License-Identifier: MIT
#include <osgTessLOD/render/SelectionOptions.h>

#include <array>
#include <charconv>
#include <cmath>

namespace osgTessLOD {

namespace {

/// All of `text` as a number; nothing if it is anything else. Whatever the locale.
template <typename Number> std::optional<Number> number(const std::string& text)
{
    Number value{};
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end ? std::optional<Number>(value) : std::nullopt;
}

bool readErrorPixels(const std::string& text, SelectionOptions& options)
{
    const std::optional<double> value = number<double>(text);
    if (!value || !std::isfinite(*value) || *value <= 0.0) { return false; }
    options.errorPixels = *value;
    return true;
}

/// The shortest text that gives the same number again.
std::string errorPixelsText(const SelectionOptions& options)
{
    std::array<char, 32> text{};
    return {text.data(), std::to_chars(text.data(), text.data() + text.size(), options.errorPixels).ptr};
}

bool readMaxFactor(const std::string& text, SelectionOptions& options)
{
    const std::optional<unsigned> value = number<unsigned>(text);
    if (!value || *value == 0) { return false; }
    options.maxFactor = *value;
    return true;
}

/// Takes what `text` names, if it names anything.
template <typename Value>
bool readNamed(std::optional<Value> (*find)(const std::string&), const std::string& text, Value& value)
{
    const std::optional<Value> found = find(text);
    value = found.value_or(value);
    return found.has_value();
}

std::optional<bool> truthNamed(const std::string& name)
{
    if (name == "true") { return true; }
    if (name == "false") { return false; }
    return std::nullopt;
}

} // namespace

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

std::optional<SelectionOptions::Selector> selectorNamed(const std::string& name)
{
    if (name == "cpu") { return SelectionOptions::Selector::Cpu; }
    if (name == "gpu") { return SelectionOptions::Selector::Gpu; }
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

const std::vector<SelectionOption>& selectionOptionTable()
{
    using Options = SelectionOptions;
    using Text = std::string;
    static const std::vector<SelectionOption> table{
        {"errorPixels", "<number above 0>", "Largest error on screen, in pixels; 1 if not given", readErrorPixels,
         errorPixelsText},
        {"metric", "view|isotropic", "Errors as seen, which is the default, or at their largest",
         [](const Text& text, Options& options) { return readNamed(metricNamed, text, options.metric); },
         [](const Options& o) -> Text { return o.metric == Options::Metric::View ? "view" : "isotropic"; }},
        {"bound", "conservative|first-order",
         "Keep the error everywhere on screen, which is the default, or about at the middles of borders",
         [](const Text& text, Options& options) { return readNamed(boundNamed, text, options.bound); },
         [](const Options& o) -> Text {
             return o.bound == Options::Bound::Conservative ? "conservative" : "first-order";
         }},
        {"selection", "cpu|gpu",
         "Select levels in the cull traversal, which is the default, or in the control shader where that can be",
         [](const Text& text, Options& options) { return readNamed(selectorNamed, text, options.selector); },
         [](const Options& o) -> Text { return o.selector == Options::Selector::Cpu ? "cpu" : "gpu"; }},
        {"backend", "auto|tessellation|instanced",
         "Draw with tessellation shaders or an instance per patch; auto, the default, tries which is faster",
         [](const Text& text, Options& options) { return readNamed(backendNamed, text, options.backend); },
         [](const Options& o) -> Text { return nameOf(o.backend); }},
        {"maxFactor", "<whole number above 0>", "Levels of larger tessellation factors are not used", readMaxFactor,
         [](const Options& o) { return std::to_string(o.maxFactor); }},
        {"cullPatches", "true|false", "Leave out patches outside the view, which is the default, or draw them too",
         [](const Text& text, Options& options) { return readNamed(truthNamed, text, options.cullPatches); },
         [](const Options& o) -> Text { return o.cullPatches ? "true" : "false"; }},
    };
    return table;
}

} // namespace osgTessLOD
