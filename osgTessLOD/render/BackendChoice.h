// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/render/SelectionOptions.h>

#include <osg/State>

#include <optional>

namespace osgTessLOD {

class GpuAsset;

/// The backend that draws `asset` in the context of `state`, which must be current, where `wanted` is asked for: never Auto;
/// nothing where the context cannot draw. For Auto both are tried when the context first draws anything, with this asset's
/// patches and nothing shown, and the faster one is kept for the context's life.
std::optional<Backend> chooseBackend(osg::State& state, const GpuAsset& asset, Backend wanted);

} // namespace osgTessLOD
