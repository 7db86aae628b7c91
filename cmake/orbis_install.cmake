# SPDX-License-Identifier: BSD-3-Clause
#
# Headers, one export set for each component (so that a consumer's find_package pulls in no more
# than it names), the package files, and a pkg-config file.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(_orbis_cmake_dir ${CMAKE_INSTALL_DATADIR}/cmake/orbis)

install(DIRECTORY include/orbis DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
foreach(component IN LISTS ORBIS_PROVIDED_COMPONENTS)
  install(TARGETS orbis_${component} EXPORT orbis-${component})
  install(EXPORT orbis-${component} NAMESPACE orbis:: DESTINATION ${_orbis_cmake_dir}
          FILE orbis-${component}-targets.cmake)
endforeach()

write_basic_package_version_file(${PROJECT_BINARY_DIR}/orbis-config-version.cmake
  COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
configure_package_config_file(cmake/orbis-config.cmake.in ${PROJECT_BINARY_DIR}/orbis-config.cmake
  INSTALL_DESTINATION ${_orbis_cmake_dir})
install(FILES ${PROJECT_BINARY_DIR}/orbis-config.cmake ${PROJECT_BINARY_DIR}/orbis-config-version.cmake
              cmake/orbis_components.cmake
        DESTINATION ${_orbis_cmake_dir})

configure_file(cmake/orbis.pc.in ${PROJECT_BINARY_DIR}/orbis.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/orbis.pc DESTINATION ${CMAKE_INSTALL_DATADIR}/pkgconfig)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/orbis)
