# SPDX-License-Identifier: MIT
# cmake -P: installs BUILD_DIR below WORK_DIR, checks what lies there, builds CONSUMER_DIR and EXAMPLES_DIR against it, and runs
# the results; the examples for three frames, if XVFB_RUN is a program.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${ARGN}: ${status}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix")
run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}")
foreach(file bin/osgtesslodviewer include/osgTessLOD/render/TessLODDrawable.h
             "${LIBRARY_DIR}/${PLUGIN_DIR}/osgdb_tlod.so" share/osgTessLOD/shaders/tesslod_patch.vert)
  if(NOT EXISTS "${prefix}/${file}")
    message(FATAL_ERROR "${file} was not installed")
  endif()
endforeach()

# Nothing of the build may be needed: installed programs find their libraries and plugins by themselves.
set(ENV{LD_LIBRARY_PATH} "")
run("${prefix}/bin/osgtesslodviewer" --help)
if(WITH_BAKE)
  run("${prefix}/bin/osgtesslodbake" --help)
endif()

run("${CMAKE_COMMAND}" -S "${CONSUMER_DIR}" -B "${WORK_DIR}/build" -G "${GENERATOR}" -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${CXX_COMPILER} -DCMAKE_CXX_FLAGS=${CXX_FLAGS} -DWITH_BAKE=${WITH_BAKE})
run("${CMAKE_COMMAND}" --build "${WORK_DIR}/build")
run("${WORK_DIR}/build/consumer" "${WORK_DIR}")
if(WITH_BAKE)
  run("${WORK_DIR}/build/bakeConsumer")
endif()

run("${CMAKE_COMMAND}" -S "${EXAMPLES_DIR}" -B "${WORK_DIR}/examples" -G "${GENERATOR}" -DCMAKE_PREFIX_PATH=${prefix}
    -DCMAKE_CXX_COMPILER=${CXX_COMPILER} "-DCMAKE_CXX_FLAGS=${CXX_FLAGS} -Wall -Wextra -Werror")
run("${CMAKE_COMMAND}" --build "${WORK_DIR}/examples")
if(WITH_BAKE AND XVFB_RUN)
  run("${prefix}/bin/osgtesslodbake" builtin:asteroid --max-factor 8 -q -o "${WORK_DIR}/rock.tlod")
  set(ENV{OSG_RUN_FRAME_COUNT} 3)
  set(ENV{OSG_LIBRARY_PATH} "${prefix}/${LIBRARY_DIR}")
  foreach(example minimal instances shadow waves skinning picking)
    execute_process(COMMAND "${XVFB_RUN}" -a "${WORK_DIR}/examples/${example}" "${WORK_DIR}/rock.tlod"
                    RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE errors)
    if(NOT status EQUAL 0 OR errors)
      message(FATAL_ERROR "${example}: ${status}\n${output}${errors}")
    endif()
  endforeach()
  if(NOT output MATCHES "met the surface")
    message(FATAL_ERROR "picking: ${output}")
  endif()
endif()
