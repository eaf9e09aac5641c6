// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/Export.h>
#include <osgTessLOD/render/SelectionView.h>

#include <optional>
#include <string>
#include <vector>

namespace osgTessLOD {

/// How patches are drawn. Both draw the same triangles, to the bit.
enum class Backend {
    Auto,         ///< whichever a context draws faster, tried once
    Tessellation, ///< tessellation shaders; OpenGL 4.2
    Instanced     ///< an instance of the pattern's index buffer per patch; OpenGL 3.3
};

/// How levels are selected, and how what is selected is drawn.
struct SelectionOptions {
    /// Which of the errors stored with an asset count.
    enum class Metric {
        View,     ///< the error as seen along the direction of view (Lambert §2.2), never above the isotropic one
        Isotropic ///< the largest over all directions
    };
    /// What holds of what is drawn.
    enum class Bound {
        Conservative, ///< no point on screen of a patch that is not saturated is further than errorPixels from where it belongs
        FirstOrder ///< as Lambert §2.4: direction and distance at the middle of each border stand for all of it
    };

    /// What selects.
    enum class Selector {
        Cpu, ///< the cull traversal, which leaves out what is not seen
        /// The control shader, patch by patch, whatever is in view: the cull traversal only tests the drawable's box. Where a
        /// context cannot do that, or `backend` is Instanced, the CPU selects: see ShaderSelection.
        Gpu
    };

    double errorPixels = 1.0; ///< largest error asked for, in pixels of the viewport (> 0)
    Metric metric = Metric::View;
    Bound bound = Bound::Conservative;
    bool cullPatches = true;  ///< leave out patches outside the view frustum
    unsigned maxFactor = 64;  ///< coarsest allowed cap: levels of larger factors are never selected
    Backend backend = Backend::Auto; ///< where a context cannot do what is asked for, the other one draws
    Selector selector = Selector::Cpu;
    bool frozen = false;      ///< use `frozenView` instead of the camera's
    SelectionView frozenView;
};

/// "view", "isotropic"; "conservative", "first-order"; "cpu", "gpu"; "auto", "tessellation", "instanced": as command lines and files
/// name them. Nothing for other names.
OSGTESSLOD_EXPORT std::optional<SelectionOptions::Metric> metricNamed(const std::string& name);
OSGTESSLOD_EXPORT std::optional<SelectionOptions::Bound> boundNamed(const std::string& name);
OSGTESSLOD_EXPORT std::optional<SelectionOptions::Selector> selectorNamed(const std::string& name);
OSGTESSLOD_EXPORT std::optional<Backend> backendNamed(const std::string& name);
OSGTESSLOD_EXPORT const char* nameOf(Backend backend);

/// A selection option as option strings of plugins and scene files name it: "errorPixels=2".
struct SelectionOption {
    const char* name;
    const char* values;                                      ///< what may stand behind the "=", for people
    const char* purpose;                                     ///< for people
    bool (*read)(const std::string& text, SelectionOptions&); ///< false, and no change, where `text` is none of `values`
    std::string (*text)(const SelectionOptions&);            ///< what `read` takes for the same value
};

/// All that can be named so; the view of frozen selections, which belongs to a camera, is not.
OSGTESSLOD_EXPORT const std::vector<SelectionOption>& selectionOptionTable();

} // namespace osgTessLOD
