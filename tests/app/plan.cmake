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

# A cloud of a room of 2 m x 2 m: a floor with its top at 0, walls of 0.6 m, and a pillar at (1.55, 1.05).
function(make_small_room file)
  set(points "")
  set(count 0)
  macro(add x y z)
    string(APPEND points "${x} ${y} ${z}\n")
    math(EXPR count "${count} + 1")
  endmacro()
  foreach(i RANGE 39)
    math(EXPR a "25 + 50 * ${i}")
    foreach(j RANGE 39)
      math(EXPR b "25 + 50 * ${j}")
      add(${a}e-3 ${b}e-3 -0.05)
    endforeach()
    foreach(j RANGE 11)
      math(EXPR b "25 + 50 * ${j}")
      add(${a}e-3 -0.05 ${b}e-3)
      add(${a}e-3 2.05 ${b}e-3)
      add(-0.05 ${a}e-3 ${b}e-3)
      add(2.05 ${a}e-3 ${b}e-3)
    endforeach()
  endforeach()
  foreach(j RANGE 11)
    math(EXPR b "25 + 50 * ${j}")
    foreach(xy 1.525\ 1.025 1.575\ 1.025 1.525\ 1.075 1.575\ 1.075)
      string(APPEND points "${xy} ${b}e-3\n")
      math(EXPR count "${count} + 1")
    endforeach()
  endforeach()
  file(WRITE ${file} "ply\nformat ascii 1.0\nelement vertex ${count}\nproperty float x\nproperty float y\nproperty float z\nend_header\n${points}")
endfunction()

set(room_run demo --plain --frames 90 --stride 4 --width 320 --resolution 0.1 --threads 1 --out room)
# The rest is unknown.
make_plate(${WORK}/cloud.ply)
app(0 map cloud.ply --out plate --resolution 0.1 --filter none)
check(NOT EXISTS ${WORK}/plate/navigation.png)  # no floor, no camera
app(0 plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,0.5,1.6 --robot-radius 0.1 --unknown free --out way.txt --picture way.png)
must_exist(${WORK} way.txt way.png)
length_of(length way.txt)
check(length GREATER 1560)  # two sides of 0.74 m and 0.78 m, to where the ball passes the plate's edge
check(length LESS 1760)
check(out MATCHES "straight line 1.100 m")
app(0 plan plate/map.ot --from 0.5,0.5,0.5 --to 0.5,1.6,0.5 --radius 0.1 --unknown free --out way.txt)
length_of(length way.txt)
check(length EQUAL 1100)
file(SHA256 ${WORK}/way.txt kept)
# A cylinder under the plate is too high for a ball's way.
app_fails(4 "start blocked" plan plate/map.ot --from 0.5,0.5,0.5 --to 0.5,1.6,0.5 --radius 0.1 --height 0.6
          --unknown free --out way.txt)
app_fails(4 "start blocked only by unknown space" plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,0.5,1.6 --out way.txt)
app_fails(4 "start blocked" plan plate/map.bt --from 0.5,0.5,1.0 --to 0.5,0.5,1.6 --out way.txt)
check(NOT err MATCHES "unknown")
app_fails(4 "goal outside; the nearest reachable position" plan plate/map.bt --from 0.5,0.5,0.5 --to 1e6,0.5,1.0 --unknown free
          --radius 0.1 --out way.txt)
app_fails(1 "--step needs --ground" plan plate/map.bt --from 0.5,0.5,0.5 --to 1,1,1 --step 0.1)
app_fails(4 "goal blocked by an obstacle at .*; the nearest free position .*; the nearest reachable position" plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,0.5,1.0 --unknown free
          --radius 0.1 --out way.txt)
file(SHA256 ${WORK}/way.txt left)
check(left STREQUAL kept)  # what is not found replaces nothing
# A robot that drives: the reason why there is no path, and how near it comes.
make_small_room(${WORK}/small.ply)
app(0 map small.ply --out small --resolution 0.1 --filter none --origin 0.5,0.5,1.2)
set(drive plan small/map.bt --ground --robot-radius 0.12 --robot-height 0.3)
app(0 ${drive} --from 0.5,0.5,0 --to 1.5,0.3,0 --out drive.txt)
length_of(length drive.txt)
check(length EQUAL 1020)
app_fails(4 "no path: start blocked by an obstacle at 1.550,1.050; the nearest free position is [0-9.]+,[0-9.]+,0.000, 0.200 m away"
          ${drive} --from 1.55,1.05,0 --to 0.5,0.5,0 --out drive.txt)
app_fails(4 "no path: goal blocked by an obstacle at 1.550,1.050; the nearest free position is .*, 0.200 m away; the nearest reachable position is .*, 0.200 m from the goal"
          ${drive} --from 0.5,0.5,0 --to 1.55,1.05,0 --out drive.txt)
app_fails(4 "no path: goal outside; the nearest reachable position is 1.850,0.450,0.000, 7.150 m from the goal"
          ${drive} --from 0.5,0.5,0 --to 9,0.5,0 --out drive.txt)
