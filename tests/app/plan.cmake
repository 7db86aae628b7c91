# SPDX-License-Identifier: BSD-3-Clause
#
# Floor maps and paths.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

function(length_of variable file)  # of the path that was printed last, in millimetres
  string(REGEX MATCH "of ([0-9]+)\\.([0-9][0-9][0-9]) m over" found "${out}")
  set(${variable} "${CMAKE_MATCH_1}${CMAKE_MATCH_2}" PARENT_SCOPE)
  file(STRINGS ${WORK}/${file} lines)
  list(POP_FRONT lines head)
  check(head STREQUAL "# x y z, metres")
  list(LENGTH lines points)
  check(points GREATER 1)
  check(out MATCHES "over ${points} points")
endfunction()

set(room_run demo --frames 90 --stride 4 --width 320 --resolution 0.1 --threads 1 --out room)
# The rest is unknown.
make_plate(${WORK}/cloud.ply)
app(0 map cloud.ply --out plate --resolution 0.1 --filter none)
check(NOT EXISTS ${WORK}/plate/navigation.png)  # no floor, no camera
app(0 plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,0.5,1.6 --robot-radius 0.1 --unknown free --out way.txt --picture way.png)
must_exist(${WORK} way.txt way.png)
length_of(length way.txt)
check(length GREATER 1560)  # two sides of 0.74 m and 0.78 m, to where the ball passes the plate's edge
check(length LESS 1760)
check(out MATCHES "straight 1.100 m")
app(0 plan plate/map.ot --from 0.5,0.5,0.5 --to 0.5,1.6,0.5 --radius 0.1 --unknown free --out way.txt)
length_of(length way.txt)
check(length EQUAL 1100)
file(SHA256 ${WORK}/way.txt kept)
# A cylinder under the plate is too high for a ball's way.
app_fails(4 "start blocked" plan plate/map.ot --from 0.5,0.5,0.5 --to 0.5,1.6,0.5 --radius 0.1 --height 0.6
          --unknown free --out way.txt)
app_fails(4 "start blocked by unknown space alone" plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,0.5,1.6 --out way.txt)
app_fails(4 "start blocked" plan plate/map.bt --from 0.5,0.5,1.0 --to 0.5,0.5,1.6 --out way.txt)
check(NOT err MATCHES "unknown")
app_fails(4 "goal outside; the nearest" plan plate/map.bt --from 0.5,0.5,0.5 --to 1e6,0.5,1.0 --unknown free
          --radius 0.1 --out way.txt)
app_fails(1 "--step is for robots that drive" plan plate/map.bt --from 0.5,0.5,0.5 --to 1,1,1 --step 0.1)
app_fails(4 "goal blocked; the nearest" plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,0.5,1.0 --unknown free
          --radius 0.1 --out way.txt)
file(SHA256 ${WORK}/way.txt left)
check(left STREQUAL kept)  # what is not found replaces nothing
app_fails(2 "no floor" plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,1.5,0.5 --ground)
app_fails(2 "no octree map" plan cloud.ply --from 0,0,0 --to 1,1,1)
app_fails(2 "no.such" plan no.such --from 0,0,0 --to 1,1,1)
file(READ ${WORK}/plate/map.ot bytes LIMIT 300)
file(WRITE ${WORK}/half.ot "${bytes}")
app_fails(2 "half.ot" plan half.ot --from 0,0,0 --to 1,1,1)
# What would write over the map, or over the path.
file(SHA256 ${WORK}/plate/map.bt kept)
set(ends --from 0.5,0.5,0.5 --to 0.5,1.6,0.5 --radius 0.1 --unknown free)
app_fails(1 "would be written over" plan plate/map.bt ${ends} --out plate/map.bt)
app_fails(1 "would be written over" plan plate/map.bt ${ends} --picture plate/../plate/map.bt)
app_fails(1 "both the path and the picture" plan plate/map.bt ${ends} --out new --picture ./new)
file(SHA256 ${WORK}/plate/map.bt left)
check(left STREQUAL kept)
app_fails(2 "cloud.ply" map cloud.ply --out never --floor-map cloud.ply/floor.yaml)  # before anything is done
check(err MATCHES "^rgbd_slam: ")
app_fails(1 "is not x,y,z" plan plate/map.bt --from 0,0 --to 1,1,1)
app_fails(1 "--to" plan plate/map.bt --from 0,0,0)
app_fails(1 "--robot-radius" plan plate/map.bt ${ends} --robot-radius 0.2)  # --radius is the same
# The floor map under the name of another result, and where no file can be replaced.
app_fails(2 "floor.yaml: .*another result" ${room_run} --save-map rooms/floor.yaml --floor-map rooms/floor.yaml)
file(MAKE_DIRECTORY ${WORK}/folders/floor.pgm)
app_fails(2 "floor.pgm: .*not a regular file" map cloud.ply --out never --floor-map folders/floor.yaml)
app_fails(1 "does not end in .yaml" map cloud.ply --out plate --floor-map floor.pgm)
check(NOT EXISTS ${WORK}/never/map.bt)
file(WRITE ${WORK}/floor.yaml "of an earlier run")
app_fails(2 "no floor" map cloud.ply --out all_but_that --floor-map floor.yaml)
check(NOT EXISTS ${WORK}/floor.pgm)
file(READ ${WORK}/floor.yaml left)
check(left STREQUAL "of an earlier run")
must_exist(${WORK}/all_but_that map.bt summary.json report.html)

# A room, all round.
app(0 ${room_run} --floor-map floors/of/room.yaml)
check(out MATCHES "Floor  at a height of 0.10 m, [4-6].[0-9] square metres")
check(out MATCHES "Path   [0-9.]+ m for a ball of 0.2 m, straight")
must_exist(${WORK}/room navigation.png map.bt)
must_exist(${WORK}/floors/of room.yaml room.pgm)
file(GLOB left ${WORK}/floors/of/.rgbd_slam*)
list(LENGTH left hidden)
check(hidden EQUAL 0)
summary(status ${WORK}/room navigation path status)
check(status STREQUAL "found")
summary(length ${WORK}/room navigation path length_m)
summary(straight ${WORK}/room navigation path straight_m)
check(NOT length LESS straight)
file(READ ${WORK}/floors/of/room.yaml yaml)
check(yaml MATCHES "image: \"room.pgm\"\nmode: trinary\nresolution: 0.1\norigin: .-3.[0-9]+, -2.[0-9]+, 0.0.")
file(READ ${WORK}/room/report.html page)
check(page MATCHES "<h2>For a robot</h2>")
check(page MATCHES "T_view_world 0.0000 0.0000 -?0.00[0-9]+ ")  # pictures have the floor at 0, where it is in this world
# In a corner of it, on the floor.
app(0 plan room/map.bt --from 2.6,-2.15,0 --to 1.9,-1.6,3 --ground --robot-radius 0.12 --out way.txt --picture way.png)
length_of(length way.txt)
check(length GREATER 888)
check(length LESS 1200)
file(STRINGS ${WORK}/way.txt lines)
list(GET lines -1 last)
check(last MATCHES "^1.900000 -1.600000 0.[01]0")  # on the floor, whatever height was asked for
