# SPDX-License-Identifier: BSD-3-Clause
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

make_plate(${WORK}/cloud.ply)
app(0 map cloud.ply --out out --resolution 0.1 --filter none)
must_exist(${WORK}/out cloud.ply cloud_filtered.ply map_unfiltered.bt map.bt map.ot summary.json report.html map.png)
summary(occupied ${WORK}/out octree occupied)
check(occupied EQUAL 100)
summary(free ${WORK}/out octree free)
check(free EQUAL 0)
summary(frames ${WORK}/out frames)
check(NOT frames)  # null: there was no SLAM

app(0 map cloud.ply --out out --resolution 0.1 --filter none --origin 0.5,0.5,0.05)
summary(free ${WORK}/out octree free)
check(free GREATER 100)

app(0 map out/cloud_filtered.ply --out again --resolution 0.1 --filter statistical --neighbors 8 --sigma 3)
summary(mode ${WORK}/again filter mode)
check(mode STREQUAL "statistical")

app(0 map cloud.ply --out again --resolution 0.1 --filter radius --radius 0.11 --neighbors 4)
summary(mode ${WORK}/again filter mode)
check(mode STREQUAL "radius")
summary(kept ${WORK}/again cloud points_filtered)
check(kept EQUAL 64)  # all but the border
check(out MATCHES "Filter  radius, removed 36 of 100 points .36.00 %.")
app(0 map cloud.ply --out again --resolution 0.1 --filter radius --radius 0.02)
summary(kept ${WORK}/again cloud points_filtered)
check(kept EQUAL 0)
must_exist(${WORK}/again filter.png map.bt)

# A recording, with its ground truth for poses.
make_recording(${WORK}/room 6 160)
app(0 map room --out out --resolution 0.1)
summary(free ${WORK}/out octree free)
check(free GREATER 100)
check(NOT EXISTS ${WORK}/out/trajectory.txt)

# Every filter by its name; its name in the summary.
foreach(filter none statistical radius log-statistical cluster ray-evidence)
  app(0 map room --out named --resolution 0.2 --quiet --filter ${filter})
  summary(mode ${WORK}/named filter mode)
  check(mode STREQUAL filter)
endforeach()
