# SPDX-License-Identifier: BSD-3-Clause
#
# The table of components. Used by the build itself and, installed, by orbis-config.cmake, so that
# `find_package(orbis COMPONENTS octree)` looks for exactly what `octree` needs.

# In topological order: dependencies come first.
set(ORBIS_ALL_COMPONENTS core camera features places optimize cloud octree io eval slam mapping nav
                         cloud_nanoflann interop_opencv interop_octomap interop_pcl interop_open3d interop_ompl interop_fcl)
# One header each for another library: provided if that library is installed, and requested by name.
set(ORBIS_OPTIONAL_COMPONENTS "^(cloud_nanoflann|interop_.*|compiled)$")

set(ORBIS_core_PACKAGES Eigen3 tl-expected Threads)
set(ORBIS_core_LIBRARIES Eigen3::Eigen tl::expected Threads::Threads)

set(ORBIS_camera_NEEDS core)

set(ORBIS_features_NEEDS camera)

set(ORBIS_places_NEEDS core)

set(ORBIS_optimize_NEEDS camera)

set(ORBIS_cloud_NEEDS camera)

set(ORBIS_cloud_nanoflann_NEEDS cloud)
set(ORBIS_cloud_nanoflann_PACKAGES nanoflann)
set(ORBIS_cloud_nanoflann_LIBRARIES nanoflann::nanoflann)

set(ORBIS_octree_NEEDS camera)

set(ORBIS_io_NEEDS camera)
set(ORBIS_io_PACKAGES PNG JPEG tomlplusplus)
set(ORBIS_io_LIBRARIES PNG::PNG JPEG::JPEG tomlplusplus::tomlplusplus)

set(ORBIS_eval_NEEDS core)

set(ORBIS_slam_NEEDS features optimize places)
set(ORBIS_mapping_NEEDS cloud octree)
set(ORBIS_nav_NEEDS octree)

set(ORBIS_interop_opencv_NEEDS features)
set(ORBIS_interop_opencv_PACKAGES OpenCV)
set(ORBIS_interop_opencv_LIBRARIES opencv_core)

set(ORBIS_interop_octomap_NEEDS octree nav)
set(ORBIS_interop_octomap_PACKAGES octomap)
set(ORBIS_interop_octomap_LIBRARIES octomap octomath)

set(ORBIS_interop_pcl_NEEDS cloud)
set(ORBIS_interop_pcl_PACKAGES PCL)
set(ORBIS_interop_pcl_LIBRARIES pcl_common)

set(ORBIS_interop_open3d_NEEDS cloud)
set(ORBIS_interop_open3d_PACKAGES Open3D)
set(ORBIS_interop_open3d_LIBRARIES Open3D::Open3D)

set(ORBIS_interop_ompl_NEEDS nav)
set(ORBIS_interop_ompl_PACKAGES ompl)
set(ORBIS_interop_ompl_LIBRARIES ompl::ompl)

set(ORBIS_interop_fcl_NEEDS interop_octomap)
set(ORBIS_interop_fcl_PACKAGES fcl octomap)
set(ORBIS_interop_fcl_LIBRARIES fcl)

# Further arguments of find_package.
set(ORBIS_OpenCV_FIND_ARGUMENTS COMPONENTS core)
set(ORBIS_PCL_FIND_ARGUMENTS COMPONENTS common)

# The packages of Debian and Ubuntu, for error messages.
set(ORBIS_Eigen3_DEBIAN libeigen3-dev)
set(ORBIS_tl-expected_DEBIAN libexpected-dev)
set(ORBIS_PNG_DEBIAN libpng-dev)
set(ORBIS_JPEG_DEBIAN libjpeg-dev)
set(ORBIS_tomlplusplus_DEBIAN libtomlplusplus-dev)
set(ORBIS_nanoflann_DEBIAN libnanoflann-dev)
set(ORBIS_OpenCV_DEBIAN libopencv-dev)
set(ORBIS_octomap_DEBIAN liboctomap-dev)
set(ORBIS_PCL_DEBIAN libpcl-dev)
set(ORBIS_ompl_DEBIAN libompl-dev)
set(ORBIS_fcl_DEBIAN libfcl-dev)

# orbis_name_targets(): defines targets for packages without any. OMPL before 1.6 defines variables only; its library is
# linked to its own dependencies.
macro(orbis_name_targets)
  if(ompl_FOUND AND NOT TARGET ompl::ompl)
    list(GET OMPL_LIBRARIES 0 _orbis_library)
    add_library(ompl::ompl INTERFACE IMPORTED)
    target_include_directories(ompl::ompl SYSTEM INTERFACE ${OMPL_INCLUDE_DIRS})
    target_link_libraries(ompl::ompl INTERFACE ${_orbis_library})
  endif()
endmacro()

