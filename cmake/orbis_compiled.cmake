# SPDX-License-Identifier: BSD-3-Clause
#
# orbis::compiled: a static library of common instantiations, which saves programs compile time. Its sources,
# cmake/compiled/<component>*.cpp, instantiate templates and kernels of the headers and contain the non-template functions.
# Its users compile with ORBIS_COMPILED, which makes the headers declare these; results are the same, and programs with and
# without it can be linked together. decode_png_depth in the library may use libdeflate, which headers alone never do.
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(ORBIS_COMPILED_COMPONENTS)
set(ORBIS_COMPILED_NEEDS_LIBDEFLATE OFF)
set(_orbis_sources)
foreach(_orbis_component IN LISTS ORBIS_PROVIDED_COMPONENTS)
  file(GLOB _orbis_found CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/compiled/${_orbis_component}.cpp
       ${PROJECT_SOURCE_DIR}/cmake/compiled/${_orbis_component}_*.cpp)
  if(_orbis_found)
    list(APPEND ORBIS_COMPILED_COMPONENTS ${_orbis_component})
    list(APPEND _orbis_sources ${_orbis_found})
  endif()
endforeach()
# Users of the library do not need the dependencies of io: io and libdeflate are linked privately, and publicly by users of
# io only, for whom orbis-config.cmake looks for libdeflate.
set(ORBIS_COMPILED_NEEDS ${ORBIS_COMPILED_COMPONENTS})
list(REMOVE_ITEM ORBIS_COMPILED_NEEDS io)

if(_orbis_sources)
  add_library(orbis_compiled STATIC ${_orbis_sources})
  add_library(orbis::compiled ALIAS orbis_compiled)
  set_target_properties(orbis_compiled PROPERTIES EXPORT_NAME compiled OUTPUT_NAME orbis POSITION_INDEPENDENT_CODE ON)
  target_compile_definitions(orbis_compiled PUBLIC ORBIS_COMPILED)
  target_compile_options(orbis_compiled PRIVATE -ffp-contract=off)  # identical results on all machines
  foreach(_orbis_component IN LISTS ORBIS_COMPILED_NEEDS)
    target_link_libraries(orbis_compiled PUBLIC orbis_${_orbis_component})
  endforeach()
  if("io" IN_LIST ORBIS_COMPILED_COMPONENTS)
    target_link_libraries(orbis_compiled PRIVATE $<BUILD_INTERFACE:orbis_io>
      INTERFACE $<INSTALL_INTERFACE:$<$<TARGET_EXISTS:orbis::io>:orbis::io>>)
    option(ORBIS_LIBDEFLATE "Decode depth images in orbis::compiled with libdeflate, if it is found" ON)
    if(ORBIS_LIBDEFLATE)
      find_path(LIBDEFLATE_INCLUDE_DIR libdeflate.h)
      find_library(LIBDEFLATE_LIBRARY deflate)
      mark_as_advanced(LIBDEFLATE_INCLUDE_DIR LIBDEFLATE_LIBRARY)
    endif()
    if(ORBIS_LIBDEFLATE AND LIBDEFLATE_INCLUDE_DIR AND LIBDEFLATE_LIBRARY)
      set(ORBIS_COMPILED_NEEDS_LIBDEFLATE ON)
      set(ORBIS_COMPILED_LIBS_PRIVATE -ldeflate)
      target_compile_definitions(orbis_compiled PRIVATE ORBIS_LIBDEFLATE)
      target_include_directories(orbis_compiled SYSTEM PRIVATE ${LIBDEFLATE_INCLUDE_DIR})
      target_link_libraries(orbis_compiled PRIVATE $<BUILD_INTERFACE:${LIBDEFLATE_LIBRARY}>
        INTERFACE $<INSTALL_INTERFACE:$<$<TARGET_EXISTS:orbis::libdeflate>:orbis::libdeflate>>)
    endif()
  endif()
endif()
