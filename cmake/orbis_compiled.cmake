# SPDX-License-Identifier: BSD-3-Clause
#
# orbis::compiled: a static library of what most programs instantiate, so that they need not compile it themselves. Its
# sources, cmake/compiled/<component>*.cpp, instantiate templates and kernels of the headers and hold the functions marked
# ORBIS_COMPILED_ONCE. Who links it compiles with ORBIS_COMPILED, which makes the headers declare all of this
# (include/orbis/<component>/detail/compiled) and changes nothing else: programs with and without it can be linked
# together.
if(PROJECT_IS_TOP_LEVEL AND NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release)
endif()
set(ORBIS_COMPILED_COMPONENTS)
set(_orbis_sources)
foreach(_orbis_component IN LISTS ORBIS_PROVIDED_COMPONENTS)
  file(GLOB _orbis_found CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/compiled/${_orbis_component}.cpp
       ${PROJECT_SOURCE_DIR}/cmake/compiled/${_orbis_component}_*.cpp)
  if(_orbis_found)
    list(APPEND ORBIS_COMPILED_COMPONENTS ${_orbis_component})
    list(APPEND _orbis_sources ${_orbis_found})
  endif()
endforeach()

# _orbis_add_compiled(<name> <archive> <macro> <source>...): the target orbis_<name>.
function(_orbis_add_compiled name archive macro)
  add_library(orbis_${name} STATIC ${ARGN})
  add_library(orbis::${name} ALIAS orbis_${name})
  set_target_properties(orbis_${name} PROPERTIES EXPORT_NAME ${name} OUTPUT_NAME ${archive} POSITION_INDEPENDENT_CODE ON)
  target_compile_definitions(orbis_${name} PUBLIC ${macro})
  target_compile_options(orbis_${name} PRIVATE -ffp-contract=off)  # the same bits as everywhere
endfunction()

set(ORBIS_COMPILED_LIBRARIES)
if(_orbis_sources)
  _orbis_add_compiled(compiled orbis ORBIS_COMPILED ${_orbis_sources})
  foreach(_orbis_component IN LISTS ORBIS_COMPILED_COMPONENTS)
    target_link_libraries(orbis_compiled PUBLIC orbis_${_orbis_component})
  endforeach()
  list(APPEND ORBIS_COMPILED_LIBRARIES compiled)
endif()
