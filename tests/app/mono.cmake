# SPDX-License-Identifier: BSD-3-Clause
#
# Recordings of one camera without depth.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

app(0 demo --plain --sensor mono --frames 60 --deterministic --save-map room.map --out demo)
must_exist(${WORK}/demo trajectory.txt keyframes.txt summary.json report.html trajectory.png)
must_exist(${WORK} room.map)
check(err MATCHES "lengths are in arbitrary units, and there is no cloud and no octree")
if(EXISTS ${WORK}/demo/map.bt)
  message(FATAL_ERROR "a map without depth")
endif()
summary(sensor ${WORK}/demo sensor)
check(sensor STREQUAL "monocular")
summary(tracked ${WORK}/demo tracked)
check(tracked GREATER 30)
summary(ate ${WORK}/demo ate_rmse_m)
check(ate LESS 0.01)
summary(scale ${WORK}/demo scale)
check(scale GREATER 1.2)

# What is not corrected for is said.
app(3 demo --plain --sensor mono --frames 3 --read-out-ms 30 --out rolling)
check(err MATCHES "the rolling shutter of a monocular camera is not corrected")
app(3 demo --plain --sensor mono --frames 3 --read-out-ms 0 --out global)
check(NOT err MATCHES "rolling shutter")

# The map of landmarks is used again, by one camera only.
app(0 demo --plain --sensor mono --frames 20 --load-map room.map --localize-only --deterministic --out again)
summary(found ${WORK}/again tracked)
check(found EQUAL 20)
app_fails(2 "room.map: the map was built without depth" demo --plain --frames 20 --load-map room.map --out out)

# A trajectory in a unit of its own is compared after scaling.
file(MAKE_DIRECTORY ${WORK}/eval)
set(small "")
set(large "")
foreach(i RANGE 9)
  math(EXPR square "${i} * ${i}")
  math(EXPR twice "2 * ${i}")
  math(EXPR double_square "2 * ${square}")
  string(APPEND small "${i} ${i} ${square} 0 0 0 0 1\n")
  string(APPEND large "${i} ${twice} ${double_square} 0 0 0 0 1\n")
endforeach()
file(WRITE ${WORK}/eval/small.txt "${small}")
file(WRITE ${WORK}/eval/large.txt "${large}")
app(0 eval eval/small.txt eval/large.txt --scale)
check(out MATCHES "ATE  RMSE 0.0000 m.*after scaling by 2")
check(NOT err MATCHES "--scale")
app(0 eval eval/small.txt eval/large.txt --scale --json)
string(JSON scale GET "${out}" scale)
check(scale GREATER 1.9999 AND scale LESS 2.0001)
app(0 eval eval/small.txt eval/large.txt)
check(out MATCHES "ATE  RMSE [1-9]")
check(err MATCHES "small.txt: scaled by 2, its ATE would be 0.0000 m. use --scale")

# A camera that sees nothing that could be followed: no start.
app_fails(3 "tracking never started: no two of the 3 frames have enough matching features and parallax" demo --plain --sensor mono --frames 3 --out still)

# A folder of images is one camera's where nothing else is in it.
file(MAKE_DIRECTORY ${WORK}/nothing)
app(2 run nothing --sensor mono --out out)
check(err MATCHES "nothing: not a known recording. the folder [^\n]*\n  known layouts: rgb.txt [^\n]*image_0 or image_2")
if(EXISTS ${DATA}/kitti07_mono)
  app(0 run ${DATA}/kitti07_mono --deterministic --out kitti)
  summary(kitti_sensor ${WORK}/kitti sensor)
  check(kitti_sensor STREQUAL "monocular")
  summary(kitti_ate ${WORK}/kitti ate_rmse_m)
  check(kitti_ate LESS 1.0)
endif()