# orbis_find_packages(<out> <component>...): finds the packages of these components. <out> is empty, or a message that
# names all missing packages and how to install them.
macro(orbis_find_packages _orbis_out)
  set(THREADS_PREFER_PTHREAD_FLAG ON)
  set(_orbis_missing)
  set(_orbis_debian)
  foreach(_orbis_component ${ARGN})
    foreach(_orbis_package IN LISTS ORBIS_${_orbis_component}_PACKAGES)
      find_package(${_orbis_package} ${ORBIS_${_orbis_package}_FIND_ARGUMENTS} QUIET)
      if(NOT ${_orbis_package}_FOUND)
        list(APPEND _orbis_missing "${_orbis_package} (for ${_orbis_component})")
        list(APPEND _orbis_debian ${ORBIS_${_orbis_package}_DEBIAN})
      endif()
    endforeach()
    orbis_name_targets()
  endforeach()
  set(${_orbis_out} "")
  if(_orbis_missing)
    list(REMOVE_DUPLICATES _orbis_missing)
    list(REMOVE_DUPLICATES _orbis_debian)
    list(JOIN _orbis_missing ", " _orbis_missing)
    list(JOIN _orbis_debian " " _orbis_debian)
    set(${_orbis_out} "orbis: not found: ${_orbis_missing}.")
    if(_orbis_debian)
      string(APPEND ${_orbis_out} "\n  On Debian and Ubuntu: apt-get install ${_orbis_debian}")
    endif()
  endif()
endmacro()

# orbis_close_components(<out> <component>...): the components and all their dependencies, in order.
function(orbis_close_components out)
  set(wanted ${ARGN})
  if("all" IN_LIST wanted)
    set(wanted ${ORBIS_ALL_COMPONENTS})
  endif()
  set(pending ${wanted})
  while(pending)
    list(POP_FRONT pending component)
    if(NOT component IN_LIST ORBIS_ALL_COMPONENTS)
      message(FATAL_ERROR "orbis has no component \"${component}\"; the components are: ${ORBIS_ALL_COMPONENTS}")
    endif()
    foreach(need IN LISTS ORBIS_${component}_NEEDS)
      if(NOT need IN_LIST wanted)
        list(APPEND wanted ${need})
        list(APPEND pending ${need})
      endif()
    endforeach()
  endwhile()
  set(ordered)
  foreach(component IN LISTS ORBIS_ALL_COMPONENTS)
    if(component IN_LIST wanted)
      list(APPEND ordered ${component})
    endif()
  endforeach()
  set(${out} ${ordered} PARENT_SCOPE)
endfunction()

# Defines one INTERFACE target per requested component, and orbis::orbis for all of them. With "all", optional components
# are provided if their libraries are found. With ORBIS_HEADERS_ONLY no libraries are searched for: the targets name them,
# and find_package(orbis) finds them.
macro(orbis_add_components)
  orbis_close_components(ORBIS_PROVIDED_COMPONENTS ${ARGN})
  if("all" IN_LIST ORBIS_COMPONENTS AND NOT ORBIS_HEADERS_ONLY)
    foreach(_orbis_component IN LISTS ORBIS_PROVIDED_COMPONENTS)
      if(_orbis_component MATCHES "${ORBIS_OPTIONAL_COMPONENTS}")
        foreach(_orbis_package IN LISTS ORBIS_${_orbis_component}_PACKAGES)
          find_package(${_orbis_package} ${ORBIS_${_orbis_package}_FIND_ARGUMENTS} QUIET)
          if(NOT ${_orbis_package}_FOUND)
            list(REMOVE_ITEM ORBIS_PROVIDED_COMPONENTS ${_orbis_component})
          endif()
        endforeach()
      endif()
    endforeach()
  endif()
  if(NOT ORBIS_HEADERS_ONLY)
    orbis_find_packages(_orbis_trouble ${ORBIS_PROVIDED_COMPONENTS})
    if(_orbis_trouble)
      message(FATAL_ERROR "${_orbis_trouble}")
    endif()
  endif()
  foreach(_orbis_component IN LISTS ORBIS_PROVIDED_COMPONENTS)
    _orbis_add_component(${_orbis_component})
  endforeach()
  add_library(orbis_orbis INTERFACE)
  add_library(orbis::orbis ALIAS orbis_orbis)
  set_target_properties(orbis_orbis PROPERTIES EXPORT_NAME orbis)
  foreach(_orbis_component IN LISTS ORBIS_PROVIDED_COMPONENTS)
    if(NOT _orbis_component MATCHES "${ORBIS_OPTIONAL_COMPONENTS}")
      target_link_libraries(orbis_orbis INTERFACE orbis_${_orbis_component})
    endif()
  endforeach()
endmacro()

function(_orbis_add_component component)
  add_library(orbis_${component} INTERFACE)
  add_library(orbis::${component} ALIAS orbis_${component})
  set_target_properties(orbis_${component} PROPERTIES EXPORT_NAME ${component})
  target_compile_features(orbis_${component} INTERFACE cxx_std_20)
  target_include_directories(orbis_${component} INTERFACE
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>)
  foreach(need IN LISTS ORBIS_${component}_NEEDS)
    target_link_libraries(orbis_${component} INTERFACE orbis_${need})
  endforeach()
  target_link_libraries(orbis_${component} INTERFACE ${ORBIS_${component}_LIBRARIES})
endfunction()
