# SPDX-License-Identifier: BSD-3-Clause
#
# A run and its child process are killed while files are moved into place: the next command finishes first, so that
# results are never refused or of two runs.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
make_recording(${WORK}/room 4 160)
set(quick --quiet --resolution 0.2 --filter none)
list(JOIN quick " " quick_text)
file(WRITE ${WORK}/cloud.ply "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n"
     "end_header\n0 0 1\n0.1 0 1\n")
function(run_killed moved)  # arguments of the run
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_PRELOAD=${KILLED} ASAN_OPTIONS=verify_asan_link_order=0
                          ORBIS_TEST_RENAMES=${moved} ${APP} ${ARGN} WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result
                          OUTPUT_QUIET ERROR_QUIET)
  check(NOT result EQUAL 0)
  file(GLOB ready ${WORK}/out/.rgbd_slam-*.ready)
  check(ready)
endfunction()
function(must_be_of run)  # the trajectory's files in out are those of this run
  foreach(name trajectory.txt keyframes.txt camera_used.toml)
    must_equal(out/${name} ${run}/${name})
  endforeach()
  file(GLOB ready ${WORK}/out/.rgbd_slam-*)
  check(NOT ready)
endfunction()

app(0 run room --out all ${quick} --deterministic)
app(0 run room --frames 3 --out three ${quick} --deterministic)
app(0 run room --frames 2 --out two ${quick} --deterministic)
foreach(moved 0 1 4 9)
  # Without earlier results: not refused.
  file(REMOVE_RECURSE ${WORK}/out)
  run_killed(${moved} run room --out out ${quick} --deterministic)
  app(0 map cloud.ply --out out ${quick})
  must_be_of(all)
  # Over earlier results, by a command that makes other files.
  run_killed(${moved} run room --frames 3 --out out ${quick} --deterministic)
  app(0 map cloud.ply --out out ${quick})
  must_be_of(three)
endforeach()

# Files in other folders belong to the same run; the next command may know one of the folders only.
set(elsewhere --save-map maps/room.map --floor-map floors/floor.yaml)
app(0 run room --out all ${quick} --deterministic --save-map all/room.map --floor-map all/floor.yaml)
foreach(moved 0 7 14)
  foreach(next "map;cloud.ply;--out;out;${quick}" "eval;out/trajectory.txt;all/trajectory.txt"
               "run;room;--frames;2;--load-map;maps/room.map;--localize-only;--out;new;${quick}")
    file(REMOVE_RECURSE ${WORK}/out ${WORK}/maps ${WORK}/floors)
    run_killed(${moved} run room --out out ${quick} --deterministic ${elsewhere})
    if(moved EQUAL 7)  # killed again, while it finishes the first run
      run_killed(3 map cloud.ply --out out ${quick})
    endif()
    app(0 ${next})
    must_be_of(all)
    must_equal(maps/room.map all/room.map)
    must_equal(floors/floor.yaml all/floor.yaml)
    must_equal(floors/floor.pgm all/floor.pgm)
    file(GLOB hidden ${WORK}/maps/.rgbd_slam-* ${WORK}/floors/.rgbd_slam-*)
    check(NOT hidden)
  endforeach()
endforeach()

