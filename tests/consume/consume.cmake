# SPDX-License-Identifier: BSD-3-Clause
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    string(JOIN " " command ${ARGN})
    message(FATAL_ERROR "${command}\n${output}")
  endif()
endfunction()

# Builds and runs a program with what pkg-config says of a package, with options that follow the program.
function(build_by_pkg_config name package program)
  execute_process(COMMAND ${PKG_CONFIG} --cflags --libs ${ARGN} ${package} OUTPUT_VARIABLE flags RESULT_VARIABLE status)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "pkg-config does not know ${package}")
  endif()
  separate_arguments(flags UNIX_COMMAND "${flags}")
  file(WRITE ${SCRATCH}/${name}.cpp "${program}")
  run(${COMPILER} -std=c++20 ${SCRATCH}/${name}.cpp -o ${SCRATCH}/${name} ${flags})
  run(${SCRATCH}/${name})
endfunction()

file(REMOVE_RECURSE ${SCRATCH})
set(options -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_BUILD_TYPE=Debug -DCMAKE_CXX_FLAGS_DEBUG=-O0)

if(WAY STREQUAL "find_package")
  run(${CMAKE_COMMAND} -S ${ORBIS_SOURCE} -B ${SCRATCH}/orbis ${options} -DORBIS_BUILD_TESTS=OFF
      -DORBIS_BUILD_BENCH=OFF -DORBIS_BUILD_EXAMPLES=OFF -DCMAKE_INSTALL_PREFIX=${SCRATCH}/first
      -DCMAKE_INSTALL_INCLUDEDIR=include/versioned
      -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON -DCMAKE_DISABLE_FIND_PACKAGE_PNG=ON)  # headers install without libraries
  run(${CMAKE_COMMAND} --install ${SCRATCH}/orbis)
  file(RENAME ${SCRATCH}/first ${SCRATCH}/prefix)  # what is installed can be moved
  foreach(file IN ITEMS include/versioned/orbis/orbis.hpp share/cmake/orbis/orbis-config.cmake share/pkgconfig/orbis.pc)
    if(NOT EXISTS ${SCRATCH}/prefix/${file})
      message(FATAL_ERROR "${file} was not installed")
    endif()
  endforeach()
  list(APPEND options -DCMAKE_PREFIX_PATH=${SCRATCH}/prefix)
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${PROJECT} -B ${SCRATCH}/without ${options} -DWAY=find_package
                  -DCMAKE_DISABLE_FIND_PACKAGE_Eigen3=ON ERROR_VARIABLE output OUTPUT_QUIET)
  if(NOT output MATCHES "Eigen3 .for core." OR NOT output MATCHES "apt-get install libeigen3-dev")
    message(FATAL_ERROR "no word of how to install Eigen:\n${output}")
  endif()
  find_program(PKG_CONFIG pkg-config)
  if(PKG_CONFIG)
    set(ENV{PKG_CONFIG_PATH} ${SCRATCH}/prefix/share/pkgconfig)
    build_by_pkg_config(core orbis "#include <orbis/core.hpp>\nint main() { return orbis::seq.threads() == 1 ? 0 : 1; }\n")
  endif()
  if(BUILD)  # the compiled flavour, as this build has it
    run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${SCRATCH}/with_library)
    foreach(with_io IN ITEMS OFF ON)  # in this order: the second build adds io to the first
      run(${CMAKE_COMMAND} -S ${PROJECT} -B ${SCRATCH}/mixed ${options} -DWAY=find_package -DMIXED=ON
          -DWITH_IO=${with_io} -DCMAKE_PREFIX_PATH=${SCRATCH}/with_library)
      run(${CMAKE_COMMAND} --build ${SCRATCH}/mixed)
      run(${SCRATCH}/mixed/consumer)
    endforeach()
    if(PKG_CONFIG)
      file(GLOB directory ${SCRATCH}/with_library/lib*/pkgconfig ${SCRATCH}/with_library/lib/*/pkgconfig)
      list(JOIN directory ":" directory)
      set(ENV{PKG_CONFIG_PATH} ${SCRATCH}/with_library/share/pkgconfig:${directory})
      build_by_pkg_config(octree orbis-compiled
        "#include <orbis/octree.hpp>\nint main() { return orbis::octree::occupancy_octree<>{0.05}.num_occupied_leaves() == 0 ? 0 : 1; }\n")
      build_by_pkg_config(recording orbis-compiled
        "#include <orbis/io/recording.hpp>\nint main() { return orbis::io::open_recording(\"nowhere\") ? 1 : 0; }\n" --static)
    endif()
  endif()
endif()

run(${CMAKE_COMMAND} -S ${PROJECT} -B ${SCRATCH}/build ${options} -DWAY=${WAY} -DORBIS_SOURCE=${ORBIS_SOURCE})
run(${CMAKE_COMMAND} --build ${SCRATCH}/build)
run(${SCRATCH}/build/consumer)
