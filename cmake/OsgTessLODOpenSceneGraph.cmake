# SPDX-License-Identifier: MIT
# FindOpenSceneGraph gives variables; this wraps them in one imported target, osgTessLOD::OpenSceneGraph.
# Shared by the build and by the installed package.
find_package(OpenSceneGraph 3.6.5 REQUIRED COMPONENTS osgViewer osgGA osgText osgUtil osgDB)
if(NOT TARGET osgTessLOD::OpenSceneGraph)
  add_library(osgTessLOD::OpenSceneGraph INTERFACE IMPORTED)
  set_target_properties(osgTessLOD::OpenSceneGraph PROPERTIES
    INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${OPENSCENEGRAPH_INCLUDE_DIRS}"
    INTERFACE_INCLUDE_DIRECTORIES "${OPENSCENEGRAPH_INCLUDE_DIRS}"
    INTERFACE_LINK_LIBRARIES "${OSGUTIL_LIBRARY};${OSGDB_LIBRARY};${OSG_LIBRARY};${OPENTHREADS_LIBRARY}")
  add_library(osgTessLOD::OpenSceneGraphViewer INTERFACE IMPORTED)
  set_target_properties(osgTessLOD::OpenSceneGraphViewer PROPERTIES
    INTERFACE_LINK_LIBRARIES "${OSGVIEWER_LIBRARY};${OSGGA_LIBRARY};${OSGTEXT_LIBRARY};osgTessLOD::OpenSceneGraph")
endif()
set(OSGTESSLOD_OSG_VERSION "${OPENSCENEGRAPH_VERSION}")
