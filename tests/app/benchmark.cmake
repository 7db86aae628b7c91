# SPDX-License-Identifier: BSD-3-Clause
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

make_recording(${WORK}/data/rgbd_dataset_freiburg1_desk 8 160)
make_recording(${WORK}/data/room 8 160)
file(REMOVE ${WORK}/data/room/groundtruth.txt)
make_recording(${WORK}/data/more/broken 3 160)
file(REMOVE_RECURSE ${WORK}/data/more/broken/rgb)
file(WRITE ${WORK}/coarse.toml "resolution = 0.2\n")

# All recordings in and below a folder. One that fails has a reason, and the others go on.
app(1 benchmark data --quick --json)
string(JSON count LENGTH "${out}")
check(count EQUAL 3)
function(must_be index)  # value, path in the JSON...
  list(POP_FRONT ARGN expected)
  string(JSON value GET "${out}" ${index} ${ARGN})
  if(NOT value STREQUAL expected)
    message(FATAL_ERROR "${index} ${ARGN} is \"${value}\", not \"${expected}\"")
  endif()
endfunction()
must_be(0 more/broken recording)
must_be(0 "" cpu_ms_per_frame)
string(JSON failure GET "${out}" 0 failure)
check(failure MATCHES "more/broken/rgb/000000.png: ")
must_be(1 rgbd_dataset_freiburg1_desk recording)
must_be(1 deterministic run)
must_be(1 "" failure)
must_be(1 8 summary frames)
must_be(1 8 summary tracked)
must_be(1 0.016 published_ate_rmse_m ORB-SLAM2)
string(JSON ate GET "${out}" 1 summary ate_rmse_m)
check(ate GREATER 0 AND ate LESS 0.01)
string(JSON cpu GET "${out}" 1 cpu_ms_per_frame)
check(cpu GREATER 1)
string(JSON peak GET "${out}" 1 peak_mb)
check(peak GREATER 20 AND peak LESS 4000)
must_be(2 room recording)
must_be(2 "" summary ate_rmse_m)
must_be(2 "" published_ate_rmse_m)

# Every run would replace a file with a fixed name.
file(WRITE ${WORK}/saves.toml "save-map = \"all.map\"\n")
app_fails(1 "saves.toml: save-map: every run would replace the file" benchmark data --quick --run-config saves.toml)

# A table: deterministic, and with threads under load. Results are kept on request, and are those of `run`.
app(0 benchmark data/room data/rgbd_dataset_freiburg1_desk --frames 4 --run-config coarse.toml --out kept --markdown)
foreach(name room rgbd_dataset_freiburg1_desk)
  foreach(run deterministic threads threads-1-busy threads-2-busy)
    check(out MATCHES "\n. ${name} +. ${run} +. +4 . +100.0 .")
    must_exist(${WORK}/kept/${name}/${run} summary.json map.bt report.html)
    must_not_be_half_written(${WORK}/kept/${name}/${run})
  endforeach()
endforeach()
check(out MATCHES "room +. deterministic +. +4 . +100.0 . +- . +- .")
check(out MATCHES "\n. rgbd_dataset_freiburg1_desk . +[0-9.]+ . +16 . +20 . +16 . +17 . +29 .\n")
check(NOT out MATCHES "failure")
app(0 run data/room --frames 4 --resolution 0.2 --deterministic --quiet --out one)
must_equal(one/map.bt kept/room/deterministic/map.bt)
must_equal(one/trajectory.txt kept/room/deterministic/trajectory.txt)

# An interrupt ends it at once; nothing is left behind.
file(MAKE_DIRECTORY ${WORK}/temporary)
foreach(signal INT TERM)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env TMPDIR=${WORK}/temporary timeout -s ${signal} 1 ${APP} benchmark data --out part
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_QUIET)
  check(result EQUAL 124)
  string(LENGTH "${out}" printed)
  check(printed EQUAL 0)
  file(GLOB_RECURSE left ${WORK}/temporary/* ${WORK}/part/*/.rgbd_slam-*)
  check(NOT left)
endforeach()

# A parent that ignores the end of its children, as some process managers do, does not hide the failure of a run.
file(WRITE ${WORK}/broken/rgb.txt "0 nowhere.png\n")
file(WRITE ${WORK}/broken/depth.txt "0 nowhere.png\n")
app(1 benchmark broken --quick)
check(out MATCHES "nowhere.png: the first image.*does not exist")
execute_process(COMMAND env --ignore-signal=SIGCHLD ${APP} benchmark broken --quick WORKING_DIRECTORY ${WORK}
                RESULT_VARIABLE result OUTPUT_VARIABLE out ERROR_QUIET)
check(result EQUAL 1 AND out MATCHES "nowhere.png: the first image.*does not exist")

# The sequences of a scene are separate recordings.
foreach(sequence seq-01 seq-02)
  file(COPY_FILE ${WORK}/data/room/rgb/000000.png ${WORK}/color.png)
  file(COPY ${WORK}/color.png DESTINATION ${WORK}/scenes/office/${sequence})
  file(RENAME ${WORK}/scenes/office/${sequence}/color.png ${WORK}/scenes/office/${sequence}/frame-000000.color.png)
endforeach()
app(1 benchmark scenes --quick)
check(out MATCHES "\noffice/seq-01 .*\noffice/seq-02 ")

app_fails(2 "temporary: contains no recordings, or only recordings that are already listed" benchmark temporary)
app_fails(2 "nowhere: does not exist" benchmark nowhere)
app_fails(1 "--json excludes --markdown" benchmark data --json --markdown)
