// SPDX-License-Identifier: MIT
// PatchCullCallback has no state of its own. It is stored so that callbacks nested with it are, and takes the place of the
// one that a drawable is constructed with.
#include <osgTessLOD/render/PatchCullCallback.h>

#include <osgDB/ObjectWrapper>

REGISTER_OBJECT_WRAPPER(osgTessLOD_PatchCullCallback, new osgTessLOD::PatchCullCallback, osgTessLOD::PatchCullCallback,
                        "osg::Object osg::Callback osgTessLOD::PatchCullCallback")
{
}