app_fails(4 "no path: start outside; the map extends from -?[0-9.]+,-?[0-9.]+,-?[0-9.]+ to " ${drive} --from 9,0.5,0 --to 0.5,0.5,0 --out drive.txt)
set(tall plan small/map.bt --ground --robot-radius 0.12 --robot-height 0.9 --from 1.75,0.35,0 --to 0.5,0.5,0)
app_fails(4 "start blocked only by unknown space at [0-9.]+,[0-9.]+ .--unknown free" ${tall})
app(0 ${tall} --unknown free)
app_fails(2 "no floor" plan plate/map.bt --from 0.5,0.5,0.5 --to 0.5,1.5,0.5 --ground)
app_fails(2 "is not an octree map" plan cloud.ply --from 0,0,0 --to 1,1,1)
app_fails(2 "plate: is a directory; did you mean plate/map.bt." plan plate --from 0,0,0 --to 1,1,1)
app_fails(2 "no.such" plan no.such --from 0,0,0 --to 1,1,1)
file(READ ${WORK}/plate/map.ot bytes LIMIT 300)
file(WRITE ${WORK}/half.ot "${bytes}")
app_fails(2 "half.ot" plan half.ot --from 0,0,0 --to 1,1,1)
# What would write over the map, or over the path.
file(SHA256 ${WORK}/plate/map.bt kept)
set(ends --from 0.5,0.5,0.5 --to 0.5,1.6,0.5 --radius 0.1 --unknown free)
app_fails(1 "would be overwritten" plan plate/map.bt ${ends} --out plate/map.bt)
app_fails(1 "would be overwritten" plan plate/map.bt ${ends} --picture plate/../plate/map.bt)
app_fails(1 "both the path and the picture" plan plate/map.bt ${ends} --out new --picture ./new)
file(SHA256 ${WORK}/plate/map.bt left)
check(left STREQUAL kept)
app_fails(2 "cloud.ply" map cloud.ply --out never --floor-map cloud.ply/floor.yaml)  # before anything is done
check(err MATCHES "^rgbd_slam: ")
app_fails(1 "is not x,y,z" plan plate/map.bt --from 0,0 --to 1,1,1)
app_fails(1 "--to" plan plate/map.bt --from 0,0,0)
app_fails(1 "--robot-radius" plan plate/map.bt ${ends} --robot-radius 0.2)  # --radius is the same
# The floor map under the name of another result, and where no file can be replaced.
app_fails(1 "floor.yaml: .*another result" ${room_run} --save-map rooms/floor.yaml --floor-map rooms/floor.yaml)
file(MAKE_DIRECTORY ${WORK}/folders/floor.pgm)
app_fails(1 "floor.pgm: exists and is not the image of" map cloud.ply --out never --floor-map folders/floor.yaml)
file(MAKE_DIRECTORY ${WORK}/folders/map.yaml)
app_fails(1 "map.yaml: .*not a regular file" map cloud.ply --out never --floor-map folders/map.yaml)
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
# The image is replaced with its floor map; one that is not of a floor map stays.
app(0 map room/cloud.ply --origin 0,0,1.3 --resolution 0.1 --filter none --out again --floor-map floors/of/room.yaml)
file(RENAME ${WORK}/floors/of/room.yaml ${WORK}/room.yaml)
file(SHA256 ${WORK}/floors/of/room.pgm kept)
app_fails(1 "room.pgm: exists and is not the image of" ${room_run} --floor-map floors/of/room.yaml)
file(SHA256 ${WORK}/floors/of/room.pgm left)
check(left STREQUAL kept)
file(RENAME ${WORK}/room.yaml ${WORK}/floors/of/room.yaml)
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
check(page MATCHES "<h2>Navigation</h2>")
# Pictures have the floor at 0; in this world it is there already, and walls are along x and y.
check(page MATCHES "in the world frame of the files. T_view_world 0.0000 0.0000 -?0.00[0-9]+ ")
check(NOT page MATCHES "rotated by|shifted by")
# In a corner of it, on the floor.
app(0 plan room/map.bt --from 2.6,-2.15,0 --to 1.9,-1.6,3 --ground --robot-radius 0.12 --out way.txt --picture way.png)
length_of(length way.txt)
check(length GREATER 888)
check(length LESS 1200)
file(STRINGS ${WORK}/way.txt lines)
list(GET lines -1 last)
check(last MATCHES "^1.900000 -1.600000 0.[01]0")  # on the floor, whatever height was asked for

# Obstacles far apart in a fine map: the distances around them would fill the memory.
set(points "")
foreach(i RANGE 9)
  foreach(j RANGE 9)
    foreach(k RANGE 9)
      math(EXPR x "3 * ${i} - 13")
      math(EXPR y "3 * ${j} - 13")
      math(EXPR z "3 * ${k} - 13")
      string(APPEND points "${x} ${y} ${z}\n")
    endforeach()
  endforeach()
endforeach()
file(WRITE ${WORK}/apart.ply "ply\nformat ascii 1.0\nelement vertex 1000\nproperty float x\nproperty float y\nproperty float z\nend_header\n${points}")
app(0 map apart.ply --out apart --resolution 0.001 --filter none --quiet)
app_fails(2 "apart/map.bt: the distance field, up to.* may take more than the .* GB of available memory" plan apart/map.bt --from 0,0,1 --to 9,9,1
          --unknown free)

# A file of a few bytes: one occupied voxel of 1638 m. Its faces alone would fill the memory.
execute_process(COMMAND bash -c "printf '# Octomap OcTree binary file\n# c\nid OcTree\nsize 2\nres 0.05\ndata\n\\2\\0'"
                OUTPUT_FILE ${WORK}/large.bt)
app_fails(2 "large.bt: the distance field, up to.* may take more than the .* GB of available memory" plan large.bt
          --from 0,0,1 --to 9,9,1 --unknown free)

# Beyond a margin around known space, there is no path, not even a straight one, even if unknown space counts as free.
app_fails(4 "goal outside; the nearest reachable position" plan plate/map.bt --from 0.5,0.5,0.5 --to 20,0.5,0.5 --unknown free)
app_fails(1 "--to: .1e30,0,0. is not x,y,z in metres, up to 1e7" plan plate/map.bt --from 0.5,0.5,0.5 --to 1e30,0,0)
