# SPDX-License-Identifier: MIT
# osgtesslod_embed_shaders(TARGET SHADER…) adds one generated source to TARGET, which defines
#   const char* osgTessLOD::embeddedShader(const std::string& name)      (declared in render/ShaderSource.h)
# with the text of every SHADER by its file name. It is generated anew whenever a shader changes.
if(CMAKE_SCRIPT_MODE_FILE STREQUAL CMAKE_CURRENT_LIST_FILE)
  # Script mode: -DOUTPUT=file.cpp -DSHADERS=a|b|c -P EmbedShaders.cmake
  string(REPLACE "|" ";" shaders "${SHADERS}")
  set(text "// Generated from the shader sources: do not edit.\n#include <osgTessLOD/render/ShaderSource.h>\n\n")
  string(APPEND text "namespace osgTessLOD {\n\nconst char* embeddedShader(const std::string& name)\n{\n")
  foreach(shader IN LISTS shaders)
    get_filename_component(name "${shader}" NAME)
    file(READ "${shader}" source)
    string(APPEND text "    if (name == \"${name}\") {\n        return R\"tessLod(${source})tessLod\";\n    }\n")
  endforeach()
  string(APPEND text "    return nullptr;\n}\n\n} // namespace osgTessLOD\n")
  file(WRITE "${OUTPUT}" "${text}")
  return()
endif()

set(OSGTESSLOD_EMBED_SHADERS_SCRIPT "${CMAKE_CURRENT_LIST_FILE}")

function(osgtesslod_embed_shaders target)
  set(output "${CMAKE_CURRENT_BINARY_DIR}/EmbeddedShaders.cpp")
  string(REPLACE ";" "|" joined "${ARGN}")
  add_custom_command(OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" "-DOUTPUT=${output}" "-DSHADERS=${joined}" -P "${OSGTESSLOD_EMBED_SHADERS_SCRIPT}"
    DEPENDS ${ARGN} "${OSGTESSLOD_EMBED_SHADERS_SCRIPT}"
    COMMENT "Embedding shaders" VERBATIM)
  # The target may live in another folder, where the rule above is not known.
  add_custom_target(${target}EmbeddedShaders DEPENDS "${output}")
  set_source_files_properties("${output}" PROPERTIES GENERATED TRUE)
  target_sources(${target} PRIVATE "${output}")
  add_dependencies(${target} ${target}EmbeddedShaders)
endfunction()