# One of the folders is missing: nothing is deleted, and the run is finished once the folder is there again, even under
# another name.
foreach(missing out maps)
  file(REMOVE_RECURSE ${WORK}/out ${WORK}/maps ${WORK}/floors ${WORK}/away)
  run_killed(0 run room --out out ${quick} --deterministic ${elsewhere})
  file(RENAME ${WORK}/${missing} ${WORK}/away)
  foreach(folder out maps floors)
    if(NOT folder STREQUAL missing)
      app_fails(2 "${folder}: the results of an earlier run, in the hidden folder .rgbd_slam-.*: .*missing"
                map cloud.ply --out ${folder} ${quick})
      file(MAKE_DIRECTORY ${WORK}/${missing})  # such as the folder at which a disk is not mounted
      app_fails(2 "${folder}: the results of an earlier run, in the hidden folder .rgbd_slam-.*: .*missing"
                map cloud.ply --out ${folder} ${quick})
      file(REMOVE_RECURSE ${WORK}/${missing})
    endif()
  endforeach()
  if(missing STREQUAL maps)
    file(RENAME ${WORK}/away ${WORK}/maps)
  else()
    file(RENAME ${WORK}/away ${WORK}/out)
    file(RENAME ${WORK}/out ${WORK}/away)
    app(0 eval away/trajectory.txt all/trajectory.txt)
    file(RENAME ${WORK}/away ${WORK}/out)
  endif()
  app(0 map cloud.ply --out out ${quick})
  must_be_of(all)
  must_equal(maps/room.map all/room.map)
  must_equal(floors/floor.yaml all/floor.yaml)
endforeach()

# What is left of a complete run, all of whose files were moved, blocks nothing; files that were not moved do.
set(left ${WORK}/emptied/.rgbd_slam-left)
file(MAKE_DIRECTORY ${left}/.rgbd_slam)
execute_process(COMMAND printf "${WORK}/gone/.rgbd_slam-first.ready\\0" OUTPUT_FILE ${left}/.rgbd_slam/first)
execute_process(COMMAND printf "room.map\\0" OUTPUT_FILE ${left}/.rgbd_slam/names)
app(0 map cloud.ply --out emptied ${quick})
file(WRITE ${left}/room.map "a map")
app_fails(2 "emptied: .* hidden folder .rgbd_slam-left,.*missing" map cloud.ply --out emptied ${quick})
must_exist(${left} room.map)

# The user creates a folder with the name of a result: it is kept, and later results wait for the earlier ones.
file(REMOVE_RECURSE ${WORK}/out)
run_killed(0 run room --out out ${quick} --deterministic)
file(WRITE ${WORK}/out/map.bt/notes "mine")
app_fails(2 "out: .*hidden folder .*: map.bt is not a regular file" run room --frames 2 --out out ${quick})
must_exist(${WORK}/out map.bt/notes)
check(NOT EXISTS ${WORK}/out/trajectory.txt)
file(REMOVE_RECURSE ${WORK}/out/map.bt)
app(0 map cloud.ply --out out ${quick})
must_be_of(all)
file(REMOVE_RECURSE ${WORK}/out)
app(0 run room --frames 3 --out out ${quick} --deterministic)

