# SPDX-License-Identifier: BSD-3-Clause
#
# Installs headers, one export set per component (so that find_package needs only the requested ones), the package files,
# and a pkg-config file.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(_orbis_cmake_dir ${CMAKE_INSTALL_DATADIR}/cmake/orbis)

install(DIRECTORY include/orbis DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
foreach(component IN LISTS ORBIS_PROVIDED_COMPONENTS)
  install(TARGETS orbis_${component} EXPORT orbis-${component}
          INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT orbis-${component} NAMESPACE orbis:: DESTINATION ${_orbis_cmake_dir}
          FILE orbis-${component}-targets.cmake)
endforeach()

set(_orbis_arch_independent ARCH_INDEPENDENT)
if(TARGET orbis_compiled)
  install(TARGETS orbis_compiled EXPORT orbis-compiled ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
          INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
  install(EXPORT orbis-compiled NAMESPACE orbis:: DESTINATION ${_orbis_cmake_dir} FILE orbis-compiled-targets.cmake)
  set(_orbis_arch_independent "")
endif()

write_basic_package_version_file(${PROJECT_BINARY_DIR}/orbis-config-version.cmake
  COMPATIBILITY SameMinorVersion ${_orbis_arch_independent})
configure_package_config_file(cmake/orbis-config.cmake.in ${PROJECT_BINARY_DIR}/orbis-config.cmake
  INSTALL_DESTINATION ${_orbis_cmake_dir})
install(FILES ${PROJECT_BINARY_DIR}/orbis-config.cmake ${PROJECT_BINARY_DIR}/orbis-config-version.cmake
              cmake/orbis_components.cmake
        DESTINATION ${_orbis_cmake_dir})

# Relative to the file, so that the installed tree can be moved or installed elsewhere than configured.
file(RELATIVE_PATH _orbis_pc_to_prefix ${CMAKE_INSTALL_FULL_DATADIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" _orbis_pc_to_prefix "${_orbis_pc_to_prefix}")
cmake_path(IS_ABSOLUTE CMAKE_INSTALL_INCLUDEDIR _orbis_fixed_include)
if(_orbis_fixed_include)
  set(_orbis_pc_include ${CMAKE_INSTALL_INCLUDEDIR})
else()
  set(_orbis_pc_include "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
configure_file(cmake/orbis.pc.in ${PROJECT_BINARY_DIR}/orbis.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/orbis.pc DESTINATION ${CMAKE_INSTALL_DATADIR}/pkgconfig)
if(TARGET orbis_compiled)
  set(_orbis_pc_private "")  # libraries of programs that read recordings: pkg-config --static
  if("io" IN_LIST ORBIS_COMPILED_COMPONENTS)
    set(_orbis_pc_private "libpng libjpeg tomlplusplus")
  endif()
  configure_file(cmake/orbis-compiled.pc.in ${PROJECT_BINARY_DIR}/orbis-compiled.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/orbis-compiled.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/orbis)
