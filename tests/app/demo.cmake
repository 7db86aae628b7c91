# SPDX-License-Identifier: BSD-3-Clause
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

app(0 demo --plain --frames 40 --width 320 --resolution 0.1 --deterministic --save-map room.map --out demo)
set(files trajectory.txt keyframes.txt camera_used.toml cloud.ply cloud_filtered.ply map_unfiltered.bt map.bt map.ot summary.json
          report.html trajectory.png map.png map_unfiltered.png filter.png)
must_exist(${WORK}/demo ${files})
must_not_be_half_written(${WORK}/demo)
check(out MATCHES "octree, 10 cm, after the filter")
check(out MATCHES "ATE")

# What was chosen, and why, where people look: the terminal, the summary and the page.
summary(mode ${WORK}/demo filter mode)
summary(reason ${WORK}/demo filter reason)
summary(removed ${WORK}/demo filter removed)
string(LENGTH "${reason}" length)
check(length GREATER 20)
string(FIND "${out}" "Filter  ${mode}, removed " at)
check(at GREATER -1)
string(REPLACE "; " ";\n          " lines "${reason}")
string(FIND "${out}" "${lines}" at)
check(at GREATER -1)
file(READ ${WORK}/demo/report.html page)
string(REPLACE "&" "&amp;" escaped "${reason}")
string(REPLACE "'" "&#39;" escaped "${escaped}")
string(FIND "${page}" "${escaped}" at)
check(at GREATER -1)
check(page MATCHES "T_view_world")  # the frame of the pictures
summary(points ${WORK}/demo cloud points)
summary(kept ${WORK}/demo cloud points_filtered)
math(EXPR difference "${points} - ${kept}")
check(removed EQUAL difference)

# Every field of the contract is there.
set(fields frames tracked lost relocalized keyframes landmarks loops_closed maps_merged keyframes_culled tracking_ms:median tracking_ms:p95
           tracking_ms:mean wall_s fps peak_rss_mb ate_rmse_m rpe_trans_rmse_m rpe_rot_rmse_deg filter:mode
           filter:reason filter:removed cloud:points cloud:points_filtered cloud:bytes cloud:bytes_filtered
           octree:resolution_m octree:leaves_unfiltered octree:leaves octree:occupied octree:free
           octree:bt_bytes_unfiltered octree:bt_bytes octree:ot_bytes octree:insert_ms_per_frame:median
           octree:insert_ms_per_frame:p95 live_map:insert_ms:median live_map:insert_ms:p95 live_map:insert_ms:max
           live_map:behind_frames_max live_map:dropped_keyframes live_map:corrections map_error_m)
foreach(field IN LISTS fields)
  string(REPLACE ":" ";" path ${field})
  summary(value ${WORK}/demo ${path})
  string(LENGTH "${value}" length)
  check(length GREATER 0)
endforeach()
summary(tracked ${WORK}/demo tracked)
check(tracked EQUAL 40)
summary(ate ${WORK}/demo ate_rmse_m)
check(ate LESS 0.05)
summary(map_error ${WORK}/demo map_error_m)
check(map_error LESS 0.1)
summary(bytes ${WORK}/demo octree bt_bytes)
file(SIZE ${WORK}/demo/map.bt size)
check(bytes EQUAL size)
summary(occupied ${WORK}/demo octree occupied)
summary(free ${WORK}/demo octree free)
summary(leaves ${WORK}/demo octree leaves)
math(EXPR sum "${occupied} + ${free}")
check(leaves EQUAL sum)

# The page needs nothing but itself, and no gap in it was left open.
file(READ ${WORK}/demo/report.html page)
check(NOT page MATCHES "https?://")
check(NOT page MATCHES "{{")

