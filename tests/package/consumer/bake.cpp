// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/BuiltinSurface.h>

int main()
{
    return osgTessLOD::bake::builtinSurfaceNames().empty() ? 1 : 0;
}