# An error at the first, a middle and the last file, with and without hard links: the earlier results are restored.
file(GLOB names RELATIVE ${WORK}/out ${WORK}/out/*)
file(COPY ${WORK}/out/ DESTINATION ${WORK}/before)
file(REMOVE ${WORK}/out/navigation.png)  # one of the new files replaces nothing
file(REMOVE ${WORK}/before/navigation.png)
list(REMOVE_ITEM names navigation.png)
list(LENGTH names last)
foreach(how 0-NO 5-NO ${last}-NO 0-HAS 5-HAS ${last}-HAS)
  string(REGEX MATCH "^(.*)-(.*)$" how ${how})
  set(moved ${CMAKE_MATCH_1})
  set(links ${CMAKE_MATCH_2})
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_PRELOAD=${KILLED} ASAN_OPTIONS=verify_asan_link_order=0
                          ORBIS_TEST_RENAMES=${moved} ORBIS_TEST_FAILS=1 ORBIS_TEST_${links}_LINKS=1
                          ${APP} run room --out out ${quick} --deterministic
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
  check(result EQUAL 2)
  check(err MATCHES "cannot move the new files into place: Input/output error")
  file(GLOB now RELATIVE ${WORK}/out ${WORK}/out/* ${WORK}/out/.rgbd*)
  check(now STREQUAL names)
  foreach(name IN LISTS names)
    must_equal(out/${name} before/${name})
  endforeach()
endforeach()

# The same, and the run is killed before it can remove its files: nobody finishes it.
foreach(moved 0 5)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_PRELOAD=${KILLED} ASAN_OPTIONS=verify_asan_link_order=0
                          ORBIS_TEST_RENAMES=${moved} ORBIS_TEST_FAILS=1 ORBIS_TEST_NO_LINKS=1 ORBIS_TEST_KILLED_AFTER_ERROR=1
                          ${APP} run room --out out ${quick} --deterministic ${elsewhere}
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
  check(NOT result EQUAL 0 AND NOT result EQUAL 2)
  file(GLOB hidden ${WORK}/out/.rgbd_slam-*)
  check(hidden AND NOT hidden MATCHES "[.]ready")
  file(GLOB maps ${WORK}/maps/.rgbd_slam-*)
  check(maps)
  app(0 eval out/trajectory.txt all/trajectory.txt)
  app(0 map cloud.ply --out maps ${quick})
  must_be_of(three)
  foreach(name IN LISTS names)
    must_equal(out/${name} before/${name})
  endforeach()
  file(GLOB maps ${WORK}/maps/.rgbd_slam-*)
  check(NOT maps)
endforeach()

# The same, and files that were moved cannot be moved back: the next command finishes, with or without earlier results.
foreach(moved 3 8)
  foreach(earlier ON OFF)
    file(REMOVE_RECURSE ${WORK}/out)
    if(earlier)
      file(COPY ${WORK}/before/ DESTINATION ${WORK}/out)
    endif()
    execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_PRELOAD=${KILLED} ASAN_OPTIONS=verify_asan_link_order=0
                            ORBIS_TEST_RENAMES=${moved} ORBIS_TEST_FAILS=1 ORBIS_TEST_NO_LINKS=1 ORBIS_TEST_STAYS_BROKEN=1
                            ${APP} run room --out out ${quick} --deterministic
                    WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
    check(result EQUAL 2)
    check(err MATCHES "Input/output error. the next command that uses the folder moves the new files into place\n$")
    file(GLOB ready ${WORK}/out/.rgbd_slam-*.ready)
    check(ready)
    app(0 map cloud.ply --out out ${quick})
    must_be_of(all)
  endforeach()
endforeach()

# Another program holds the lock of the folder: after an interrupt the run ends soon, and its results are moved into
# place later: by the next command, or by a run that ends later, before its own.
foreach(later OFF ON)
  file(REMOVE_RECURSE ${WORK}/out)
  file(COPY ${WORK}/before/ DESTINATION ${WORK}/out)
  execute_process(COMMAND bash -c "
    begin() {  # number of frames, number of hidden folders then
      '${APP}' run room --frames $1 --out out ${quick_text} --deterministic 2>$1.log &
      run=$!
      until [ $(ls -d out/.rgbd_slam-* 2>/dev/null | wc -l) = $2 ] || ! kill -0 $run; do sleep 0.01; done
    }
    present=0
    if [ ${later} = ON ]; then
      begin 3 1
      later=$run present=1
      kill -STOP $later
    fi
    begin 2 $((present + 1))
    exec 9<out
    flock -s 9
    until [ -e out/.rgbd_slam-*/.rgbd_slam/names ] || ! kill -0 $run; do sleep 0.01; done
    start=$(date +%s)
    kill -TERM $run
    wait $run
    [ $? = 2 ] && [ $(($(date +%s) - start)) -lt 6 ] || exit 1
    exec 9<&-
    if [ ${later} = ON ]; then
      kill -CONT $later
      wait $later
    fi" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result)
  check(result EQUAL 0)
  file(READ ${WORK}/2.log err)
  check(err MATCHES "out: another program has locked the folder. the next command that uses the folder moves the new")
  if(later)
    must_be_of(three)
  else()
    must_equal(out/trajectory.txt before/trajectory.txt)
    app(0 map cloud.ply --out out ${quick})
    must_be_of(two)
  endif()
