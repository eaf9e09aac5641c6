// SPDX-License-Identifier: MIT
// What tessLodShade is told of a fragment of the surface.
//
// Shared text: pasted behind the #version line of the stages that need it.

struct TessLodFragment {
    vec3 position;                  // eye space
    vec3 normal;                    // eye space, unit, on the viewer's side
    bool isBack;                    // the back of the surface is seen
    gl_MaterialParameters material; // of the side that is seen; ambient and diffuse are the surface's own colours where it has any
};