# OctoMap's own programs read the maps.
find_program(BT2VRML bt2vrml)
find_program(CONVERT_OCTREE convert_octree)
if(BT2VRML)
  execute_process(COMMAND ${BT2VRML} map.bt WORKING_DIRECTORY ${WORK}/demo RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
  check(result EQUAL 0)
  must_exist(${WORK}/demo map.bt.wrl)
endif()
if(CONVERT_OCTREE)
  execute_process(COMMAND ${CONVERT_OCTREE} map.ot converted.bt WORKING_DIRECTORY ${WORK}/demo RESULT_VARIABLE result
                  OUTPUT_QUIET ERROR_QUIET)
  check(result EQUAL 0)
  must_equal(demo/converted.bt demo/map.bt)
endif()

# The octree that grew while frames were tracked is the one that is made of all keyframes in the end.
app(0 demo --plain --frames 40 --width 320 --resolution 0.1 --batch-map --out batch --quiet --threads 1)
foreach(name trajectory.txt cloud_filtered.ply map_unfiltered.bt map.bt map.ot)
  must_equal(demo/${name} batch/${name})
endforeach()
file(READ ${WORK}/batch/summary.json json)
string(JSON type TYPE "${json}" live_map)
check(type STREQUAL "NULL")

# Somebody walks through the room; what was taken out of the live map is judged again in the end. (In smaller images
# most of the features that are left belong to the person for a while.)
app(0 demo --plain --frames 90 --resolution 0.1 --person --out person --quiet --threads 1)
app(0 demo --plain --frames 90 --resolution 0.1 --person --batch-map --out person_batch --quiet --threads 1)
foreach(name cloud_filtered.ply map_unfiltered.bt map.bt map.ot)
  must_equal(person/${name} person_batch/${name})
endforeach()
summary(ate ${WORK}/person ate_rmse_m)
check(ate LESS 0.02)
summary(reason ${WORK}/person filter reason)
check(reason MATCHES "moved objects")
summary(map_error ${WORK}/person map_error_m)
check(map_error LESS 0.02)

# The whole demo has stray depths, which the filter removes, and a person.
app(0 demo --frames 60 --width 320 --resolution 0.1 --out stray --quiet --threads 1)
summary(removed ${WORK}/stray filter removed)
summary(points ${WORK}/stray cloud points)
math(EXPR tenths "1000 * ${removed} / ${points}")
check(tenths GREATER_EQUAL 1)  # one pixel in a thousand is stray
summary(map_error ${WORK}/stray map_error_m)
check(map_error LESS 0.05)
summary(occupied ${WORK}/stray octree occupied)
summary(leaves ${WORK}/stray octree leaves)
summary(leaves_unfiltered ${WORK}/stray octree leaves_unfiltered)
check(leaves LESS leaves_unfiltered)

# A walking robot: its camera shakes, its images are blurred, and its shutter rolls.
app(0 demo --plain --walk --frames 40 --width 320 --resolution 0.1 --out walk --quiet --threads 1)
summary(tracked ${WORK}/walk tracked)
check(tracked EQUAL 40)
summary(walking ${WORK}/walk rpe_trans_rmse_m)
summary(by_hand ${WORK}/demo rpe_trans_rmse_m)
check(walking GREATER by_hand)
check(walking LESS 0.02)
summary(shutter ${WORK}/walk shutter from)
check(shutter STREQUAL "camera")
file(READ ${WORK}/walk/report.html walk_page)
check(walk_page MATCHES "<h1>synthetic room, walking robot</h1>")

# --quiet says nothing; one thread means the same bytes as --deterministic.
app(0 demo --plain --frames 40 --width 320 --resolution 0.1 --out again --save-map again.map --quiet --threads 1)
string(LENGTH "${out}${err}" said)
check(said EQUAL 0)
foreach(name trajectory.txt keyframes.txt camera_used.toml cloud.ply cloud_filtered.ply map_unfiltered.bt map.bt map.ot trajectory.png
             map.png map_unfiltered.png filter.png)
  must_equal(demo/${name} again/${name})
endforeach()
must_equal(room.map again.map)
foreach(field frames tracked keyframes landmarks loops_closed maps_merged keyframes_culled ate_rmse_m map_error_m)
  summary(one ${WORK}/demo ${field})
  summary(other ${WORK}/again ${field})
  check(one STREQUAL other)
endforeach()

# The world is upright: the true room's, whose z is up; or by gravity, which here pulls along the camera's -x.
summary(up ${WORK}/demo world up_from)
check(up STREQUAL "ground truth")
check(page MATCHES "of the ground truth, with z up")
app_fails(1 "is not a direction" demo --plain --frames 5 --width 160 --gravity 0,0,0 --out never)
