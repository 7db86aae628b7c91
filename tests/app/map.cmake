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

# Many rays of metres through voxels of a millimetre: refused at once; without rays the points' voxels are all.
string(REPEAT "5.05 5.05 1.05\n" 40000 points)
file(WRITE ${WORK}/many.ply "ply\nformat ascii 1.0\nelement vertex 40000\nproperty float x\nproperty float y\n"
     "property float z\nend_header\n${points}")
app_fails(2 "--resolution: voxels of 1 mm: the space between origin and points has about .* too many"
          map many.ply --out no --resolution 0.001 --filter none --origin 0,0,0)
app(0 map many.ply --out fine --resolution 0.001 --filter none)

# A map has no place for other numbers and for the viewpoint of a cloud: both are mentioned.
file(WRITE ${WORK}/fields.pcd "FIELDS x y z normal_x intensity\nSIZE 4 4 4 4 4\nTYPE F F F F F\nWIDTH 2\nHEIGHT 1\n"
     "VIEWPOINT 0 -1 0 0.7071068 0.7071068 0 0\nPOINTS 2\nDATA ascii\n0 0 0 1 10\n1 0 0 1 20\n")
app(0 map fields.pcd --out fields --resolution 0.1 --filter none)
check(err MATCHES "warning: fields.pcd: VIEWPOINT 0 -1 0 0.7071068 0.7071068 0 0 is not applied")
check(err MATCHES "warning: fields.pcd: not used: normal_x, intensity\n")

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

# A rolling shutter that the camera file knows of: the walls become less thick than without it.
foreach(read_out 0 40)
  make_recording(${WORK}/read_${read_out} 30 160 ${read_out})
  app(0 map read_${read_out} --out out --resolution 0.05 --filter none --quiet)
  summary(occupied_${read_out} ${WORK}/out octree occupied)
endforeach()
file(STRINGS ${WORK}/read_40/camera.toml camera)
list(FILTER camera EXCLUDE REGEX read_out)
list(JOIN camera "\n" camera)
file(WRITE ${WORK}/unknown.toml "${camera}\n")
app(0 map read_40 --camera unknown.toml --out out --resolution 0.05 --filter none --quiet)
summary(occupied ${WORK}/out octree occupied)
math(EXPR thicker "(${occupied_40} - ${occupied_0}) * 4")
math(EXPR unknown_thicker "(${occupied} - ${occupied_0}) * 3")
check(thicker LESS unknown_thicker)

# Every filter by its name; its name in the summary.
foreach(filter none statistical radius log-statistical cluster ray-evidence)
  app(0 map room --out named --resolution 0.2 --quiet --filter ${filter})
  summary(mode ${WORK}/named filter mode)
  check(mode STREQUAL filter)
endforeach()

# Coordinates as maps of the earth have them: the same map, relative to a place near by, and it says so.
function(plate_at file x y)
  set(points "")
  foreach(i RANGE 9)
    foreach(j RANGE 9)
      string(APPEND points "${x}.${i}5 ${y}.${j}5 1.05\n")
    endforeach()
  endforeach()
  file(WRITE ${WORK}/${file} "ply\nformat ascii 1.0\nelement vertex 100\nproperty double x\nproperty double y\n"
       "property double z\nend_header\n${points}")
endfunction()
plate_at(far.ply 455000 5430000)
app(0 map far.ply --out far --resolution 0.1 --filter none)
check(err MATCHES "far from their origin: all results are relative to \\(45500[01], 543000[01], 1\\)")
summary(occupied ${WORK}/far octree occupied)
check(occupied EQUAL 100)
summary(origin ${WORK}/far world origin_m)
check(origin MATCHES "45500[01].*543000[01].*1")
file(READ ${WORK}/far/report.html page)
check(page MATCHES "far from their origin")
check(page MATCHES "<td>shifted by -0.05 metres in height relative to the world frame of the files. T_view_world ")
make_recording(${WORK}/near 6 160)
file(COPY ${WORK}/near/ DESTINATION ${WORK}/away)
file(STRINGS ${WORK}/near/groundtruth.txt poses REGEX "^[^#]")
set(moved "")
foreach(pose IN LISTS poses)
  string(REGEX REPLACE "^([^ ]+) ([-0-9.e]+) ([-0-9.e]+) (.*)$" "\\1 455000 5430000 \\4" pose "${pose}")
  string(APPEND moved "${pose}\n")
endforeach()
file(WRITE ${WORK}/away/groundtruth.txt "${moved}")
app(0 map away --out away_out --resolution 0.1 --filter none)
check(err MATCHES "far from their origin: all results are relative to \\(455000, 5430000, [0-9]+\\)")
file(SIZE ${WORK}/away_out/map.bt size)
check(size GREATER 1000)
summary(origin ${WORK}/away_out world origin_m)
check(origin MATCHES "455000.*5430000")
app(0 map near --out near_out --resolution 0.1 --filter none)
summary(origin ${WORK}/near_out world origin_m)
string(REGEX REPLACE "[^0-9.,]" "" origin "${origin}")
check(origin STREQUAL "0.0,0.0,0.0")