endforeach()
file(REMOVE_RECURSE ${WORK}/out)
file(COPY ${WORK}/before/ DESTINATION ${WORK}/out)

# The map cannot be added to the other results: they are written without it.
foreach(added 0 3)
  file(REMOVE_RECURSE ${WORK}/no_map)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env LD_PRELOAD=${KILLED} ASAN_OPTIONS=verify_asan_link_order=0
                          ORBIS_TEST_OPTIONAL=${added} ${APP} run room --frames 2 --out no_map ${quick} --deterministic
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
  check(result EQUAL 2)
  check(err MATCHES "no_map: cannot move the new files: Input/output error. the map is missing")
  must_equal(no_map/trajectory.txt two/trajectory.txt)
  must_exist(${WORK}/no_map keyframes.txt camera_used.toml summary.json report.html)
  must_not_be_half_written(${WORK}/no_map)
  file(GLOB map ${WORK}/no_map/*.bt ${WORK}/no_map/*.ply ${WORK}/no_map/map.png)
  check(NOT map)
endforeach()

# The user renames the folder during a run: the results are in the renamed folder.
execute_process(COMMAND bash -c "
  '${APP}' run room --frames 2 --out moved/out ${quick_text} --deterministic --save-map moved/maps/room.map &
  run=$!
  until ls -d moved/maps/.rgbd_slam-* >/dev/null 2>&1 || ! kill -0 $run; do sleep 0.01; done
  kill -STOP $run
  mv moved elsewhere
  kill -CONT $run
  wait $run" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result)
check(result EQUAL 0)
check(NOT EXISTS ${WORK}/moved)
must_equal(elsewhere/out/trajectory.txt two/trajectory.txt)
must_exist(${WORK}/elsewhere/out map.bt report.html summary.json)
must_exist(${WORK}/elsewhere/maps room.map)
must_not_be_half_written(${WORK}/elsewhere/out)
must_not_be_half_written(${WORK}/elsewhere/maps)

# While a run waits for the lock, the user creates a folder with the name of a result: an error, and nothing else is
# lost. If the user deletes the folder of the landmark map, the other results are written.
foreach(change "mkdir waits/out/map.bt" "rm -rf waits/maps")
  file(REMOVE_RECURSE ${WORK}/waits)
  execute_process(COMMAND bash -c "
    '${APP}' run room --frames 2 --out waits/out ${quick_text} --save-map waits/maps/room.map 2>waits.log &
    run=$!
    until [ -d waits/out ] || ! kill -0 $run; do sleep 0.01; done
    exec 9<waits/out
    until [ -e waits/out/.rgbd_slam-*/.rgbd_slam/optional ] || ! kill -0 $run; do sleep 0.01; done
    flock -s 9
    ${change}
    exec 9<&-
    wait $run" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result)
  file(READ ${WORK}/waits.log err)
  check(result EQUAL 2 AND err MATCHES "rgbd_slam: [^\n]*waits/[^\n]*\n$")
  must_not_be_half_written(${WORK}/waits/out)
  if(change MATCHES mkdir)
    check(IS_DIRECTORY ${WORK}/waits/out/map.bt)
    check(NOT EXISTS ${WORK}/waits/out/trajectory.txt)
  else()
    check(err MATCHES "waits/maps: .*. the other results were written")
    must_equal(waits/out/trajectory.txt two/trajectory.txt)
    must_exist(${WORK}/waits/out summary.json map.bt)
  endif()
endforeach()

