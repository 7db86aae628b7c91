# SPDX-License-Identifier: BSD-3-Clause
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
set(options -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Release)

if(WAY STREQUAL "find_package")
  run(${CMAKE_COMMAND} -S ${ORBIS_SOURCE} -B ${SCRATCH}/orbis ${options} -DORBIS_BUILD_TESTS=OFF
      -DORBIS_BUILD_BENCH=OFF -DORBIS_BUILD_EXAMPLES=OFF -DCMAKE_INSTALL_PREFIX=${SCRATCH}/prefix)
  run(${CMAKE_COMMAND} --install ${SCRATCH}/orbis)
  foreach(file IN ITEMS include/orbis/orbis.hpp share/cmake/orbis/orbis-config.cmake share/pkgconfig/orbis.pc)
    if(NOT EXISTS ${SCRATCH}/prefix/${file})
      message(FATAL_ERROR "${file} was not installed")
    endif()
  endforeach()
  list(APPEND options -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix)
endif()

run(${CMAKE_COMMAND} -S ${PROJECT} -B ${SCRATCH}/build ${options} -DWAY=${WAY} -DORBIS_SOURCE=${ORBIS_SOURCE})
run(${CMAKE_COMMAND} --build ${SCRATCH}/build)
run(${SCRATCH}/build/consumer)
