# SPDX-License-Identifier: MIT
# Compile options that every target of the project shares: link to osgTessLODOptions privately.
add_library(osgTessLODOptions INTERFACE)
target_compile_options(osgTessLODOptions INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
                       -Wold-style-cast -Wcast-qual -Wformat=2 -Wundef)
# The same source must give the same bytes on every machine: no contraction of a*b+c into one rounding.
target_compile_options(osgTessLODOptions INTERFACE -ffp-contract=off)
if(OSGTESSLOD_WARNINGS_AS_ERRORS)
  target_compile_options(osgTessLODOptions INTERFACE -Werror)
endif()
if(OSGTESSLOD_SANITIZE)
  add_compile_options(-fsanitize=${OSGTESSLOD_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${OSGTESSLOD_SANITIZE})
endif()
