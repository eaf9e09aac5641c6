// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/SelectionOptions.h>

#include <osgDB/Options>

#include <exception>
#include <new>
#include <stdexcept>
#include <string>

namespace osgTessLOD {

// What the plugins share: options that are not in selectionOptionTable(), and how errors are reported.

/// Of the pseudo-loader that bakes: "scan.ply.tesslod".
constexpr const char* kBakeExtension = "tesslod";

/// A switch: leave the textures of the assets out.
constexpr const char* kNoTextures = "noTextures";
/// How scenes are baked that are read or written through the plugin tesslod; their values and purposes.
constexpr const char* kTechnique = "technique";
constexpr const char* kTechniqueValues = "strips|uniform";
constexpr const char* kTechniquePurpose =
    "When baking: contract strips of edges from level to level, which is the default, or take evenly spaced vertices";
constexpr const char* kTolerance = "tolerance";
constexpr const char* kToleranceValues = "<number, 0 or more>";
constexpr const char* kTolerancePurpose =
    "When baking: store no finer levels than it takes to be this near, as a part of the diagonal; 0: store all";

/// Where the assets of models go when a scene of them is written; without it, into the scene unless they have a file.
constexpr const char* kAssetHint = "WriteTlodHint";
constexpr const char* kAssetHintValues = "IncludeFile|WriteOut";
constexpr const char* kIncludeFile = "IncludeFile"; ///< into the scene file
constexpr const char* kWriteOut = "WriteOut";       ///< to files beside the scene unless they have one

/// What `options` has of option `name`, empty where it is not given; "true" for one without a value.
inline std::string optionText(const osgDB::Options* options, const char* name)
{
    return options != nullptr ? options->getPluginStringData(name) : std::string();
}

inline bool isOptionSet(const osgDB::Options* options, const char* name)
{
    const std::string text = optionText(options, name);
    return !text.empty() && text != "false" && text != "0";
}

[[noreturn]] inline void throwBadOption(const std::string& name, const std::string& text, const std::string& wanted)
{
    throw std::runtime_error("option " + name + "=" + text + ": " + wanted + " is wanted");
}

/// Gives `selection` what `options` asks for. Throws std::runtime_error for what is none of an option's values.
inline void applyOptions(const osgDB::Options* options, SelectionOptions& selection)
{
    for (const SelectionOption& option : selectionOptionTable()) {
        const std::string text = optionText(options, option.name);
        if (!text.empty() && !option.read(text, selection)) { throwBadOption(option.name, text, option.values); }
    }
}

/// The result of `work`, or what went wrong with the file `name`: OSG's readers and writers expect no exceptions.
template <typename Result, typename Work> Result guarded(const std::string& name, const Work& work)
{
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return Result(name + ": not enough memory");
    } catch (const std::exception& error) {
        const std::string message = error.what();
        return Result(message.find(name) == std::string::npos ? name + ": " + message : message);
    } catch (...) {
        return Result(name + ": unknown error");
    }
}

} // namespace osgTessLOD
