# SPDX-License-Identifier: MIT
# Installs libraries, plugins, programs, headers and shaders, and the package that find_package(osgTessLOD) reads:
# osgTessLOD::osgTessLOD and, where the bake library was built, osgTessLOD::osgTessLODBake.
include(CMakePackageConfigHelpers)

set(OSGTESSLOD_CMAKE_DIR "${CMAKE_INSTALL_LIBDIR}/cmake/osgTessLOD")
set(OSGTESSLOD_SHADER_DIR "${CMAKE_INSTALL_DATADIR}/osgTessLOD/shaders")

set_target_properties(osgTessLOD PROPERTIES INSTALL_RPATH "$ORIGIN")
install(TARGETS osgTessLOD EXPORT osgTessLODTargets LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(DIRECTORY osgTessLOD/asset osgTessLOD/render DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/osgTessLOD"
        FILES_MATCHING PATTERN "*.h")
install(FILES osgTessLOD/Export.h DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/osgTessLOD")
install(DIRECTORY shaders/ DESTINATION "${OSGTESSLOD_SHADER_DIR}")

install(TARGETS osgtesslodviewer RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")

if(OSGTESSLOD_BUILD_BAKE)
  set_target_properties(osgTessLODBake PROPERTIES INSTALL_RPATH "$ORIGIN")
  install(TARGETS osgTessLODBake EXPORT osgTessLODTargets LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
  install(TARGETS osgTessLODImages LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
  install(DIRECTORY osgTessLOD/bake DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/osgTessLOD" FILES_MATCHING PATTERN "*.h")
  install(TARGETS osgtesslodbake RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")
endif()

install(EXPORT osgTessLODTargets NAMESPACE osgTessLOD:: DESTINATION "${OSGTESSLOD_CMAKE_DIR}")
configure_package_config_file(cmake/osgTessLODConfig.cmake.in "${PROJECT_BINARY_DIR}/osgTessLODConfig.cmake"
                              INSTALL_DESTINATION "${OSGTESSLOD_CMAKE_DIR}"
                              PATH_VARS OSGTESSLOD_SHADER_DIR)
# Before 1.0 a minor version may break what used the last one.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/osgTessLODConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/osgTessLODConfig.cmake" "${PROJECT_BINARY_DIR}/osgTessLODConfigVersion.cmake"
              cmake/OsgTessLODOpenSceneGraph.cmake
        DESTINATION "${OSGTESSLOD_CMAKE_DIR}")
