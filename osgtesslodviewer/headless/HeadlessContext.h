// SPDX-License-Identifier: MIT
#pragma once

#include <osg/GraphicsContext>
#include <osg/ref_ptr>

#include <string>

namespace osgTessLOD {

/// Creates an OpenGL compatibility context that draws into an off-screen buffer of width × height pixels (both ≥ 1), by
/// EGL, needing neither a display nor a window system. EGL's devices are tried first, in their order, then Mesa's
/// surfaceless platform, then EGL's default display; the first that gives a context is taken. The context has its
/// osg::State and context id; it is not realized yet.
///
/// The result works as a camera's graphics context with every threading model. It shares GL objects with
/// `sharedContext` when that is not null and was made by this function.
///
/// Null on failure; `error` then says what each platform answered. On success `error` is empty.
osg::ref_ptr<osg::GraphicsContext> createHeadlessContext(int width, int height, std::string& error,
                                                         osg::GraphicsContext* sharedContext = nullptr);

} // namespace osgTessLOD
