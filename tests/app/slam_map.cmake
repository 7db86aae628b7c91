# SPDX-License-Identifier: BSD-3-Clause
#
# Maps of landmarks in files: saved, found again, gone on with.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)
set(room demo --plain --width 320 --quiet --resolution 0.1 --filter none)

# The farthest apart that two trajectories are at the same times, as their files have them: nothing is aligned.
function(must_be_near a b metres)
  execute_process(
    COMMAND awk -v most=${metres} "/^#/ { next }
      NR == FNR { x[$1] = $2; y[$1] = $3; z[$1] = $4; next }
      $1 in x { ++n; d = sqrt((x[$1]-$2)^2 + (y[$1]-$3)^2 + (z[$1]-$4)^2); if (d > worst) worst = d }
      END { print n + 0, worst + 0; exit !(n > 10 && worst < most) }" ${WORK}/${a} ${WORK}/${b}
    RESULT_VARIABLE result OUTPUT_VARIABLE said)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${a} and ${b}: poses in common, metres apart: ${said}")
  endif()
endfunction()

app(0 ${room} --frames 24 --deterministic --out first --save-map maps/first.map)
file(COPY_FILE ${WORK}/maps/first.map ${WORK}/maps/copy.map)

# The camera is found in the map, in the world of the run that made it; the map stays as it is, and nothing else is made.
app(0 ${room} --frames 24 --load-map maps/first.map --localize-only --out found)
must_exist(${WORK}/found trajectory.txt keyframes.txt summary.json report.html trajectory.png)
check(NOT EXISTS ${WORK}/found/cloud.ply AND NOT EXISTS ${WORK}/found/map.bt)
summary(tracked ${WORK}/found tracked)
check(tracked EQUAL 24)
must_be_near(first/trajectory.txt found/trajectory.txt 0.02)
must_equal(first/keyframes.txt found/keyframes.txt)
must_equal(maps/first.map maps/copy.map)

# It can be gone on with: in the same world, with what there was; mapping beside tracking finds next to the same.
app(0 ${room} --frames 40 --load-map maps/first.map --save-map maps/more.map --out more)
must_be_near(first/trajectory.txt more/trajectory.txt 0.02)
summary(before ${WORK}/first keyframes)
summary(after ${WORK}/more keyframes)
check(after GREATER before)
# A map that shows it all gets no keyframes, and there is nothing to make a cloud of.
app(0 ${room} --frames 4 --load-map maps/first.map --out known)
check(NOT EXISTS ${WORK}/known/cloud.ply)

# Another room: the camera is not found, and a map of another room is not saved over the loaded one.
app_fails(3 "maps/first.map: the camera was never found in this map: none of 6 frames"
          ${room} --seed 2 --frames 6 --load-map maps/first.map --localize-only --out other)
must_exist(${WORK}/other summary.json)
check(NOT EXISTS ${WORK}/other/trajectory.txt)
app_fails(3 "maps/first.map: the camera was never found.*it was not saved over the loaded map" ${room} --seed 2 --frames 12 --stride 6
          --load-map maps/first.map --save-map maps/first.map --out other)
must_exist(${WORK}/other trajectory.txt cloud.ply)
must_equal(maps/first.map maps/copy.map)

# A loaded map is given up after a second, not at the first frame, whatever the clock says.
app(0 ${room} --seed 2 --frames 2 --save-map maps/elsewhere.map --out elsewhere)
make_recording(${WORK}/late 6 320)
foreach(list rgb depth)
  file(READ ${WORK}/late/${list}.txt lines)
  string(REGEX REPLACE "(^|\n)0" "\\11300000000" lines "${lines}")
  file(WRITE ${WORK}/late/${list}.txt "${lines}")
endforeach()
file(REMOVE ${WORK}/late/groundtruth.txt)
app_fails(3 "maps/elsewhere.map: the camera was never found in this map: none of 6 frames"
          run late --quiet --load-map maps/elsewhere.map --out late_out)
summary(tracked ${WORK}/late_out tracked)
check(tracked EQUAL 0)

# What was reached is saved though the run is cut short.
execute_process(COMMAND timeout --preserve-status --signal=TERM 2 ${APP} ${room} --frames 100000 --out cut
                        --save-map maps/cut.map
                WORKING_DIRECTORY ${WORK} RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
check(result EQUAL 130)
must_exist(${WORK} cut/trajectory.txt maps/cut.map)
must_not_be_half_written(${WORK}/maps)

# Maps that cannot be read: 2, before anything is written.
app_fails(2 "none.map: no such file" ${room} --load-map none.map --out out)
app_fails(2 "maps: is a directory" ${room} --load-map maps --out out)
file(WRITE ${WORK}/text.map "room\n")
app_fails(2 "text.map: not an orbis map" ${room} --load-map text.map --out out)
execute_process(COMMAND head -c 5000 maps/first.map WORKING_DIRECTORY ${WORK} OUTPUT_FILE ${WORK}/short.map)
app_fails(2 "short.map: .*cut off" ${room} --load-map short.map --out out)
# Maps that cannot be written, or have no name of their own: an error before any work is done.
app_fails(1 "maps: the map cannot be saved" ${room} --save-map maps --out out)
app_fails(2 "text.map" ${room} --save-map text.map/room.map --out out)
app_fails(1 "map.bt: .*another result" ${room} --save-map out/map.bt --out out)
file(GLOB left ${WORK}/out/*)
check(NOT left)
# What makes no sense: 1.
app_fails(1 "--localize-only.*--load-map FILE" ${room} --localize-only --out out)
app_fails(1 "--save-map" ${room} --localize-only --load-map maps/first.map --save-map x.map --out out)
file(WRITE ${WORK}/localize.toml "localize-only = true\n")
app_fails(1 "--localize-only.*--load-map FILE" ${room} --config localize.toml --out out)
