# SPDX-License-Identifier: BSD-3-Clause
#
# Included by every script here: an empty folder to work in, and checks.
cmake_minimum_required(VERSION 3.22)
file(REMOVE_RECURSE ${WORK})
file(MAKE_DIRECTORY ${WORK})

function(check)  # condition...
  if(NOT (${ARGN}))
    list(JOIN ARGN " " condition)
    message(FATAL_ERROR "does not hold: ${condition}")
  endif()
endfunction()

# Runs the program; its exit code must be `code`, a regular expression. Leaves `out` and `err` behind.
macro(app code)
  execute_process(COMMAND ${APP} ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_VARIABLE out
                  ERROR_VARIABLE err)
  if(NOT result MATCHES "^(${code})$")
    message(FATAL_ERROR "rgbd_slam ${ARGN}\nleft with ${result}, not ${code}\n${out}${err}")
  endif()
endmacro()

# Must fail with `code` and end with one line that says why and matches `message`.
macro(app_fails code message)
  app(${code} ${ARGN})
  if(NOT err MATCHES "(^|\n)rgbd_slam: [^\n]*${message}[^\n]*\n$" OR err MATCHES "rgbd_slam: [^\n]*\n.*rgbd_slam: ")
    message(FATAL_ERROR "rgbd_slam ${ARGN}\nsaid\n${err}instead of one line that matches \"${message}\"")
  endif()
endmacro()

# Runs the program within ever more memory, in steps of 1 MB: it does its work, or gives up with one line and exit code 2.
# Skipped where the system limits no memory, and with sanitizers, which reserve too much of it.
function(app_short_of_memory program)
  execute_process(COMMAND bash -c "ulimit -v 200000 && \"${APP}\" --help" RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
  if(NOT result EQUAL 0)
    message(STATUS "no limit on memory here: want of it is not tried")
    return()
  endif()
  set(gave_up 0)
  foreach(megabytes RANGE 8 300)
    execute_process(COMMAND bash -c "ulimit -v ${megabytes}000; exec \"$@\"" limited ${APP} ${ARGN}
                    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE err)
    if(result EQUAL 0)
      break()
    elseif(result EQUAL 127)  # not even the libraries found room
      continue()
    elseif(NOT (result EQUAL 2 AND err MATCHES "^${program}: [^\n]+\n$"))
      message(FATAL_ERROR "${program} ${ARGN}\nwithin ${megabytes} MB left with ${result} and said\n${err}")
    endif()
    math(EXPR gave_up "${gave_up} + 1")
  endforeach()
  check(result EQUAL 0 AND gave_up GREATER 0)
endfunction()

function(make_recording folder frames width)  # [read-out in milliseconds, or -; distortion k1]
  execute_process(COMMAND ${MAKE_RECORDING} ${folder} ${frames} ${width} ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "no recording: ${result}")
  endif()
endfunction()

# A cloud: a square metre of points 10 cm apart, 1 m above the origin.
function(make_plate file)
  set(points "")
  foreach(x RANGE 9)
    foreach(y RANGE 9)
      string(APPEND points "0.${x}5 0.${y}5 1.05\n")
    endforeach()
  endforeach()
  file(WRITE ${file} "ply\nformat ascii 1.0\nelement vertex 100\nproperty float x\nproperty float y\n"
       "property float z\nend_header\n${points}")
endfunction()

# Two files must have the same bytes.
function(must_equal a b)
  file(SHA256 ${WORK}/${a} first)
  file(SHA256 ${WORK}/${b} second)
  if(NOT first STREQUAL second)
    message(FATAL_ERROR "${a} and ${b} differ")
  endif()
endfunction()

function(must_exist folder)  # names...
  foreach(name IN LISTS ARGN)
    if(NOT EXISTS ${folder}/${name})
      message(FATAL_ERROR "${folder}/${name} is not there")
    endif()
    file(SIZE ${folder}/${name} size)
    check(size GREATER 0)
  endforeach()
endfunction()

function(must_not_be_half_written folder)
  file(GLOB parts ${folder}/*.part ${folder}/.*)
  if(parts)
    message(FATAL_ERROR "left behind: ${parts}")
  endif()
endfunction()

# A value of summary.json, e.g. `summary(tracked ${folder} tracking_ms median)`.
macro(summary variable folder)
  file(READ ${folder}/summary.json text)
  string(JSON ${variable} GET "${text}" ${ARGN})
endmacro()
