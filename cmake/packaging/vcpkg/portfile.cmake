# SPDX-License-Identifier: BSD-3-Clause
#
# An overlay port that builds the sources containing it.
#   vcpkg install orbis --overlay-ports=<orbis>/cmake/packaging/vcpkg
get_filename_component(SOURCE_PATH "${CURRENT_PORT_DIR}/../../.." ABSOLUTE)

set(components core camera features places optimize cloud octree eval slam mapping nav)
foreach(feature IN ITEMS io nanoflann octomap opencv pcl ompl fcl)
  if(feature IN_LIST FEATURES)
    set(component interop_${feature})
    if(feature STREQUAL "io")
      set(component io)
    elseif(feature STREQUAL "nanoflann")
      set(component cloud_nanoflann)
    endif()
    list(APPEND components ${component})
  endif()
endforeach()

vcpkg_check_features(OUT_FEATURE_OPTIONS options FEATURES compiled ORBIS_BUILD_COMPILED)
if(NOT "compiled" IN_LIST FEATURES)
  set(VCPKG_BUILD_TYPE release)  # headers only
endif()
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS
    "-DORBIS_COMPONENTS=${components}"
    -DORBIS_BUILD_TESTS=OFF
    -DORBIS_BUILD_BENCH=OFF
    -DORBIS_BUILD_EXAMPLES=OFF
    -DORBIS_LIBDEFLATE=OFF
    ${options}
  MAYBE_UNUSED_VARIABLES
    ORBIS_LIBDEFLATE
)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH share/cmake/orbis)
vcpkg_fixup_pkgconfig()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
if(NOT "compiled" IN_LIST FEATURES)
  file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/lib")
endif()
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
