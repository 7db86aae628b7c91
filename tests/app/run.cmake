# SPDX-License-Identifier: BSD-3-Clause
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
make_recording(${WORK}/room 30 320)

app(0 run room --out out --resolution 0.1)
summary(tracked ${WORK}/out tracked)
check(tracked EQUAL 30)
summary(map_error_m ${WORK}/out map_error_m)
check(NOT map_error_m)  # null: a recording on disk knows no surface

# The camera as it was used: a shutter that was given is in its file, one that was found to be global is not.
check(err MATCHES "\nshutter +")
file(READ ${WORK}/out/camera_used.toml camera)
check(camera MATCHES "fx = 262.5\n" AND NOT camera MATCHES "read_out")
app(0 run room --out rolling --read-out-ms 20 --frames 5 --resolution 0.2 --filter none)
file(READ ${WORK}/rolling/camera_used.toml camera)
check(camera MATCHES "\nread_out_ms = 20.0\ndepth_read_out_ms = 20.0\n")

# Options from a file; the command line has the last word.
file(WRITE ${WORK}/options.toml "resolution = 0.2\nstride = 2\nfilter = \"none\"\n")
app(0 run room --out out --config options.toml --stride 3 --quiet)
summary(frames ${WORK}/out frames)
check(frames EQUAL 10)
summary(resolution ${WORK}/out octree resolution_m)
check(resolution EQUAL 0.2)
summary(removed ${WORK}/out filter removed)
check(removed EQUAL 0)

# Without ground truth there is nothing to compare with, and nothing is invented.
file(REMOVE ${WORK}/room/groundtruth.txt)
app(0 run room --out out --frames 10 --resolution 0.1)
summary(ate ${WORK}/out ate_rmse_m)
check(NOT ate)

# Names from outside are text in the page, whatever is in them.
file(RENAME ${WORK}/room "${WORK}/<script>alert(1)<")
app(0 run "<script>alert(1)<" --out out --frames 5 --resolution 0.2)
file(READ ${WORK}/out/report.html page)
string(FIND "${page}" "<script>alert" at)
check(at EQUAL -1)
file(RENAME "${WORK}/<script>alert(1)<" ${WORK}/room)

# The world is upright, and the summary says how that was found.
summary(up ${WORK}/out world up_from)
check(up STREQUAL "floor" OR up STREQUAL "walls")
summary(confidence ${WORK}/out world confidence)
check(confidence GREATER 0.06)
check(out MATCHES "World  z up, from the ${up}")
app(0 run room --out level --frames 5 --resolution 0.2 --gravity 0,2,0)
summary(up ${WORK}/level world up_from)
check(up STREQUAL "gravity")
file(STRINGS ${WORK}/level/trajectory.txt poses REGEX "^[^#]")
list(GET poses 0 first)  # at the origin; a level camera looks along x: half turns about the room's diagonals
check(first MATCHES " 0(\\.0+)? 0(\\.0+)? 0(\\.0+)? -?0\\.50* -?0\\.50* -?0\\.50* -?0\\.50*$")

# Two places that hang together by nothing: the smaller map's trajectory has a file of its own.
make_recording(${WORK}/apart 190 320)
foreach(list rgb depth)
  file(STRINGS ${WORK}/apart/${list}.txt lines)
  list(SUBLIST lines 0 40 first)
  list(SUBLIST lines 120 70 second)
  list(APPEND first ${second})
  list(JOIN first "\n" text)
  file(WRITE ${WORK}/apart/${list}.txt "${text}\n")
endforeach()
app(0 run apart --out apart_out --resolution 0.2 --filter none --deterministic)
check(err MATCHES "40 of 110 tracked frames are not in the cloud and octree.* in trajectory_2\\.txt")
must_exist(${WORK}/apart_out trajectory.txt trajectory_2.txt)
file(STRINGS ${WORK}/apart_out/trajectory.txt main REGEX "^[^#]")
file(STRINGS ${WORK}/apart_out/trajectory_2.txt other REGEX "^[^#]")
list(LENGTH main count)
check(count EQUAL 70)
list(LENGTH other count)
check(count EQUAL 40)
file(READ ${WORK}/apart_out/summary.json text)
string(JSON name GET "${text}" other_maps 0 file)
check(name STREQUAL "trajectory_2.txt")
string(JSON count GET "${text}" other_maps 0 frames)
check(count EQUAL 40)
