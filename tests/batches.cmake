# SPDX-License-Identifier: BSD-3-Clause
#
# orbis_batch(<out> <name> <file>...): the sources to compile for these test files. With ORBIS_BATCH_TESTS, several of them
# at a time are put into one translation unit (see batch.awk), which saves most of the parsing when everything is built;
# without, each file is compiled alone, which is faster while one of them is edited.
option(ORBIS_BATCH_TESTS "Compile several test files in one translation unit" OFF)
set(ORBIS_BATCH_BYTES 45000 CACHE STRING "How much of test files goes into one translation unit")

function(orbis_batch out name)
  if(NOT ORBIS_BATCH_TESTS)
    set(${out} ${ARGN} PARENT_SCOPE)
    return()
  endif()
  set(most ${ORBIS_BATCH_BYTES})
  # Kernels for each target, expressions of small matrices and solvers take memory to compile.
  if(name MATCHES "^(core|optimize)$")
    math(EXPR most "${most} / 3")
  elseif(name STREQUAL "features")
    math(EXPR most "${most} / 2")
  elseif(name MATCHES "^(cloud|octree)$")  # tests of many kinds of points, of many sensor models
    math(EXPR most "${most} * 2 / 3")
  endif()
  set(sources)
  set(batch)
  set(bytes 0)
  set(number 0)
  foreach(file IN ITEMS ${ARGN} -)  # the last one closes the last batch
    if(NOT file STREQUAL "-")
      set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
      # What cannot stand in a namespace, or is switched by the preprocessor, is compiled alone.
      file(STRINGS ${file} alone LIMIT_COUNT 1
           REGEX "^(namespace [a-z_:]+ *{|template *<>|struct [a-z_]+::|# *define|#ifdef|# *if defined|int main)")
      if(alone)
        list(APPEND sources ${file})
        continue()
      endif()
      file(SIZE ${file} size)
    else()
      set(size ${most})
    endif()
    math(EXPR total "${bytes} + ${size}")
    if(batch AND total GREATER most)
      math(EXPR number "${number} + 1")
      set(unit ${CMAKE_CURRENT_BINARY_DIR}/batches/${name}_${number}.cpp)
      add_custom_command(OUTPUT ${unit} DEPENDS ${batch} ${PROJECT_SOURCE_DIR}/tests/batch.awk VERBATIM
        COMMAND awk -f ${PROJECT_SOURCE_DIR}/tests/batch.awk ${batch} > ${unit})
      list(APPEND sources ${unit})
      set(batch)
      set(bytes 0)
    endif()
    if(NOT file STREQUAL "-")
      list(APPEND batch ${file})
      math(EXPR bytes "${bytes} + ${size}")
    endif()
  endforeach()
  file(MAKE_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR}/batches)
  set(${out} ${sources} PARENT_SCOPE)
endfunction()