# Another run of another kind ends while a run waits: both results are known as such, and can be replaced.
execute_process(COMMAND bash -c "
  '${APP}' map all/cloud.ply --out both --quiet --resolution 0.02 &
  run=$!
  until ls -d both/.rgbd_slam-* >/dev/null 2>&1 || ! kill -0 $run; do sleep 0.01; done
  exec 9<both
  flock -s 9
  until [ -e both/.rgbd_slam-*/.rgbd_slam/names ] || ! kill -0 $run; do sleep 0.01; done
  kill -STOP $run
  exec 9<&-
  '${APP}' run room --frames 2 --out both ${quick_text} --localize-only --load-map maps/room.map
  kill -CONT $run
  wait $run" WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result)
check(result EQUAL 0)
must_exist(${WORK}/both trajectory.txt map.bt)
app(0 run room --frames 2 --out both ${quick})

# On a full disk the trajectory and the summary come before the landmark map and the report.
file(MAKE_DIRECTORY ${WORK}/disk)
foreach(size 76k 100k 160k 184k)
  execute_process(COMMAND mount -t tmpfs -o size=${size} none disk WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result
                  OUTPUT_QUIET ERROR_QUIET)
  if(NOT result EQUAL 0)
    message(STATUS "[skipped] a full disk: no file system can be mounted here")
    break()
  endif()
  execute_process(COMMAND ${APP} run room --frames 2 --out disk/out ${quick} --deterministic --save-map disk/room.map
                  WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result ERROR_VARIABLE err)
  file(COPY ${WORK}/disk/ DESTINATION ${WORK}/disk_${size})
  execute_process(COMMAND umount ${WORK}/disk)
  check(result EQUAL 2 AND err MATCHES "No space left on device")
  must_equal(disk_${size}/out/trajectory.txt two/trajectory.txt)
  must_equal(disk_${size}/out/camera_used.toml two/camera_used.toml)
  must_exist(${WORK}/disk_${size}/out summary.json)
  if(NOT EXISTS ${WORK}/disk_${size}/room.map)
    check(err MATCHES "disk/room.map: [^\n]*\n")
  endif()
endforeach()

foreach(inodes 18 20 22 24 26)
  execute_process(COMMAND mount -t tmpfs -o size=4m,nr_inodes=${inodes} none disk WORKING_DIRECTORY ${WORK}
                  RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
  if(NOT result EQUAL 0)
    break()
  endif()
  execute_process(COMMAND ${APP} run room --frames 2 --out disk/out ${quick} --deterministic WORKING_DIRECTORY ${WORK}
                  RESULT_VARIABLE result ERROR_VARIABLE err)
  file(COPY ${WORK}/disk/ DESTINATION ${WORK}/disk_${inodes})
  execute_process(COMMAND umount ${WORK}/disk)
  check(result EQUAL 0 OR (result EQUAL 2 AND err MATCHES "No space left on device"))
  must_equal(disk_${inodes}/out/trajectory.txt two/trajectory.txt)
  must_exist(${WORK}/disk_${inodes}/out summary.json)
endforeach()

# What another user has put into the folder is neither moved nor removed, unless the folder is that user's.
execute_process(COMMAND id -u OUTPUT_VARIABLE user OUTPUT_STRIP_TRAILING_WHITESPACE)
if(user EQUAL 0)
  set(foreign ${WORK}/out/.rgbd_slam-others.ready)
  file(WRITE ${foreign}/trajectory.txt "theirs")
  file(WRITE ${WORK}/names "trajectory.txt\n")
  file(MAKE_DIRECTORY ${foreign}/.rgbd_slam/replaced)
  execute_process(COMMAND tr "\\n" "\\000" INPUT_FILE ${WORK}/names OUTPUT_FILE ${foreign}/.rgbd_slam/names)
  execute_process(COMMAND chown -R 65534 ${foreign})
  app(0 map cloud.ply --out out ${quick})
  must_equal(out/trajectory.txt before/trajectory.txt)
  must_exist(${foreign} trajectory.txt)
  execute_process(COMMAND chown 65534 ${WORK}/out)
  app(0 map cloud.ply --out out ${quick})
  file(READ ${WORK}/out/trajectory.txt trajectory)
  check(trajectory MATCHES "^theirs$")
  check(NOT EXISTS ${foreign})
else()
  message(STATUS "[skipped] folders of other users: only root can make them")
endif()
