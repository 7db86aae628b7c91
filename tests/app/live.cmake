# SPDX-License-Identifier: BSD-3-Clause
#
# The live map under strain: every frame, more than it can take, a disk that is full.
include(${CMAKE_CURRENT_LIST_DIR}/support.cmake)

set(files trajectory.txt keyframes.txt cloud.ply cloud_filtered.ply map_unfiltered.bt map.bt map.ot)
function(must_be_the_same one other)
  foreach(name IN LISTS files)
    must_equal(${one}/${name} ${other}/${name})
  endforeach()
endfunction()

app_fails(1 "--map-every-frame needs a live map" demo --out never --map-every-frame --batch-map)

# Frames between keyframes are in the live map, and not in the files.
set(room demo --plain --frames 80 --width 160 --resolution 0.1 --deterministic --quiet)
app(0 ${room} --batch-map --out batch)
app(0 ${room} --map-every-frame --threads 1 --out every)
must_be_the_same(batch every)
summary(keyframes ${WORK}/every keyframes)
summary(inserted ${WORK}/every live_map frames inserted)
summary(dropped ${WORK}/every live_map frames dropped)
summary(refused ${WORK}/every live_map frames refused)
check(inserted GREATER 40)
check(dropped EQUAL 0)
check(refused EQUAL 0)
summary(behind ${WORK}/every live_map behind_frames_max)  # one thread: tracking waits for the map
check(behind EQUAL 0)

# At the pace of the recording, 30 Hz.
app(0 demo --plain --frames 61 --width 160 --resolution 0.1 --quiet --map-every-frame --realtime --out paced)
summary(dropped ${WORK}/paced live_map frames dropped)
check(dropped EQUAL 0)
# Three frames with 2 s between them take 4 s at least, wherever they run; without the pace less than one.
app(0 demo --plain --frames 3 --stride 60 --width 160 --resolution 0.1 --quiet --realtime --out sparse)
summary(fps ${WORK}/sparse fps)
check(fps GREATER 0)
check(fps LESS_EQUAL 0.75)

# Voxels so small that the map cannot keep up: frames give way, which is told; the files are those of the keyframes.
set(fine demo --plain --frames 80 --width 160 --resolution 0.008 --filter none --deterministic)
app(0 ${fine} --batch-map --quiet --out fine_batch)
app(0 ${fine} --map-every-frame --out fine)
check(err MATCHES "[0-9]+ frames? between keyframes arrived faster than the live map could insert them")
summary(dropped ${WORK}/fine live_map frames dropped)
check(dropped GREATER 0)
file(READ ${WORK}/fine/report.html page)
check(page MATCHES "arrived faster than the live map")
must_be_the_same(fine_batch fine)

# No room for the file that depth images are spilled to: that is said, and nothing is lost.
app(0 ${room} --depth-memory 0 --out spilled)
string(LENGTH "${out}${err}" said)
check(said EQUAL 0)
must_be_the_same(batch spilled)
must_not_be_half_written(${WORK}/spilled)
set(program ${APP})
set(APP ${CMAKE_COMMAND} -E env LD_PRELOAD=${FULL_DISK} ASAN_OPTIONS=verify_asan_link_order=0 ${program})
list(REMOVE_ITEM room --quiet)
app(0 ${room} --depth-memory 0 --out full)
check(err MATCHES "the temporary file for depth images cannot be written: No space left on device")
check(err MATCHES "depth images are kept in memory instead")
must_be_the_same(batch full)
must_not_be_half_written(${WORK}/full)

# No threads to be had: what would be done beside is done in turn.
set(APP ${CMAKE_COMMAND} -E env LD_PRELOAD=${NO_THREADS} ASAN_OPTIONS=verify_asan_link_order=0 ${program})
app(0 ${room} --batch-map --out alone)
must_be_the_same(batch alone)
