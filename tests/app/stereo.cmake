# SPDX-License-Identifier: BSD-3-Clause
#
# Recordings of stereo cameras.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

app(0 demo --plain --sensor stereo --frames 30 --width 320 --resolution 0.1 --deterministic --out demo)
must_exist(${WORK}/demo trajectory.txt cloud.ply map.bt summary.json report.html)
summary(tracked ${WORK}/demo tracked)
check(tracked EQUAL 30)
summary(ate ${WORK}/demo ate_rmse_m)
check(ate LESS 0.02)
summary(map_error ${WORK}/demo map_error_m)
check(map_error LESS 0.15)
summary(points ${WORK}/demo cloud points)
check(points GREATER 10000)

# Depth beyond what millimetres in 16 bits reach is kept in coarser steps.
app(0 demo --plain --sensor stereo --frames 3 --width 160 --resolution 0.2 --filter none --max-depth 130 --out far)
file(READ ${WORK}/far/report.html page)
check(page MATCHES "depth / 500 = metres" AND page MATCHES "measurements up to 130 m")

# A folder that is neither: both kinds are named.
file(MAKE_DIRECTORY ${WORK}/nothing)
foreach(kind "stereo;image_0, image_1" "rgbd;rgb.txt and depth.txt")
  list(GET kind 0 sensor)
  list(GET kind 1 layout)
  app(2 run nothing --sensor ${sensor} --out out)
  check(err MATCHES "nothing: not a known recording. the folder [^\n]*\n  known layouts: ${layout}")
endforeach()

# Two lists of images are stereo where there is no depth.
if(EXISTS ${DATA}/kitti_stereo_a)
  app(0 run ${DATA}/kitti_stereo_a --frames 6 --filter none --deterministic --out kitti)
  # As far as the cameras measure well: 20 times their distance of 0.54 m.
  file(READ ${WORK}/kitti/report.html page)
  check(page MATCHES "measurements up to 10.7")
  app(0 run ${DATA}/kitti_stereo_a --frames 3 --max-depth 4 --filter none --deterministic --out near)
  file(READ ${WORK}/near/report.html page)
  check(page MATCHES "measurements up to 4 m")
  summary(tracked ${WORK}/kitti tracked)
  check(tracked EQUAL 6)
  app_fails(2 "depth.txt" run ${DATA}/kitti_stereo_a --sensor rgbd --out out)
endif()
